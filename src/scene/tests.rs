//! Tests of the builder: accepted values, error messages, and changes of the hash.

use std::path::Path;
use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use half::f16;

use super::*;

const FILM: FilmSize = FilmSize { width: 8, height: 6 };

/// A textured floor, a grey sphere and a light under a constant environment.
fn room() -> SceneBuilder {
    let mut scene = Scene::builder(Camera::new([0.0, 2.0, 6.0], [0.0; 3], Fov::X(40.0)), FILM);
    let grey = scene.material(Material::diffuse("grey", [0.5; 3]));
    let texture = Texture {
        width: 2,
        height: 1,
        texels: Texels::Single(vec![[0.25; 3], [0.5; 3]]),
        wrap: Wrap::Repeat,
    };
    let tiles = scene.material(Material {
        texture: Some(Arc::new(texture)),
        ..Material::phong("tiles", [0.5; 3], 50.0)
    });
    let corners = [
        [-3.0, -1.0, 3.0],
        [3.0, -1.0, 3.0],
        [3.0, -1.0, -3.0],
        [-3.0, -1.0, -3.0],
    ];
    scene.mesh(Mesh {
        uvs: Some(vec![DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y]),
        ..Mesh::quadrilateral(corners, tiles).smooth()
    });
    scene.sphere(Sphere::new([0.0; 3], 1.0, grey));
    scene.sphere(Sphere::new([0.0, 4.0, 0.0], 0.5, Surface::emission([5.0; 3])));
    scene.light(Light::spot([0.0, 3.0, 1.0], [0.0; 3], [2.0; 3], [10.0, 20.0]));
    scene.environment(Environment::Constant(DVec3::splat(0.25)));
    scene
}

fn floor(scene: &mut SceneBuilder) -> &mut Mesh {
    Arc::make_mut(&mut scene.meshes[0])
}

fn tiles(scene: &mut SceneBuilder) -> &mut Texture {
    Arc::make_mut(scene.materials[1].texture.as_mut().unwrap())
}

type Change = fn(&mut SceneBuilder);

fn changed(change: Change) -> SceneBuilder {
    let mut scene = room();
    change(&mut scene);
    scene
}

