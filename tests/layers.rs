//! The table of layers holds: who may import whom, where `unsafe` may be, who names `wide`, how long a file may be.
//!
//! The source is read as tokens, comments and strings left out: enough to find every path that starts at the crate's
//! root, and nothing to keep in step with the compiler. Paths that a macro would put together are not seen.

use std::fs;
use std::path::{Path, PathBuf};

/// What a module may import of the crate.
enum Uses {
    /// Every module of a lower layer.
    Below,
    /// These paths and what is under them.
    Only(&'static [&'static str]),
}
use Uses::{Below, Only};

/// Module, layer, what it may use: the line of `src/lib.rs` that starts with "Layers", in its order.
const TABLE: [(&str, u32, Uses); 20] = [
    ("cpu", 0, Below),
    ("about", 0, Below),
    ("machine", 0, Below),
    ("settings", 0, Below),
    ("texels", 0, Below),
    ("lane", 1, Below),
    ("math", 2, Below),
    ("sampling", 3, Below),
    // Rays are vectors of lanes; who answers them knows nothing of what is shaded. A light says where its rays go.
    ("shape", 3, Only(&["lane", "math"])),
    ("bsdf", 4, Below),
    ("light", 4, Below),
    ("embree", 6, Only(&["lane", "math", "shape"])),
    ("linear", 6, Only(&["lane", "math", "shape"])),
    // Scene data is for the oracle too: nothing of the fast path may leak into it.
    ("scene", 7, Only(&["settings", "texels"])),
    // Functions of points, directions and numbers: no scene, no accelerator.
    (
        "estimator",
        8,
        Only(&["bsdf", "light", "shape", "sampling", "math", "lane"]),
    ),
    ("film", 9, Below),
    ("pipeline", 10, Below),
    ("run", 11, Below),
    // It judges everything else, so it shares only what is asked for and the form of the answer.
    ("reference", 12, Only(&["scene", "film::Picture"])),
    ("study", 13, Below),
];

/// Where `unsafe` may be: foreign functions, vector instructions, and the two of `cpuid`.
const UNSAFE: [&str; 3] = ["embree/", "lane/", "cpu.rs"];

/// The one file that names the crate `wide`.
const AVX2: &str = "lane/wide8.rs";

/// Where the lanes of AVX-512 are named: all other code gets them as parameters of what runs behind a question to the processor.
const SIXTEEN: [&str; 2] = ["lane/", "embree/packet.rs"];

/// Lines of a file; past them there is usually a second thing inside.
const LINES: usize = 400;

/// Files that may be longer, each with its reason.
const LONGER: [(&str, &str); 0] = [];

/// Identifiers, `::` and single marks; no comments, strings, characters or lifetimes.
fn tokens(source: &str) -> Vec<&str> {
    let bytes = source.as_bytes();
    let word = |b: u8| b.is_ascii_alphanumeric() || b == b'_' || b >= 128;
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &source[at..];
        at += if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            rest.find("*/").map_or(rest.len(), |end| end + 2)
        } else if let Some(length) = literal(rest) {
            length
        } else if word(bytes[at]) {
            let length = rest.bytes().position(|b| !word(b)).unwrap_or(rest.len());
            found.push(&rest[..length]);
            length
        } else {
            let length = if rest.starts_with("::") { 2 } else { 1 };
            if !bytes[at].is_ascii_whitespace() {
                found.push(&rest[..length]);
            }
            length
        };
    }
    found
}

/// The length of a string, a character or a lifetime at the start of `rest`, if one is there.
fn literal(rest: &str) -> Option<usize> {
    let body = rest.trim_start_matches(['b', 'c']);
    let prefix = rest.len() - body.len();
    if let Some(raw) = body.strip_prefix('r') {
        let hashes = raw.bytes().take_while(|&b| b == b'#').count();
        if raw[hashes..].starts_with('"') {
            let close = format!("\"{}", "#".repeat(hashes));
            let end = raw[hashes + 1..].find(&close)?;
            return Some(prefix + 1 + hashes + 1 + end + close.len());
        }
        return None;
    }
    if body.starts_with('\'') {
        let mut chars = body.char_indices().skip(1);
        let (_, first) = chars.next()?;
        if first == '\\' {
            // At least one character is escaped: `'\''` ends at the second quote.
            return Some(prefix + 3 + body[3..].find('\'')? + 1);
        }
        return Some(match chars.next() {
            Some((end, '\'')) => prefix + end + 1,
            _ => prefix + 1,
        });
    }
    let text = body.strip_prefix('"')?;
    let mut escaped = false;
    let end = text.bytes().position(|b| {
        let ends = b == b'"' && !escaped;
        escaped = b == b'\\' && !escaped;
        ends
    });
    Some(prefix + 1 + end.unwrap_or(text.len()) + 1)
}

