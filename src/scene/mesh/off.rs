//! OFF (Object File Format), as text, with or without normals, colours and texture coordinates at its vertices.

use std::io::BufRead;

use glam::{DVec2, DVec3};

use super::lines::{DAMAGED, Lines, number, words};
use super::polygons::Polygons;
use super::{Problem, RawMesh, Wanted};

/// Reads all faces. Lines may have comments after `#`; counts may follow the keyword, even without a space.
pub fn read<R: BufRead>(source: R, wanted: Wanted) -> Result<RawMesh, Problem> {
    let mut lines = Content(Lines::new(source)?);
    let first = lines.need("its header")?;
    let mut first = first.iter().map(Vec::as_slice);
    let word = first.next().unwrap_or_default();
    let Kind { normals, uvs, joined } = Kind::of(word)?;
    let rest: Vec<_> = joined.into_iter().chain(first.map(<[u8]>::to_vec)).collect();
    if rest.first().is_some_and(|word| word.eq_ignore_ascii_case(b"binary")) {
        return Err(Problem::new("is binary OFF", "save it as text, or as .ply"));
    }
    let counts = if rest.is_empty() {
        lines.need("its counts")?
    } else {
        rest
    };
    let count = |at: usize| counts.get(at).and_then(|word| number::<u64>(word));
    let (Some(vertices), Some(faces)) = (count(0), count(1)) else {
        return Err(lines.broken("counts"));
    };

    let mut raw = RawMesh {
        normals: (normals && wanted.normals).then(Vec::new),
        uvs: (uvs && wanted.uvs).then(Vec::new),
        ..Default::default()
    };
    for _ in 0..vertices {
        let line = lines.need(&format!("{vertices} vertices"))?;
        let all: Option<Vec<f64>> = line.iter().map(|word| number(word)).collect();
        let [start, end] = [3 + 3 * usize::from(normals), 2 * usize::from(uvs)];
        let all = all
            .filter(|all| all.len() >= start + end)
            .ok_or_else(|| lines.broken("a vertex"))?;
        raw.vertices.push(DVec3::from_slice(&all));
        raw.normals
            .iter_mut()
            .for_each(|list| list.push(DVec3::from_slice(&all[3..])));
        raw.uvs
            .iter_mut()
            .for_each(|list| list.push(DVec2::from_slice(&all[all.len() - 2..])));
    }
    let (mut polygons, mut short) = (Polygons::default(), 0);
    for _ in 0..faces {
        let line = lines.need(&format!("{faces} faces"))?;
        let corners = line
            .first()
            .and_then(|word| number::<usize>(word))
            .and_then(|count| line.get(1..count.checked_add(1)?));
        let corners: Option<Vec<u32>> = corners.and_then(|words| words.iter().map(|word| number(word)).collect());
        let corners = corners.ok_or_else(|| lines.broken("a face"))?;
        if let Some(missing) = corners.iter().find(|&&corner| corner as usize >= raw.vertices.len()) {
            let what = format!(
                "has a face that names vertex {missing} of {vertices} in line {}",
                lines.0.number()
            );
            return Err(Problem::new(what, "save the mesh again; an OFF file counts from 0"));
        }
        if corners.len() < 3 {
            short += 1;
            continue;
        }
        let points = corners.iter().map(|&corner| raw.vertices[corner as usize]);
        for triangle in polygons.triangles(points, lines.0.number()) {
            raw.triangles.push(triangle.map(|corner| corners[corner as usize]));
        }
    }
    if raw.triangles.is_empty() {
        return Err(Problem::new(
            "has no face with 3 corners or more",
            "save the mesh with its faces",
        ));
    }
    raw.notes.extend(super::short_faces(short));
    raw.notes.extend(polygons.note("line"));
    Ok(raw)
}

/// Vertex attributes declared by the keyword.
struct Kind {
    normals: bool,
    uvs: bool,
    /// A count joined to the keyword.
    joined: Option<Vec<u8>>,
}

