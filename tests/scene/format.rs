//! What the keys of a scene file mean (version 1 of the format).

use std::path::Path;

use glam::DVec3;
use octolux::scene::{
    Bsdf, Environment, EstimatorKind, Fov, Light, LightClass, MaterialId, Mesh, SamplerKind, Scene, Surface,
};

const VIEW: &str = "[camera]\norigin = [0, 2, 15]\ntarget = [0.0, -2, 2.5]\nup = [0, 1, 0]\nfov_y = 28\n\n\
    [film]\nwidth = 768\nheight = 512\n\n[materials.b]\ndiffuse = [1, 0.5, 0]\n\n[materials.a]\n\
    phong = [2, 0, 0]\nexponent = 1000\n\n";

const TRIANGLE: &str =
    "[[meshes]]\nmaterial = \"b\"\nvertices = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nfaces = [[0, 1, 2]]\n";

fn scene(rest: &str) -> Scene {
    Scene::parse(&format!("{VIEW}{rest}"), Path::new("scenes/any.toml")).unwrap()
}

/// The vertices of [`TRIANGLE`] after a transform.
fn moved(transform: &str) -> Vec<DVec3> {
    scene(&format!("{TRIANGLE}transform = {{ {transform} }}\n")).meshes()[0]
        .vertices
        .clone()
}

#[test]
fn whole_numbers_will_do_and_tables_keep_their_order() {
    let scene = scene("");
    assert_eq!(scene.camera().fov, Fov::Y(28.0));
    assert_eq!(scene.camera().origin, DVec3::new(0.0, 2.0, 15.0));
    assert_eq!(
        scene.materials()[0].name,
        "b",
        "in the order of the file, not of the alphabet"
    );
    assert_eq!(
        scene.materials()[0].bsdf,
        Bsdf::Diffuse {
            rho: DVec3::new(1.0, 0.5, 0.0)
        }
    );
    assert_eq!(
        scene.materials()[1].bsdf,
        Bsdf::Phong {
            rho: DVec3::new(2.0, 0.0, 0.0),
            alpha: 1000.0
        }
    );
    assert!(
        scene.spheres().is_empty() && scene.meshes().is_empty(),
        "an empty scene is a black picture"
    );
    assert_eq!(scene.render(), Default::default());
}

#[test]
fn the_render_table_is_optional_key_by_key() {
    let render = scene("[render]\nestimator = \"light\"\nsampler = \"independent\"\nspp = 0x10\n").render();
    assert_eq!(render.estimator, Some(EstimatorKind::Light));
    assert_eq!(scene("[render]\nestimator = \"auto\"\n").render().estimator, None);
    assert_eq!(render.sampler, Some(SamplerKind::Independent));
    assert_eq!((render.spp, render.seed), (Some(16), None));
}

#[test]
fn brdf_params_are_diffuse_at_one_and_phong_above() {
    let bsdf = |alpha: &str| {
        scene(&format!("[materials.s]\nbrdf_params = [0.1, 0.2, 0.3, {alpha}]\n"))
            .materials()
            .last()
            .unwrap()
            .bsdf
    };
    let rho = DVec3::new(0.1, 0.2, 0.3);
    assert_eq!(bsdf("1"), Bsdf::Diffuse { rho });
    assert_eq!(bsdf("1.5"), Bsdf::Phong { rho, alpha: 1.5 });
}

#[test]
fn rough_surfaces_have_three_spellings_and_hashes_of_their_own() {
    let of = |keys: &str| {
        let scene = scene(&format!(
            "[materials.s]\n{keys}\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"s\"\n"
        ));
        (scene.materials().last().unwrap().bsdf, scene.hash().to_owned())
    };
    let base = DVec3::new(0.1, 0.2, 0.3);
    let coated = |metallic: f64, roughness: f64| Bsdf::Ggx {
        base,
        metallic,
        roughness,
    };
    let found = [
        of("base_color = [0.1, 0.2, 0.3]\nmetallic = 0\nroughness = 0.5"),
        of("base_color = [0.1, 0.2, 0.3]\nmetallic = 1\nroughness = 0.5"),
        of("base_color = [0.1, 0.2, 0.3]\nmetallic = 1\nroughness = 0.25"),
        of("eta = [0.1, 0.2, 0.3]\nk = [1, 2, 3]\nroughness = 0.25"),
        of("eta = [0.1, 0.2, 0.3]\nk = [1, 2, 4]\nroughness = 0.25"),
    ];
    assert_eq!(found[0].0, coated(0.0, 0.5));
    assert_eq!(found[1].0, coated(1.0, 0.5));
    assert_eq!(found[2].0, coated(1.0, 0.25));
    let metal = Bsdf::Conductor {
        eta: base,
        k: DVec3::new(1.0, 2.0, 3.0),
        roughness: 0.25,
    };
    assert_eq!(found[3].0, metal);
    for (i, (_, hash)) in found.iter().enumerate() {
        assert!(found[..i].iter().all(|(_, other)| other != hash), "{i}");
    }
}

