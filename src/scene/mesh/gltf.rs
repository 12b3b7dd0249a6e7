//! glTF 2.0: the JSON is read and validated by the `gltf` crate.
//!
//! The numbers are read here: the crate's readers trust the counts and offsets of the file (1.4.1: `count - 1`
//! underflows, strides are only asserted), and a scene may come from anywhere.

use glam::{DMat4, DVec2, DVec3};
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::{Data, Source};
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Node, Primitive, Semantic};

use super::{Problem, RawMesh, fan, transform};

const DAMAGED: &str = "the file is damaged or cut short: export it again";

/// Reads all triangles of the file's default scene, moved to where its nodes put them, with `TEXCOORD_0` where that is wanted.
/// `file` reads buffers of their own, whose names are relative to the file.
pub fn read(bytes: &[u8], textured: bool, file: &dyn Fn(&str) -> Result<Vec<u8>, Problem>) -> Result<RawMesh, Problem> {
    if bytes.starts_with(b"glTF") {
        check_length(bytes)?;
    }
    let Gltf { document, mut blob } = Gltf::from_slice_without_validation(bytes).map_err(problem)?;
    let document = validated(document)?;
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let data = match buffer.source() {
            Source::Uri(uri) if !uri.starts_with("data:") => {
                let bytes = file(&name(uri)?);
                Data(bytes.map_err(|fault| {
                    Problem::new(format!("has a buffer that cannot be read: {}", fault.what), fault.help)
                })?)
            }
            source => Data::from_source_and_blob(source, None, &mut blob).map_err(problem)?,
        };
        if data.len() < buffer.length() {
            return Err(Problem::new(
                format!("is cut short: buffer {} ends too early", buffer.index()),
                DAMAGED,
            ));
        }
        buffers.push(data);
    }

    let scene = document.default_scene().or_else(|| document.scenes().next());
    let scene = scene.ok_or_else(|| Problem::new("has no scene", "export a scene with a mesh in it"))?;
    let mut whole = Collected {
        mesh: RawMesh {
            normals: Some(Vec::new()),
            uvs: textured.then(Vec::new),
            ..Default::default()
        },
        buffers,
    };
    let mut waiting: Vec<(Node<'_>, DMat4)> = scene.nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut visited = vec![false; document.nodes().len()];
    while let Some((node, parent)) = waiting.pop() {
        // The nodes of a scene are trees: who comes by a second time walks in a circle.
        if std::mem::replace(&mut visited[node.index()], true) {
            return Err(Problem::new(
                format!("has node {} in two places", node.index()),
                "export the scene again",
            ));
        }
        let placement = parent * DMat4::from_cols_array_2d(&node.transform().matrix().map(|col| col.map(f64::from)));
        for primitive in node.mesh().iter().flat_map(gltf::Mesh::primitives) {
            whole.add(&primitive, placement)?;
        }
        waiting.extend(node.children().map(|child| (child, placement)));
    }
    Ok(whole.mesh)
}

/// Whether the length in the header of a `.glb` is one that the crate can subtract its header from, and is all there.
fn check_length(bytes: &[u8]) -> Result<(), Problem> {
    let length = bytes
        .get(8..12)
        .and_then(|length| length.try_into().ok())
        .map(u32::from_le_bytes);
    match length {
        Some(length) if (20..=bytes.len() as u64).contains(&u64::from(length)) => Ok(()),
        _ => Err(Problem::new(
            "is cut short: its header promises more bytes than there are",
            DAMAGED,
        )),
    }
}

/// The rules of glTF; the one that comes first here is one that the crate's validation takes for granted.
fn validated(document: Document) -> Result<Document, Problem> {
    let root = document.into_json();
    let mut attributes = root
        .meshes
        .iter()
        .flat_map(|mesh| &mesh.primitives)
        .flat_map(|p| p.attributes.values());
    if attributes.any(|accessor| accessor.value() >= root.accessors.len()) {
        return Err(Problem::new(
            "breaks the rules of glTF: a mesh names an accessor that does not exist",
            DAMAGED,
        ));
    }
    Document::from_json(root).map_err(problem)
}

