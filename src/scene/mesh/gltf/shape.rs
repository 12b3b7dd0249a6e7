//! The triangles of one primitive: attributes, default morph targets, and skin.

use glam::{DMat3, DMat4, DVec3};
use gltf::accessor::Dimensions;
use gltf::mesh::Mode;
use gltf::{Document, Node, Primitive, Semantic, Skin};

use super::super::{Problem, RawMesh, Wanted, strip, transform};
use super::numbers::Numbers;
use super::{DAMAGED, local};

/// The untransformed primitive, morphed by `weights`. It has positions.
pub fn part(
    numbers: &Numbers<'_>,
    primitive: &Primitive<'_>,
    wanted: Wanted,
    weights: &[f32],
) -> Result<RawMesh, Problem> {
    let list = |semantic: Semantic| {
        primitive
            .get(&semantic)
            .map(|accessor| numbers.vectors(&accessor))
            .transpose()
    };
    let mut vertices = list(Semantic::Positions)?.unwrap_or_default();
    let count = vertices.len();
    let mut normals = if wanted.normals { list(Semantic::Normals)? } else { None };
    normals = normals.filter(|normals| normals.len() == count);
    for (target, &weight) in primitive.morph_targets().zip(weights) {
        if weight == 0.0 {
            continue;
        }
        let add = |all: &mut Vec<DVec3>, accessor| -> Result<(), Problem> {
            let moves = numbers.vectors(&accessor)?;
            if moves.len() != count {
                return Err(Problem::new(
                    "has a morph target of another length than its mesh",
                    DAMAGED,
                ));
            }
            all.iter_mut()
                .zip(moves)
                .for_each(|(v, by)| *v += f64::from(weight) * by);
            Ok(())
        };
        if let Some(positions) = target.positions() {
            add(&mut vertices, positions)?;
        }
        if let (Some(normals), Some(moves)) = (&mut normals, target.normals()) {
            add(normals, moves)?;
        }
    }
    let uvs = primitive.get(&Semantic::TexCoords(0)).filter(|_| wanted.uvs);
    let uvs = uvs.map(|uvs| numbers.coordinates(&uvs)).transpose()?;
    let corners = match primitive.indices() {
        Some(indices) => numbers.indices(&indices)?,
        None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect(),
    };
    Ok(RawMesh {
        vertices,
        triangles: triangles(primitive.mode(), &corners),
        normals,
        uvs: uvs.filter(|uvs| uvs.len() == count),
        notes: Vec::new(),
    })
}

/// Triangles with three corners each, with the winding that the mode implies.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleFan => {
            let pairs = corners.get(1..).unwrap_or_default().windows(2);
            pairs.map(|pair| [corners[0], pair[0], pair[1]]).collect()
        }
        Mode::TriangleStrip => strip(corners).collect(),
        _ => corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

/// The joint matrices of a skin in the rest pose.
pub fn pose(document: &Document, numbers: &Numbers<'_>, skin: &Skin<'_>) -> Result<Vec<DMat4>, Problem> {
    let mut parents = vec![None; document.nodes().len()];
    for node in document.nodes() {
        node.children()
            .for_each(|child| parents[child.index()] = Some(node.index()));
    }
    let nodes: Vec<Node<'_>> = document.nodes().collect();
    let inverse = skin.inverse_bind_matrices();
    let inverse = inverse
        .map(|accessor| numbers.items(&accessor, Dimensions::Mat4, false))
        .transpose()?;
    let joints = skin.joints().enumerate().map(|(number, joint)| {
        let mut placement = local(&joint);
        let (mut at, mut steps) = (joint.index(), 0);
        while let Some(parent) = parents[at] {
            (at, steps) = (parent, steps + 1);
            if steps > nodes.len() {
                let what = format!("has node {at} in two places");
                return Err(Problem::new(what, "export the scene again"));
            }
            placement = local(&nodes[at]) * placement;
        }
        match &inverse {
            None => Ok(placement),
            Some(all) => {
                let matrix = all
                    .get(number)
                    .ok_or_else(|| Problem::new("has a skin with fewer matrices than joints", DAMAGED))?;
                Ok(placement * DMat4::from_cols_array(matrix))
            }
        }
    });
    joints.collect()
}

/// Applies the joint matrices of a skin to vertices (glTF 2.0, 3.7.3.3); `false` if the primitive has no joints.
pub fn apply(
    numbers: &Numbers<'_>,
    primitive: &Primitive<'_>,
    pose: &[DMat4],
    part: &mut RawMesh,
) -> Result<bool, Problem> {
    let broken = |what: &str| Problem::new(format!("has a skin {what}"), DAMAGED);
    let count = part.vertices.len();
    let mut moves = vec![DMat4::ZERO; count];
    let mut sums = vec![0.0; count];
    let mut sets = 0;
    while let (Some(joints), Some(weights)) = (
        primitive.get(&Semantic::Joints(sets)),
        primitive.get(&Semantic::Weights(sets)),
    ) {
        let joints = numbers.items(&joints, Dimensions::Vec4, false)?;
        let weights = numbers.items(&weights, Dimensions::Vec4, true)?;
        if joints.len() != count || weights.len() != count {
            return Err(broken("of another length than its mesh"));
        }
        for (vertex, (joints, weights)) in joints.iter().zip(&weights).enumerate() {
            for (&joint, &weight) in joints[..4].iter().zip(&weights[..4]) {
                if weight != 0.0 {
                    let matrix = pose
                        .get(joint as usize)
                        .ok_or_else(|| broken("without a joint that it names"))?;
                    moves[vertex] += *matrix * weight;
                    sums[vertex] += weight;
                }
            }
        }
        sets += 1;
    }
    if sets == 0 {
        return Ok(false);
    }
    for (matrix, &sum) in moves.iter_mut().zip(&sums) {
        // Weights should sum to 1. A vertex without weights follows the first joint, as in other programs.
        *matrix = if sum > 0.0 {
            *matrix * (1.0 / sum)
        } else {
            pose.first().copied().unwrap_or(DMat4::IDENTITY)
        };
    }
    part.vertices
        .iter_mut()
        .zip(&moves)
        .for_each(|(v, matrix)| *v = matrix.transform_point3(*v));
    let linear = |vertex: usize| DMat3::from_mat4(moves[vertex]);
    for (vertex, normal) in part.normals.iter_mut().flatten().enumerate() {
        *normal = (transform::of_normals(linear(vertex)) * *normal).normalize_or_zero();
    }
    let turned = part
        .triangles
        .iter_mut()
        .filter(|corners| transform::mirrors(linear(corners[0] as usize)));
    turned.for_each(|corners| corners.swap(1, 2));
    Ok(true)
}
