//! Shows the scene's text beside the picture: saving the file renders again, and errors are shown at their line.

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

/// Detects that a file was saved.
type Stamp = Vec<Option<(SystemTime, u64)>>;

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
    /// Watches until the engine is gone.
    pub fn run(self, mut files: Vec<PathBuf>) {
        self.show(&Value::Null);
        let mut seen = stamp(&files);
        let mut changing = seen.clone();
        loop {
            std::thread::sleep(PERIOD);
            let now = stamp(&files);
            // A file may be empty for a moment during saving: read it once it stays unchanged.
            if now == seen || std::mem::replace(&mut changing, now.clone()) != now {
                continue;
            }
            seen = now;
            match self.reading.load(&self.path) {
                Ok(scene) => {
                    files = scene.files().to_vec();
                    seen = stamp(&files);
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

fn stamp(files: &[PathBuf]) -> Stamp {
    let of = |found: Metadata| Some((found.modified().ok()?, found.len()));
    files
        .iter()
        .map(|file| std::fs::metadata(file).ok().and_then(of))
        .collect()
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
