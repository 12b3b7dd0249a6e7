//! Hand-made glTF files.

mod extensions;

use glam::DVec2;

use super::*;

const ALL: Wanted = Wanted {
    uvs: true,
    normals: true,
};

/// A triangle with coordinates of one of glTF's number types.
fn triangle(component: u32, normalized: bool, coordinates: &[u8], stride: usize) -> Vec<u8> {
    let mut buffer: Vec<u8> = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    buffer.extend(coordinates);
    buffer.resize(buffer.len().next_multiple_of(4), 0);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":{component},"normalized":{normalized},"count":3,"type":"VEC2"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},
        {{"buffer":0,"byteOffset":36,"byteLength":{},"byteStride":{stride}}}],"buffers":[{{"byteLength":{}}}]}}"#,
        coordinates.len(),
        buffer.len()
    );
    let mut json = json.into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + buffer.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

#[test]
fn texture_coordinates_of_every_type_count_upwards() {
    let numbers = [0.0_f32, 0.2, 1.0, 0.6, 0.4, 1.0];
    let floats: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let shorts: Vec<u8> = numbers
        .iter()
        .flat_map(|x| ((x * 65_535.0) as u16).to_le_bytes())
        .collect();
    let bytes: Vec<u8> = numbers
        .chunks(2)
        .flat_map(|x| [(x[0] * 255.0) as u8, (x[1] * 255.0) as u8, 0, 0])
        .collect();
    let types = [
        (5126, false, floats, 8),
        (5123, true, shorts, 4),
        (5121, true, bytes, 4),
    ];
    for (component, normalized, coordinates, stride) in types {
        let file = triangle(component, normalized, &coordinates, stride);
        let alone = |_: &str| -> Result<Vec<u8>, Problem> { unreachable!("the buffer is in the file") };
        let uvs = read(file.clone(), ALL, &alone).unwrap().uvs.unwrap();
        let upwards = [DVec2::new(0.0, 0.8), DVec2::new(1.0, 0.4), DVec2::new(0.4, 0.0)];
        for (found, wanted) in uvs.iter().zip(upwards) {
            assert!((*found - wanted).length() < 1e-7, "{component}: {found} for {wanted}");
        }
        assert!(read(file.clone(), Wanted::default(), &alone).unwrap().uvs.is_none());
    }
}

#[test]
fn texture_coordinates_of_other_types_are_refused_where_they_are_wanted() {
    let file = triangle(5125, false, &[0; 24], 8);
    let alone = |_: &str| -> Result<Vec<u8>, Problem> { unreachable!("the buffer is in the file") };
    let error = read(file.clone(), ALL, &alone).unwrap_err();
    assert!(
        error.what.contains("texture coordinates that are not pairs"),
        "{}",
        error.what
    );
    assert!(read(file.clone(), Wanted::default(), &alone).is_ok());
}

fn no_file(_: &str) -> Result<Vec<u8>, Problem> {
    unreachable!("the buffer is in the file")
}

/// A `.gltf` of one buffer, with a view for each run of bytes.
fn gltf(runs: &[Vec<u8>], json: &str) -> Vec<u8> {
    use base64::Engine;
    let (mut buffer, mut views) = (Vec::new(), Vec::new());
    for run in runs {
        views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{}}}"#,
            buffer.len(),
            run.len()
        ));
        buffer.extend(run);
        buffer.resize(buffer.len().next_multiple_of(4), 0);
    }
    let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],{json},"bufferViews":[{}],
        "buffers":[{{"byteLength":{},"uri":"data:application/octet-stream;base64,{data}"}}]}}"#,
        views.join(","),
        buffer.len()
    )
    .into_bytes()
}

fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// A triangle with one corner at the origin, counter-clockwise as seen from +z.
const CORNERS: [f32; 9] = [0., 0., 0., 1., 0., 0., 0., 1., 0.];

const POSITIONS: &str = r#"{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}"#;

fn corners(raw: &RawMesh) -> Vec<[[f64; 3]; 3]> {
    let point = |corner: u32| raw.vertices[corner as usize].to_array();
    raw.triangles.iter().map(|t| t.map(point)).collect()
}

fn error(bytes: Vec<u8>) -> String {
    read(bytes, ALL, &no_file).unwrap_err().what
}

