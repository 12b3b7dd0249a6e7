//! Files of exact sums: the checkpoint of a render, or the part of one shard.
//!
//! Layout: `OCTOSUMS`, then in little-endian numbers: the format's version; the length of a JSON object about the render, and
//! the object; width and height; tile by tile the state of [`Tile`]; if the object says so, further films of the same form and
//! pictures (width and height, then `f32` row by row); finally the CRC-32 (IEEE) of everything before it. A CRC detects every
//! flipped byte, and a truncated file lacks it.

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::ops::Range;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::sums::{Film, MOST_LEAF, TILE, Tile};
use super::tree::{Node, TileSum, Tree};
use super::{Picture, PictureError, replace};
use crate::scene::FilmSize;

const MAGIC: &[u8; 8] = b"OCTOSUMS";

/// Incremented with every change of the format. Older versions cannot be read: sums are kept for days, not for years.
const VERSION: u32 = 1;

/// Upper limit of the JSON object in bytes.
const LONGEST_ABOUT: u32 = 1 << 20;

/// The longest side of a film, as in scene files.
const LONGEST_SIDE: u32 = 65_536;

/// Size in the file of a tile without sums: five numbers of 32 bits.
const LEAST_TILE: u64 = 20;

impl Film {
    /// Whether all samples of a render of these passes are there. Of an adaptive render the passes of a pixel differ, their mean does not.
    pub fn has_all(&self, passes: &Range<u32>) -> bool {
        match self.most_samples() {
            Some(_) => {
                self.spread().1 >= u64::from(self.size().width) * u64::from(self.size().height) * passes.len() as u64
            }
            None => self.passes() == *passes,
        }
    }
}

/// Writes the sums of `film` and `about` atomically.
///
/// # Errors
/// Errors of the system; an older file is then kept.
pub fn write(path: &Path, about: &impl Serialize, film: &Film) -> Result<(), PictureError> {
    write_all(path, about, &[film], &[])
}

/// Writes the sums of several films, at least one, and pictures.
///
/// # Errors
/// As for [`write()`].
pub fn write_all(
    path: &Path,
    about: &impl Serialize,
    films: &[&Film],
    pictures: &[&Picture],
) -> Result<(), PictureError> {
    replace::replace(path, |file| {
        let mut to = Checked::new(file);
        let about = serde_json::to_vec(about)?;
        to.write_all(MAGIC)?;
        to.numbers(&[VERSION, about.len() as u32])?;
        to.write_all(&about)?;
        for film in films {
            let FilmSize { width, height } = film.size();
            to.numbers(&[width, height])?;
            for tile in film.tiles() {
                write_tile(&mut to, tile)?;
            }
        }
        for picture in pictures {
            to.numbers(&[picture.width, picture.height])?;
            to.write_all(bytemuck::cast_slice(picture.pixels.as_flattened()))?;
        }
        let sum = to.crc.clone().finalize();
        to.numbers(&[sum])
    })
}

/// Reads what [`write()`] wrote.
///
/// # Errors
/// A sentence about a file that is missing, of another kind or version, truncated or damaged.
pub fn read<A: DeserializeOwned>(path: &Path) -> Result<(A, Film), PictureError> {
    let (about, films, _) = read_all(path, |_| [1, 0])?;
    let film = films
        .into_iter()
        .next()
        .ok_or_else(|| damaged(path, &io::ErrorKind::InvalidData.into()))?;
    Ok((about, film))
}

/// Reads what [`write_all`] wrote: the numbers of films and pictures come from the description.
///
/// # Errors
/// As for [`read`].
pub fn read_all<A: DeserializeOwned>(
    path: &Path,
    count: impl FnOnce(&A) -> [usize; 2],
) -> Result<(A, Vec<Film>, Vec<Picture>), PictureError> {
    let (mut from, about) = open(path)?;
    let [films, pictures] = count(&about);
    let mut all = || {
        let films = (0..films).map(|_| from.film()).collect::<io::Result<Vec<_>>>()?;
        let pictures = (0..pictures).map(|_| from.picture()).collect::<io::Result<Vec<_>>>()?;
        Ok((films, pictures))
    };
    let (films, pictures) = all().map_err(|error| damaged(path, &error))?;
    from.end().map_err(|error| damaged(path, &error))?;
    Ok((about, films, pictures))
}

/// Reads the description of a render, and the CRC of its sums, after checking the whole file.
///
/// # Errors
/// As for [`read`].
pub fn read_about<A: DeserializeOwned>(path: &Path) -> Result<(A, u32), PictureError> {
    let (mut from, about) = open(path)?;
    let crc = from.skip().map_err(|error| damaged(path, &error))?;
    Ok((about, crc))
}

