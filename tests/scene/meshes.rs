//! Mesh files through the whole way: one pyramid in every format, and files that somebody has damaged.

use std::path::Path;

use glam::DVec3;
use octolux::scene::{Mesh, Scene};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const SCENE: &str = "camera = { origin = [0, 0, 9], target = [0, 0, 0], up = [0, 1, 0], fov_x = 40 }\n\
    film = { width = 4, height = 4 }\nmaterials.m = { diffuse = [1, 1, 1] }\n";

/// Loads the mesh file `name` with these bytes.
fn load(name: &str, bytes: &[u8], more: &str) -> Result<Mesh, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join(name), bytes).unwrap();
    let text = format!("{SCENE}[[meshes]]\nmaterial = \"m\"\nfile = \"{name}\"\n{more}");
    let scene = Scene::parse(&text, &folder.path().join("scene.toml"));
    scene
        .map(|scene| Mesh::clone(&scene.meshes()[0]))
        .map_err(|error| error.to_string())
}

/// A pyramid over a square: a quad and four triangles.
const POINTS: [[f32; 3]; 5] = [
    [-1., 0., 1.],
    [1., 0., 1.],
    [1., 0., -1.],
    [-1., 0., -1.],
    [0., 1.5, 0.],
];
const TRIANGLES: [[u16; 3]; 6] = [[3, 2, 1], [3, 1, 0], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];

fn obj() -> Vec<u8> {
    let mut text = "mtllib nowhere.mtl\no pyramid\n".to_owned();
    POINTS.iter().for_each(|[x, y, z]| text += &format!("v {x} {y} {z}\n"));
    text += "vt 0 0\ng base\nusemtl stone\nf 4/1 3/1 2/1 1/1\ng sides\ns 1\nf 1 2 -1\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
    text.into_bytes()
}

fn ply() -> Vec<u8> {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\n\
        property float z\nelement face 5\nproperty list uchar ushort vertex_index\nend_header\n"
        .to_vec();
    POINTS.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
    for face in [&[3_u16, 2, 1, 0][..], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]] {
        bytes.push(face.len() as u8);
        face.iter().for_each(|corner| bytes.extend(corner.to_le_bytes()));
    }
    bytes
}

