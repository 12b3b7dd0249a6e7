//! The numbers after the header of a PLY file.

use std::io::{BufRead, ErrorKind};

use super::super::Problem;
use super::super::lines::{DAMAGED, Lines, number, unreadable, words};
use super::header::{Element, Encoding, Property, Scalar, cut_short};

/// Reads the numbers of one element after another.
pub enum Payload<R> {
    /// Each element is a line; blank lines are skipped.
    Text {
        lines: Lines<R>,
        line: Vec<u8>,
        /// Position in the line.
        at: usize,
    },
    Binary {
        source: R,
        big: bool,
    },
}

impl<R: BufRead> Payload<R> {
    /// The data after a header that was read from these lines.
    pub fn new(lines: Lines<R>, encoding: Encoding) -> Result<Self, Problem> {
        Ok(match encoding {
            Encoding::Ascii => Self::Text {
                lines,
                line: Vec::new(),
                at: 0,
            },
            _ => Self::Binary {
                source: lines.into_rest()?,
                big: encoding == Encoding::Big,
            },
        })
    }

    /// Call before the properties of each element.
    pub fn begin(&mut self, element: &Element) -> Result<(), Problem> {
        let Self::Text { lines, line, at } = self else {
            return Ok(());
        };
        *at = 0;
        loop {
            let (_, next) = lines.next()?.ok_or_else(|| cut_short(element))?;
            if element.properties.is_empty() || words(next).next().is_some() {
                line.clear();
                line.extend_from_slice(next);
                return Ok(());
            }
        }
    }

    /// Reads the next property of an element and returns its number, or its length if it is a list, whose numbers go into
    /// `list` if wanted.
    pub fn property(
        &mut self,
        property: &Property,
        element: &Element,
        list: Option<&mut Vec<f64>>,
    ) -> Result<f64, Problem> {
        let Some(length) = property.length else {
            return self.number(property.item, element);
        };
        let length = self.number(length, element)?;
        if length < 0.0 || length.fract() != 0.0 {
            return Err(self.broken(element));
        }
        match list {
            Some(list) => {
                list.clear();
                for _ in 0..length as u64 {
                    list.push(self.number(property.item, element)?);
                }
            }
            None => {
                for _ in 0..length as u64 {
                    self.number(property.item, element)?;
                }
            }
        }
        Ok(length)
    }

    fn number(&mut self, scalar: Scalar, element: &Element) -> Result<f64, Problem> {
        match self {
            Self::Text { line, at, .. } => {
                let rest = &line[*at..];
                let word = words(rest).next();
                let value = word.and_then(|word| {
                    // Text numbers are rounded to the declared type. Some programs write integers as 3.0.
                    let value = match scalar {
                        Scalar::F32 => number::<f32>(word).map(f64::from)?,
                        _ => number::<f64>(word)?,
                    };
                    *at = word.as_ptr_range().end as usize - line.as_ptr() as usize;
                    (!scalar.is_whole() || (value.fract() == 0.0 && value.is_finite())).then_some(value)
                });
                value.ok_or_else(|| self.broken(element))
            }
            Self::Binary { source, big } => {
                let mut bytes = [0; 8];
                let part = &mut bytes[..scalar.bytes()];
                source.read_exact(part).map_err(|error| match error.kind() {
                    ErrorKind::UnexpectedEof => cut_short(element),
                    _ => unreadable(error),
                })?;
                if *big {
                    part.reverse();
                }
                Ok(little(scalar, bytes))
            }
        }
    }

    fn broken(&self, element: &Element) -> Problem {
        let name = &element.name;
        let place = match self {
            Self::Text { lines, .. } => format!(" in line {}", lines.number()),
            // Binary files have no lines to report.
            Self::Binary { .. } => String::new(),
        };
        Problem::new(format!("has a `{name}` element that cannot be read{place}"), DAMAGED)
    }
}

/// Decodes a little-endian number.
fn little(scalar: Scalar, bytes: [u8; 8]) -> f64 {
    let [a, b, c, d, ..] = bytes;
    match scalar {
        Scalar::I8 => f64::from(a as i8),
        Scalar::U8 => f64::from(a),
        Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
        Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
        Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
        Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
        Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
        Scalar::F64 => f64::from_le_bytes(bytes),
    }
}