/// Every path from the crate's root, as up to two names, in a file `depth` modules below the root.
fn root_paths(tokens: &[&str], depth: usize) -> Vec<String> {
    let mut paths = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let mut next = at;
        let mut rooted = tokens[at] == "crate" && tokens.get(at + 1) == Some(&"::");
        if rooted {
            next = at + 2;
        } else if tokens[at] == "super" {
            let mut up = 0;
            while tokens.get(next) == Some(&"super") && tokens.get(next + 1) == Some(&"::") {
                up += 1;
                next += 2;
            }
            // Inside `mod tests { … }` as many lead less far; then a module's name does not follow.
            rooted = up >= depth;
        }
        if rooted {
            tree(tokens, next, "", &mut paths);
        }
        at = next.max(at + 1);
    }
    paths
}

/// Reads the path or the `{…}` at `at`, adds what it names under `prefix`, and returns where it ends.
fn tree(tokens: &[&str], mut at: usize, prefix: &str, paths: &mut Vec<String>) -> usize {
    if tokens.get(at) == Some(&"{") {
        at += 1;
        while at < tokens.len() && tokens[at] != "}" {
            at = tree(tokens, at, prefix, paths);
            while at < tokens.len() && tokens[at] != "," && tokens[at] != "}" {
                at += 1; // `as name`
            }
            at += usize::from(tokens.get(at) == Some(&","));
        }
        return at + 1;
    }
    let Some(name) = tokens.get(at) else { return at };
    let path = if prefix.is_empty() {
        (*name).to_owned()
    } else {
        format!("{prefix}::{name}")
    };
    if tokens.get(at + 1) == Some(&"::") {
        return tree(tokens, at + 2, &path, paths);
    }
    paths.push(path);
    at + 1
}

/// What is wrong with one file; `name` is its path under `src`, with `/`.
fn faults(name: &str, source: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let tokens = tokens(source);
    let module = name.split('/').next().unwrap_or(name).trim_end_matches(".rs");
    // `mutant.rs` is for the crate's own tests: its macro stands in every layer and is the plain code outside of them. `cli` belongs to
    // the program, which is another crate: nothing of the library can name it.
    if !["lib", "main", "mutant", "cli"].contains(&module) {
        let depth = name.trim_end_matches("/mod.rs").split('/').count();
        for path in root_paths(&tokens, depth) {
            if !allowed(module, &path) {
                faults.push(format!("{name}: `{module}` may not use `{path}`"));
            }
        }
    }
    if tokens.contains(&"unsafe") && !UNSAFE.iter().any(|place| name.starts_with(place)) {
        faults.push(format!("{name}: `unsafe` belongs into {UNSAFE:?}"));
    }
    if tokens.windows(2).any(|pair| pair == ["wide", "::"]) && name != AVX2 {
        faults.push(format!("{name}: only {AVX2} names the crate `wide`"));
    }
    if tokens.contains(&"F32x16") && !SIXTEEN.iter().any(|place| name.starts_with(place)) {
        faults.push(format!("{name}: only {SIXTEEN:?} name `F32x16`"));
    }
    let lines = source.lines().count();
    if lines > LINES && !LONGER.iter().any(|(file, _)| *file == name) {
        faults.push(format!("{name}: {lines} lines, more than {LINES}"));
    }
    faults
}

fn allowed(module: &str, path: &str) -> bool {
    let layer = |name| TABLE.iter().find(|(module, ..)| *module == name);
    let Some((_, own, uses)) = layer(module) else {
        return false; // a module that the table does not know
    };
    let first = path.split("::").next().unwrap_or(path);
    match (first == module, uses, layer(first)) {
        // A macro at the root, or after `super` a name of the module around `mod tests`.
        (true, ..) | (_, _, None) => true,
        (_, Below, Some((_, other, _))) => other < own,
        (_, Only(paths), _) => paths.iter().any(|p| {
            path.strip_prefix(p)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
        }),
    }
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            found.push(path);
        }
    }
}

