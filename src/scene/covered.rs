//! Removal of invisible shapes, and notes for the user about the rest.

use std::collections::HashSet;
use std::sync::Arc;

use glam::DVec3;

use super::check::Extremes;
use super::invalid::{InvalidScene, Subject, Wrong};
use super::light::Light;
use super::mesh::has_area;
use super::parts::{Environment, Material, Mesh, Sphere, Surface};
use super::{SceneBuilder, coincide};

/// Removes triangles with collinear corners.
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

/// Removes spheres that coincide with an earlier one, which hides them.
pub fn drop_spheres(spheres: &mut Vec<Sphere>, notes: &mut Vec<String>) {
    let (mut seen, all) = (HashSet::new(), spheres.len());
    // The addition turns -0 into 0.
    spheres.retain(|s| seen.insert([s.center.x, s.center.y, s.center.z, s.radius].map(|x| (x + 0.0).to_bits())));
    let hidden = all - spheres.len();
    if hidden > 0 {
        notes.push(format!(
            "{hidden} of {all} spheres coincide with an earlier one, which hides them: left out"
        ));
    }
}

/// Removes emitting triangles that coincide with an earlier one after rounding to `f32` relative to the camera: which of the
/// two a ray hits would be arbitrary.
pub fn drop_triangles(meshes: &mut Vec<Arc<Mesh>>, origin: DVec3, notes: &mut Vec<String>) {
    let (mut seen, mut covered) = (HashSet::new(), 0);
    for mesh in meshes
        .iter_mut()
        .filter(|mesh| matches!(mesh.surface, Surface::Emission(_)))
    {
        let mut uncovered = |corners: &[u32; 3]| {
            // The addition turns -0 into 0.
            let place = |i: u32| {
                (mesh.vertices[i as usize] - origin)
                    .to_array()
                    .map(|x| (x as f32 + 0.0).to_bits())
            };
            let mut places = corners.map(place);
            places.sort_unstable();
            // Triangles that collapse to a point after rounding do not count as coincident.
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

/// Removes faces that lie exactly on earlier ones which certainly hide them.
pub fn drop_twins(meshes: &mut [Arc<Mesh>], materials: &[Material], notes: &mut Vec<String>) {
    let one_sided = |surface: &Surface| matches!(*surface, Surface::Material(id) if materials[id.index()].one_sided);
    let keep = |mesh: &mut Arc<Mesh>, kept: &dyn Fn(usize) -> bool| {
        let mut numbers = 0..;
        let triangles = &mut Arc::make_mut(mesh).triangles;
        triangles.retain(|_| numbers.next().is_some_and(kept));
    };
    notes.extend(coincide::drop_twins(meshes, one_sided, keep));
}

/// Adds notes about meshes with overlapping faces in one plane, and returns their pairs. Empty meshes are removed after the
/// notes, which use the original numbers; the pairs use the final ones.
pub fn note_overlaps(meshes: &mut Vec<Arc<Mesh>>, origin: DVec3, notes: &mut Vec<String>) -> Vec<[usize; 2]> {
    let (mut pairs, all) = coincide::overlaps(meshes, origin);
    notes.extend(coincide::note_overlaps(meshes, &pairs));
    if !all {
        notes.push("too many faces lie close to each other to test all pairs of them for coincidence".to_owned());
    }
    // The final index of each mesh after empty meshes before it are removed.
    let mut places = Vec::with_capacity(meshes.len());
    let mut place = 0;
    for mesh in meshes.iter() {
        places.push(place);
        place += usize::from(!mesh.triangles.is_empty());
    }
    pairs.iter_mut().flatten().for_each(|mesh| *mesh = places[*mesh]);
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    pairs
}

/// Relative size, in terms of the farthest distance, below which single precision loses a shape. It does not depend on the unit
/// of length; textures and smooth normals of meshes fail first, at 2^-58.
const SMALLEST: f64 = 1.0 / (1_u64 << 58) as f64;

/// Adds notes about shapes so small relative to the scene that packets lose them.
pub fn note_reach(scene: &SceneBuilder, notes: &mut Vec<String>) {
    let Some((reach, smallest)) = Extremes::of(scene).map(|found| found.lengths()) else {
        return;
    };
    if smallest < SMALLEST * reach {
        notes.push(format!(
            "the scene reaches {reach:.1e} from the camera, and its smallest shape {smallest:.1e}: below {SMALLEST:.1e} of the reach \
             single precision loses textures, smooth normals and shapes: bring in what is so far away, or leave out one of the two"
        ));
    }
}

/// Adds a note if nothing emits light.
pub fn note_darkness(scene: &SceneBuilder, notes: &mut Vec<String>) {
    let spheres = scene.spheres.iter().map(|sphere| sphere.surface);
    let mut surfaces = spheres.chain(scene.meshes.iter().map(|mesh| mesh.surface));
    let sky = scene.environment.as_ref().is_some_and(Environment::emits);
    let lights = scene.lights.iter().any(Light::emits);
    if !sky && !lights && !surfaces.any(|surface| surface.emits()) {
        notes.push("nothing in the scene emits light: the picture will be black".to_owned());
    }
}

/// A reflectance above this is probably an 8-bit colour used instead of a value from 0 to 1.
const BRIGHTEST: f64 = 2.0;

/// Adds notes about materials that reflect much more than they receive.
pub fn note_colours(scene: &SceneBuilder, notes: &mut Vec<String>) {
    for material in &scene.materials {
        let largest = material.bsdf.largest();
        if largest > BRIGHTEST {
            let bytes = if largest <= 255.0 {
                ": if it is a colour from 0 to 255, divide it by 255"
            } else {
                ""
            };
            notes.push(format!(
                "material {} reflects {largest} times the light that it receives, and nothing real more than 1{bytes}",
                material.name
            ));
        }
    }
}
