//! What a scene leaves out because nothing of it can be seen, and what the user should be told about the rest.

use std::collections::HashSet;
use std::sync::Arc;

use glam::DVec3;

use super::SceneBuilder;
use super::invalid::{InvalidScene, Subject, Wrong};
use super::mesh::has_area;
use super::parts::{Environment, Mesh, Sphere, Surface};

/// Leaves out triangles whose corners lie on one line.
///
/// # Errors
/// If no triangle is left.
pub fn drop_flat(index: usize, mesh: &mut Arc<Mesh>, notes: &mut Vec<String>) -> Result<(), InvalidScene> {
    let area = |corners: &[u32; 3]| has_area(corners.map(|corner| mesh.vertices[corner as usize]));
    let all = mesh.triangles.len();
    let kept = mesh.triangles.iter().filter(|corners| area(corners)).count();
    if kept == 0 {
        let problem = match all {
            0 => "has no faces".to_owned(),
            _ => format!("has no triangle with an area, got {all} without"),
        };
        let remedy = "a mesh needs a triangle whose corners are not on one line";
        return Err(Wrong::new(problem, remedy).on(Subject::Mesh(index), &mesh.name));
    }
    if kept < all {
        let triangles = mesh.triangles.iter().copied().filter(area).collect();
        Arc::make_mut(mesh).triangles = triangles;
        let left_out = all - kept;
        let (noun, verb) = if left_out == 1 {
            ("triangle", "is")
        } else {
            ("triangles", "are")
        };
        let name = if mesh.name.is_empty() {
            Subject::Mesh(index).to_string()
        } else {
            mesh.name.clone()
        };
        notes.push(format!(
            "{name}: {left_out} {noun} of {all} without area {verb} left out"
        ));
    }
    Ok(())
}

/// Leaves out spheres that coincide with an earlier one, which hides them.
pub fn drop_spheres(spheres: &mut Vec<Sphere>, notes: &mut Vec<String>) {
    let (mut seen, all) = (HashSet::new(), spheres.len());
    // The sum makes one zero of the two.
    spheres.retain(|s| seen.insert([s.center.x, s.center.y, s.center.z, s.radius].map(|x| (x + 0.0).to_bits())));
    let hidden = all - spheres.len();
    if hidden > 0 {
        notes.push(format!(
            "{hidden} of {all} spheres coincide with an earlier one, which hides them: left out"
        ));
    }
}

/// Leaves out emitting triangles that lie exactly on an earlier one, once they are rounded to `f32` about the camera: a ray meets
/// either of the two by chance.
pub fn drop_triangles(meshes: &mut Vec<Arc<Mesh>>, origin: DVec3, notes: &mut Vec<String>) {
    let (mut seen, mut covered) = (HashSet::new(), 0);
    for mesh in meshes
        .iter_mut()
        .filter(|mesh| matches!(mesh.surface, Surface::Emission(_)))
    {
        let mut uncovered = |corners: &[u32; 3]| {
            // The sum makes one zero of the two.
            let place = |i: u32| {
                (mesh.vertices[i as usize] - origin)
                    .to_array()
                    .map(|x| (x as f32 + 0.0).to_bits())
            };
            let mut places = corners.map(place);
            places.sort_unstable();
            // Of triangles that are a single point to the rays it says nothing that they coincide.
            places[0] == places[2] || seen.insert(places)
        };
        let kept: Vec<_> = mesh.triangles.iter().copied().filter(|t| uncovered(t)).collect();
        if kept.len() < mesh.triangles.len() {
            covered += mesh.triangles.len() - kept.len();
            Arc::make_mut(mesh).triangles = kept;
        }
    }
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    if covered > 0 {
        notes.push(format!(
            "{covered} triangles that emit lie on earlier ones, which hide them: left out"
        ));
    }
}

/// Squares of lengths and the volumes of corners leave single precision beyond this, and below one over it.
const FARTHEST: f64 = 1e12;

/// Says where the scene as a whole is so large or so small that packets lose it.
pub fn note_reach(scene: &SceneBuilder, notes: &mut Vec<String>) {
    let origin = scene.camera.origin;
    let of_spheres = scene.spheres.iter().map(|s| (s.center - origin).length() + s.radius);
    let of_mesh = |mesh: &Arc<Mesh>| {
        let corners = mesh.triangles.iter().flatten();
        let reach = corners.map(|&corner| (mesh.vertices[corner as usize] - origin).length());
        reach.fold(0.0, f64::max)
    };
    let reach = of_spheres.chain(scene.meshes.iter().map(of_mesh)).fold(0.0, f64::max);
    let said = if reach > FARTHEST {
        "give lengths in a larger unit, or bring in what is so far away"
    } else if 0.0 < reach && reach < 1.0 / FARTHEST {
        "give lengths in a smaller unit"
    } else {
        return;
    };
    notes.push(format!(
        "the scene reaches {reach:.1e} from the camera; beyond {FARTHEST:e} and below {:e} single precision loses shapes: {said}",
        1.0 / FARTHEST
    ));
}

/// Says that nothing emits.
pub fn note_darkness(scene: &SceneBuilder, notes: &mut Vec<String>) {
    let spheres = scene.spheres.iter().map(|sphere| sphere.surface);
    let mut surfaces = spheres.chain(scene.meshes.iter().map(|mesh| mesh.surface));
    let sky = scene.environment.as_ref().is_some_and(Environment::emits);
    if !sky && !surfaces.any(|surface| surface.emits()) {
        notes.push("nothing in the scene emits light: the picture will be black".to_owned());
    }
}
