//! Parses the bytes of a glTF file into a validated document.

use std::borrow::Cow;

use gltf::buffer::{Data, Source};
use gltf::json::validation::{Error, Validate};
use gltf::json::{Path, Root};
use gltf::{Document, Glb};
use serde_json::{Map, Value};

use super::super::Problem;
use super::DAMAGED;

/// Required extensions that are supported.
const READ: [&str; 3] = [
    "KHR_mesh_quantization",
    "EXT_mesh_gpu_instancing",
    "KHR_node_visibility",
];

/// Parts of extension names that do not concern shapes.
const NOT_OF_SHAPES: [&str; 8] = [
    "_material",
    "_texture",
    "_light",
    "_image",
    "_animation",
    "_xmp",
    "_packing",
    "_audio",
];

/// Mesh compression extensions, by the end of their names.
const COMPRESSION: [(&str, &str); 2] = [
    ("_draco_mesh_compression", "Draco"),
    ("_meshopt_compression", "meshopt"),
];

/// A document with its embedded buffer.
type WithBuffer<'a> = (Document, Option<Cow<'a, [u8]>>);

/// Parses the document and its embedded buffer.
pub fn document(bytes: &[u8]) -> Result<WithBuffer<'_>, Problem> {
    let (json, blob) = if bytes.starts_with(b"glTF") {
        check_length(bytes)?;
        let glb = Glb::from_slice(bytes).map_err(problem)?;
        (glb.json, glb.bin)
    } else {
        let json = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
        (Cow::Borrowed(json), None)
    };
    let not_gltf = |error: &dyn std::fmt::Display| Problem::new(format!("is not glTF: {error}"), DAMAGED);
    let mut value: Value = gltf::json::deserialize::from_slice(&json).map_err(|error| not_gltf(&error))?;
    shapes_alone(&mut value);
    compressed(&value)?;
    let root: Root = gltf::json::deserialize::from_value(value).map_err(|error| not_gltf(&error))?;
    for name in &root.extensions_required {
        if !READ.contains(&name.as_str()) && !NOT_OF_SHAPES.iter().any(|part| name.contains(part)) {
            return Err(Problem::new(
                format!("requires the glTF extension {name}, which Octolux does not read"),
                "export the scene again without this extension",
            ));
        }
    }
    Ok((validated(root)?, blob))
}

/// Removes what meshes do not need, so that pictures and materials unknown to the crate are not rejected.
fn shapes_alone(root: &mut Value) {
    let Some(root) = root.as_object_mut() else { return };
    for key in ["materials", "textures", "images", "samplers", "cameras", "animations"] {
        root.remove(key);
    }
    let objects = |value: Option<&mut Value>, visit: &mut dyn FnMut(&mut Map<String, Value>)| {
        for object in value.and_then(Value::as_array_mut).into_iter().flatten() {
            object.as_object_mut().map(&mut *visit);
        }
    };
    objects(root.get_mut("nodes"), &mut |node| _ = node.remove("camera"));
    objects(root.get_mut("meshes"), &mut |mesh| {
        objects(mesh.get_mut("primitives"), &mut |primitive| {
            _ = primitive.remove("material")
        });
    });
}

