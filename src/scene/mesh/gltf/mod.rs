//! glTF 2.0: the JSON is read and validated by the `gltf` crate.

mod document;
mod numbers;
mod shape;
#[cfg(test)]
mod tests;

use glam::{DMat4, DQuat, DVec3};
use gltf::accessor::Dimensions;
use gltf::mesh::Mode;
use gltf::{Document, Node, Semantic};

use super::super::memory;
use super::{NO_NORMAL, NO_UV, Problem, RawMesh, Wanted, transform};
pub(in crate::scene) use document::name;
use numbers::Numbers;

const DAMAGED: &str = "the file is damaged or cut short: export it again";

const INSTANCING: &str = "EXT_mesh_gpu_instancing";

/// Reads all triangles of the file's default scene, transformed by its nodes, with `NORMAL` and `TEXCOORD_0` if wanted. `file`
/// reads external buffers, whose names are relative to the file.
pub fn read(
    bytes: Vec<u8>,
    wanted: Wanted,
    file: &dyn Fn(&str) -> Result<Vec<u8>, Problem>,
) -> Result<RawMesh, Problem> {
    let (document, blob) = document::document(&bytes)?;
    let used = |name: &str| document.extensions_used().any(|used| used == name);
    let numbers = Numbers {
        quantized: used("KHR_mesh_quantization"),
        buffers: document::buffers(&document, blob, file)?,
    };
    let mut whole = Collected {
        wanted,
        document: &document,
        numbers,
        mesh: RawMesh::default(),
        checked: 0,
        without_surface: 0,
    };
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let scene = scene.ok_or_else(|| Problem::new("has no scene", "export a scene with a mesh in it"))?;
    let mut waiting: Vec<(Node<'_>, DMat4)> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut visited = vec![false; document.nodes().len()];
    while let Some((node, parent)) = waiting.pop() {
        // The nodes of a scene form trees: a second visit means a cycle.
        if std::mem::replace(&mut visited[node.index()], true) {
            return Err(Problem::new(
                format!("has node {} in two places", node.index()),
                "export the scene again",
            ));
        }
        let visibility = node
            .extension_value("KHR_node_visibility")
            .and_then(|all| all.get("visible"));
        if visibility.and_then(gltf::json::Value::as_bool) == Some(false) {
            continue;
        }
        let placement = parent * local(&node);
        whole.node(&node, placement)?;
        waiting.extend(node.children().map(|child| (child, placement)));
    }
    Ok(whole.finish())
}

/// The local transform of a node.
fn local(node: &Node<'_>) -> DMat4 {
    DMat4::from_cols_array_2d(&node.transform().matrix().map(|col| col.map(f64::from)))
}

/// The mesh so far, and its source.
struct Collected<'d> {
    wanted: Wanted,
    document: &'d Document,
    numbers: Numbers<'d>,
    mesh: RawMesh,
    /// Number of vertices and triangles at the last memory check.
    checked: usize,
    /// Number of primitives of points and lines.
    without_surface: usize,
}

