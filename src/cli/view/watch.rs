//! The scene's text beside the picture: saving the file renders again, and an error stands at its line.

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

/// How often the files are looked at.
const PERIOD: Duration = Duration::from_millis(100);

/// What is shown of a long text, in bytes: a mesh may stand in it.
const LONGEST_TEXT: usize = 256 << 10;

/// What tells that a file was saved.
type Stamp = Vec<Option<(SystemTime, u64)>>;

/// Shows the text of a scene, and reads it again when it or a file that it names is saved.
pub struct Watch {
    /// The scene file as it was named.
    pub path: PathBuf,
    /// Which files it may name.
    pub reading: LoadOptions,
    /// Where its text is shown.
    pub board: Arc<Board>,
    /// Who renders it.
    pub orders: Sender<Order>,
}

impl Watch {
    /// Watches until nobody renders any more.
    pub fn run(self, mut files: Vec<PathBuf>) {
        self.show(&Value::Null);
        let mut seen = stamp(&files);
        let mut changing = seen.clone();
        loop {
            std::thread::sleep(PERIOD);
            let now = stamp(&files);
            // A file that is being saved may be empty for a moment: it is read when it has come to rest.
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
                // The last good picture stays.
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