#[test]
fn a_node_that_mirrors_turns_the_winding() {
    let file = |scale: &str| {
        gltf(
            &[floats(&CORNERS)],
            &format!(
                r#""nodes":[{{"mesh":0,"scale":{scale}}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1}}}}]}}],
                "accessors":[{POSITIONS},{POSITIONS}]"#
            ),
        )
    };
    let normal = |raw: &RawMesh| {
        let [a, b, c] = corners(raw)[0].map(DVec3::from_array);
        (b - a).cross(c - a).normalize()
    };
    let mirrored = read(file("[-1,1,1]"), ALL, &no_file).unwrap();
    assert_eq!(normal(&mirrored), DVec3::Z, "the front stays in front");
    assert_eq!(
        mirrored.normals.unwrap()[1],
        DVec3::NEG_X,
        "what pointed at +x points at -x"
    );
    assert_eq!(normal(&read(file("[-1,-1,1]"), ALL, &no_file).unwrap()), DVec3::Z);
    assert_eq!(normal(&read(file("[1,1,-1]"), ALL, &no_file).unwrap()), DVec3::NEG_Z);
}

#[test]
fn morph_targets_have_their_weights_at_rest() {
    let file = |weights: &str, of_node: &str| {
        gltf(
            &[floats(&CORNERS), floats(&[0., 0., 0., 2., 0., 0., 0., 0., 0.])],
            &format!(
                r#""nodes":[{{"mesh":0{of_node}}}],"meshes":[{{{weights}"primitives":[{{"attributes":{{"POSITION":0}},"targets":[{{"POSITION":1}}]}}]}}],
                "accessors":[{POSITIONS},{{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"}}]"#
            ),
        )
    };
    let x = |weights: &str, of_node: &str| read(file(weights, of_node), ALL, &no_file).unwrap().vertices[1].x;
    assert_eq!(x("", ""), 1.0);
    assert_eq!(x(r#""weights":[0.25],"#, ""), 1.5);
    assert_eq!(
        x(r#""weights":[0.25],"#, r#","weights":[1]"#),
        3.0,
        "the node's own come first"
    );
}

#[test]
fn a_skin_moves_vertices_by_its_joints_and_its_node_by_nothing() {
    // Joint 2 is at [0, 0, 5] in node 1 at [10, 0, 0]; its bind position is [0, 0, 1].
    let mut inverse = DMat4::IDENTITY.to_cols_array().map(|x| x as f32);
    inverse[14] = -1.0;
    let weights = [255, 0, 0, 0, 255, 0, 0, 0, 128, 127, 0, 0];
    let json = format!(
        r#""nodes":[{{"children":[1,3]}},{{"translation":[10,0,0],"children":[2]}},{{"translation":[0,0,5]}},
        {{"mesh":0,"skin":0,"translation":[7,7,7],"scale":[-3,3,3]}}],
        "skins":[{{"joints":[2,1],"inverseBindMatrices":3}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2}}}}]}}],
        "accessors":[{POSITIONS},{{"bufferView":1,"componentType":5121,"count":3,"type":"VEC4"}},
        {{"bufferView":2,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"}},
        {{"bufferView":3,"componentType":5126,"count":2,"type":"MAT4"}}]"#
    );
    let joints = vec![0_u8, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0];
    let two = [
        floats(&inverse),
        floats(&DMat4::IDENTITY.to_cols_array().map(|x| x as f32)),
    ]
    .concat();
    let file = gltf(&[floats(&CORNERS), joints, weights.to_vec(), two], &json);
    let raw = read(file.clone(), ALL, &no_file).unwrap();
    assert_eq!(raw.vertices[0].to_array(), [10., 0., 4.]);
    assert_eq!(raw.vertices[1].to_array(), [11., 0., 4.]);
    // Half of each joint, to 8-bit precision.
    assert!(
        (raw.vertices[2] - DVec3::new(10., 1., 4.0 * 128.0 / 255.0)).length() < 1e-12,
        "{}",
        raw.vertices[2]
    );
    assert_eq!(
        raw.triangles,
        [[0, 1, 2]],
        "the mirror of its own node counts for nothing"
    );
    let file = String::from_utf8(file)
        .unwrap()
        .replace(r#""joints":[2,1]"#, r#""joints":[2]"#);
    assert_eq!(error(file.into_bytes()), "has a skin without a joint that it names");
}

#[test]
fn instances_are_copies() {
    let half = 0.5_f32.sqrt();
    let json = format!(
        r#""extensionsUsed":["EXT_mesh_gpu_instancing"],"extensionsRequired":["EXT_mesh_gpu_instancing"],
        "nodes":[{{"mesh":0,"translation":[100,0,0],"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":1,"ROTATION":2,"SCALE":3}}}}}}}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{POSITIONS},{{"bufferView":1,"componentType":5126,"count":2,"type":"VEC3"}},
        {{"bufferView":2,"componentType":5126,"count":2,"type":"VEC4"}},{{"bufferView":3,"componentType":5126,"count":2,"type":"VEC3"}}]"#
    );
    let file = gltf(
        &[
            floats(&CORNERS),
            floats(&[1., 0., 0., 2., 0., 0.]),
            floats(&[0., 0., 0., 1., 0., 0., half, half]),
            floats(&[1., 1., 1., 3., 3., 3.]),
        ],
        &json,
    );
    let mut points: Vec<_> = read(file.clone(), ALL, &no_file).unwrap().vertices;
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    // The second instance is scaled by three and rotated by a quarter turn about z.
    let expected = [
        [99., 0., 0.],
        [101., 0., 0.],
        [101., 1., 0.],
        [102., 0., 0.],
        [102., 0., 0.],
        [102., 3., 0.],
    ];
    for point in expected.map(DVec3::from_array) {
        assert!(
            points.iter().any(|p| (*p - point).length() < 1e-5),
            "{point} in {points:?}"
        );
    }
    let file = String::from_utf8(file).unwrap().replace(r#""SCALE":3"#, r#""SCALE":9"#);
    assert_eq!(
        error(file.into_bytes()),
        "has instances that name an accessor that does not exist"
    );
}