impl Kind {
    fn of(word: &[u8]) -> Result<Self, Problem> {
        let text = String::from_utf8_lossy(word);
        let Some((prefix, rest)) = text.split_once("OFF") else {
            return Err(Problem::new(
                "is not an OFF file: it does not begin with the word `OFF`",
                "name a mesh that is saved as OFF",
            ));
        };
        if prefix.contains(['4', 'n']) {
            return Err(Problem::new(
                format!("is of the kind {text}: its vertices do not have three coordinates"),
                "save it with three coordinates",
            ));
        }
        // The format fixes the order of the letters, but any order is accepted.
        let (uvs, others) = prefix
            .strip_prefix("ST")
            .map_or((false, prefix), |others| (true, others));
        if !others.chars().all(|letter| "CN".contains(letter)) {
            return Err(Problem::new(
                format!("is of a kind of OFF that is not known: {text}"),
                "save it as plain OFF",
            ));
        }
        Ok(Self {
            normals: others.contains('N'),
            uvs,
            joined: (!rest.is_empty()).then(|| rest.as_bytes().to_vec()),
        })
    }
}

/// Lines that are not blank.
struct Content<R>(Lines<R>);

impl<R: BufRead> Content<R> {
    /// The words of the next line; `what` is what the file declared.
    fn need(&mut self, what: &str) -> Result<Vec<Vec<u8>>, Problem> {
        while let Some((_, line)) = self.0.next()? {
            let content = line.split(|&byte| byte == b'#').next().unwrap_or_default();
            let words: Vec<_> = words(content).map(<[u8]>::to_vec).collect();
            if !words.is_empty() {
                return Ok(words);
            }
        }
        Err(Problem::new(
            format!("is cut short: the file ends before {what} are there"),
            DAMAGED,
        ))
    }

    fn broken(&self, what: &str) -> Problem {
        Problem::new(
            format!("has {what} that cannot be read in line {}", self.0.number()),
            DAMAGED,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Wanted = Wanted {
        uvs: true,
        normals: true,
    };

    fn load(text: &str) -> RawMesh {
        read(text.as_bytes(), ALL).unwrap()
    }

    const SQUARE: [[f64; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    #[test]
    fn one_square_in_many_spellings() {
        let plain = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
        for text in [
            plain.to_owned(),
            plain.replace('\n', "\r\n"),
            plain.replace('\n', "\r"),
            format!("\u{feff}{plain}"),
            plain.replace("OFF\n", "OFF "),
            plain.replace("OFF\n", "OFF"),
            plain.replace("4 1 0", "4 1"),
            plain
                .replace("OFF\n", "# a comment\n\nOFF # and\n# another\n\n")
                .replace("1 1 0", "1 1 0 # here"),
            plain.replace("0 1 2 3", "0 1 2 3 255 0 0"),
            plain
                .replace("OFF", "COFF")
                .replace(" 0\n", " 0 0.5 0.5 0.5 1\n")
                .replace("4 1 0 0.5 0.5 0.5 1", "4 1 0"),
        ] {
            let raw = load(&text);
            assert_eq!(raw.vertices, SQUARE.map(DVec3::from_array), "{text}");
            assert_eq!(raw.triangles, [[0, 1, 2], [0, 2, 3]], "{text}");
            assert!(raw.notes.is_empty() && raw.normals.is_none() && raw.uvs.is_none());
        }
    }

    #[test]
    fn normals_and_texture_coordinates() {
        let raw = load(
            "STCNOFF\n3 1 0\n0 0 0 0 0 1 1 1 1 1 0 0.5\n1 0 0 1 0 0 1 1 1 1 1 0\n0 1 0 0 1 0 1 1 1 1 0 1\n3 0 1 2\n",
        );
        assert_eq!(raw.normals.unwrap(), [DVec3::Z, DVec3::X, DVec3::Y]);
        assert_eq!(raw.uvs.unwrap(), [DVec2::new(0.0, 0.5), DVec2::X, DVec2::Y]);
    }

    #[test]
    fn refusals_are_true() {
        let error = |text: &str| read(text.as_bytes(), ALL).unwrap_err().what;
        assert!(error("a letter\n").starts_with("is not an OFF file"));
        assert_eq!(error("OFF BINARY\n4 1 0\n"), "is binary OFF");
        assert!(error("4OFF\n4 1 0\n").contains("4OFF"));
        assert!(error("OFF\n").starts_with("is cut short"));
        assert_eq!(
            error("OFF\n2 1 0\n0 0 0\n0 x 0\n"),
            "has a vertex that cannot be read in line 4"
        );
        assert_eq!(
            error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
            "has a face that names vertex 3 of 3 in line 6"
        );
        assert_eq!(
            error("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n"),
            "has a face that cannot be read in line 6"
        );
        assert!(error("OFF\n99999999999 1 0\n0 0 0\n").starts_with("is cut short"));
    }
}
