//! Extensions, and attributes missing from some primitives.

use super::*;

#[test]
fn what_is_said_of_materials_refuses_no_mesh() {
    let with = |more: &str, primitive: &str| {
        let json = format!(
            r#"{more}"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}{primitive}}}]}}],"accessors":[{POSITIONS}]"#
        );
        read(gltf(&[floats(&CORNERS)], &json), ALL, &no_file)
    };
    for (name, more) in [
        (
            "KHR_texture_basisu",
            r#""textures":[{"extensions":{"KHR_texture_basisu":{"source":0}}}],"images":[{"uri":"a.ktx2"}],"#,
        ),
        (
            "EXT_texture_webp",
            r#""textures":[{"extensions":{"EXT_texture_webp":{"source":0}}}],"#,
        ),
        (
            "KHR_materials_unlit",
            r#""materials":[{"alphaMode":"MAYBE","extensions":{"KHR_materials_unlit":{}}}],"#,
        ),
        ("KHR_texture_transform", ""),
        (
            "KHR_lights_punctual",
            r#""extensions":{"KHR_lights_punctual":{"lights":[{"type":"sun"}]}},"#,
        ),
    ] {
        let all = format!(r#""extensionsUsed":["{name}"],"extensionsRequired":["{name}"],{more}"#);
        assert_eq!(with(&all, r#","material":7"#).unwrap().triangles.len(), 1, "{name}");
    }
    let refused = |name: &str| {
        with(&format!(r#""extensionsRequired":["{name}"],"#), "")
            .unwrap_err()
            .what
    };
    assert_eq!(
        refused("KHR_draco_mesh_compression"),
        "is compressed with Draco, which Octolux does not read"
    );
    assert_eq!(
        refused("EXT_meshopt_compression"),
        "is compressed with meshopt, which Octolux does not read"
    );
    assert_eq!(
        refused("ACME_shapes"),
        "requires the glTF extension ACME_shapes, which Octolux does not read"
    );
    // An uncompressed copy beside the compressed mesh is read.
    let draco = r#","extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0}}}"#;
    assert_eq!(
        with(r#""extensionsUsed":["KHR_draco_mesh_compression"],"#, draco)
            .unwrap()
            .triangles
            .len(),
        1
    );
}

#[test]
fn each_primitive_has_its_own_normals_and_coordinates() {
    let json = |first: &str, second: &str| {
        format!(
            r#""nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{first}}}}},{{"attributes":{{"POSITION":0{second}}}}},
            {{"mode":1,"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{POSITIONS},{{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"}},
            {{"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"}}]"#
        )
    };
    let runs = [floats(&CORNERS), floats(&[1.0; 9]), floats(&[0.5; 6])];
    let has = r#","NORMAL":1,"TEXCOORD_0":2"#;
    let lists = |first: &str, second: &str| {
        let raw = read(gltf(&runs, &json(first, second)), ALL, &no_file).unwrap();
        assert_eq!(raw.notes, ["1 primitive of points or lines is left out"]);
        let normals = raw
            .normals
            .map(|all| all.iter().map(|&n| n != NO_NORMAL).collect::<Vec<_>>());
        (
            normals,
            raw.uvs.map(|all| all.iter().map(|&uv| uv != NO_UV).collect::<Vec<_>>()),
        )
    };
    let (left, right) = (
        vec![true, true, true, false, false, false],
        vec![false, false, false, true, true, true],
    );
    assert_eq!(lists(has, ""), (Some(left.clone()), Some(left)));
    assert_eq!(lists("", has), (Some(right.clone()), Some(right)));
    assert_eq!(lists("", ""), (None, None));
}