fn src() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

#[test]
fn every_file_keeps_to_its_layer() {
    let mut files = Vec::new();
    sources(&src(), &mut files);
    assert!(files.len() > 50, "the sources are not where they were");
    let mut all = Vec::new();
    for path in files {
        let name = path.strip_prefix(src()).unwrap().to_string_lossy().replace('\\', "/");
        all.extend(faults(&name, &fs::read_to_string(&path).unwrap()));
    }
    assert!(all.is_empty(), "\n{}\n", all.join("\n"));
}

#[test]
fn the_table_is_that_of_the_documentation() {
    let lib = fs::read_to_string(src().join("lib.rs")).unwrap();
    let doc: String = lib.lines().filter_map(|line| line.strip_prefix("//! ")).collect();
    let listed: Vec<&str> = doc[doc.find("Layers").unwrap()..]
        .split("[`")
        .skip(1)
        .map(|rest| rest[..rest.find('`').unwrap()].trim_start_matches("mod@"))
        .collect();
    let mut table: Vec<&str> = TABLE.iter().map(|(module, ..)| *module).collect();
    assert_eq!(listed, table, "the order of src/lib.rs and of this table");
    let declared: Vec<&str> = lib
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'))
        .collect();
    table.sort_unstable();
    assert_eq!(
        declared, table,
        "the modules that src/lib.rs declares and those of this table"
    );
    assert!(TABLE.is_sorted_by_key(|(_, layer, _)| *layer));
}

#[test]
fn planted_faults_are_found() {
    for (name, source) in [
        ("math/vec3.rs", "use crate::sampling::warp;"),
        ("light/sphere.rs", "use crate::{lane::Lane, bsdf::{Lobe, Bsdf}};"),
        (
            "light/sphere.rs",
            "fn f() { let x = crate::bsdf::diffuse::sample(0.5); }",
        ),
        ("light/sphere.rs", "use super::super::bsdf::Lobe;"),
        ("light/mod.rs", "use super::bsdf;"),
        ("embree/packet.rs", "use crate::sampling::Pair;"),
        ("estimator/per_light.rs", "use crate::scene::Scene;"),
        ("scene/load.rs", "use crate::math::Vec3;"),
        ("film/mod.rs", "use crate::pipeline::Counters;"),
        ("reference/mod.rs", "use crate::film::{Picture, Tile};"),
        ("reference/mod.rs", "use crate::math::Vec3;"),
        ("unheard/of.rs", "use crate::lane::Lane;"),
        ("pipeline/stream.rs", "fn f() { unsafe { g() } }"),
        ("math/frame.rs", "use wide::f32x8;"),
        ("pipeline/kernels.rs", "use crate::lane::{F32x8, F32x16};"),
        ("math/frame.rs", "let x = ::wide::f32x8::ZERO;"),
        ("math/frame.rs", &"\n".repeat(LINES + 1)),
    ] {
        assert!(!faults(name, source).is_empty(), "{name}: {source:?} must be found");
    }
}

#[test]
fn what_only_looks_like_a_fault_passes() {
    for (name, source) in [
        (
            "math/vec3.rs",
            "// use crate::scene::Scene; unsafe\n/* unsafe */ use crate::lane::{Lane as L, Mask};",
        ),
        (
            "math/vec3.rs",
            r##"const A: &str = "\" unsafe"; const B: &str = r#"" unsafe"#; const C: char = '\'';"##,
        ),
        (
            "math/vec3.rs",
            "fn f<'a>(x: &'a str) -> char { 'u' } mod tests { use super::super::Frame; }",
        ),
        (
            "sampling/sampler.rs",
            "let safe = short.pair(3); safe.0; #![deny(unsafe_op_in_unsafe_fn)]",
        ),
        (
            "reference/mod.rs",
            "use crate::film::Picture; use crate::scene::{FilmSize, Scene};",
        ),
        ("lane/wide8.rs", "use wide::f32x8; unsafe {}"),
        ("math/frame.rs", "let wide = 3; wide.max(4)"),
        ("pipeline/plan.rs", "use crate::film::Tile; use super::stage::Chunk;"),
    ] {
        assert_eq!(faults(name, source), Vec::<String>::new(), "{source:?}");
    }
}
