//! Light clouds: the lights of a file are those of `[[spheres]]`, whatever the file's format.

use std::path::Path;

use octolux::scene::Scene;

const VIEW: &str = "[camera]\norigin = [0, 1, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 45\n\
                    [film]\nwidth = 8\nheight = 8\n";

/// Numbers that `f32` holds exactly.
const LIGHTS: [[f64; 7]; 2] = [
    [0.5, -1.25, 3.0, 0.125, 8.0, 0.0, 2.5],
    [-2.0, 0.75, 1e3, 4.0, 0.0, 0.0, 0.5],
];

/// NumPy's format, version 1.0, written by hand: the reader is another program's.
fn npy(descr: &str, shape: &str, values: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let length = u16::try_from(header.len()).unwrap().to_le_bytes();
    [b"\x93NUMPY\x01\x00".as_slice(), &length, header.as_bytes(), values].concat()
}

fn with_cloud(folder: &Path, name: &str, content: &[u8]) -> Result<Scene, String> {
    cloud_of(folder, name, content, "")
}

/// With further keys of the cloud.
fn cloud_of(folder: &Path, name: &str, content: &[u8], keys: &str) -> Result<Scene, String> {
    std::fs::write(folder.join(name), content).unwrap();
    let path = folder.join("scene.toml");
    std::fs::write(&path, format!("{VIEW}[[light_clouds]]\nfile = \"{name}\"\n{keys}\n")).unwrap();
    Scene::load(&path).map_err(|error| error.to_string())
}

#[test]
fn all_formats_give_the_scene_of_the_spheres() {
    let folder = tempfile::tempdir().unwrap();
    let values = LIGHTS.as_flattened();
    let single = |x: &f64| *x as f32;
    let files = [
        (
            "little.npy",
            npy(
                "<f4",
                "(2, 7)",
                &values.iter().flat_map(|x| single(x).to_le_bytes()).collect::<Vec<_>>(),
            ),
        ),
        (
            "big.npy",
            npy(
                ">f4",
                "(2, 7)",
                &values.iter().flat_map(|x| single(x).to_be_bytes()).collect::<Vec<_>>(),
            ),
        ),
        (
            "double.NPY",
            npy(
                "<f8",
                "(2, 7)",
                &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>(),
            ),
        ),
        ("text.ply", {
            let names =
                ["x", "y", "z", "radius", "red", "green", "blue"].map(|name| format!("property double {name}\n"));
            let rows = LIGHTS
                .map(|light| light.map(|x| x.to_string()).join(" ") + "\n")
                .concat();
            format!(
                "ply\nformat ascii 1.0\nelement vertex 2\n{}end_header\n{rows}",
                names.concat()
            )
            .into_bytes()
        }),
    ];
    let spheres = LIGHTS.map(|[x, y, z, radius, red, green, blue]| {
        format!("[[spheres]]\ncenter = [{x:?}, {y:?}, {z:?}]\nradius = {radius:?}\nemission = [{red:?}, {green:?}, {blue:?}]\n")
    });
    let path = folder.path().join("spheres.toml");
    std::fs::write(&path, format!("{VIEW}{}", spheres.concat())).unwrap();
    let truth = Scene::load(&path).unwrap();
    assert_eq!(truth.spheres().len(), 2);
    for (name, content) in files {
        let scene = with_cloud(folder.path(), name, &content).unwrap();
        assert_eq!(scene.hash(), truth.hash(), "{name}");
    }
}

/// The same numbers without their radii, in every format, are the points of `[[lights]]`.
#[test]
fn a_cloud_of_points_gives_the_scene_of_the_lights() {
    let folder = tempfile::tempdir().unwrap();
    let points = LIGHTS.map(|[x, y, z, _, red, green, blue]| [x, y, z, red, green, blue]);
    let single: Vec<u8> = points
        .iter()
        .flatten()
        .flat_map(|&x| (x as f32).to_le_bytes())
        .collect();
    let double: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let names = ["blue", "x", "y", "z", "red", "green"].map(|name| format!("property double {name}\n"));
    let rows = points.map(|[x, y, z, red, green, blue]| format!("{blue} {x} {y} {z} {red} {green}\n"));
    let (names, rows) = (names.concat(), rows.concat());
    let text = format!("ply\nformat ascii 1.0\nelement vertex 2\n{names}end_header\n{rows}").into_bytes();
    let lights = points.map(|[x, y, z, red, green, blue]| {
        format!("[[lights]]\nkind = \"point\"\nposition = [{x:?}, {y:?}, {z:?}]\nintensity = [{red:?}, {green:?}, {blue:?}]\n")
    });
    let path = folder.path().join("lights.toml");
    std::fs::write(&path, format!("{VIEW}{}", lights.concat())).unwrap();
    let truth = Scene::load(&path).unwrap();
    assert_eq!(truth.lights().len(), 2);
    let files = [
        ("single.npy", npy("<f4", "(2, 6)", &single)),
        ("double.npy", npy("<f8", "(2, 6)", &double)),
        ("text.ply", text),
    ];
    for (name, content) in files {
        let scene = cloud_of(folder.path(), name, &content, "kind = \"point\"").unwrap();
        assert_eq!(scene.hash(), truth.hash(), "{name}");
    }
}

