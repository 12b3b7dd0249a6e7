//! Chooses the reader of a mesh file by its name.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use super::super::error::Fault;
use super::super::files::Files;
use super::super::memory;
use super::lines::unreadable;
use super::{Problem, RawMesh, Wanted, clean, gltf, obj, off, ply, stl};

const ENDINGS: [&str; 6] = ["obj", "ply", "stl", "off", "gltf", "glb"];

/// Maximum compression factor of deflate (zlib's technical notes).
const DENSEST: u64 = 1032;

/// Reads the mesh file `name`. Normals and texture coordinates are read only if wanted, because they split vertices.
pub fn read(files: &Files, name: &str, wanted: Wanted) -> Result<RawMesh, Fault> {
    let ending = |path: &Path| path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let path = Path::new(name);
    let packed = ending(path) == "gz";
    let format = ending(if packed {
        Path::new(path.file_stem().unwrap_or_default())
    } else {
        path
    });
    if !ENDINGS.contains(&format.as_str()) {
        let what = format!("mesh file \"{name}\" has an ending that Octolux does not read");
        return Err(Fault::new(
            what,
            "save the mesh as .obj, .ply, .stl, .off, .gltf or .glb; each may be packed as .gz",
        ));
    }
    let named = |problem: Problem| Fault::new(format!("mesh file \"{name}\" {}", problem.what), problem.help);
    let beside = |buffer: &str| files.bytes("buffer", &beside(name, buffer));
    let raw = if format.starts_with("gl") {
        let bytes = files.bytes("mesh file", name)?;
        let bytes = if packed {
            unpacked(&bytes).map_err(named)?
        } else {
            bytes
        };
        gltf::read(bytes, wanted, &beside)
    } else {
        files.stream("mesh file", name, |source, length| {
            if !packed {
                return text(&format, BufReader::with_capacity(1 << 16, source), length, wanted);
            }
            let source = Unpacked {
                source: MultiGzDecoder::new(BufReader::with_capacity(1 << 16, source)),
                bytes: 0,
            };
            let mut source = BufReader::with_capacity(1 << 16, source);
            let raw = text(&format, &mut source, length.saturating_mul(DENSEST), wanted)?;
            // The checksum follows the last byte.
            io::copy(&mut source, &mut io::sink()).map_err(unreadable)?;
            Ok(raw)
        })?
    };
    let raw = raw.and_then(|mut raw| clean::check(&mut raw).map(|()| raw));
    raw.map_err(named)
}

fn text<R: BufRead>(format: &str, source: R, length: u64, wanted: Wanted) -> Result<RawMesh, Problem> {
    match format {
        "obj" => obj::read(source, wanted),
        "ply" => ply::read(source, length, wanted),
        "stl" => stl::read(source),
        _ => off::read(source, wanted),
    }
}

fn unpacked(bytes: &[u8]) -> Result<Vec<u8>, Problem> {
    let mut source = Unpacked {
        source: MultiGzDecoder::new(bytes),
        bytes: 0,
    };
    let mut all = Vec::new();
    source.read_to_end(&mut all).map_err(unreadable)?;
    Ok(all)
}

/// Counts uncompressed bytes, and stops if they cannot fit into memory: a few bytes may expand to any size.
struct Unpacked<R> {
    source: R,
    bytes: u64,
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.source.read(buffer)?;
        let (before, step) = (self.bytes, 64 << 20);
        self.bytes += count as u64;
        // Parsed numbers take about as much memory as the file: that much must be free.
        if before / step != self.bytes / step && !memory::fits(self.bytes) {
            return Err(io::ErrorKind::OutOfMemory.into());
        }
        Ok(count)
    }
}

/// The file `other` in the folder of the file `name`.
fn beside(name: &str, other: &str) -> String {
    Path::new(name).with_file_name(other).to_string_lossy().into_owned()
}
