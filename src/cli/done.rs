//! The record of finished pictures of a batch: one line of JSON per picture, with a hash of all its inputs and the checksums of
//! its files. A picture counts as finished if all of these still match.

use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::{CliError, leftovers};

/// The record of one batch.
#[derive(Debug)]
pub struct Done {
    path: PathBuf,
    file: Mutex<File>,
    lines: Vec<Line>,
}

#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Line {
    /// Hash of everything that affects the files.
    key: String,
    /// CRC-32 of each file.
    files: BTreeMap<PathBuf, u32>,
}

impl Done {
    /// Reads the record at `path`, if it exists. Truncated lines are ignored.
    ///
    /// # Errors
    /// A record that cannot be read or appended to.
    pub fn open(path: &Path) -> Result<Self, CliError> {
        let failed = |error: io::Error| {
            let what = format!(
                "{}: the notes of the batch cannot be read and written: {error}",
                path.display()
            );
            CliError::failed(what)
                .with_help("they are beside the manifest: copy it into a folder that you may write to")
        };
        let text = match fs::read_to_string(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                leftovers::note(path);
                String::new()
            }
            text => text.map_err(failed)?,
        };
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(path)
            .map_err(failed)?;
        if !text.is_empty() && !text.ends_with('\n') {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self {
            path: path.to_owned(),
            file: Mutex::new(file),
            lines: text
                .lines()
                .filter_map(|line| serde_json::from_str(line).ok())
                .collect(),
        })
    }

    /// Whether these files are unchanged since they were written for this key.
    pub fn holds(&self, key: &str, files: &[PathBuf]) -> bool {
        // Later lines replace earlier ones.
        let line = self
            .lines
            .iter()
            .rev()
            .find(|line| line.key == key && line.files.keys().eq(sorted(files)));
        line.is_some_and(|line| {
            line.files
                .iter()
                .all(|(path, crc)| checksum(path).is_ok_and(|now| now == *crc))
        })
    }

    /// Records that these files were written for this key.
    ///
    /// # Errors
    /// Files that cannot be read back, a record that cannot be written.
    pub fn note(&self, key: String, files: &[PathBuf]) -> Result<(), CliError> {
        let failed = |error: io::Error| CliError::failed(format!("{}: {error}", self.path.display()));
        let checked = files.iter().map(|path| Ok((path.clone(), checksum(path)?)));
        let files = checked.collect::<io::Result<_>>().map_err(failed)?;
        let mut line = serde_json::to_vec(&Line { key, files }).map_err(|error| failed(error.into()))?;
        line.push(b'\n');
        // One call, so that lines of several threads do not interleave.
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(&line).and_then(|()| file.sync_data()).map_err(failed)
    }
}

fn sorted(files: &[PathBuf]) -> impl Iterator<Item = &PathBuf> {
    let mut files: Vec<&PathBuf> = files.iter().collect();
    files.sort();
    files.into_iter()
}

/// SHA-256 of a text, in hexadecimal.
pub fn key(words: &str) -> String {
    Sha256::digest(words).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn checksum(path: &Path) -> io::Result<u32> {
    let (mut file, mut crc, mut buffer) = (File::open(path)?, crc32fast::Hasher::new(), vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(crc.finalize()),
            n => crc.update(&buffer[..n]),
        }
    }
}