#[test]
fn what_cannot_be_is_named_with_its_value() {
    let cases: [(Change, &str); 31] = [
        (
            |s| s.camera.origin.x = f64::NAN,
            "camera origin must be finite, got NaN",
        ),
        (
            |s| s.camera.target = s.camera.origin,
            "camera target must differ from the origin, got [0, 2, 6]",
        ),
        (
            |s| s.camera.up = DVec3::ZERO,
            "camera up must not be zero, got [0, 0, 0]",
        ),
        (
            |s| s.camera.up = DVec3::new(0.0, 1.0, 3.0),
            "camera up must not be parallel to the view, got [0, 1, 3]",
        ),
        (
            |s| s.camera.fov = Fov::Y(180.0),
            "camera fov_y must be between 0 and 180 degrees, got 180",
        ),
        (
            |s| {
                s.camera.lens = Some(Lens {
                    radius: 0.0,
                    focus: 1.0,
                })
            },
            "camera lens_radius must be positive and finite, got 0",
        ),
        (
            |s| {
                s.camera.lens = Some(Lens {
                    radius: 1.0,
                    focus: -1.0,
                })
            },
            "camera focus_distance must be positive and finite, got -1",
        ),
        (
            |s| s.film.width = 0,
            "film width must be a whole number from 1 to 65536, got 0",
        ),
        (
            |s| s.film.height = 65537,
            "film height must be a whole number from 1 to 65536, got 65537",
        ),
        (
            |s| s.render.spp = Some(0),
            "render spp must be a whole number from 1 to 1073741824, got 0",
        ),
        (
            |s| s.materials[0] = Material::diffuse("grey", [0.5, -0.5, 0.5]),
            "material \"grey\" diffuse must be finite and not negative, got -0.5",
        ),
        (
            |s| {
                s.materials[1].bsdf = Bsdf::Phong {
                    rho: DVec3::ONE,
                    alpha: 1.0,
                }
            },
            "material \"tiles\" exponent must be above 1 and finite, got 1",
        ),
        (
            |s| tiles(s).texels = Texels::Single(vec![[0.25; 3], [0.5, 0.5, f32::INFINITY]]),
            "material \"tiles\" has a texture with [0.5, 0.5, inf] at (1, 0)",
        ),
        (
            |s| tiles(s).height = 2,
            "material \"tiles\" has a texture of 2 x 2 texels and 2 values for them",
        ),
        (
            |s| s.spheres[1].radius = -0.5,
            "sphere 2 radius must be positive and finite, got -0.5",
        ),
        (
            |s| s.spheres[0].center.z = -1e39,
            "sphere 1 center is beyond single precision, got -1e39",
        ),
        (
            |s| s.spheres[1].surface = Surface::emission([1.0, 1.0, -2.0]),
            "sphere 2 emission must be finite and not negative, got -2",
        ),
        (
            |s| s.spheres[1].surface = MaterialId::new(2).into(),
            "sphere 2 material must be a material of this scene, got number 3 of 2",
        ),
        (
            |s| floor(s).uvs = None,
            "mesh 1 has a material with a texture, and no texture coordinates",
        ),
        (
            |s| floor(s).vertices[2].y = f64::INFINITY,
            "mesh 1 vertices[2] must be finite, got inf",
        ),
        (
            |s| floor(s).triangles.push([0, 1, 4]),
            "mesh 1 triangles[2] must have corners among the 4 vertices, got 4",
        ),
        (
            |s| floor(s).uvs = Some(vec![DVec2::ZERO]),
            "mesh 1 uvs must have as many pairs as there are vertices, 4, got 1",
        ),
        (
            |s| floor(s).normals = Some(vec![DVec3::Y; 3]),
            "mesh 1 normals must have as many vectors as there are vertices, 4, got 3",
        ),
        (
            |s| floor(s).normals = Some(vec![DVec3::Y * 2.0; 4]),
            "mesh 1 normals[0] must have length 1, got [0, 2, 0]",
        ),
        (
            |s| (floor(s).normals, floor(s).smooth_terminator) = (None, true),
            "mesh 1 shadow_terminator belongs to smooth normals, got \"smooth\"",
        ),
        (|s| floor(s).triangles.clear(), "mesh 1 has no faces"),
        (
            |s| floor(s).triangles = vec![[0, 1, 1]],
            "mesh 1 has no triangle with an area, got 1 without",
        ),
        (
            |s| (floor(s).name, floor(s).triangles) = ("the floor".to_owned(), vec![]),
            "the floor has no faces",
        ),
        (
            |s| *s.lights[0].power_mut() = DVec3::NEG_X,
            "light 1 intensity must be finite and not negative, got -1",
        ),
        (
            |s| _ = s.environment(Environment::Constant(DVec3::NEG_X)),
            "environment emission must be finite and not negative, got -1",
        ),
        (
            |s| {
                let sky = LatLong {
                    width: 1,
                    height: 1,
                    texels: Arc::new(Texels::Single(vec![[1.0; 3]])),
                    to_scene: DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)),
                };
                s.environment(Environment::Picture(sky));
            },
            "environment must be turned by a rotation",
        ),
    ];
    assert!(room().build().is_ok());
    for (change, expected) in cases {
        let error = changed(change).build().expect_err(expected);
        assert_eq!(error.to_string(), expected);
        assert!(!error.remedy().is_empty());
    }
    let error = changed(|s| floor(s).vertices[2].y = f64::INFINITY).build().unwrap_err();
    let property = Property {
        key: "vertices",
        index: Some(2),
        component: Some(1),
    };
    assert_eq!((error.subject(), error.property()), (Subject::Mesh(0), Some(property)));
    assert_eq!((error.problem(), error.value()), ("must be finite", Some("inf")));
}

