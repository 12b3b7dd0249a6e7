//! Radiance pictures: the header is parsed here, the crate `image` decodes the scan lines.
//!
//! The format: "Radiance File Formats" (radsite.lbl.gov/radiance/refer/filefmts.pdf), and `color.h` and `resolu.h` of Radiance.
//! The crate only reads `#?RADIANCE` with rows from the top, so it gets a new header, and scan lines are arranged here.

use std::io::Cursor;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder as _};

use super::colour::{Primaries, XYZ};
use super::{Decoded, Problem, Purpose, damaged, room_for};
use crate::texels::Texels;

/// Maximum header length in bytes: programs add a line each time they process a picture.
const LONGEST_HEADER: usize = 1 << 20;

/// The contents of a header.
#[derive(Debug, PartialEq)]
struct Header {
    /// Factor of stored over measured values: red, green, blue.
    exposure: [f64; 3],
    xyz: bool,
    /// Whether there is any `EXPOSURE`.
    exposed: bool,
    primaries: Option<Primaries>,
    resolution: Resolution,
    /// Offset of the scan lines.
    end: usize,
}

/// The arrangement of scan lines in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Resolution {
    /// Number of scan lines, and pixels per line.
    lines: usize,
    pixels: usize,
    /// Scan lines are columns, not rows.
    columns: bool,
    /// Rows go up: `+Y`.
    from_below: bool,
    /// Columns go left: `-X`.
    from_right: bool,
}

pub(super) fn read(bytes: &[u8], purpose: Purpose) -> Result<Decoded, Problem> {
    let header = header(bytes)?;
    let Resolution { lines, pixels, .. } = header.resolution;
    let (width, height) = if header.resolution.columns {
        (lines, pixels)
    } else {
        (pixels, lines)
    };
    room_for(width, height, purpose)?;
    if let Some(scan) = flat(&bytes[header.end..], lines, pixels) {
        let texels = placed(&scan, header.resolution);
        return Ok(decoded(header, (width, height), texels));
    }
    let mut plain = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {lines} +X {pixels}\n").into_bytes();
    plain.extend_from_slice(&bytes[header.end..]);
    let mut decoder = HdrDecoder::new(Cursor::new(plain)).map_err(|error| damaged(&error))?;
    // Memory was checked above.
    let _ = decoder.set_limits(image::Limits::no_limits());
    let picture = DynamicImage::from_decoder(decoder).map_err(|error| damaged(&error))?;
    let scan = picture.into_rgb32f().into_raw();
    let texels = placed(scan.as_chunks::<3>().0, header.resolution);
    Ok(decoded(header, (width, height), texels))
}

/// Lumens per watt of white in Radiance (`WHTEFFICACY` of its `color.h`).
const EFFICACY: f64 = 179.0;

fn decoded(header: Header, (width, height): (usize, usize), texels: Vec<[f32; 3]>) -> Decoded {
    // Radiance's `ra_xyze` converts radiance to luminance by an exposure of 1 / 179. Files without any exposure are not from
    // it.
    let luminances = header.xyz && header.exposed;
    let efficacy = if luminances { EFFICACY } else { 1.0 };
    let note = luminances.then(|| format!("its luminances are radiances of {EFFICACY} lumens a watt"));
    Decoded {
        width: width as u32,
        height: height as u32,
        texels: Texels::Single(texels),
        factors: header.exposure.map(|exposure| 1.0 / (exposure * efficacy)),
        primaries: if header.xyz { Some(XYZ) } else { header.primaries },
        neutral: None,
        notes: note.into_iter().collect(),
    }
}

/// Widths of scan lines that may use run-length encoding by component (`color.c` of Radiance).
const IN_RUNS: std::ops::RangeInclusive<usize> = 8..=0x7fff;

/// Decodes a file of four bytes per pixel whose first pixel looks like a run-length marker: the crate mistakes it for one at
/// any width.
fn flat(data: &[u8], lines: usize, pixels: usize) -> Option<Vec<[f32; 3]>> {
    let [2, 2, high @ 0..128, low, ..] = *data else {
        return None;
    };
    let is_mark = IN_RUNS.contains(&pixels) && usize::from(high) << 8 | usize::from(low) == pixels;
    if is_mark || data.len() != 4 * lines * pixels {
        return None;
    }
    let pixel = |&[r, g, b, e]: &[u8; 4]| {
        let unit = if e == 0 {
            0.0
        } else {
            f64::from(i32::from(e) - 136).exp2()
        };
        [r, g, b].map(|x| (f64::from(x) * unit) as f32)
    };
    Some(data.as_chunks::<4>().0.iter().map(pixel).collect())
}

