//! Tests of coincident shapes.

use super::*;
use crate::scene::{Camera, FilmSize, Fov, Material, MaterialId, Scene};

fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]], surface: Surface) -> Mesh {
    Mesh {
        name: String::new(),
        vertices: vertices.iter().copied().map(DVec3::from_array).collect(),
        triangles: triangles.to_vec(),
        normals: None,
        smooth_terminator: false,
        uvs: None,
        surface,
    }
}

const FLOOR: [[f64; 3]; 4] = [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]];
const CAMERA: DVec3 = DVec3::new(0.3, 2.0, 4.0);

fn floor(triangles: &[[u32; 3]], material: usize) -> Mesh {
    mesh(&FLOOR, triangles, Surface::Material(MaterialId::new(material)))
}

/// A box of side 1 around `(x, y, 0)`.
fn body(x: f64, y: f64) -> Mesh {
    let corner = |i: u32| [x + f64::from(i & 1), y + f64::from(i >> 1 & 1), f64::from(i >> 2 & 1)];
    let vertices: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles: Vec<[u32; 3]> = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    mesh(&vertices, &triangles, Surface::Material(MaterialId::new(0)))
}

fn pairs(meshes: &[Mesh]) -> Vec<[usize; 2]> {
    overlaps(meshes, CAMERA).0
}

#[test]
fn what_lies_exactly_on_an_earlier_face_is_left_out() {
    let keep = |mesh: &mut Mesh, kept: &dyn Fn(usize) -> bool| {
        let mut numbers = 0..;
        mesh.triangles.retain(|_| numbers.next().is_some_and(kept));
    };
    let (up, down) = ([[0, 1, 2], [0, 2, 3]], [[2, 1, 0], [0, 3, 2]]);
    let glow = || mesh(&FLOOR, &[[2, 1, 0], [0, 3, 2]], Surface::Emission(DVec3::ONE));
    // Meshes, whether only fronts reflect, and the number of faces left of the second.
    for (mut meshes, one_sided, left) in [
        (vec![floor(&up, 0), floor(&[[1, 2, 0], [3, 0, 2]], 1)], false, 0),
        (vec![floor(&up, 0), floor(&[[0, 1, 2], [0, 1, 3]], 1)], false, 1),
        (vec![floor(&up, 0), floor(&down, 1)], true, 2),
        (vec![floor(&up, 0), glow()], false, 0),
        (vec![glow(), floor(&up, 0)], false, 0),
    ] {
        let said = drop_twins(&mut meshes, |_| one_sided, keep);
        assert_eq!((meshes[0].triangles.len(), meshes[1].triangles.len()), (2, left));
        assert_eq!(said.is_some(), left < 2);
    }
    // Both sides of a surface in one mesh: needed where only fronts reflect.
    for (one_sided, left) in [(true, 4), (false, 2)] {
        let mut meshes = vec![floor(&[up, down].concat(), 0)];
        drop_twins(&mut meshes, |_| one_sided, keep);
        assert_eq!(meshes[0].triangles.len(), left);
    }
}

#[test]
fn meshes_that_cover_each_other_in_a_plane_are_found_and_others_are_not() {
    let up = [[0, 1, 2], [0, 2, 3]];
    let rug = |y: f64, triangles: &[[u32; 3]]| {
        mesh(
            &[[-1.0, y, 1.0], [1.0, y, 1.0], [0.0, y, -1.0]],
            triangles,
            Surface::Material(MaterialId::new(1)),
        )
    };
    let beside = mesh(
        &[[9.0, 0.0, 9.0], [20.0, 0.0, 9.0], [9.0, 0.0, -9.0]],
        &[[0, 1, 2]],
        Surface::Material(MaterialId::new(1)),
    );
    assert_eq!(pairs(&[floor(&up, 0), rug(0.0, &[[0, 1, 2]])]), [[0, 1]]);
    assert_eq!(
        pairs(&[floor(&up, 0), rug(1e-9, &[[0, 1, 2]])]),
        [[0, 1]],
        "as far as packets tell"
    );
    assert_eq!(
        pairs(&[floor(&up, 0), rug(0.0, &[[0, 2, 1]])]),
        [[0, 1]],
        "an open sheet, wound the other way"
    );
    assert!(pairs(&[floor(&up, 0), rug(1e-3, &[[0, 1, 2]])]).is_empty());
    assert!(pairs(&[floor(&up, 0), beside]).is_empty(), "they share an edge");
    assert!(
        pairs(&[floor(&up, 0), body(0.0, 0.0)]).is_empty(),
        "a box that stands on the floor hides its bottom"
    );
    assert!(
        pairs(&[body(0.0, 0.0), body(1.0, 0.0)]).is_empty(),
        "boxes side by side hide what touches"
    );
    assert_eq!(
        pairs(&[body(0.0, 0.0), body(0.5, 0.0)]),
        [[0, 1]],
        "boxes in each other have tops in one plane"
    );
}

#[test]
fn of_spheres_with_one_centre_the_one_behind_goes() {
    let sphere = |radius: f64| Sphere {
        center: DVec3::ZERO,
        radius,
        surface: Surface::Material(MaterialId::new(0)),
    };
    for (camera, kept) in [(DVec3::X * 5.0, 1.0 + 1e-9), (DVec3::X * 0.5, 1.0)] {
        for order in [[1.0, 1.0 + 1e-9], [1.0 + 1e-9, 1.0]] {
            let mut spheres = order.map(sphere).to_vec();
            let notes = drop_close(&mut spheres, camera);
            assert_eq!((spheres.len(), spheres[0].radius, notes.len()), (1, kept, 1));
        }
    }
    let mut apart = vec![sphere(1.0), sphere(1.001)];
    assert!(drop_close(&mut apart, DVec3::X * 5.0).is_empty() && apart.len() == 2);
}

/// A builder removes hidden faces, and reports overlapping meshes by their indices in the final scene.
#[test]
fn a_scene_names_what_coincides_by_its_own_places() {
    let camera = Camera::new(CAMERA, [0.0; 3], Fov::X(40.0));
    let mut scene = Scene::builder(camera, FilmSize { width: 8, height: 6 });
    let grey = scene.material(Material::diffuse("grey", [0.5; 3]));
    let floor = Mesh::quadrilateral(FLOOR, grey);
    let rug = Mesh::quadrilateral(FLOOR.map(|corner| corner.map(|x| 0.5 * x)), grey);
    scene.mesh(floor.clone());
    scene.mesh(floor);
    scene.mesh(rug);
    scene.sphere(Sphere::new([0.0, 5.0, 0.0], 0.5, Surface::emission([1.0; 3])));
    let scene = scene.build().unwrap();
    assert_eq!(scene.meshes().len(), 2, "the second floor is hidden");
    assert_eq!(scene.overlapping_meshes(), [[0, 1]]);
    let [hidden, named] = scene.notes() else {
        panic!("{:?}", scene.notes());
    };
    assert!(hidden.contains("2 triangles lie exactly on earlier ones"), "{hidden}");
    assert!(named.contains("faces of mesh 1 and mesh 3 lie in one plane"), "{named}");
}