#[test]
fn materials_may_follow_the_shapes_that_use_them() {
    let sphere =
        "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = \"late\"\n\n[materials.late]\ndiffuse = [1, 1, 1]\n";
    assert_eq!(
        scene(sphere).spheres()[0].surface,
        Surface::Material(MaterialId::new(2))
    );
}

#[test]
fn quads_are_split_along_0_2() {
    let mesh = "[[meshes]]\nemission = [1, 2, 3]\nvertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nfaces = [[3, 2, 1, 0]]\n";
    let mesh = &scene(mesh).meshes()[0].clone();
    assert_eq!(mesh.triangles, [[3, 2, 1], [3, 1, 0]]);
    assert_eq!(mesh.surface, Surface::Emission(DVec3::new(1.0, 2.0, 3.0)));
    assert_eq!(mesh.normals, None, "flat unless it says otherwise");
}

#[test]
fn transforms_go_scale_x_y_z_translate_whatever_the_order_of_the_keys() {
    let v = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    assert_eq!(moved(""), [DVec3::X, DVec3::Y, DVec3::Z]);
    assert_eq!(
        moved("translate = [10, 20, 30], scale = 2"),
        [v(12., 20., 30.), v(10., 22., 30.), v(10., 20., 32.)]
    );
    // About x: y to z, z to -y; then about y: z to x, x to -z; then about z: x to y, y to -x.
    assert_eq!(
        moved("rotate_y = 90, rotate_x = 90"),
        [v(0., 0., -1.), v(1., 0., 0.), v(0., -1., 0.)]
    );
    assert_eq!(
        moved("rotate_z = 90, rotate_x = 90, rotate_y = 90"),
        [v(0., 0., -1.), v(0., 1., 0.), v(1., 0., 0.)]
    );
    // The scale is along the axes of the mesh: it comes before the turn.
    assert_eq!(
        moved("rotate_z = 90, scale = [2, 3, 4], translate = [1, 0, 0]")[..2],
        [v(1., 2., 0.), v(-2., 0., 0.)]
    );
}

#[test]
fn a_mirrored_mesh_keeps_its_normals_and_turns_its_winding() {
    let smooth = |scale: &str| {
        let text = format!("{TRIANGLE}normals = \"smooth\"\ntransform = {{ scale = {scale} }}\n");
        Mesh::clone(&scene(&text).meshes()[0])
    };
    let mesh = smooth("-1");
    let [a, b, c] = mesh.triangles[0].map(|corner| mesh.vertices[corner as usize]);
    let normal = mesh.normals.unwrap()[0];
    assert!((normal.abs() - DVec3::splat(3.0_f64.sqrt().recip())).length() < 1e-15);
    assert!((b - a).cross(c - a).dot(normal) > 0.0);
}

#[test]
fn triangles_without_area_are_left_out_with_a_note() {
    let mesh = "[[meshes]]\nmaterial = \"a\"\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [1, 1e-20, 0]]\n\
        faces = [[0, 1, 2], [0, 1, 3], [1, 1, 2], [0, 3, 4]]\n";
    let scene = scene(mesh);
    assert_eq!(scene.meshes()[0].triangles, [[0, 1, 2]]);
    assert_eq!(
        scene.notes(),
        [
            "[[meshes]] 1: 3 triangles of 4 without area are left out",
            "nothing in the scene emits light: the picture will be black"
        ]
    );
}

#[test]
fn small_and_thin_is_not_flat() {
    let mesh =
        "[[meshes]]\nmaterial = \"a\"\nvertices = [[0, 0, 0], [1e-20, 0, 0], [0, 1e-30, 0]]\nfaces = [[0, 1, 2]]\n";
    assert_eq!(scene(mesh).meshes()[0].triangles.len(), 1);
}

