//! What the targets share: bytes to a scene or to an error, in which every sentence can be made.

use std::fs;
use std::path::{Path, PathBuf};

use octolux::scene::{Features, Scene};

/// Reads a scene text; files that it names are looked for in an empty folder.
pub fn scene(text: &str) {
    load(text, &folder().join("scene.toml"));
}

/// Reads `bytes` as a mesh file with this ending, by way of a scene that names it.
pub fn mesh(ending: &str, bytes: &[u8]) {
    let folder = folder();
    fs::write(folder.join(format!("mesh.{ending}")), bytes).expect("the folder takes files");
    let text = format!(
        "[camera]\norigin = [0, 0, 0]\ntarget = [0, 0, 1]\nup = [0, 1, 0]\nfov_x = 40\n\
         [film]\nwidth = 4\nheight = 4\n[materials.m]\ndiffuse = [0.5, 0.5, 0.5]\n\
         [[meshes]]\nfile = \"mesh.{ending}\"\nmaterial = \"m\"\nnormals = \"smooth\"\n"
    );
    load(&text, &folder.join("scene.toml"));
}

/// Reads `bytes` as a picture with this ending, as a texture and as an environment.
pub fn picture(ending: &str, bytes: &[u8]) {
    let folder = folder();
    fs::write(folder.join(format!("picture.{ending}")), bytes).expect("the folder takes files");
    let view = "[camera]\norigin = [0, 0, 0]\ntarget = [0, 0, 1]\nup = [0, 1, 0]\nfov_x = 40\n\
        [film]\nwidth = 4\nheight = 4\n";
    let texture = format!("{view}[materials.m]\ndiffuse = [1, 1, 1]\ntexture = \"picture.{ending}\"\n");
    let environment = format!("{view}[environment]\nfile = \"picture.{ending}\"\n");
    for text in [texture, environment] {
        load(&text, &folder.join("scene.toml"));
    }
}

/// A folder of this process; in memory where the system has such a place.
fn folder() -> PathBuf {
    let shared = Path::new("/dev/shm");
    let base = if shared.is_dir() {
        shared.to_owned()
    } else {
        std::env::temp_dir()
    };
    let folder = base.join(format!("octolux-fuzz-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder for one file");
    folder
}

fn load(text: &str, path: &Path) {
    match Scene::parse(text, path) {
        Ok(scene) => _ = Features::of(&scene, scene.film()),
        Err(error) => {
            assert!(!format!("{error:?}").is_empty());
            assert!(error.to_string().len() > 10, "an error is a sentence");
        }
    }
}