/// Whether a file was written by [`write()`], complete or not.
pub fn is_one(path: &Path) -> bool {
    let mut magic = [0; MAGIC.len()];
    let is_file = std::fs::metadata(path).is_ok_and(|found| found.is_file());
    is_file && File::open(path).is_ok_and(|mut file| file.read_exact(&mut magic).is_ok() && magic == *MAGIC)
}

fn damaged(path: &Path, error: &io::Error) -> PictureError {
    let what = match error.kind() {
        io::ErrorKind::UnexpectedEof => "is cut short".to_owned(),
        io::ErrorKind::InvalidData => "is cut short or damaged: its checksum does not match".to_owned(),
        _ => return PictureError::unreadable(path, error),
    };
    PictureError::new(path, what).help("delete it, and render what it held again")
}

fn open<A: DeserializeOwned>(path: &Path) -> Result<(Checked<impl Read>, A), PictureError> {
    let unreadable = |error: io::Error| PictureError::unreadable(path, &error);
    let other = || {
        PictureError::new(path, "holds no sums of Octolux")
            .help("give a file that render wrote by --checkpoint, --shard or -o FILE.acc")
    };
    let file = File::open(path).map_err(unreadable)?;
    let metadata = file.metadata().map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(other());
    }
    let mut from = Checked::new(BufReader::with_capacity(1 << 18, file));
    from.left = metadata.len();
    let mut magic = [0; MAGIC.len()];
    from.read_exact(&mut magic).map_err(|_| other())?;
    if magic != *MAGIC {
        return Err(other());
    }
    let version = from.number().map_err(|error| damaged(path, &error))?;
    if version != VERSION {
        let what = format!("is of version {version} of its format, and this Octolux reads version {VERSION}");
        return Err(PictureError::new(path, what).help("use the Octolux that wrote it"));
    }
    let about = from.about().map_err(|error| damaged(path, &error))?;
    let about = serde_json::from_slice(&about).map_err(|_| damaged(path, &io::ErrorKind::InvalidData.into()))?;
    Ok((from, about))
}

/// A stream of bytes with a running CRC.
struct Checked<F> {
    file: F,
    crc: crc32fast::Hasher,
    /// Bytes not yet read.
    left: u64,
}

impl<F> Checked<F> {
    fn new(file: F) -> Self {
        Self {
            file,
            crc: crc32fast::Hasher::new(),
            left: 0,
        }
    }
}

impl<F: Write> Checked<F> {
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.crc.update(bytes);
        self.file.write_all(bytes)
    }

    fn numbers(&mut self, numbers: &[u32]) -> io::Result<()> {
        numbers
            .iter()
            .try_for_each(|number| self.write_all(&number.to_le_bytes()))
    }

    /// Written as in memory: every processor that runs Octolux is little-endian.
    fn put(&mut self, sums: &TileSum) -> io::Result<()> {
        self.write_all(bytemuck::cast_slice(sums.0.as_flattened()))
    }
}

/// Writes five counts (passes, nodes, passes of the open leaf, goals, squares), then the values of nodes, open leaf, goals and
/// squares.
fn write_tile<F: Write>(to: &mut Checked<F>, tile: &Tile) -> io::Result<()> {
    let (tree, goals, squares) = (tile.sums(), tile.goals(), tile.squares());
    let (open, open_passes) = tree.open();
    let counts = [tree.nodes().len(), goals.len(), squares.0.len()].map(|count| count as u32);
    to.numbers(&[tile.passes(), counts[0], open_passes, counts[1], counts[2]])?;
    for node in tree.nodes() {
        to.numbers(&[node.level, node.index])?;
        to.put(&node.sums)?;
    }
    to.put(open)?;
    to.numbers(goals)?;
    to.put(squares)
}

impl<F: Read> Checked<F> {
    fn read_exact(&mut self, bytes: &mut [u8]) -> io::Result<()> {
        self.file.read_exact(bytes)?;
        self.crc.update(bytes);
        self.left = self.left.saturating_sub(bytes.len() as u64);
        Ok(())
    }

    fn number(&mut self) -> io::Result<u32> {
        let mut bytes = [0; 4];
        self.read_exact(&mut bytes)?;
        Ok(u32::from_le_bytes(bytes))
    }