/// Rejects compressed meshes by the name of the extension.
fn compressed(root: &Value) -> Result<(), Problem> {
    let refused = |name: &str| {
        Problem::new(
            format!("is compressed with {name}, which Octolux does not read"),
            format!("export the scene again without {name} compression"),
        )
    };
    let extension = |value: &Value, end: &str| {
        let extensions = value.get("extensions").and_then(Value::as_object);
        extensions.is_some_and(|all| all.keys().any(|key| key.ends_with(end)))
    };
    for (end, name) in COMPRESSION {
        if list(root, "extensionsRequired")
            .iter()
            .filter_map(Value::as_str)
            .any(|key| key.ends_with(end))
        {
            return Err(refused(name));
        }
    }
    // A file may contain an uncompressed copy; if not, it requires the extension.
    let [(draco, draco_name), (meshopt, meshopt_name)] = COMPRESSION;
    if list(root, "buffers")
        .iter()
        .any(|buffer| extension(buffer, meshopt) && buffer.get("uri").is_none())
    {
        return Err(refused(meshopt_name));
    }
    let accessors = list(root, "accessors");
    let bare = |index: &Value| {
        let accessor = index
            .as_u64()
            .and_then(|index| accessors.get(usize::try_from(index).ok()?));
        accessor.is_some_and(|accessor| accessor.get("bufferView").is_none())
    };
    for mesh in list(root, "meshes") {
        for primitive in list(mesh, "primitives")
            .iter()
            .filter(|primitive| extension(primitive, draco))
        {
            if primitive
                .get("attributes")
                .and_then(|all| all.get("POSITION"))
                .is_some_and(bare)
            {
                return Err(refused(draco_name));
            }
        }
    }
    Ok(())
}

fn list<'v>(value: &'v Value, key: &str) -> &'v [Value] {
    value.get(key).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// Checks the length in the header of a `.glb`: at least the header (the crate subtracts it), and not beyond the data.
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

/// Validates the rules of glTF that a mesh needs; the first one here is a precondition of the crate's own validation.
fn validated(root: Root) -> Result<Document, Problem> {
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
    let mut first = None;
    root.validate(&root, Path::new, &mut |path, error| {
        let path = path();
        let ends = |ends: &[&str]| ends.iter().any(|end| path.as_str().ends_with(end));
        let harmless = match error {
            // Extensions were checked above; an accessor without a buffer holds zeros; bounds are not needed.
            Error::Unsupported => path.as_str().starts_with("extensionsRequired"),
            Error::Missing => ends(&[".bufferView", ".min", ".max"]),
            Error::Invalid => ends(&[".min", ".max"]),
            _ => false,
        };
        if !harmless && first.is_none() {
            first = Some(format!("breaks the rules of glTF: {path}: {error}"));
        }
    });
    match first {
        Some(what) => Err(Problem::new(what, "export the scene again")),
        None => Ok(Document::from_json_without_validation(root)),
    }
}

/// The bytes of all buffers; `file` reads external ones, whose names are relative to the file.
pub fn buffers<'b>(
    document: &Document,
    mut blob: Option<Cow<'b, [u8]>>,
    file: &dyn Fn(&str) -> Result<Vec<u8>, Problem>,
) -> Result<Vec<Cow<'b, [u8]>>, Problem> {
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let missing = || Problem::new(format!("has no bytes for buffer {}", buffer.index()), DAMAGED);
        let data = match buffer.source() {
            Source::Bin => blob.take().ok_or_else(missing)?,
            Source::Uri(uri) if !uri.starts_with("data:") => {
                let bytes = file(&name(uri)?);
                Cow::Owned(bytes.map_err(|fault| {
                    Problem::new(format!("has a buffer that cannot be read: {}", fault.what), fault.help)
                })?)
            }
            source @ Source::Uri(_) => Cow::Owned(Data::from_source(source, None).map_err(problem)?.0),
        };
        if data.len() < buffer.length() {
            return Err(Problem::new(
                format!("is cut short: buffer {} ends too early", buffer.index()),
                DAMAGED,
            ));
        }
        buffers.push(data);
    }
    Ok(buffers)
}

/// The file name of a URI without a scheme, with percent-encoding decoded.
pub(in crate::scene) fn name(uri: &str) -> Result<String, Problem> {
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
        gltf::Error::Binary(_) => Problem::new("is cut short or not a binary glTF file", DAMAGED),
        gltf::Error::Io(error) => Problem::new(format!("has a buffer that cannot be read: {error}"), DAMAGED),
        other => Problem::new(format!("cannot be read: {other}"), DAMAGED),
    }
}