#[test]
fn what_decides_the_picture_makes_another_scene() {
    let mut hashes = vec![room().build().unwrap().hash().to_owned()];
    let changes: [Change; 27] = [
        |s| s.camera.origin.x = 1e-9,
        |s| s.camera.target.x = 1e-9,
        |s| s.camera.up.x = 1e-9,
        |s| s.camera.fov = Fov::Y(40.0),
        |s| {
            s.camera.lens = Some(Lens {
                radius: 1.0,
                focus: 2.0,
            })
        },
        |s| s.materials[0] = Material::diffuse("grey", [0.5, 0.5, 0.25]),
        |s| s.materials[0] = Material::phong("grey", [0.5; 3], 2.0),
        |s| s.materials[0] = Material::phong("grey", [0.5; 3], 3.0),
        |s| s.materials[0].one_sided = true,
        |s| tiles(s).texels = Texels::Single(vec![[0.0, 0.25, 0.25], [0.5; 3]]),
        |s| tiles(s).wrap = Wrap::Clamp,
        |s| s.spheres[0].radius = 1.5,
        |s| s.spheres[0].center.y = 0.5,
        |s| s.spheres[1].surface = Surface::emission([5.0, 5.0, 6.0]),
        |s| floor(s).vertices[3].y = -1.0000001,
        |s| floor(s).triangles.swap(0, 1),
        |s| floor(s).normals = None,
        |s| floor(s).smooth_terminator = true,
        |s| floor(s).uvs.as_mut().unwrap()[0].x = 0.125,
        |s| s.lights.clear(),
        |s| s.lights[0] = Light::point([0.0, 3.0, 1.0], [2.0; 3]),
        |s| s.lights[0] = Light::spot([0.0, 3.0, 1.0], [0.0; 3], [2.0; 3], [10.0, 21.0]),
        |s| s.lights[0] = Light::directional([0.0, -3.0, -1.0], [2.0; 3], 0.0),
        |s| s.lights[0] = Light::directional([0.0, -3.0, -1.0], [2.0; 3], 2.0),
        |s| _ = s.light(Light::point([0.0, 3.0, 1.0], [2.0; 3])),
        |s| s.environment = None,
        |s| _ = s.environment(Environment::Constant(DVec3::splat(0.5))),
    ];
    hashes.extend(changes.map(|change| changed(change).build().unwrap().hash().to_owned()));
    let sky = |width, height| {
        let sky = LatLong {
            width,
            height,
            texels: Arc::new(Texels::Single(vec![[1.0; 3]; 6])),
            to_scene: DMat3::IDENTITY,
        };
        let mut scene = room();
        scene.environment(Environment::Picture(sky));
        scene.build().unwrap().hash().to_owned()
    };
    hashes.extend([sky(2, 3), sky(3, 2)]);
    let different: std::collections::HashSet<_> = hashes.iter().collect();
    assert_eq!(different.len(), hashes.len());
    assert!(hashes.iter().all(|hash| hash.len() == 64));
}

#[test]
fn what_decides_no_picture_makes_no_other_scene() {
    let scene = room().build().unwrap();
    let changes: [Change; 8] = [
        |_| (),
        |s| s.files.push("room.toml".into()),
        |s| tiles(s).texels = Texels::Half(vec![[f16::from_f32(0.25); 3], [f16::from_f32(0.5); 3]]),
        |s| (s.film.width, s.render.seed) = (9, Some(3)),
        |s| s.name = "another".to_owned(),
        |s| (floor(s).name, s.materials[0].name) = ("a floor".to_owned(), "a material".to_owned()),
        // The hash of a material is part of the shapes that use it.
        |s| _ = s.material(Material::diffuse("unused", [0.1; 3])),
        |s| {
            s.materials.swap(0, 1);
            s.spheres[0].surface = MaterialId::new(1).into();
            floor(s).surface = MaterialId::new(0).into();
        },
    ];
    for (number, change) in changes.into_iter().enumerate() {
        assert_eq!(changed(change).build().unwrap().hash(), scene.hash(), "change {number}");
    }
    // Rebuilding gives the same bits, including smooth normals.
    assert_eq!(scene.to_builder().build().unwrap().hash(), scene.hash());
}