/// The kind says how many numbers a light has. Points of a file come behind those of the scene, whose errors keep their places.
#[test]
fn clouds_of_the_wrong_kind_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let numbers = |count: usize| {
        [1.0_f32]
            .repeat(count)
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let point = "kind = \"point\"";
    for (shape, keys, expected) in [
        (
            "(1, 7)",
            point,
            "\"lamps.npy\" has the shape [1, 7], a cloud of points has (lights, 6)",
        ),
        (
            "(1, 6)",
            "kind = \"sphere\"",
            "\"lamps.npy\" has the shape [1, 6], a light cloud has (lights, 7)",
        ),
        ("(1, 7)", "kind = \"spot\"", "light_cloud kind"),
        ("(1, 7)", "kind = 7", "light_cloud kind"),
    ] {
        let content = npy("<f4", shape, &numbers(if shape == "(1, 7)" { 7 } else { 6 }));
        let said = cloud_of(folder.path(), "lamps.npy", &content, keys).unwrap_err();
        assert!(said.contains(expected), "{said}");
    }
    let negative: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, -2.0, 1.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let content = npy("<f4", "(1, 6)", &negative);
    let said = cloud_of(folder.path(), "lamps.npy", &content, point).unwrap_err();
    assert!(said.contains("has a row 0 whose green"), "{said}");
    let broken = format!("{point}\n[[lights]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = [-1, 1, 1]");
    let content = npy("<f4", "(1, 6)", &numbers(6));
    let said = cloud_of(folder.path(), "lamps.npy", &content, &broken).unwrap_err();
    assert!(said.contains("scene.toml:15: light intensity must be finite"), "{said}");
}

#[test]
fn arrays_that_are_no_lights_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let one = |radius: f32| {
        [0.0, 0.0, 0.0, radius, 1.0, 1.0, 1.0]
            .iter()
            .flat_map(|x: &f32| x.to_le_bytes())
            .collect::<Vec<_>>()
    };
    let cases = [
        (
            npy("<f4", "(7,)", &one(1.0)),
            "has the shape [7], a light cloud has (lights, 7)",
        ),
        (
            npy("<i4", "(1, 7)", &one(1.0)),
            "holds '<i4', a light cloud holds f4 or f8",
        ),
        (
            npy("<f4", "(2, 7)", &one(1.0)),
            "is cut short: its header promises 2 lights",
        ),
        (
            npy("<f4", "(2305843009213693952, 7)", &one(1.0)),
            "is cut short: its header promises 2305843009213693952 lights",
        ),
        (
            npy("<f4", "(1, 7)", &one(-1.0)),
            "has a row 0 whose radius must be positive and finite, got -1.0",
        ),
        (
            npy("<f4", "(1, 7)", &one(f32::NAN)),
            "has a row 0 whose radius must be positive and finite, got NaN",
        ),
        (b"lights".to_vec(), "is not an NPY array"),
        (
            [b"\x93NUMPY\x01\x00\x60\xea".as_slice(), &[b'('; 60_000]].concat(),
            "is not an NPY array",
        ),
    ];
    for (content, expected) in cases {
        let said = with_cloud(folder.path(), "lamps.npy", &content).unwrap_err();
        assert!(
            said.contains(&format!("light cloud \"lamps.npy\" {expected}")),
            "{said}"
        );
    }
    let mut columns = npy("<f4", "(1, 7)", &one(1.0));
    let at = columns.windows(5).position(|word| word == b"False").unwrap();
    columns[at..at + 5].copy_from_slice(b"True ");
    let said = with_cloud(folder.path(), "lamps.npy", &columns).unwrap_err();
    assert!(said.contains("is in Fortran order"), "{said}");
}
