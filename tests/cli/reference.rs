//! `octolux reference` as its users meet it.

use std::process::Command;

use octolux::film::read_picture;

const SCENE: &str = r#"
[camera]
origin = [3, 1, 4]
target = [0, 0, 0]
up = [0, 0, 1]
fov_y = 40.0
[film]
width = 64
height = 64
[materials.floor]
diffuse = [0.8, 0.5, 0.1]
[[meshes]]
material = "floor"
vertices = [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]]
faces = [[0, 1, 2, 3]]
[[spheres]]
center = [0, 0, 2]
radius = 0.5
emission = [2, 3, 5]
"#;

#[test]
fn two_pictures_and_one_line() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    let reference = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_octolux"));
        command
            .args(["reference", "scene.toml", "--spp", "4", "--size", "12x8"])
            .args(args);
        command.current_dir(folder.path()).output().unwrap()
    };
    let result = reference(&["-o", "x.npy", "--threads", "1"]);
    let summary = String::from_utf8(result.stderr).unwrap();
    assert_eq!(result.status.code(), Some(0), "{summary}");
    assert!(
        summary.starts_with("12x8, 4 spp: mean ") && summary.lines().count() == 1,
        "{summary}"
    );
    assert!(result.stdout.is_empty());
    let [mean, stderr] = ["x.npy", "x_stderr.npy"].map(|name| read_picture(&folder.path().join(name)).unwrap());
    assert_eq!((mean.width, mean.height, stderr.width, stderr.height), (12, 8, 12, 8));
    assert!(mean.pixels.iter().all(|pixel| pixel[1] > 0.0));
    assert!(stderr.pixels.iter().any(|pixel| pixel[1] > 0.0 && pixel[1] < 1.0));

    let result = reference(&["-o", "y.exr", "--stderr", "z.exr", "--threads", "2", "--quiet"]);
    assert!(result.status.success() && result.stderr.is_empty());
    assert_eq!(read_picture(&folder.path().join("y.exr")).unwrap().pixels, mean.pixels);
    assert_eq!(
        read_picture(&folder.path().join("z.exr")).unwrap().pixels,
        stderr.pixels
    );
    reference(&["-o", "s.npy", "--seed", "1", "--quiet"]);
    assert_ne!(read_picture(&folder.path().join("s.npy")).unwrap().pixels, mean.pixels);

    assert_eq!(reference(&["-o", "x.npy", "--spp", "1"]).status.code(), Some(2));
    assert_eq!(reference(&["-o", "missing/x.npy"]).status.code(), Some(2));
}