/// The name of a file: a URI without a scheme, whose percent signs stand for bytes.
fn name(uri: &str) -> Result<String, Problem> {
    let unreadable = || {
        Problem::new(
            "names a buffer in an unreadable way",
            "rename the .bin file and export again",
        )
    };
    let digits = |pair: &[u8]| {
        std::str::from_utf8(pair)
            .ok()
            .and_then(|pair| u8::from_str_radix(pair, 16).ok())
    };
    let mut decoded = Vec::new();
    let mut rest = uri.as_bytes();
    while let [first, after @ ..] = rest {
        let byte = (*first == b'%').then(|| after.get(..2).and_then(digits)).flatten();
        decoded.push(byte.unwrap_or(*first));
        rest = if byte.is_some() { &after[2..] } else { after };
    }
    String::from_utf8(decoded).map_err(|_| unreadable())
}

fn problem(error: gltf::Error) -> Problem {
    match error {
        gltf::Error::Validation(errors) => {
            let first = errors
                .first()
                .map(|(path, error)| format!(": {path}: {error}"))
                .unwrap_or_default();
            Problem::new(format!("breaks the rules of glTF{first}"), "export the scene again")
        }
        gltf::Error::Binary(_) => Problem::new("is cut short or not a binary glTF file", DAMAGED),
        gltf::Error::Deserialize(error) => Problem::new(format!("is not glTF: {error}"), DAMAGED),
        gltf::Error::Io(error) => Problem::new(format!("has a buffer that cannot be read: {error}"), DAMAGED),
        other => Problem::new(format!("cannot be read: {other}"), DAMAGED),
    }
}

/// The mesh so far, and the bytes that it comes from.
struct Collected {
    mesh: RawMesh,
    buffers: Vec<Data>,
}

impl Collected {
    /// Adds the triangles of a primitive. Points and lines have no surface: they are skipped.
    fn add(&mut self, primitive: &Primitive<'_>, placement: DMat4) -> Result<(), Problem> {
        if !matches!(
            primitive.mode(),
            Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
        ) {
            return Ok(());
        }
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            return Ok(());
        };
        let vertices = self.vectors(&positions)?;
        let normals = primitive
            .get(&Semantic::Normals)
            .map(|normals| self.vectors(&normals))
            .transpose()?;
        let normals = normals.filter(|normals| normals.len() == vertices.len());
        let uvs = primitive
            .get(&Semantic::TexCoords(0))
            .filter(|_| self.mesh.uvs.is_some());
        let uvs = uvs.map(|uvs| self.coordinates(&uvs)).transpose()?;
        let uvs = uvs.filter(|uvs| uvs.len() == vertices.len());
        let count = vertices.len();
        let corners = match primitive.indices() {
            Some(indices) => self.indices(&indices)?,
            None => (0..u32::try_from(count).unwrap_or(u32::MAX)).collect(),
        };

        let mut part = RawMesh {
            vertices,
            triangles: triangles(primitive.mode(), &corners),
            normals,
            uvs,
        };
        super::clean::check(&part)?;
        transform::apply(&mut part, placement);

