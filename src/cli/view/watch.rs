//! Shows the scene's text beside the picture: saving the file renders again, and errors are shown at their line.

use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Sender;
use std::time::{Duration, SystemTime};

use serde_json::{Value, json};

use super::board::{Board, Topic};
use super::engine::Order;
use crate::cli::CliError;
use crate::cli::reading::LoadOptions;

/// Polling interval of the files.
const PERIOD: Duration = Duration::from_millis(100);

/// Maximum length of the shown text in bytes: it may contain a mesh.
const LONGEST_TEXT: usize = 256 << 10;

/// The states of files, by which a save is noticed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stamp(BTreeMap<PathBuf, Option<(SystemTime, u64)>>);

impl Stamp {
    /// Looks at files.
    pub fn of(files: &[PathBuf]) -> Self {
        let state = |found: Metadata| Some((found.modified().ok()?, found.len()));
        let of = |file: &PathBuf| (file.clone(), std::fs::metadata(file).ok().and_then(state));
        Self(files.iter().map(of).collect())
    }

    /// The states of these files when they were read. What was known before counts: a file that was saved while it was read is read
    /// again.
    fn of_read(&self, files: &[PathBuf]) -> Self {
        let mut all = Self::of(files);
        for (file, state) in &mut all.0 {
            if let Some(before) = self.0.get(file) {
                *state = *before;
            }
        }
        all
    }
}

/// Shows the text of a scene, and reads it again when it or a file that it names is saved.
pub struct Watch {
    /// The scene file as given.
    pub path: PathBuf,
    /// Which files it may name.
    pub reading: LoadOptions,
    /// Where its text is shown.
    pub board: Arc<Board>,
    /// Orders to the engine.
    pub orders: Sender<Order>,
}

impl Watch {
    /// Watches the files of a scene until the engine is gone; `before` is of a time before the scene was read.
    pub fn run(self, mut files: Vec<PathBuf>, before: &Stamp) {
        let mut seen = before.of_read(&files);
        self.show(&Value::Null);
        let mut changing = seen.clone();
        loop {
            std::thread::sleep(PERIOD);
            let now = Stamp::of(&files);
            // A file may be empty for a moment during saving: read it once it stays unchanged.
            if now == seen || std::mem::replace(&mut changing, now.clone()) != now {
                continue;
            }
            seen = now;
            match self.reading.load(&self.path) {
                Ok(scene) => {
                    files = scene.files().to_vec();
                    seen = seen.of_read(&files);
                    self.show(&Value::Null);
                    self.board.interrupt();
                    if self.orders.send(Order::Scene(Arc::new(scene))).is_err() {
                        return;
                    }
                }
                // Keep the last good picture.
                Err(error) => self.show(&fault(&error)),
            }
        }
    }

    fn show(&self, error: &Value) {
        let (text, cut) = text(&self.path);
        let path = self.path.display().to_string();
        let scene = json!({ "kind": "scene", "path": path, "text": text, "cut": cut, "error": error });
        self.board.tell(Topic::Scene, scene.to_string());
    }
}

fn text(path: &Path) -> (String, bool) {
    let bytes = std::fs::read(path).unwrap_or_default();
    let cut = bytes.len() > LONGEST_TEXT;
    let shown = &bytes[..bytes.len().min(LONGEST_TEXT)];
    (String::from_utf8_lossy(shown).into_owned(), cut)
}

fn fault(error: &CliError) -> Value {
    let line = match error {
        CliError::Scene(error) => error.line(),
        _ => None,
    };
    json!({ "line": line, "what": error.to_string(), "help": error.help() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A save between the first look and the end of reading is a change; files that only reading names are as they were then.
    #[test]
    fn a_save_while_a_scene_is_read_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let [scene, mesh] = ["scene.toml", "mesh.ply"].map(|name| folder.path().join(name));
        std::fs::write(&scene, "old").unwrap();
        let before = Stamp::of(std::slice::from_ref(&scene));
        std::fs::write(&scene, "newer").unwrap();
        std::fs::write(&mesh, "mesh").unwrap();
        let files = [scene, mesh];
        let read = before.of_read(&files);
        assert_ne!(read, Stamp::of(&files));
        let again = Stamp::of(&files).of_read(&files);
        assert_eq!(again, Stamp::of(&files));
        assert_eq!(read.0[&files[1]], again.0[&files[1]]);
    }
}
