//! Meshes written in the scene file.

use glam::DVec2;

use super::super::error::Fault;
use super::super::rule::FINITE;
use super::super::value::Value;
use super::RawMesh;
use super::polygons::Polygons;

/// The mesh that the lists `vertices` and `faces` describe.
pub fn inline(vertices: &Value<'_>, faces: &Value<'_>, uvs: Option<Value<'_>>) -> Result<RawMesh, Fault> {
    let points = vertices.list("write a list of points, such as [[0, 0, 0], [1, 0, 0], [0, 1, 0]]")?;
    // Polygon triangulation needs finite numbers.
    let points = points
        .map(|point| point.ruled_triple(&FINITE))
        .collect::<Result<Vec<_>, _>>()?;

    let (mut triangles, mut polygons) = (Vec::new(), Polygons::default());
    for (number, face) in faces.list("write a list of faces, such as [[0, 1, 2]]")?.enumerate() {
        let corners = corners(&face, points.len())?;
        let made = polygons.triangles(corners.iter().map(|&corner| points[corner as usize]), number);
        triangles.extend(made.map(|triangle| triangle.map(|corner| corners[corner as usize])));
    }
    let uvs = match uvs {
        Some(value) => Some(coordinates(&value)?),
        None => None,
    };
    Ok(RawMesh {
        vertices: points,
        triangles,
        normals: None,
        uvs,
        notes: polygons.note("face").into_iter().collect(),
    })
}

fn coordinates(uvs: &Value<'_>) -> Result<Vec<DVec2>, Fault> {
    let help = "write a pair for each vertex, such as [[0, 0], [1, 0], [1, 1]]";
    let pairs = uvs.list(help)?;
    pairs
        .map(|pair| pair.ruled_numbers(&FINITE).map(DVec2::from_array))
        .collect()
}

fn corners(face: &Value<'_>, count: usize) -> Result<Vec<u32>, Fault> {
    let help = "write 3 or 4 indices of vertices, counted from 0, such as [0, 1, 2]";
    let indices = face.list(help)?;
    if !(3..=4).contains(&indices.len()) {
        return Err(face.fault("must have 3 or 4 indices", help));
    }
    let last = u32::try_from(count).unwrap_or(u32::MAX).saturating_sub(1);
    let one = |index: Value<'_>| {
        index.index().filter(|&i| i <= last && count > 0).ok_or_else(|| {
            let help = format!("there are {count} vertices: indices go from 0 to {last}");
            let help = if count == 0 {
                "this mesh has no vertices: list them first".to_owned()
            } else {
                help
            };
            index.fault("must be the index of a vertex", help)
        })
    };
    indices.map(one).collect()
}