#[test]
fn sparse_and_quantized_numbers() {
    let one = |accessor: &str, runs: &[Vec<u8>]| {
        let json = format!(
            r#""extensionsUsed":["KHR_mesh_quantization"],"extensionsRequired":["KHR_mesh_quantization"],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],"accessors":[{accessor}]"#
        );
        read(gltf(runs, &json), ALL, &no_file).map(|raw| raw.vertices.iter().map(|v| v.to_array()).collect::<Vec<_>>())
    };
    let replaced = floats(&[0., 5., 0.]);
    let sparse = |base: &str, index: u8| {
        format!(
            r#"{{{base}"componentType":5126,"count":3,"type":"VEC3","sparse":{{"count":1,
            "indices":{{"bufferView":1,"componentType":5121}},"values":{{"bufferView":2}}}}}}"#
        )
        .replace("\"count\":1,", &format!("\"count\":{},", usize::from(index > 0)))
    };
    let runs = |index| [floats(&CORNERS), vec![index], replaced.clone()];
    assert_eq!(
        one(&sparse(r#""bufferView":0,"#, 2), &runs(2)).unwrap(),
        [[0., 0., 0.], [1., 0., 0.], [0., 5., 0.]]
    );
    assert_eq!(
        one(&sparse("", 1), &runs(1)).unwrap(),
        [[0., 0., 0.], [0., 5., 0.], [0., 0., 0.]],
        "zeros where there is no view"
    );
    assert_eq!(
        one(&sparse(r#""bufferView":0,"#, 3), &runs(3)).unwrap_err().what,
        "has accessor 0 outside of its buffer"
    );

    let strided = |component: u32, normalized: bool| {
        format!(r#"{{"bufferView":0,"componentType":{component},"normalized":{normalized},"count":3,"type":"VEC3"}}"#)
    };
    let shorts: Vec<u8> = [0_u16, 0, 0, 65_535, 0, 0, 0, 13_107, 0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    assert_eq!(
        one(&strided(5123, false), std::slice::from_ref(&shorts)).unwrap()[1..],
        [[65_535., 0., 0.], [0., 13_107., 0.]]
    );
    assert_eq!(
        one(&strided(5123, true), &[shorts]).unwrap()[1..],
        [[1., 0., 0.], [0., 0.2, 0.]]
    );
    let bytes = vec![0, 0, 0, 127, 0, 0, 0x80, 0x81, 0];
    assert_eq!(
        one(&strided(5120, true), std::slice::from_ref(&bytes)).unwrap()[1..],
        [[1., 0., 0.], [-1., -1., 0.]]
    );
    assert_eq!(
        one(&strided(5120, false), &[bytes]).unwrap()[1..],
        [[127., 0., 0.], [-128., -127., 0.]]
    );
}