/// A binary glTF file whose nodes move the pyramid by [4, 0, 0] in two steps and double it in between.
fn glb() -> Vec<u8> {
    let mut buffer: Vec<u8> = POINTS.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    buffer.extend(TRIANGLES.iter().flatten().flat_map(|corner| corner.to_le_bytes()));
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
        "nodes":[{"translation":[2,0,0],"scale":[2,2,2],"children":[1]},{"translation":[1,0,0],"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3","min":[-1,0,-1],"max":[1,1.5,1]},
                     {"bufferView":1,"componentType":5123,"count":18,"type":"SCALAR"}],
        "bufferViews":[{"buffer":0,"byteLength":60},{"buffer":0,"byteOffset":60,"byteLength":36}],
        "buffers":[{"byteLength":96}]}"#;
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((12 + 8 + json.len() as u32 + 8 + buffer.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn stl() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((TRIANGLES.len() as u32).to_le_bytes());
    for triangle in TRIANGLES {
        bytes.extend([0; 12]);
        let points = triangle.iter().flat_map(|&corner| POINTS[corner as usize]);
        points.for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn off() -> Vec<u8> {
    let mut text = "OFF\n5 5 8\n".to_owned();
    POINTS.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    text += "4 3 2 1 0\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";
    text.into_bytes()
}

fn packed(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

/// The corners of all triangles.
fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    mesh.triangles
        .iter()
        .map(|corners| corners.map(|corner| mesh.vertices[corner as usize]))
        .collect()
}

fn pyramid() -> Vec<[DVec3; 3]> {
    TRIANGLES
        .map(|t| t.map(|corner| DVec3::from_array(POINTS[corner as usize].map(f64::from))))
        .to_vec()
}

#[test]
fn a_pyramid_is_the_same_in_every_format() {
    for (name, bytes) in [("p.obj", obj()), ("p.PLY", ply()), ("p.stl", stl()), ("p.off", off())] {
        let mesh = load(name, &bytes, "").unwrap();
        assert_eq!(corners(&mesh), pyramid(), "{name}");
        assert_eq!(mesh.vertices.len(), 5, "{name}");
        let packed = load(&format!("{name}.gz"), &packed(&bytes), "").unwrap();
        // Its name is that of its file.
        let name_aside = Mesh {
            name: mesh.name.clone(),
            ..packed
        };
        assert_eq!(name_aside, mesh, "{name}.gz");
    }
    let back = "transform = { scale = 0.5, translate = [-2, 0, 0] }\n";
    assert_eq!(corners(&load("p.glb", &glb(), back).unwrap()), pyramid());
    assert_eq!(corners(&load("p.glb.gz", &packed(&glb()), back).unwrap()), pyramid());
}

#[test]
fn a_mirror_leaves_the_front_in_front() {
    let mirror = "transform = { scale = [-1, 1, 1] }\n";
    for (name, bytes) in [("p.obj", obj()), ("p.ply", ply()), ("p.stl", stl())] {
        let mesh = load(name, &bytes, mirror).unwrap();
        let outwards = corners(&mesh).iter().all(|[a, b, c]| {
            let middle = DVec3::new(0.0, 0.4, 0.0);
            (*b - *a).cross(*c - *a).dot(*a - middle) > 0.0
        });
        assert!(outwards, "{name}");
    }
}

/// A square whose half has no texture coordinates, under a material with a texture.
#[test]
fn a_texture_on_faces_without_coordinates_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy("scenes/textures/tiles.png", folder.path().join("t.png")).unwrap();
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";
    let scene = |faces: &str| {
        std::fs::write(folder.path().join("p.obj"), format!("{points}{faces}")).unwrap();
        let text = SCENE.replace("[1, 1, 1] }", "[1, 1, 1], texture = \"t.png\" }");
        let text = format!("{text}[[meshes]]\nmaterial = \"m\"\nfile = \"p.obj\"\n");
        Scene::parse(&text, &folder.path().join("scene.toml")).map_err(|error| error.to_string())
    };
    let error = scene("f 1/1 2/2 3/3\nf 1 3 4\n").unwrap_err();
    assert!(
        error.ends_with(
            "[[meshes]] 1 (p.obj) has a material with a texture, and 1 of its 2 triangles have no texture coordinates"
        ),
        "{error}"
    );
    let uvs = scene("f 1/1 2/2 3/3\n").unwrap().meshes()[0].uvs.clone().unwrap();
    assert!(uvs.iter().all(|uv| uv.is_finite()), "a vertex that no face uses");
    assert!(scene("f 1 2 3\n").unwrap_err().ends_with("and no texture coordinates"));
}

#[test]
fn normals_of_some_faces_leave_the_others_alone() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0.6 0 0.8\nf 1//1 2//1 3//1\nf 1 3 4\n";
    let mesh = load("p.obj", text.as_bytes(), "normals = \"smooth\"\n").unwrap();
    let normals = mesh.normals.unwrap();
    let of = |i: usize| mesh.triangles[i].map(|corner| normals[corner as usize]);
    assert!(of(0).iter().all(|n| (*n - DVec3::new(0.6, 0.0, 0.8)).length() < 1e-15));
    assert_eq!(of(1), [DVec3::Z; 3]);
}

#[test]
fn packed_files_are_whole_or_an_error() {
    let file = packed(&ply());
    for end in 0..file.len() {
        assert!(
            load("p.ply.gz", &file[..end], "").is_err(),
            "cut at {end} of {}",
            file.len()
        );
    }
    let mut wrong = file.clone();
    let checksum = file.len() - 6;
    wrong[checksum] ^= 1;
    assert!(load("p.ply.gz", &wrong, "").is_err());
    let error = load("p.obj.gz", &obj(), "").unwrap_err();
    assert!(error.contains("invalid gzip header"), "{error}");
}

#[test]
fn smooth_normals_without_any_in_the_file() {
    for (name, bytes) in [
        ("p.obj", obj()),
        ("p.ply", ply()),
        ("p.glb", glb()),
        ("p.stl", stl()),
        ("p.off", off()),
    ] {
        let mesh = load(name, &bytes, "normals = \"smooth\"\n").unwrap();
        let normals = mesh.normals.unwrap();
        let top = mesh.vertices.iter().position(|v| v.y > 1.0).unwrap();
        assert!((normals[top] - DVec3::Y).length() < 1e-12, "{name}: {}", normals[top]);
        assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
    }
}

#[test]
fn a_gltf_with_a_buffer_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let glb = glb();
    let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json = String::from_utf8(glb[20..20 + json_length].to_vec()).unwrap();
    let json = json.replace(r#"{"byteLength":96}"#, r#"{"byteLength":96,"uri":"the%20buffer.bin"}"#);
    std::fs::write(folder.path().join("p.gltf"), json).unwrap();
    let text = format!("{SCENE}[[meshes]]\nmaterial = \"m\"\nfile = \"p.gltf\"\n");
    let error = Scene::parse(&text, &folder.path().join("scene.toml"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("has a buffer that cannot be read"), "{error}");
    std::fs::write(folder.path().join("the buffer.bin"), &glb[28 + json_length..]).unwrap();
    assert_eq!(
        Scene::parse(&text, &folder.path().join("scene.toml")).unwrap().meshes()[0]
            .triangles
            .len(),
        6
    );
}

#[test]
fn a_cut_file_is_an_error() {
    for (name, bytes) in [("p.ply", ply()), ("p.glb", glb()), ("p.stl", stl())] {
        for end in 0..bytes.len() {
            assert!(
                load(name, &bytes[..end], "").is_err(),
                "{name} cut at {end} of {}",
                bytes.len()
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..Default::default() })]

    /// Whatever happens to a file, loading it ends with a mesh or a sentence. (A panic fails the test.)
    #[test]
    fn damaged_files_never_panic(
        which in 0..6_usize,
        damage in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![any::<u8>(), Just(b'9'), Just(b'-')]), 1..6),
    ) {
        let (name, mut bytes) = [("p.obj", obj()), ("p.ply", ply()), ("p.glb", glb()), ("p.gltf", glb()[20..].to_vec()), ("p.stl", stl()), ("p.off", off())][which].clone();
        for (place, byte) in damage {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        let smooth = "normals = \"smooth\"\n";
        if let Ok(mesh) = load(name, &bytes, smooth) {
            prop_assert!(mesh.triangles.iter().flatten().all(|&corner| (corner as usize) < mesh.vertices.len()));
            prop_assert!(mesh.vertices.iter().chain(mesh.normals.as_ref().unwrap()).all(|v| v.is_finite()));
        }
    }

    /// The same for the scene file itself.
    #[test]
    fn damaged_scenes_never_panic(
        damage in prop::collection::vec((any::<prop::sample::Index>(), "[ -~\n\u{e9}]{0,3}"), 1..5),
    ) {
        let mut text = include_str!("../../scenes/large-lights.toml").to_owned();
        for (place, words) in damage {
            let mut place = place.index(text.len());
            while !text.is_char_boundary(place) {
                place -= 1;
            }
            text.replace_range(place..place + usize::from(text.is_char_boundary(place + 1)), &words);
        }
        match Scene::parse(&text, Path::new("scenes/damaged.toml")) {
            Ok(_) => {}
            Err(error) => prop_assert_eq!(error.to_string().lines().count(), 1),
        }
    }
}
