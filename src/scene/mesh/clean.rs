//! Validation of mesh files: indices and numbers. And the area test of triangles.

use glam::{DVec2, DVec3};

use super::{NO_NORMAL, NO_UV, Problem, RawMesh};

/// Whether single precision, in which packets compute, can hold `v`.
pub fn in_range(v: DVec3) -> bool {
    // NaN fails the comparison too.
    v.to_array().iter().all(|x| x.abs() <= f64::from(f32::MAX))
}

/// Checks a file's numbers and indices. Unused vertices may be anything; they are replaced by a used point. Normals that are
/// not finite are removed, with a note.
pub fn check(raw: &mut RawMesh) -> Result<(), Problem> {
    let mend = "save the mesh again; vertices and triangles are counted from 0";
    let count = raw.vertices.len();
    for (index, triangle) in raw.triangles.iter().enumerate() {
        if let Some(corner) = triangle.iter().find(|&&corner| corner as usize >= count) {
            let what = format!("has a corner that does not exist: triangle {index} names vertex {corner} of {count}");
            return Err(Problem::new(what, mend));
        }
    }
    let Some(&[some, ..]) = raw.triangles.first() else {
        return Ok(());
    };
    if !raw.vertices.iter().all(|&v| in_range(v)) {
        let mut used = vec![false; count];
        raw.triangles
            .iter()
            .flatten()
            .for_each(|&corner| used[corner as usize] = true);
        let vertices = raw.vertices.iter().zip(&used).enumerate();
        if let Some((index, (&v, _))) = vertices.clone().find(|(_, (v, used))| **used && !in_range(**v)) {
            let what = format!("has a vertex that is not finite: vertex {index} is {}", triple(v));
            return Err(Problem::new(what, mend));
        }
        let some = raw.vertices[some as usize];
        raw.vertices
            .iter_mut()
            .filter(|v| !in_range(**v))
            .for_each(|v| *v = some);
    }
    if let Some(normals) = &mut raw.normals {
        let none = normals.iter_mut().filter(|n| !in_range(**n));
        let none = none.map(|n| *n = NO_NORMAL).count();
        if none > 0 {
            let note =
                format!("{none} of {count} normals are not finite: the triangles around them give them new ones");
            raw.notes.push(note);
        }
    }
    if let Some(uvs) = &mut raw.uvs {
        let finite = |uv: &DVec2| uv.to_array().iter().all(|x| x.abs() <= f64::from(f32::MAX)) || *uv == NO_UV;
        if let Some(index) = uvs.iter().position(|uv| !finite(uv)) {
            return Err(Problem::new(
                format!("has a texture coordinate that is not finite: number {index}"),
                mend,
            ));
        }
    }
    Ok(())
}

fn triple(v: DVec3) -> String {
    format!("[{}, {}, {}]", v.x, v.y, v.z)
}

/// Whether a triangle has an area in `f64`: its corners are not collinear.
///
/// Collinear ones are invisible, have no normal, and Embree's hits on them can be far outside (RenderKit/embree issue 387).
pub fn has_area([a, b, c]: [DVec3; 3]) -> bool {
    let (ab, bc, ca) = (b - a, c - b, a - c);
    let longest = ab.length_squared().max(bc.length_squared()).max(ca.length_squared());
    // The cross product of the two shorter edges has the least cancellation.
    let twice_area = if longest == bc.length_squared() {
        ab.cross(ca)
    } else if longest == ca.length_squared() {
        ab.cross(bc)
    } else {
        bc.cross(ca)
    };
    0.5 * twice_area.length() > f64::EPSILON * longest
}
