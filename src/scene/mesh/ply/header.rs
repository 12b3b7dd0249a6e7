//! The header of a PLY file: elements and their properties.

use std::io::BufRead;

use super::super::Problem;
use super::super::lines::{DAMAGED, Lines, number, words};

const MESH: &str = "a mesh file has vertices with x, y, z and faces with vertex_indices";

/// The encoding of the numbers after the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

/// The types of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub fn is_whole(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// A number of an element, or a list with the type of its length.
#[derive(Debug)]
pub struct Property {
    pub name: String,
    pub length: Option<Scalar>,
    pub item: Scalar,
}

/// A number of elements of the same kind.
#[derive(Debug)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

impl Element {
    pub fn property(&self, names: &[&str]) -> Option<&Property> {
        self.properties.iter().find(|property| names.contains(&&*property.name))
    }
}

/// The contents of a header.
#[derive(Debug)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
}

impl Header {
    /// Reads up to the line `end_header`.
    pub fn read<R: BufRead>(lines: &mut Lines<R>) -> Result<Self, Problem> {
        let first = lines.next()?.map(|(_, line)| line.trim_ascii_end());
        if first != Some(b"ply") {
            return Err(Problem::new(
                "is not a PLY file: it does not begin with the line `ply`",
                "name a mesh that is saved as PLY",
            ));
        }
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        loop {
            let Some((number, line)) = lines.next()? else {
                return Err(Problem::new("is cut short: its header has no end", DAMAGED));
            };
            let mut words = words(line);
            let understood = match words.next() {
                None | Some(b"comment" | b"obj_info") => Some(()),
                Some(b"end_header") => break,
                Some(b"format") => format(words).map(|format| encoding = Some(format)),
                Some(b"element") => element(words).map(|element| elements.push(element)),
                Some(b"property") => elements.last_mut().and_then(|element| {
                    element.properties.push(property(words)?);
                    Some(())
                }),
                Some(_) => None,
            };
            if understood.is_none() {
                return Err(Problem::new(
                    format!("has a header that cannot be read, line {number}"),
                    DAMAGED,
                ));
            }
        }
        let encoding = encoding.ok_or_else(|| {
            Problem::new(
                "has no line `format` in its header",
                "it says ascii, binary_little_endian or binary_big_endian",
            )
        })?;
        Ok(Self { encoding, elements })
    }

    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }

    /// Checks that it describes a mesh that fits into `length` bytes, before anything is allocated.
    pub fn check(&self, length: u64) -> Result<(), Problem> {
        for name in ["vertex", "face", "tristrips"] {
            if self.elements.iter().filter(|element| element.name == name).count() > 1 {
                return Err(Problem::new(
                    format!("has two `{name}` elements in its header"),
                    DAMAGED,
                ));
            }
        }
        let missing = |name: &str| Problem::new(format!("has no `{name}` element in its header"), MESH);
        let vertex = self.element("vertex").ok_or_else(|| missing("vertex"))?;
        for key in ["x", "y", "z"] {
            if vertex.property(&[key]).is_none_or(|property| property.length.is_some()) {
                return Err(Problem::new(format!("has vertices without the number `{key}`"), MESH));
            }
        }
        let surfaces = [("face", "faces"), ("tristrips", "strips")];
        if surfaces.iter().all(|(name, _)| self.element(name).is_none()) {
            return Err(missing("face"));
        }
        for (name, plural) in surfaces {
            let Some(element) = self.element(name).filter(|element| element.count > 0) else {
                continue;
            };
            let list = element
                .property(super::CORNERS)
                .filter(|property| property.length.is_some());
            let list =
                list.ok_or_else(|| Problem::new(format!("has {plural} without the list `vertex_indices`"), MESH))?;
            if !list.item.is_whole() {
                return Err(Problem::new(
                    format!("has {plural} whose `vertex_indices` are not whole numbers"),
                    MESH,
                ));
            }
        }
        self.fits(length)
    }

    /// Checks that all elements fit into `length` bytes.
    pub fn fits(&self, length: u64) -> Result<(), Problem> {
        for element in &self.elements {
            let least = element
                .properties
                .iter()
                .map(|p| least_bytes(p, self.encoding))
                .sum::<u64>()
                .max(1);
            // The last line of a text may lack its newline.
            if element
                .count
                .checked_mul(least)
                .is_none_or(|needed| needed > length + 1)
            {
                return Err(cut_short(element));
            }
        }
        Ok(())
    }
}

/// The minimum size of a property in bytes: a list may be empty, a number in a text is a digit and a space.
fn least_bytes(property: &Property, encoding: Encoding) -> u64 {
    match encoding {
        Encoding::Ascii => 2,
        _ => property.length.unwrap_or(property.item).bytes() as u64,
    }
}

pub fn cut_short(element: &Element) -> Problem {
    let Element { name, count, .. } = element;
    Problem::new(
        format!("is cut short: its header promises {count} `{name}` elements, the file ends before"),
        DAMAGED,
    )
}

fn format<'l>(mut words: impl Iterator<Item = &'l [u8]>) -> Option<Encoding> {
    let encoding = match words.next()? {
        b"ascii" => Encoding::Ascii,
        b"binary_little_endian" => Encoding::Little,
        b"binary_big_endian" => Encoding::Big,
        _ => return None,
    };
    number::<f64>(words.next()?).map(|_| encoding)
}

fn element<'l>(mut words: impl Iterator<Item = &'l [u8]>) -> Option<Element> {
    Some(Element {
        name: String::from_utf8_lossy(words.next()?).into_owned(),
        count: number(words.next()?)?,
        properties: Vec::new(),
    })
}

fn property<'l>(mut words: impl Iterator<Item = &'l [u8]>) -> Option<Property> {
    let word = words.next()?;
    let (length, item) = match word {
        b"list" => (Some(Scalar::named(words.next()?)?), Scalar::named(words.next()?)?),
        _ => (None, Scalar::named(word)?),
    };
    // Names of several words are not used here: keep the first.
    let name = String::from_utf8_lossy(words.next()?).into_owned();
    Some(Property { name, length, item })
}
