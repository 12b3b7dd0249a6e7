//! OBJ files in variants that programs write.

use super::*;

const CUBE: &str = "# a cube\no cube\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    g ends\nf 4 3 2 1\nf -4 -3 -2 -1\ng sides\nusemtl any\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

const ALL: Wanted = Wanted {
    uvs: true,
    normals: true,
};

fn plain(text: &str) -> RawMesh {
    read(text.as_bytes(), Wanted::default()).unwrap()
}

fn all(text: &str) -> RawMesh {
    read(text.as_bytes(), ALL).unwrap()
}

#[test]
fn quads_negative_indices_and_groups() {
    let raw = plain(CUBE);
    assert_eq!(raw.vertices.len(), 8, "groups share their vertices");
    assert_eq!(raw.triangles.len(), 12);
    assert!(raw.normals.is_none());
    // The second quad is split along its first and third corner.
    let points = |i: usize| raw.triangles[i].map(|corner| raw.vertices[corner as usize].to_array());
    assert_eq!(points(2), [[0., 0., 1.], [1., 0., 1.], [1., 1., 1.]]);
    assert_eq!(points(3), [[0., 0., 1.], [1., 1., 1.], [0., 1., 1.]]);
}

#[test]
fn a_pair_of_position_and_normal_is_a_vertex() {
    let raw = all("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvn 0 0 1\nvn 1 0 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n");
    assert_eq!(raw.vertices.len(), 6);
    assert_eq!(raw.normals.unwrap()[3], DVec3::X);
}

#[test]
fn a_corner_has_texture_coordinates_of_its_own() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 0 0.5\nf 1/1 2/2 3/3\nf 2/1 4/2 3/3\n";
    let raw = all(text);
    let uvs = raw.uvs.unwrap();
    assert_eq!(
        (raw.vertices.len(), uvs.len()),
        (5, 5),
        "vertex 2 has two pairs, vertex 3 one"
    );
    assert_eq!(uvs[2], DVec2::new(0.0, 0.5));
    assert!(raw.normals.is_none());
    assert!(plain(text).uvs.is_none());
}

#[test]
fn what_some_faces_lack_they_get_from_nobody() {
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0.5 0.5\nvn 1 0 0\n";
    for faces in ["f 1/1/1 2/1/1 3/1/1\nf 1 3 4\n", "f 1 3 4\nf 1/1/1 2/1/1 3/1/1\n"] {
        let raw = all(&format!("{points}{faces}"));
        let (normals, uvs) = (raw.normals.unwrap(), raw.uvs.unwrap());
        assert_eq!(raw.vertices.len(), 6);
        for triangle in raw.triangles {
            let bare = triangle.iter().any(|&corner| raw.vertices[corner as usize] == DVec3::Y);
            for corner in triangle.map(|corner| corner as usize) {
                assert_eq!(normals[corner], if bare { NO_NORMAL } else { DVec3::X });
                assert_eq!(uvs[corner], if bare { NO_UV } else { DVec2::splat(0.5) });
            }
        }
    }
}

#[test]
fn smoothing_groups_part_vertices_where_normals_are_wanted() {
    // A roof of four faces along x: two in group 1, one in group 2, one in no group.
    let text = "v 0 0 0\nv 0 0 1\nv 1 1 0\nv 1 1 1\nv 2 0 0\nv 2 0 1\nv 3 1 0\nv 3 1 1\nv 4 0 0\nv 4 0 1\n\
        s 1\nf 1 2 4 3\nf 3 4 6 5\ns 2\nf 5 6 8 7\ns off\nf 7 8 10 9\n";
    assert_eq!(plain(text).vertices.len(), 10);
    let raw = all(text);
    let mut used: Vec<_> = raw.triangles.iter().flatten().collect();
    used.sort_unstable();
    used.dedup();
    // Eight points of the groups, two of them duplicated; both triangles of the last face have separate corners.
    assert_eq!(used.len(), 8 + 2 + 6);
    let users = |point: [f64; 3]| {
        let near = |corner: &&u32| raw.vertices[**corner as usize] == DVec3::from_array(point);
        let mut corners: Vec<_> = raw.triangles.iter().flatten().filter(near).collect();
        corners.sort_unstable();
        corners.dedup();
        corners.len()
    };
    assert_eq!(users([1., 1., 0.]), 1, "inside of group 1");
    assert_eq!(users([2., 0., 0.]), 2, "between groups 1 and 2");
    assert_eq!(users([4., 0., 1.]), 2, "a flat face");
    // Without any group, and with `s off` alone, faces share their vertices as usual.
    assert_eq!(all(&text.replace("s 1", "").replace("s 2", "s 0")).vertices.len(), 10);
}

