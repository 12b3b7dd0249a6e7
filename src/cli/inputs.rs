//! Inputs of a command, protected against being overwritten by its outputs; outputs must differ, too.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::CliError;
use super::outputs::is_sums;
use octolux::film::{Film, sums_file};
use octolux::run::Record;
use octolux::scene::Scene;

/// Identifies a file: by device and inode if it exists, so that links of either kind match, otherwise by absolute path.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Identity {
    #[cfg(unix)]
    File(u64, u64),
    Path(PathBuf),
}

impl Identity {
    fn of(path: &Path) -> Self {
        #[cfg(unix)]
        if let Ok(found) = std::fs::metadata(path) {
            use std::os::unix::fs::MetadataExt as _;
            return Self::File(found.dev(), found.ino());
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize();
        Self::Path(match (folder, path.file_name()) {
            (Ok(folder), Some(name)) => folder.join(name),
            _ => path.to_owned(),
        })
    }
}

/// Files that must not be overwritten, with a description of the reader, such as "the scene sky.toml".
#[derive(Debug, Default)]
pub struct Inputs(HashMap<Identity, (PathBuf, String)>);

impl Inputs {
    /// Files that `reader` reads.
    pub fn of(reader: impl Into<String>, files: impl IntoIterator<Item = PathBuf>) -> Self {
        let reader = reader.into();
        let named = |file: PathBuf| (Identity::of(&file), (file, reader.clone()));
        Self(files.into_iter().map(named).collect())
    }

    /// The files that a scene was read from.
    pub fn of_scene(scene: &Scene) -> Self {
        let name = scene.files().first().map_or(Path::new(scene.name()), PathBuf::as_path);
        Self::of(format!("the scene {}", name.display()), scene.files().iter().cloned())
    }

    /// The files that scenes name, before any of them is read.
    pub fn named_by<'a>(scenes: impl IntoIterator<Item = &'a PathBuf>) -> Self {
        let mut all = Self::default();
        for scene in scenes {
            all.add(Self::of(
                format!("the scene {}", scene.display()),
                Scene::named_files(scene),
            ));
        }
        all
    }

    /// Adds other inputs.
    pub fn add(&mut self, others: Self) {
        others
            .0
            .into_iter()
            .for_each(|(file, read)| _ = self.0.entry(file).or_insert(read));
    }

    /// Checks that none of these outputs overwrites an input, another output, or sums that no picture has been made of yet.
    ///
    /// # Errors
    /// The first output that does, with the name of what it would overwrite.
    pub fn are_kept_by<'a>(&self, outputs: impl IntoIterator<Item = &'a Path>) -> Result<(), CliError> {
        let mut seen: HashMap<Identity, &Path> = HashMap::new();
        for path in outputs {
            let identity = Identity::of(path);
            if let Some((input, reader)) = self.0.get(&identity) {
                let what = format!(
                    "{}: would replace {}, which {reader} reads",
                    path.display(),
                    input.display()
                );
                return Err(CliError::usage(what).with_help("write to another name"));
            }
            if let Some(other) = seen.insert(identity, path) {
                let also = match other == path {
                    true => String::new(),
                    false => format!(", as {} is the same file", other.display()),
                };
                let what = format!("{}: would be written twice{also}", path.display());
                return Err(CliError::usage(what).with_help("give each scene and each picture its own name"));
            }
        }
        Ok(())
    }
}

/// Checks that an output overwrites no checkpoint: pictures and figures may not overwrite any sums, sums not those of an
/// unfinished render.
///
/// # Errors
/// If it does.
pub fn keeps_checkpoints(path: &Path) -> Result<(), CliError> {
    if !sums_file::is_one(path) {
        return Ok(());
    }
    let whole = || {
        let (record, _): (Record, _) = sums_file::read_about(path).ok()?;
        if record.replicates.is_some() {
            return Some(false);
        }
        let (_, film): (Record, Film) = sums_file::read(path).ok()?;
        Some(film.passes() == record.passes || record.passes.is_empty())
    };
    // Damaged sums may be overwritten.
    if is_sums(path) && whole().unwrap_or(true) {
        return Ok(());
    }
    let what = format!("{}: would replace the checkpoint of a render", path.display());
    Err(CliError::usage(what).with_help("write to another name, or delete the checkpoint if it is of no use"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_file_is_known_by_all_of_its_names() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        std::fs::create_dir(at("in")).unwrap();
        std::fs::write(at("a"), "a").unwrap();
        std::fs::write(at("b"), "a").unwrap();
        std::os::unix::fs::symlink(at("a"), at("soft")).unwrap();
        std::os::unix::fs::symlink(place.path(), at("folder")).unwrap();
        std::fs::hard_link(at("a"), at("hard")).unwrap();
        let names = ["a", "./a", "in/../a", "soft", "hard", "folder/a", "folder/in/../soft"];
        assert!(
            names
                .iter()
                .all(|name| Identity::of(&at(name)) == Identity::of(&at("a")))
        );
        let new = ["new", "./new", "in/../new", "folder/new"];
        assert!(
            new.iter()
                .all(|name| Identity::of(&at(name)) == Identity::of(&at("new")))
        );
        assert!(Identity::of(&at("b")) != Identity::of(&at("a")) && Identity::of(&at("c")) != Identity::of(&at("new")));
    }
}
