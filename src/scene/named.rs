//! Lists the files that a scene names, without reading them. A command that renders several scenes must know in advance that no
//! picture overwrites an input of a later scene.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use toml::Value;

use super::Scene;

/// Keys whose values are file names, in any table of a scene.
const KEYS: [&str; 2] = ["file", "texture"];

impl Scene {
    /// The scene file at `path` and the files that it names, with the buffers of its glTF files. Nothing is checked: unreadable
    /// files are skipped, and loading the scene reports them. [`Scene::files`] has the same list for a loaded scene.
    pub fn named_files(path: &Path) -> Vec<PathBuf> {
        // What comes through a pipe can be read only once, and is left to the loader.
        let text = match path.is_file() {
            true => std::fs::read_to_string(path).unwrap_or_default(),
            false => String::new(),
        };
        let mut names = Vec::new();
        if let Ok(table) = text.parse() {
            collect(&Value::Table(table), &mut names);
        }
        let beside = |file: &Path, name: String| file.parent().unwrap_or(Path::new("")).join(name);
        let mut files = vec![path.to_owned()];
        files.extend(names.into_iter().map(|name| beside(path, name)));
        let buffers = files.iter().flat_map(|file| {
            let uris = buffers(file).into_iter();
            uris.map(|uri| beside(file, uri))
        });
        let buffers: Vec<PathBuf> = buffers.collect();
        files.extend(buffers);
        files
    }
}

fn collect(value: &Value, names: &mut Vec<String>) {
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| match value {
            Value::String(name) if KEYS.contains(&key.as_str()) => names.push(name.clone()),
            other => collect(other, names),
        }),
        Value::Array(list) => list.iter().for_each(|value| collect(value, names)),
        _ => {}
    }
}

/// File names of the buffers of a glTF file.
fn buffers(path: &Path) -> Vec<String> {
    let root: serde_json::Value = serde_json::from_slice(&json(path)).unwrap_or_default();
    let list = root["buffers"].as_array().cloned().unwrap_or_default();
    let uris = list.iter().filter_map(|buffer| buffer["uri"].as_str());
    uris.filter(|uri| !uri.starts_with("data:"))
        .filter_map(|uri| super::mesh::buffer_name(uri).ok())
        .collect()
}

/// The JSON of a glTF file of either kind, compressed or not; empty for other files.
fn json(path: &Path) -> Vec<u8> {
    let name = path.to_string_lossy().to_lowercase();
    let plain = name.strip_suffix(".gz").unwrap_or(&name);
    if !plain.ends_with(".gltf") && !plain.ends_with(".glb") {
        return Vec::new();
    }
    let mut bytes = std::fs::read(path).unwrap_or_default();
    if name.ends_with(".gz") {
        let packed = std::mem::take(&mut bytes);
        let _ = flate2::read::MultiGzDecoder::new(&packed[..]).read_to_end(&mut bytes);
    }
    if plain.ends_with(".gltf") {
        return bytes;
    }
    // Twelve bytes about the file, then a chunk of JSON: its length, its type, its bytes.
    let length = bytes
        .get(12..16)
        .and_then(|four| four.try_into().ok())
        .map_or(0, u32::from_le_bytes);
    bytes
        .get(20..)
        .map_or(Vec::new(), |rest| rest[..rest.len().min(length as usize)].to_vec())
}