impl Collected<'_> {
    /// Adds the mesh of a node, once per instance.
    fn node(&mut self, node: &Node<'_>, placement: DMat4) -> Result<(), Problem> {
        let Some(mesh) = node.mesh() else { return Ok(()) };
        let mut places = vec![placement];
        if node.extension_value(INSTANCING).is_some() {
            places = self.instances(node)?;
            places.iter_mut().for_each(|place| *place = placement * *place);
        }
        let pose = node
            .skin()
            .map(|skin| shape::pose(self.document, &self.numbers, &skin))
            .transpose()?;
        let weights = node.weights().or(mesh.weights()).unwrap_or_default();
        for primitive in mesh.primitives() {
            let surface = matches!(
                primitive.mode(),
                Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
            );
            if !surface || primitive.get(&Semantic::Positions).is_none() {
                self.without_surface += 1;
                continue;
            }
            let mut part = shape::part(&self.numbers, &primitive, self.wanted, weights)?;
            super::clean::check(&mut part)?;
            // A skin places its vertices by its joints; the transform of its node is ignored.
            if let Some(pose) = &pose
                && shape::apply(&self.numbers, &primitive, pose, &mut part)?
            {
                self.add(part)?;
                continue;
            }
            for &place in &places[1..] {
                let mut copy = RawMesh {
                    vertices: part.vertices.clone(),
                    triangles: part.triangles.clone(),
                    normals: part.normals.clone(),
                    uvs: part.uvs.clone(),
                    notes: Vec::new(),
                };
                transform::apply(&mut copy, place);
                self.add(copy)?;
            }
            transform::apply(&mut part, places[0]);
            self.add(part)?;
        }
        Ok(())
    }

    /// Transforms of the instances of a node's mesh, relative to the node (`EXT_mesh_gpu_instancing`).
    fn instances(&self, node: &Node<'_>) -> Result<Vec<DMat4>, Problem> {
        let attributes = node
            .extension_value(INSTANCING)
            .and_then(|value| value.get("attributes"));
        let list = |name: &str, dimensions| match attributes.and_then(|all| all.get(name)) {
            None => Ok(None),
            Some(index) => {
                let accessor = numbers::accessor(self.document, index)?;
                self.numbers.items(&accessor, dimensions, true).map(Some)
            }
        };
        let translations = list("TRANSLATION", Dimensions::Vec3)?;
        let rotations = list("ROTATION", Dimensions::Vec4)?;
        let scales = list("SCALE", Dimensions::Vec3)?;
        let counts: Vec<_> = [&translations, &rotations, &scales]
            .into_iter()
            .flatten()
            .map(Vec::len)
            .collect();
        let &[count, ..] = &counts[..] else {
            return Ok(vec![DMat4::IDENTITY]);
        };
        if counts.iter().any(|&other| other != count) {
            return Err(Problem::new("has instances with different numbers of places", DAMAGED));
        }
        let place = |i: usize| {
            let three = |list: &Option<Vec<[f64; 16]>>, else_: DVec3| {
                list.as_ref().map_or(else_, |all| DVec3::from_slice(&all[i]))
            };
            let turn = rotations
                .as_ref()
                .map_or(DQuat::IDENTITY, |all| DQuat::from_slice(&all[i]));
            let turn = if turn.length_squared() > 0.0 {
                turn.normalize()
            } else {
                DQuat::IDENTITY
            };
            DMat4::from_scale_rotation_translation(three(&scales, DVec3::ONE), turn, three(&translations, DVec3::ZERO))
        };
        Ok((0..count).map(place).collect())
    }

    /// Adds a mesh that is already transformed.
    fn add(&mut self, mut part: RawMesh) -> Result<(), Problem> {
        let mesh = &mut self.mesh;
        let (before, count) = (mesh.vertices.len(), part.vertices.len());
        let first = u32::try_from(before)
            .ok()
            .filter(|first| first.checked_add(count as u32).is_some());
        let first =
            first.ok_or_else(|| Problem::new("has more vertices than 32 bits can count", "use a smaller mesh"))?;
        mesh.triangles
            .extend(part.triangles.iter().map(|t| t.map(|corner| corner + first)));
        mesh.vertices.append(&mut part.vertices);
        unite(&mut mesh.normals, part.normals, before, count, NO_NORMAL);
        unite(&mut mesh.uvs, part.uvs, before, count, NO_UV);
        mesh.notes.append(&mut part.notes);
        // A small file may instance a large mesh many times.
        let size = mesh.vertices.len() + mesh.triangles.len();
        if size - self.checked > 1 << 20 {
            self.checked = size;
            if !memory::fits(64 << 20) {
                return Err(Problem::new(
                    "has more triangles than fit into the memory that is free",
                    "use a smaller mesh",
                ));
            }
        }
        Ok(())
    }

    fn finish(mut self) -> RawMesh {
        if self.without_surface > 0 {
            let (noun, verb) = if self.without_surface == 1 {
                ("primitive", "is")
            } else {
                ("primitives", "are")
            };
            let note = format!("{} {noun} of points or lines {verb} left out", self.without_surface);
            self.mesh.notes.push(note);
        }
        if self.wanted.uvs && self.mesh.uvs.is_some() {
            return self.mesh;
        }
        self.mesh.uvs = None;
        self.mesh
    }
}

/// Appends an attribute of `count` more vertices to that of the `before` first ones; fills up with `none` if one of the two
/// lacks it.
fn unite<T: Copy>(all: &mut Option<Vec<T>>, more: Option<Vec<T>>, before: usize, count: usize, none: T) {
    match (all.as_mut(), more) {
        (None, None) => {}
        (Some(all), more) => match more {
            Some(more) => all.extend(more),
            None => all.resize(before + count, none),
        },
        (None, Some(more)) => {
            let mut list = vec![none; before];
            list.extend(more);
            *all = Some(list);
        }
    }
}

fn unsupported(what: &str) -> Problem {
    Problem::new(
        format!("has {what}"),
        "export the scene again as plain glTF 2.0, without compression",
    )
}
