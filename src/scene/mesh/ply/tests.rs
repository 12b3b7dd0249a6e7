//! PLY files in variants that programs write.

use super::*;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\nproperty short z\nproperty uchar red\n\
    element face 2\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n";

const ALL: Wanted = Wanted {
    uvs: true,
    normals: true,
};

fn expected(raw: &RawMesh) {
    let [a, b, c, d] = [[0., 0., 0.], [1.5, 0., 0.], [1.5, 2.25, -3.], [0., 2.25, -3.]].map(DVec3::from_array);
    assert_eq!(raw.vertices, [a, b, c, d]);
    assert_eq!(raw.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 0]]);
    assert!(raw.normals.is_none());
}

#[test]
fn ascii() {
    let text = format!(
        "ply\nformat ascii 1.0\ncomment by hand\n{HEADER}0 0 0 1\n1.5 0 0 1\n1.5 2.25 -3 1\n0 2.25 -3 1\n\
         4 0 1 2 3 0.5\n3 2 1 0 0.5"
    );
    expected(&read(text.as_bytes(), text.len() as u64, ALL).unwrap());
}

#[test]
fn binary_of_both_orders() {
    for little in [true, false] {
        let mut bytes = Vec::new();
        let order = if little { "little" } else { "big" };
        bytes.extend(format!("ply\nformat binary_{order}_endian 1.0\n{HEADER}").bytes());
        let mut put = |big: &[u8]| match little {
            true => bytes.extend(big.iter().rev()),
            false => bytes.extend(big),
        };
        for (x, y, z) in [
            (0.0_f32, 0.0_f64, 0_i16),
            (1.5, 0.0, 0),
            (1.5, 2.25, -3),
            (0.0, 2.25, -3),
        ] {
            put(&x.to_be_bytes());
            put(&y.to_be_bytes());
            put(&z.to_be_bytes());
            put(&[200]);
        }
        for corners in [&[0_i32, 1, 2, 3][..], &[2, 1, 0]] {
            put(&[corners.len() as u8]);
            corners.iter().for_each(|corner| put(&corner.to_be_bytes()));
            put(&0.5_f32.to_be_bytes());
        }
        expected(&read(&bytes[..], bytes.len() as u64, ALL).unwrap());
        // Truncation anywhere is an error, never a smaller mesh.
        for end in 0..bytes.len() {
            assert!(read(&bytes[..end], end as u64, ALL).is_err(), "cut at {end}");
        }
    }
}

#[test]
fn faces_and_lines_of_a_long_file_are_counted_through() {
    let count = 20_003;
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {count}\nproperty list uchar uint vertex_index\nend_header\n"
    );
    (0..count).for_each(|i| text += &format!("{i} 0 1\n"));
    (0..count).for_each(|i| text += &format!("3 0 1 {i}\n"));
    let raw = read(text.as_bytes(), text.len() as u64, ALL).unwrap();
    let numbers = 0..count as u32;
    assert!(raw.vertices.iter().map(|v| v.x as u32).eq(numbers.clone()));
    assert!(raw.triangles.iter().map(|t| t[2]).eq(numbers));

    // Faces and lines are counted through.
    let last = text.trim_end().rfind('\n').unwrap() + 1;
    let error = |end: &str| {
        read(format!("{}{end}\n", &text[..last]).as_bytes(), u64::from(u32::MAX), ALL)
            .unwrap_err()
            .what
    };
    assert!(error("2 0").starts_with("has a `face` element"));
    let line = 9 + 2 * count;
    assert_eq!(
        error("3 0 1 x"),
        format!("has a `face` element that cannot be read in line {line}")
    );
}

#[test]
fn normals_of_the_file() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nelement face 1\n\
        property list uchar uint vertex_index\nend_header\n0 0 0 0 0 1\n1 0 0 0 1 0\n0 1 0 1 0 0\n3 0 1 2\n";
    assert_eq!(
        read(text.as_bytes(), text.len() as u64, ALL).unwrap().normals.unwrap(),
        [DVec3::Z, DVec3::Y, DVec3::X]
    );
}

#[test]
fn a_header_that_promises_too_much_costs_nothing() {
    for encoding in ["ascii", "binary_little_endian"] {
        for vertices in ["4000000000", "18446744073709551615"] {
            let text = format!(
                "ply\nformat {encoding} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n\
                 property float z\nelement face 1\nproperty list uint uint vertex_indices\nend_header\n"
            );
            assert!(
                read(text.as_bytes(), text.len() as u64, ALL)
                    .unwrap_err()
                    .what
                    .starts_with("is cut short")
            );
        }
        // Elements without properties take no bytes, but their count is still checked.
        let text = format!(
            "ply\nformat {encoding} 1.0\nelement thing 4000000000\nelement vertex 0\nproperty float x\n\
             property float y\nproperty float z\nelement face 0\nend_header\n"
        );
        assert!(read(text.as_bytes(), text.len() as u64, ALL).is_err());
    }
}

