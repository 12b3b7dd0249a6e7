//! The ratio of the largest to the smallest length of a scene, which single precision limits.

use crate::scene::SceneBuilder;
use crate::scene::invalid::{InvalidScene, Subject, Wrong};
use crate::scene::mesh::has_area;

/// Packets have lengths scaled so that the farthest shape is at 2^28. Where a shape is smaller than this share of the reach, products of
/// four of its lengths underflow, and lights lose their brightness without a sign: by a third at 2^-76, wholly at 2^-128 (camera inside a
/// sphere that emits, beside shapes of size 1).
const LEAST: f64 = 1.0 / (1_u128 << 72) as f64;

/// Checks that no shape is too small beside the farthest one.
pub(super) fn ratio(scene: &SceneBuilder) -> Result<(), InvalidScene> {
    let origin = scene.camera.origin;
    let spheres = scene.spheres.iter().enumerate().map(|(i, sphere)| {
        let reach = (sphere.center - origin).length() + sphere.radius;
        (Subject::Sphere(i), reach, 2.0 * sphere.radius)
    });
    let meshes = scene.meshes.iter().enumerate().map(|(i, mesh)| {
        let triangles = mesh
            .triangles
            .iter()
            .map(|t| t.map(|corner| mesh.vertices[corner as usize]));
        // Triangles without area are dropped later.
        let corners = triangles
            .filter(|&corners| has_area(corners))
            .flatten()
            .map(|v| v - origin);
        let (mut reach, mut low, mut high) = (0.0_f64, glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY);
        for corner in corners {
            (reach, low, high) = (reach.max(corner.length()), low.min(corner), high.max(corner));
        }
        (Subject::Mesh(i), reach, (high - low).max_element())
    });
    let shapes: Vec<_> = spheres.chain(meshes).filter(|(_, _, size)| *size > 0.0).collect();
    let farthest = shapes.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let smallest = shapes.iter().min_by(|a, b| a.2.total_cmp(&b.2));
    let (Some(&(subject, reach, _)), Some(&(least, _, size))) = (farthest, smallest) else {
        return Ok(());
    };
    if size >= LEAST * reach {
        return Ok(());
    }
    let problem = format!(
        "reaches {reach:.1e} from the camera, and {least} has the size {size:.1e}: single precision cannot hold both, whose ratio must \
         be at most {:.1e}",
        1.0 / LEAST
    );
    let name = match subject {
        Subject::Mesh(i) => &scene.meshes[i].name,
        _ => "",
    };
    Err(Wrong::new(problem, "bring in what is so far away, or leave out one of the two").on(subject, name))
}
