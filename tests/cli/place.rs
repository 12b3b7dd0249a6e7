//! A folder with a scene, in which tests run the real binary.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// The smallest scene that shows something: one light over one ball, 8 x 6 pixels.
const SCENE: &str = r#"
[camera]
origin = [0.0, 0.0, 6.0]
target = [0.0, 0.0, 0.0]
up     = [0.0, 1.0, 0.0]
fov_x  = 45.0

[film]
width  = 8
height = 6

[render]
spp = 3

[materials.grey]
diffuse = [0.5, 0.5, 0.5]

[[spheres]]
center   = [0.0, 0.0, 0.0]
radius   = 1.0
material = "grey"

[[spheres]]
center   = [0.0, 3.0, 2.0]
radius   = 0.5
emission = [10.0, 10.0, 10.0]
"#;

/// A folder of its own for one test, with `SCENE` as `small.toml` in `in/`.
pub struct Place(tempfile::TempDir);

impl Place {
    pub fn new() -> Self {
        let place = Self(tempfile::tempdir().unwrap());
        fs::create_dir(place.0.path().join("in")).unwrap();
        place.scene("small");
        place
    }

    pub fn scene(&self, name: &str) {
        fs::write(self.0.path().join("in").join(name).with_extension("toml"), SCENE).unwrap();
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Runs `octolux` in the folder; the arguments are separated by spaces.
    pub fn octolux(&self, arguments: &str) -> Output {
        self.command(arguments).output().unwrap()
    }

    /// The same, not yet run.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_octolux"));
        command
            .args(arguments.split_whitespace())
            .current_dir(self.path())
            .stdin(Stdio::null());
        command
    }

    /// The names in the folder, hidden ones too, without `in`.
    pub fn files(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name != "in")
            .collect();
        names.sort();
        names
    }

    /// Runs a command that must be refused as bad usage, and write nothing. Returns what it said.
    #[track_caller]
    pub fn refused(&self, arguments: &str) -> String {
        let before = self.files();
        let output = self.octolux(arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert!(
            said.starts_with("error: ") && !said.contains("panicked"),
            "{arguments}: {said}"
        );
        assert!(output.stdout.is_empty(), "{arguments}");
        assert_eq!(self.files(), before, "{arguments}");
        said
    }

    /// Runs a command that must succeed.
    #[track_caller]
    pub fn succeeds(&self, arguments: &str) -> Output {
        let output = self.octolux(arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments}: {}", stderr(&output));
        output
    }
}

pub fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}
