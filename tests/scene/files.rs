//! Every scene that ships loads, and says what its kind has to say.

use std::path::{Path, PathBuf};

use octolux::scene::{MaterialId, Scene, Surface};

fn scenes(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut scenes: Vec<_> = entries
        .filter(|path| path.extension().is_some_and(|ending| ending == "toml"))
        .collect();
    scenes.sort();
    scenes
}

#[test]
fn scenes_load() {
    let scenes = scenes("scenes");
    assert!(scenes.len() >= 6);
    for path in scenes {
        match Scene::load(&path) {
            Ok(scene) => assert!(scene.notes().is_empty(), "{}: {:?}", path.display(), scene.notes()),
            // Files of two scenes do not ship, and the error names the script that brings them.
            Err(error) => {
                let script = ["dragon", "city"]
                    .into_iter()
                    .find(|name| path.ends_with(format!("{name}.toml")));
                let script = script.unwrap_or_else(|| panic!("{error:?}"));
                assert_eq!(
                    error.remedy(),
                    format!("run scenes/fetch-{script}.sh, which fetches it")
                );
            }
        }
    }
}

#[test]
fn test_scenes_load_and_state_the_mean_of_their_pictures() {
    let scenes = scenes("scenes/tests");
    assert!(scenes.len() >= 8);
    for path in scenes {
        let text = std::fs::read_to_string(&path).unwrap();
        let expect = text.lines().next().and_then(|line| line.strip_prefix("# expect: "));
        let expect = expect.unwrap_or_else(|| panic!("{} states no answer", path.display()));
        let means: Vec<f64> = expect.split(' ').map(|mean| mean.parse().unwrap()).collect();
        assert_eq!(means.len(), 3, "{}", path.display());
        let scene = Scene::load(&path).unwrap();
        // An answer that is a light's own radiance, or 0, may come without a material; all others need one.
        assert!(scene.spheres().len() + scene.meshes().len() > 0);
        // Only the scene of lights that coincide has something to say.
        let says = path.ends_with("coincident-lights.toml");
        assert_eq!(
            scene.notes().len(),
            usize::from(says),
            "{}: {:?}",
            path.display(),
            scene.notes()
        );
    }
}

#[test]
fn the_knot_is_wound_as_its_normals_say() {
    let scene = Scene::load(Path::new("scenes/knot.toml")).unwrap();
    for mesh in &scene.meshes()[..2] {
        assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (2800, 5600));
        let normals = mesh.normals.as_ref().unwrap();
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize]);
            let ng = (b - a).cross(c - a).normalize();
            assert!(corners.iter().all(|&corner| normals[corner as usize].dot(ng) > 0.5));
        }
        let lowest = mesh.vertices.iter().map(|v| v.y).fold(f64::INFINITY, f64::min);
        assert!((0.0..0.2).contains(&lowest), "the knot stands on the floor: {lowest}");
    }
}

#[test]
fn veachs_scene_has_its_plates_and_lights() {
    let scene = Scene::load(Path::new("scenes/veach-mis.toml")).unwrap();
    assert_eq!(scene.name(), "veach-mis");
    assert_eq!((scene.film().width, scene.film().height), (768, 512));
    assert_eq!(
        (scene.spheres().len(), scene.meshes().len(), scene.materials().len()),
        (5, 6, 5)
    );
    assert!(
        scene
            .spheres()
            .iter()
            .all(|sphere| matches!(sphere.surface, Surface::Emission(_)))
    );
    assert_eq!(scene.meshes()[0].surface, Surface::Material(MaterialId::new(0)));
}