    fn about(&mut self) -> io::Result<Vec<u8>> {
        let length = within(self.number()?, LONGEST_ABOUT)?;
        let mut bytes = vec![0; length as usize];
        self.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    fn sums(&mut self, pixels: usize) -> io::Result<TileSum> {
        let mut bytes = vec![0; pixels * 24];
        self.read_exact(&mut bytes)?;
        let (numbers, _) = bytes.as_chunks::<8>();
        let (triples, _) = numbers.as_chunks::<3>();
        Ok(TileSum(
            triples.iter().map(|triple| triple.map(f64::from_le_bytes)).collect(),
        ))
    }

    fn size(&mut self) -> io::Result<FilmSize> {
        let width = within(self.number()?, LONGEST_SIDE)?;
        let height = within(self.number()?, LONGEST_SIDE)?;
        if width == 0 || height == 0 {
            return Err(io::ErrorKind::InvalidData.into());
        }
        Ok(FilmSize { width, height })
    }

    fn picture(&mut self) -> io::Result<Picture> {
        let FilmSize { width, height } = self.size()?;
        let length = u64::from(width) * u64::from(height) * 12;
        if length > self.left {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let mut bytes = vec![0; length as usize];
        self.read_exact(&mut bytes)?;
        let (numbers, _) = bytes.as_chunks::<4>();
        let (triples, _) = numbers.as_chunks::<3>();
        let pixels = triples.iter().map(|triple| triple.map(f32::from_le_bytes)).collect();
        Ok(Picture { width, height, pixels })
    }

    fn film(&mut self) -> io::Result<Film> {
        let FilmSize { width, height } = self.size()?;
        let tiles = u64::from(width.div_ceil(TILE)) * u64::from(height.div_ceil(TILE));
        // Check before allocating by sizes from a file.
        if tiles * LEAST_TILE > self.left {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        let mut film = Film::new(FilmSize { width, height });
        for tile in film.tiles_mut() {
            self.tile(tile)?;
        }
        Ok(film)
    }

    fn tile(&mut self, tile: &mut Tile) -> io::Result<()> {
        let area = tile.area();
        let all_or_none = |count: u32| (count == 0 || count as usize == area).then_some(count as usize);
        let broken = || io::Error::from(io::ErrorKind::InvalidData);
        let passes = self.number()?;
        let nodes = within(self.number()?, u32::BITS)?;
        let open_passes = self.number()?;
        let goals = all_or_none(self.number()?).ok_or_else(broken)?;
        let squares = all_or_none(self.number()?).ok_or_else(broken)?;
        let most_leaf = u64::from(MOST_LEAF);
        let mut list: Vec<Node> = Vec::new();
        for _ in 0..nodes {
            let level = within(self.number()?, u32::BITS - 1)?;
            let index = self.number()?;
            let sums = self.sums(area)?;
            let node = Node { level, index, sums };
            let behind = list.last().is_none_or(|last| last.leaves().end <= node.leaves().start);
            if !behind || node.leaves().end * most_leaf > u64::from(u32::MAX - open_passes) {
                return Err(broken());
            }
            list.push(node);
        }
        let open = self.sums(if open_passes > 0 { area } else { 0 })?;
        let goals = (0..goals).map(|_| self.number()).collect::<io::Result<_>>()?;
        let squares = self.sums(squares)?;
        tile.restore(passes, Tree::new(list, open, open_passes), goals, squares);
        Ok(())
    }

    /// Reads the checksum and compares.
    fn end(mut self) -> io::Result<()> {
        let computed = self.crc.clone().finalize();
        let stored = self.number()?;
        if stored != computed || self.left > 0 {
            return Err(io::ErrorKind::InvalidData.into());
        }
        Ok(())
    }

    /// Skips to the checksum and verifies it; returns the checksum of the part read before.
    fn skip(&mut self) -> io::Result<u32> {
        let mut sums = crc32fast::Hasher::new();
        let mut buffer = vec![0; 1 << 18];
        while self.left > 4 {
            let most = (self.left - 4).min(buffer.len() as u64) as usize;
            self.read_exact(&mut buffer[..most])?;
            sums.update(&buffer[..most]);
        }
        let computed = self.crc.clone().finalize();
        if self.number()? == computed {
            Ok(sums.finalize())
        } else {
            Err(io::ErrorKind::InvalidData.into())
        }
    }
}

fn within(number: u32, most: u32) -> io::Result<u32> {
    if number <= most {
        Ok(number)
    } else {
        Err(io::ErrorKind::InvalidData.into())
    }
}

#[cfg(test)]
mod tests;