#[test]
fn an_environment_is_one_radiance_or_a_picture_that_is_scaled_and_turned() {
    let constant = scene("[environment]\nemission = [1, 2, 0]\n");
    assert_eq!(
        constant.environment(),
        Some(&Environment::Constant(DVec3::new(1.0, 2.0, 0.0)))
    );
    assert_eq!(scene("").environment(), None);
    let picture = |turn: &str| match scene(&format!("[environment]\nfile = \"skies/noon.hdr\"\n{turn}")).environment() {
        Some(Environment::Picture(picture)) => picture.clone(),
        other => panic!("{other:?} is no picture"),
    };
    let (plain, turned) = (picture(""), picture("scale = 2\nrotate_y = 90\n"));
    assert_eq!((plain.width, plain.height, plain.texels.len()), (64, 32, 64 * 32));
    assert_eq!(plain.to_scene * DVec3::NEG_Z, DVec3::NEG_Z);
    assert_eq!(
        turned.to_scene * DVec3::NEG_Z,
        DVec3::NEG_X,
        "the middle turns to the left"
    );
    assert_eq!(turned.texels.at(9), plain.texels.at(9).map(|x| 2.0 * x));
}

/// `rotate` comes after the turns about the axes, and turns about any axis: a third of a turn about the diagonal takes x to y.
#[test]
fn a_turn_about_an_axis_comes_after_those_about_the_coordinate_axes() {
    let near = |points: Vec<DVec3>, expected: [DVec3; 3]| {
        points
            .iter()
            .zip(expected)
            .for_each(|(a, b)| assert!((*a - b).length() < 1e-15, "{points:?}"));
    };
    near(
        moved("rotate = [1, 1, 1, 120]").to_vec(),
        [DVec3::Y, DVec3::Z, DVec3::X],
    );
    near(
        moved("rotate = [1, 1, 1, 120], rotate_z = 90").to_vec(),
        [DVec3::Z, -DVec3::Y, DVec3::X],
    );
}

#[test]
fn boxes_are_meshes_of_twelve_triangles_turned_about_their_middles() {
    let text = "[[boxes]]\nmaterial = \"a\"\ncenter = [1, 2, 3]\nsize = [2, 4, 6]\nrotate = [0, 1, 0, 90]\n\
        [[boxes]]\nemission = [1, 1, 1]\ncenter = [9, 0, 0]\nsize = [1, 1, 1]\n";
    let scene = scene(text);
    let mesh = &scene.meshes()[0];
    assert_eq!((mesh.triangles.len(), scene.meshes().len()), (12, 2));
    let low = mesh.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = mesh.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    assert_eq!((low, high), (DVec3::new(-2.0, 0.0, 2.0), DVec3::new(4.0, 4.0, 4.0)));
    assert_eq!(scene.meshes()[1].surface, Surface::Emission(DVec3::ONE));
}

#[test]
fn a_light_without_a_shape_is_a_point_a_spot_or_far_away() {
    let text = "[[lights]]\nkind = \"point\"\nposition = [0, 3, 0]\nintensity = [1, 2, 3]\n\
         [[lights]]\nkind = \"spot\"\nposition = [0, 3, 0]\ntarget = [0, 1, 0]\nintensity = [1, 2, 3]\nouter_angle = 30\n\
         [[lights]]\nkind = \"spot\"\nposition = [0, 3, 0]\ndirection = [0, -2, 0]\nintensity = [1, 2, 3]\n\
         inner_angle = 0\nouter_angle = 30\n\
         [[lights]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [1, 2, 3]\nangular_radius = 0.5\n";
    let (up, colour) = (DVec3::new(0.0, 3.0, 0.0), DVec3::new(1.0, 2.0, 3.0));
    let spot = Light::spot(up, [0.0, 1.0, 0.0], colour, [0.0, 30.0]);
    let sun = Light::directional(DVec3::NEG_Y, colour, 0.5);
    let scene = scene(text);
    assert_eq!(scene.lights(), [Light::point(up, colour), spot, spot, sun]);
    assert_eq!(sun.class(), LightClass::Disk);
    assert_eq!(
        Light::directional(DVec3::NEG_Y, colour, 5e-5).class(),
        LightClass::Delta
    );
}