#[test]
fn spellings_that_other_programs_write() {
    let square = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]].map(DVec3::from_array);
    for text in [
        "v 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 0.5 0.5 0.5 1\nv 0 1 0 255 0 0\nf 1 2 3 4\n",
        "v 0 0 0\nv 2 0 \\\n0 2\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 4\n",
        "\u{feff}v 0 0 0\rv 1 0 0\rv 1 1 0\rv 0 1 0\rf 1 2 3 4",
        "f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n",
        "v 0 0 0 # first\nv 1 0 0\nv 1 1 0\nv 0 1 0\nfo 1/ 2/ 3// 4 # all\nl 1 2\np 1\n",
        "v 0 0 0\nv +1.0E0 .0 0.\nv 1 1 0\nv 0 1 0\nvt 0.5\nf 1/1 2/1 3/1 4/1\nf 1 2\n",
    ] {
        let raw = plain(text);
        assert_eq!(raw.vertices, square, "{text}");
        assert_eq!(raw.triangles, [[0, 1, 2], [0, 2, 3]], "{text}");
    }
}

#[test]
fn what_is_left_out_is_noted() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\n";
    let note = |more: &str| plain(&format!("{square}{more}")).notes;
    assert_eq!(note("f 1 2\nf 3\n"), ["2 faces of fewer than 3 corners are left out"]);
    assert_eq!(note("surf 0 1 0 1 1 2 3 4\n").len(), 1);
    assert!(
        note("f 1 3 2 4\n")[0]
            .starts_with("1 face crosses itself or has more than 65536 corners (the first is line 6)")
    );
    let zeros = all(&format!("{square}vn 0 0 1\nf 1//1 2//0 3/0/1\n"));
    assert_eq!(zeros.notes.len(), 1);
    assert!(
        zeros.notes[0].starts_with("2 normals or texture coordinates with the number 0"),
        "{:?}",
        zeros.notes
    );
    assert!(note("").is_empty());
}

#[test]
fn errors_name_the_line() {
    let error = |text: &str| read(text.as_bytes(), ALL).unwrap_err().what;
    assert_eq!(
        error("v 0 0 0\nv 1 zero 0\n"),
        "has a vertex that cannot be read in line 2"
    );
    assert_eq!(
        error("v 0 0 0\n\n# f\nf 1 2 x\n"),
        "has a face that cannot be read in line 4"
    );
    assert_eq!(error("nothing here\n"), "has no faces");
    let points = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    assert_eq!(
        error(&format!("{points}f 1 2 12297829382473034413\n")),
        "has a face that cannot be read in line 4"
    );
    assert_eq!(
        error(&format!("{points}f 1 2 -4\n")),
        "has a face that names vertex -4 of 3 in line 4"
    );
    assert_eq!(
        error(&format!("{points}f 1 2 \\\n9\nf 1 2 8\n")),
        "has a face that names vertex 9 of 3 in line 4"
    );
    let normals = read(format!("{points}vn 0 0 1\nf 1/1 2/1 3/1\n").as_bytes(), ALL).unwrap_err();
    assert_eq!(
        normals.what,
        "has a face that names texture coordinate 1 of 0 in line 5"
    );
    assert!(normals.help.contains("1//1"));
    assert_eq!(
        error(&format!("{points}f 0 1 2\n")),
        "has a face that names vertex 0 in line 4"
    );
    // Each kind of element has a separate count, however they are interleaved.
    let square = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\n";
    for face in [
        "1/1 2/-2 3/1",
        "1//1 2//-2 3//1",
        "1/1 2/1\u{b}-4/1",
        "1/1/1/1 2 3",
        "1 2 --1",
        "1/2 2/1 3/1",
        "1//2 2//1 3//1",
    ] {
        assert!(error(&format!("{square}f {face}\n")).ends_with("in line 6"), "{face}");
    }
    assert_eq!(all(&format!("{square}f -3/-1/-1 2/1/1 -1/-1/-1\n")).triangles.len(), 1);
}
