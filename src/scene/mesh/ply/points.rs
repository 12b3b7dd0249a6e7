//! Point clouds: vertices with properties and nothing else.

use std::io::BufRead;

use super::super::Problem;
use super::super::lines::Lines;
use super::header::Header;
use super::payload::Payload;

/// Reads the named properties of each `vertex` of a PLY file of at most `longest` bytes; everything else is skipped.
pub fn points<const N: usize, R: BufRead>(
    source: R,
    longest: u64,
    names: [&str; N],
    help: &'static str,
) -> Result<Vec<[f64; N]>, Problem> {
    let mut lines = Lines::new(source)?;
    let header = Header::read(&mut lines)?;
    let Some(vertex) = header.element("vertex") else {
        return Err(Problem::new("has no `vertex` element in its header", help));
    };
    let lacks = |name: &&&str| {
        vertex
            .property(&[**name])
            .is_none_or(|property| property.length.is_some())
    };
    if let Some(missing) = names.iter().find(lacks) {
        return Err(Problem::new(
            format!("has vertices without the number `{missing}`"),
            help,
        ));
    }
    header.fits(longest)?;
    let places: Vec<_> = (vertex.properties.iter())
        .map(|property| names.iter().position(|name| *name == property.name))
        .collect();
    let mut payload = Payload::new(lines, header.encoding)?;
    let mut points = Vec::new();
    for element in &header.elements {
        let wanted = element.name == "vertex";
        for _ in 0..element.count {
            payload.begin(element)?;
            let mut point = [0.0; N];
            for (i, property) in element.properties.iter().enumerate() {
                let value = payload.property(property, element, None)?;
                if let (true, Some(place)) = (wanted, places.get(i).copied().flatten()) {
                    point[place] = value;
                }
            }
            if wanted {
                points.push(point);
            }
        }
        if wanted {
            break;
        }
    }
    Ok(points)
}