fn placed(scan: &[[f32; 3]], order: Resolution) -> Vec<[f32; 3]> {
    let Resolution { lines, pixels, .. } = order;
    let flip = |at: usize, of: usize, turned: bool| if turned { of - 1 - at } else { at };
    if !order.columns && !order.from_below && !order.from_right {
        return scan.to_vec();
    }
    let (width, height) = if order.columns {
        (lines, pixels)
    } else {
        (pixels, lines)
    };
    let texel = |index: usize| {
        let (x, y) = (index % width, index / width);
        let (x, y) = (flip(x, width, order.from_right), flip(y, height, order.from_below));
        let (line, pixel) = if order.columns { (x, y) } else { (y, x) };
        scan[line * pixels + pixel]
    };
    (0..width * height).map(texel).collect()
}

fn header(bytes: &[u8]) -> Result<Header, Problem> {
    if !bytes.starts_with(b"#?") {
        return Err(Problem::new(
            "is no Radiance picture: it does not begin with #?",
            "save it as Radiance .hdr, or give it the ending of its kind",
        ));
    }
    let mut header = Header {
        exposure: [1.0; 3],
        xyz: false,
        exposed: false,
        primaries: None,
        resolution: Resolution {
            lines: 0,
            pixels: 0,
            columns: false,
            from_below: false,
            from_right: false,
        },
        end: 0,
    };
    let mut lines = Lines { bytes, at: 0 };
    lines.next();
    loop {
        let line = lines.next().ok_or_else(|| damaged(&"its header has no end"))?;
        if line.is_empty() {
            break;
        }
        // Lines that begin with a tab describe pictures that this one was made from.
        let Some((name, value)) = line.split_once('=') else {
            continue;
        };
        let numbers = || -> Vec<f64> { value.split_whitespace().map_while(|word| word.parse().ok()).collect() };
        let wrong = || {
            damaged(&format!(
                "its header says {}",
                line.chars().take(60).collect::<String>()
            ))
        };
        let all = |numbers: &[f64]| numbers.iter().all(|x| *x > 0.0 && x.is_finite());
        match name {
            "FORMAT" => match value.trim() {
                "32-bit_rle_rgbe" => header.xyz = false,
                "32-bit_rle_xyze" => header.xyz = true,
                other => {
                    let other: String = other.chars().take(60).collect();
                    return Err(Problem::new(
                        format!("is of the format {other}, which Octolux does not read"),
                        "save it as 32-bit_rle_rgbe or 32-bit_rle_xyze",
                    ));
                }
            },
            "EXPOSURE" => match numbers()[..] {
                [exposure] if all(&[exposure]) => {
                    header.exposure.iter_mut().for_each(|x| *x *= exposure);
                    header.exposed = true;
                }
                _ => return Err(wrong()),
            },
            "COLORCORR" => match numbers()[..] {
                [r, g, b] if all(&[r, g, b]) => {
                    header.exposure.iter_mut().zip([r, g, b]).for_each(|(x, of)| *x *= of);
                }
                _ => return Err(wrong()),
            },
            "PRIMARIES" => match numbers()[..] {
                [a, b, c, d, e, f, g, h] => {
                    let [red, green, blue, white] = [[a, b], [c, d], [e, f], [g, h]];
                    header.primaries = Some(Primaries {
                        red,
                        green,
                        blue,
                        white,
                    });
                }
                _ => return Err(wrong()),
            },
            _ => {}
        }
    }
    let line = lines.next().ok_or_else(|| damaged(&"its header has no size"))?;
    header.resolution = resolution(&line).ok_or_else(|| {
        damaged(&format!(
            "its size is \"{}\"",
            line.chars().take(60).collect::<String>()
        ))
    })?;
    header.end = lines.at;
    Ok(header)
}