const BOX: &str = "element vertex 8\nproperty float x\nproperty float y\nproperty float z\nelement face 6\n\
    property list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n2 1 0\n0 1 0\n0 0 3\n2 0 3\n2 1 3\n0 1 3\n\
    4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n";

fn load(text: &[u8]) -> RawMesh {
    read(text, text.len() as u64, ALL).unwrap()
}

/// The triangles as points.
fn points(raw: &RawMesh) -> Vec<[DVec3; 3]> {
    raw.triangles
        .iter()
        .map(|t| t.map(|corner| raw.vertices[corner as usize]))
        .collect()
}

#[test]
fn one_box_in_many_spellings() {
    let plain = format!("ply\nformat ascii 1.0\n{BOX}");
    let expected = points(&load(plain.as_bytes()));
    assert_eq!(expected.len(), 12);
    let mut spellings: Vec<Vec<u8>> = vec![
        format!("\u{feff}{plain}").into_bytes(),
        plain.replace('\n', "\r").into_bytes(),
        plain.replace('\n', "\r\n").into_bytes(),
        plain.replace("0 0 0\n2 0 0", "\n0 .0 0.\n\n2e0 +0 0").into_bytes(),
        plain
            .replace("face 6", "face 9")
            .replace("4 4 5", "0\n1 2\n2 0 1\n4 4 5")
            .into_bytes(),
        plain
            .replace("vertex 8", "vertex 9")
            .replace("0 1 3\n", "0 1 3\nnan inf -inf\n")
            .into_bytes(),
        plain
            .replace("float x", "float x extra")
            .replace(
                "element face",
                "element odd 1\nproperty list uchar float \u{e4}\nelement face",
            )
            .replace("0 1 3\n", "0 1 3\n2 0.5 nan\n")
            .into_bytes(),
    ];
    let latin = [
        b"ply\nformat ascii 1.0\ncomment caf\xe9 \xff\nobj_info \xe4\n",
        BOX.as_bytes(),
    ]
    .concat();
    spellings.push(latin);
    // Faces before the vertices.
    let (vertices, faces) = BOX.split_at(BOX.find("element face").unwrap());
    let (header, rest) = faces.split_once("end_header\n").unwrap();
    let (numbers, corners) = rest.split_at(rest.find("4 3 2").unwrap());
    spellings.push(format!("ply\nformat ascii 1.0\n{header}{vertices}end_header\n{corners}{numbers}").into_bytes());
    for text in spellings {
        assert_eq!(points(&load(&text)), expected, "{}", String::from_utf8_lossy(&text));
    }
    let bare = plain.replace("face 6", "face 8").replace("4 4 5", "0\n2 0 1\n4 4 5");
    assert_eq!(
        load(bare.as_bytes()).notes,
        ["2 faces of fewer than 3 corners are left out"]
    );
}

#[test]
fn binary_numbers_follow_a_header_of_any_line_end() {
    for (end, first) in [("\n", b'\n'), ("\r\n", b'\n'), ("\r", b'\n'), ("\r", b'\r')] {
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty uchar x\nproperty uchar y\n\
            property uchar z\nelement face 1\nproperty list uchar uchar vertex_index\nend_header\n";
        let mut bytes = header.replace('\n', end).into_bytes();
        // The first byte of the numbers looks like a line end.
        bytes.extend([first, 0, 0, 1, 0, 0, 0, 1, 0, 3, 0, 1, 2]);
        assert_eq!(
            load(&bytes).vertices[0],
            DVec3::new(f64::from(first), 0.0, 0.0),
            "{end:?} {first}"
        );
    }
}

#[test]
fn strips_make_triangles_of_one_winding() {
    let text = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n12 0 1 2 3 4 5 -1 0 1 2 2 3\n";
    let raw = load(text.as_bytes());
    assert_eq!(raw.triangles, [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5], [0, 1, 2]]);
    let up = points(&raw).iter().all(|[a, b, c]| (*b - *a).cross(*c - *a).z > 0.0);
    assert!(up);
}

#[test]
fn texture_coordinates_of_faces_belong_to_their_corners() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 3\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n\
        0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 1 1 0.25 1\n3 0 1 3 0\n";
    let raw = load(text.as_bytes());
    let uvs = raw.uvs.clone().unwrap();
    let of = |i: usize| raw.triangles[i].map(|corner| uvs[corner as usize].to_array());
    assert_eq!(of(0), [[0., 0.], [1., 0.], [1., 1.]]);
    assert_eq!(of(1), [[0., 0.], [1., 1.], [0.25, 1.]]);
    assert_eq!(of(2).map(DVec2::from_array), [NO_UV; 3]);
    assert_eq!(
        raw.triangles[0][0], raw.triangles[1][0],
        "what is the same is one vertex"
    );
    assert_eq!(
        read(text.as_bytes(), 1000, Wanted::default()).unwrap().vertices.len(),
        4
    );
}

#[test]
fn a_text_is_rounded_to_the_type_that_it_is_declared_as() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty double y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0.1 0.1 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert_eq!(
        load(text.as_bytes()).vertices[0],
        DVec3::new(f64::from(0.1_f32), 0.1, 0.0)
    );
}
