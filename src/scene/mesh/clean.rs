//! What no mesh may have: indices out of range, numbers that are none, triangles without area.

use glam::DVec3;

use super::{Problem, RawMesh};

/// `true` if single precision can hold `v`: the packets compute in it.
pub fn in_range(v: DVec3) -> bool {
    // NaN fails the comparison too.
    v.to_array().iter().all(|x| x.abs() <= f64::from(f32::MAX))
}

/// Whether a file's numbers and indices are possible at all.
pub fn check(raw: &RawMesh) -> Result<(), Problem> {
    let mend = "save the mesh again; vertices and triangles are counted from 0";
    let none = |vectors: &[DVec3]| vectors.iter().position(|&v| !in_range(v));
    if let Some(index) = none(&raw.vertices) {
        let what = format!(
            "has a vertex that is not finite: vertex {index} is {}",
            triple(raw.vertices[index])
        );
        return Err(Problem::new(what, mend));
    }
    if let Some((index, n)) = raw
        .normals
        .as_deref()
        .and_then(|n| none(n).map(|index| (index, n[index])))
    {
        let what = format!("has a normal that is not finite: normal {index} is {}", triple(n));
        return Err(Problem::new(what, mend));
    }
    let finite = |uv: &glam::DVec2| uv.to_array().iter().all(|x| x.abs() <= f64::from(f32::MAX));
    if let Some(index) = raw.uvs.as_deref().and_then(|uvs| uvs.iter().position(|uv| !finite(uv))) {
        return Err(Problem::new(
            format!("has a texture coordinate that is not finite: number {index}"),
            mend,
        ));
    }
    let count = raw.vertices.len();
    for (index, triangle) in raw.triangles.iter().enumerate() {
        if let Some(corner) = triangle.iter().find(|&&corner| corner as usize >= count) {
            let what = format!("has a corner that does not exist: triangle {index} names vertex {corner} of {count}");
            return Err(Problem::new(what, mend));
        }
    }
    Ok(())
}

fn triple(v: DVec3) -> String {
    format!("[{}, {}, {}]", v.x, v.y, v.z)
}

/// Drops triangles whose corners lie on one line, as far as `f64` can tell.
///
/// They cannot be seen, have no normal, and Embree's hits on them can be far outside (RenderKit/embree issue 387).
pub fn drop_flat(raw: &mut RawMesh) {
    let RawMesh {
        vertices, triangles, ..
    } = raw;
    triangles.retain(|&corners| {
        let [a, b, c] = corners.map(|corner| vertices[corner as usize]);
        let (ab, bc, ca) = (b - a, c - b, a - c);
        let longest = ab.length_squared().max(bc.length_squared()).max(ca.length_squared());
        // The differences of the two shorter edges cancel least: their cross product is the most exact of the three.
        let twice_area = if longest == bc.length_squared() {
            ab.cross(ca)
        } else if longest == ca.length_squared() {
            ab.cross(bc)
        } else {
            bc.cross(ca)
        };
        0.5 * twice_area.length() > f64::EPSILON * longest
    });
}