/// Parses `-Y 512 +X 1024` and seven other orders: the first axis is that of scan lines, the second that of pixels in a line.
fn resolution(line: &str) -> Option<Resolution> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [first, lines, second, pixels] = words[..] else {
        return None;
    };
    let number = |text: &str| text.parse::<u32>().ok().filter(|&n| n > 0).map(|n| n as usize);
    let columns = match (&first.get(1..)?, &second.get(1..)?) {
        (&"Y", &"X") => false,
        (&"X", &"Y") => true,
        _ => return None,
    };
    let sign = |word: &str| match word.as_bytes().first() {
        Some(b'+') => Some(true),
        Some(b'-') => Some(false),
        _ => None,
    };
    let (x, y) = if columns { (first, second) } else { (second, first) };
    Some(Resolution {
        lines: number(lines)?,
        pixels: number(pixels)?,
        columns,
        from_below: sign(y)?,
        from_right: !sign(x)?,
    })
}

/// The lines of a header, without line ends.
struct Lines<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl Lines<'_> {
    fn next(&mut self) -> Option<String> {
        let rest = self.bytes.get(self.at..LONGEST_HEADER.min(self.bytes.len()))?;
        let length = rest.iter().position(|&byte| byte == b'\n')?;
        self.at += length + 1;
        let line = rest[..length].strip_suffix(b"\r").unwrap_or(&rest[..length]);
        Some(String::from_utf8_lossy(line).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_header_says_more_than_once_multiplies() {
        let text = "#?RGBE\n# made by hand\nEXPOSURE=2\nEXPOSURE= 1.5\nCOLORCORR=1 0.5 2\nCOLORCORR= 2 2 2\n\tEXPOSURE=9\n\
            VIEW= -vh 90\nFORMAT=32-bit_rle_xyze\n\n+X 7 -Y 5\nrest";
        let found = header(text.as_bytes()).ok().unwrap();
        assert_eq!(found.exposure, [6.0, 3.0, 12.0]);
        assert!(found.xyz && found.resolution.columns && !found.resolution.from_below && !found.resolution.from_right);
        assert_eq!((found.resolution.lines, found.resolution.pixels), (7, 5));
        assert_eq!(&text[found.end..], "rest");
    }

    #[test]
    fn a_corner_is_where_its_order_says() {
        // The first pixel of the file is 1, the second 2.
        for (order, first, second) in [
            ("-Y 2 +X 3", 0, 1),
            ("-Y 2 -X 3", 2, 1),
            ("+Y 2 +X 3", 3, 4),
            ("+Y 2 -X 3", 5, 4),
            ("+X 3 -Y 2", 0, 3),
            ("-X 3 -Y 2", 2, 5),
            ("+X 3 +Y 2", 3, 0),
            ("-X 3 +Y 2", 5, 2),
        ] {
            let scan: Vec<[f32; 3]> = (1..=6).map(|i| [i as f32; 3]).collect();
            let texels = placed(&scan, resolution(order).unwrap());
            assert_eq!((texels[first], texels[second]), ([1.0; 3], [2.0; 3]), "{order}");
        }
        for wrong in [
            "",
            "-Y 2",
            "-Y 2 +Y 3",
            "Y 2 X 3",
            "-Y 0 +X 3",
            "-Y -2 +X 3",
            "-Y 2 +X 3 4",
        ] {
            assert_eq!(resolution(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn a_header_that_is_not_understood_is_refused() {
        for (text, what) in [
            ("RADIANCE\n\n-Y 1 +X 1\n", "is no Radiance picture"),
            ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n", "has no end"),
            ("#?RADIANCE\nFORMAT=ascii\n\n-Y 1 +X 1\n", "is of the format ascii"),
            ("#?RADIANCE\nEXPOSURE=0\n\n-Y 1 +X 1\n", "EXPOSURE=0"),
            ("#?RADIANCE\nCOLORCORR=1 1\n\n-Y 1 +X 1\n", "COLORCORR=1 1"),
            ("#?RADIANCE\n\n-Z 1 +X 1\n", "its size is \"-Z 1 +X 1\""),
        ] {
            let problem = header(text.as_bytes()).unwrap_err();
            assert!(problem.what.contains(what), "{}", problem.what);
        }
    }
}