        let mesh = &mut self.mesh;
        let first = u32::try_from(mesh.vertices.len())
            .ok()
            .filter(|first| first.checked_add(count as u32).is_some());
        let first =
            first.ok_or_else(|| Problem::new("has more vertices than 32 bits can count", "use a smaller mesh"))?;
        mesh.triangles
            .extend(part.triangles.iter().map(|t| t.map(|corner| corner + first)));
        mesh.vertices.append(&mut part.vertices);
        // Normals or texture coordinates of some vertices are of no use without those of the others.
        mesh.normals = mesh.normals.take().zip(part.normals).map(|(mut all, more)| {
            all.extend(more);
            all
        });
        mesh.uvs = mesh.uvs.take().zip(part.uvs).map(|(mut all, more)| {
            all.extend(more);
            all
        });
        Ok(())
    }

    fn vectors(&self, accessor: &Accessor<'_>) -> Result<Vec<DVec3>, Problem> {
        if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
            return Err(unsupported("positions or normals that are not three 32-bit numbers"));
        }
        let vector = |bytes: &[u8]| {
            let x = |i: usize| f64::from(f32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]));
            DVec3::new(x(0), x(4), x(8))
        };
        Ok(self.items(accessor, 12)?.map(vector).collect())
    }

    /// Texture coordinates: numbers, or parts of the largest whole number. In glTF `v` goes down.
    fn coordinates(&self, accessor: &Accessor<'_>) -> Result<Vec<DVec2>, Problem> {
        let number: fn(&[u8]) -> f64 = match (accessor.data_type(), accessor.dimensions()) {
            (DataType::F32, Dimensions::Vec2) => {
                |bytes| f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            }
            (DataType::U16, Dimensions::Vec2) => |bytes| f64::from(u16::from_le_bytes([bytes[0], bytes[1]])) / 65_535.0,
            (DataType::U8, Dimensions::Vec2) => |bytes| f64::from(bytes[0]) / 255.0,
            _ => {
                return Err(unsupported(
                    "texture coordinates that are not pairs of 32-bit numbers or of whole numbers of 8 or 16 bits",
                ));
            }
        };
        let size = accessor.data_type().size();
        let pair = |bytes: &[u8]| DVec2::new(number(bytes), 1.0 - number(&bytes[size..]));
        Ok(self.items(accessor, 2 * size)?.map(pair).collect())
    }

    fn indices(&self, accessor: &Accessor<'_>) -> Result<Vec<u32>, Problem> {
        let index: fn(&[u8]) -> u32 = match accessor.data_type() {
            DataType::U8 => |bytes| u32::from(bytes[0]),
            DataType::U16 => |bytes| u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            DataType::U32 => |bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
            _ => return Err(unsupported("indices that are not whole numbers")),
        };
        Ok(self.items(accessor, accessor.data_type().size())?.map(index).collect())
    }

    /// The `size` bytes of each item of an accessor.
    fn items(&self, accessor: &Accessor<'_>, size: usize) -> Result<impl Iterator<Item = &[u8]>, Problem> {
        let outside = || {
            Problem::new(
                format!("has accessor {} outside of its buffer", accessor.index()),
                DAMAGED,
            )
        };
        let view = accessor.view().filter(|_| accessor.sparse().is_none());
        let view = view.ok_or_else(|| unsupported("sparse numbers"))?;
        let stride = view.stride().unwrap_or(size);
        let count = accessor.count();
        let end = view.offset().checked_add(view.length());
        let data = end.and_then(|end| self.buffers.get(view.buffer().index())?.get(view.offset()..end));
        let data = data
            .and_then(|data| data.get(accessor.offset()..))
            .ok_or_else(outside)?;
        let needed = count
            .saturating_sub(1)
            .checked_mul(stride)
            .and_then(|last| last.checked_add(size));
        if stride < size || count == 0 || needed.is_none_or(|needed| needed > data.len()) {
            return Err(outside());
        }
        Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
    }
}

fn unsupported(what: &str) -> Problem {
    Problem::new(
        format!("has {what}"),
        "export the scene again as plain glTF 2.0, without compression",
    )
}

/// Three corners each, with the winding that the mode implies.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleFan => fan(corners).collect(),
        Mode::TriangleStrip => {
            let strip = corners.windows(3).enumerate();
            strip
                .map(|(i, t)| {
                    if i % 2 == 0 {
                        [t[0], t[1], t[2]]
                    } else {
                        [t[1], t[0], t[2]]
                    }
                })
                .collect()
        }
        _ => corners.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle with coordinates of one of the types that glTF has for them.
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
            let uvs = read(&file, true, &alone).unwrap().uvs.unwrap();
            let upwards = [DVec2::new(0.0, 0.8), DVec2::new(1.0, 0.4), DVec2::new(0.4, 0.0)];
            for (found, wanted) in uvs.iter().zip(upwards) {
                assert!((*found - wanted).length() < 1e-7, "{component}: {found} for {wanted}");
            }
            assert!(read(&file, false, &alone).unwrap().uvs.is_none());
        }
    }

    #[test]
    fn texture_coordinates_of_other_types_are_refused_where_they_are_wanted() {
        let file = triangle(5125, false, &[0; 24], 8);
        let alone = |_: &str| -> Result<Vec<u8>, Problem> { unreachable!("the buffer is in the file") };
        let error = read(&file, true, &alone).unwrap_err();
        assert!(
            error.what.contains("texture coordinates that are not pairs"),
            "{}",
            error.what
        );
        assert!(read(&file, false, &alone).is_ok());
    }
}