const TEXT: &str = "[camera]\norigin = [0, 2, 6]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n\
    [film]\nwidth = 8\nheight = 6\n[materials.grey]\ndiffuse = [0.5, 0.5, 0.5]\n\
    [[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"grey\"\n\
    [[spheres]]\ncenter = [0, 4, 0]\nradius = 0.5\nemission = [5, 5, 5]\n";

#[test]
fn a_text_and_a_builder_that_say_the_same_make_the_same_scene() {
    let read = |text: &str| Scene::parse(text, Path::new("room.toml")).unwrap();
    let mut built = room();
    (built.meshes, built.environment) = (vec![], None);
    built.lights.clear();
    let built = built.build().unwrap();
    assert_eq!(read(TEXT).hash(), built.hash());
    // Changed comments, spaces, spelling of a number, name, size and path.
    let text = TEXT
        .replace("radius = 0.5", "radius=5e-1 # metres")
        .replace("width = 8", "width = 80")
        .replace("grey", "ash");
    assert_eq!(
        Scene::parse(&text, Path::new("elsewhere/hall.toml")).unwrap().hash(),
        built.hash()
    );
    assert_ne!(
        read(&TEXT.replace("radius = 0.5", "radius = 0.25")).hash(),
        built.hash()
    );
}

#[test]
fn what_is_never_seen_is_left_out_with_a_note() {
    let mut scene = room();
    scene.environment = None;
    scene.lights.clear();
    scene.sphere(Sphere::new([0.0, 4.0, -0.0], 0.5, Surface::emission([1.0; 3])));
    floor(&mut scene).triangles.push([1, 1, 2]);
    let lamp = Mesh::new(
        [DVec3::X, DVec3::Y, DVec3::Z],
        vec![[0, 1, 2]],
        Surface::emission([1.0; 3]),
    );
    scene.mesh(lamp.clone());
    scene.mesh(Mesh {
        triangles: vec![[2, 0, 1]],
        ..lamp
    });
    let scene = scene.build().unwrap();
    assert_eq!((scene.spheres().len(), scene.meshes().len()), (2, 2));
    assert_eq!(scene.meshes()[0].triangles.len(), 2);
    assert_eq!(
        scene.notes(),
        [
            "1 of 3 spheres coincide with an earlier one, which hides them: left out",
            "mesh 1: 1 triangle of 3 without area is left out",
            "1 triangles that emit lie on earlier ones, which hide them: left out",
        ]
    );
    let mut dark = scene.to_builder();
    (dark.meshes, dark.spheres) = (vec![], vec![]);
    assert_eq!(
        dark.build().unwrap().notes(),
        ["nothing in the scene emits light: the picture will be black"]
    );
}

#[test]
fn changing_a_scene_leaves_the_one_before_as_it_was() {
    let scene = room().build().unwrap();
    let mut other = scene.to_builder();
    assert!(
        Arc::ptr_eq(&other.meshes[0], &scene.meshes()[0]),
        "meshes are shared until they change"
    );
    floor(&mut other).vertices[0].y = -2.0;
    let other = other.build().unwrap();
    assert_eq!(
        (scene.meshes()[0].vertices[0].y, other.meshes()[0].vertices[0].y),
        (-1.0, -2.0)
    );
}

#[test]
fn smoothing_leaves_to_the_builder_what_it_would_refuse() {
    let mesh = Mesh::new([DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 1, 3]], MaterialId::new(0)).smooth();
    assert_eq!(mesh.normals, None);
    let mut scene = room();
    scene.mesh(mesh);
    let error = scene.build().unwrap_err();
    assert_eq!(
        error.to_string(),
        "mesh 2 triangles[0] must have corners among the 3 vertices, got 3"
    );
}
