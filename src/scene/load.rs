//! From a file to a [`Scene`].

use std::collections::HashSet;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::DVec3;
use toml::de::DeTable;

use super::error::Fault;
use super::files::{Files, Outside};
use super::materials::Materials;
use super::table::Table;
use super::{
    Environment, FilmSize, Material, Mesh, RenderTable, Scene, SceneError, Sphere, Surface, coincide, environment,
    materials, shapes, view,
};

/// The longest scene file, in bytes. What needs more belongs into a mesh file, which takes a tenth of the room.
const LONGEST_FILE: u64 = 64 << 20;

const KEYS: &[&str] = &[
    "camera",
    "film",
    "render",
    "materials",
    "spheres",
    "meshes",
    "environment",
];

impl Scene {
    /// Reads a scene file and the files in its folder that it names.
    ///
    /// # Errors
    /// If a file cannot be read, or says something that a scene cannot be; the error names the file, the line, the
    /// key, the value and what would do.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_with(path, Outside::Refused)
    }

    /// The same; `outside` says whether the files may lie outside of the scene's folder.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn load_with(path: &Path, outside: Outside) -> Result<Self, SceneError> {
        let text = read(path).map_err(|fault| SceneError::of_file(path, fault))?;
        let text = String::from_utf8(text).map_err(|error| {
            let good = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(&error.as_bytes()[..good]).into_owned();
            let fault = Fault::new(
                "the text is not UTF-8",
                "save the scene as plain text in UTF-8; meshes go into .ply files",
            );
            SceneError::of_text(path, &text, fault.at(good..good, "the last place that can be read"))
        })?;
        parse(&text, path, outside)
    }

    /// Reads only `[film]` and `[render]` of a scene file: how much work it will be.
    ///
    /// # Errors
    /// As for [`Scene::load`], as far as it looks.
    pub fn outline(path: &Path) -> Result<(FilmSize, RenderTable), SceneError> {
        let text = read(path).map_err(|fault| SceneError::of_file(path, fault))?;
        let text = String::from_utf8_lossy(&text);
        let look = || {
            let tree = DeTable::parse(&text).map_err(|error| syntax(&text, &error))?;
            view::film_and_render(&Table::root(&text, tree.get_ref(), KEYS)?)
        };
        look().map_err(|fault| SceneError::of_text(path, &text, fault))
    }

    /// Makes a scene of `text`. Mesh files are looked for beside `path`, which also gives the scene its name.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, SceneError> {
        parse(text, path, Outside::Refused)
    }
}

fn parse(text: &str, path: &Path, outside: Outside) -> Result<Scene, SceneError> {
    scene(text, path, outside).map_err(|fault| SceneError::of_text(path, text, fault))
}

fn read(path: &Path) -> Result<Vec<u8>, Fault> {
    let unreadable = |error: std::io::Error| {
        Fault::new(
            format!("cannot read the scene file: {error}"),
            "check the name, and that the file may be read",
        )
    };
    let mut bytes = Vec::new();
    File::open(path)
        .map_err(unreadable)?
        .take(LONGEST_FILE + 1)
        .read_to_end(&mut bytes)
        .map_err(unreadable)?;
    if bytes.len() as u64 > LONGEST_FILE {
        let what = format!("the scene file is larger than {} MiB", LONGEST_FILE >> 20);
        return Err(Fault::new(
            what,
            "put the meshes into .ply files and name them with file = \"...\"",
        ));
    }
    Ok(bytes)
}

fn scene(text: &str, path: &Path, outside: Outside) -> Result<Scene, Fault> {
    let files = Files::new(path, text, outside);
    let tree = DeTable::parse(text).map_err(|error| syntax(text, &error))?;
    let root = Table::root(text, tree.get_ref(), KEYS)?;

    let missing = |what: &str, help: &str| Fault::new(what, help).at(0..0, "in this file");
    let no_camera = || {
        missing(
            "the scene has no [camera]",
            "add [camera] with origin, target, up and fov_x",
        )
    };
    let camera = root.get("camera").ok_or_else(no_camera)?;
    let camera = view::camera(&camera.table("[camera]".to_owned(), "camera", view::CAMERA_KEYS)?)?;
    let (film, render) = view::film_and_render(&root)?;

    let mut materials = Vec::new();
    if let Some(value) = root.get("materials") {
        for (name, table) in value.named_tables("material", materials::KEYS)? {
            materials.push(materials::material(name, &table, &files)?);
        }
    }
    let named = Materials::new(&materials);
    let mut spheres = Vec::new();
    if let Some(value) = root.get("spheres") {
        for table in value.tables("sphere", shapes::SPHERE_KEYS)? {
            spheres.push(shapes::sphere(&table, &named)?);
        }
    }
    let mut notes: Vec<String> = drop_hidden(&mut spheres).into_iter().collect();
    notes.extend(coincide::drop_close(&mut spheres, camera.origin));
    let mut meshes = Vec::new();
    if let Some(value) = root.get("meshes") {
        for table in value.tables("mesh", shapes::MESH_KEYS)? {
            let (mesh, said) = shapes::mesh(&table, &named, &files)?;
            meshes.push(mesh);
            notes.extend(said);
        }
    }

    notes.extend(drop_covered(&mut meshes, camera.origin));
    notes.extend(coincident(&mut meshes, &materials, camera.origin));
    let environment = match root.get("environment") {
        Some(value) => {
            let table = value.table("[environment]".to_owned(), "environment", environment::KEYS)?;
            Some(environment::environment(&table, &files)?)
        }
        None => None,
    };
    notes.extend(out_of_range(&spheres, &meshes, camera.origin));
    let sky_emits = environment.as_ref().is_some_and(Environment::emits);

    let mut surfaces = spheres
        .iter()
        .map(|s| s.surface)
        .chain(meshes.iter().map(|m: &Mesh| m.surface));
    if !sky_emits && !surfaces.any(|s| matches!(s, Surface::Emission(le) if le.max_element() > 0.0)) {
        notes.push("nothing in the scene emits light: the picture will be black".to_owned());
    }

    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(Scene {
        name,
        path: path.to_owned(),
        hash: files.digest(),
        camera,
        film,
        render,
        materials,
        spheres,
        meshes,
        environment,
        notes,
    })
}

/// Leaves out faces that others hide for certain, and says which meshes have faces that others may hide.
fn coincident(meshes: &mut Vec<Mesh>, materials: &[Material], origin: DVec3) -> Vec<String> {
    let one_sided = |surface: &Surface| matches!(*surface, Surface::Material(i) if materials[i].one_sided);
    let keep = |mesh: &mut Mesh, kept: &dyn Fn(usize) -> bool| {
        let mut numbers = 0..;
        mesh.triangles.retain(|_| numbers.next().is_some_and(kept));
    };
    let mut notes: Vec<String> = coincide::drop_twins(meshes, one_sided, keep).into_iter().collect();
    let (pairs, all) = coincide::overlaps(meshes, origin);
    notes.extend(coincide::note_overlaps(meshes, &pairs));
    if !all {
        notes.push("there are too many faces beside each other to ask all of them whether they coincide".to_owned());
    }
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    notes
}

/// Leaves out spheres that coincide with an earlier one, which hides them; returns a sentence if there are any.
fn drop_hidden(spheres: &mut Vec<Sphere>) -> Option<String> {
    let (mut seen, all) = (HashSet::new(), spheres.len());
    // The sum makes one zero of the two.
    spheres.retain(|s| seen.insert([s.center.x, s.center.y, s.center.z, s.radius].map(|x| (x + 0.0).to_bits())));
    let hidden = all - spheres.len();
    (hidden > 0).then(|| format!("{hidden} of {all} spheres coincide with an earlier one, which hides them: left out"))
}

/// Leaves out emitting triangles that lie exactly on an earlier one, once they are rounded to `f32` about the camera: a ray meets
/// either of the two by chance. Returns a sentence if there are any.
fn drop_covered(meshes: &mut Vec<Mesh>, origin: DVec3) -> Option<String> {
    let (mut seen, mut covered) = (HashSet::new(), 0);
    let emitting = |mesh: &&mut Mesh| matches!(mesh.surface, Surface::Emission(_));
    for mesh in meshes.iter_mut().filter(emitting) {
        let (vertices, all) = (&mesh.vertices, mesh.triangles.len());
        mesh.triangles.retain(|corners| {
            // The sum makes one zero of the two.
            let place = |i: u32| {
                (vertices[i as usize] - origin)
                    .to_array()
                    .map(|x| (x as f32 + 0.0).to_bits())
            };
            let mut places = corners.map(place);
            places.sort_unstable();
            // Of triangles that are a single point to the rays it says nothing that they coincide.
            places[0] == places[2] || seen.insert(places)
        });
        covered += all - mesh.triangles.len();
    }
    meshes.retain(|mesh| !mesh.triangles.is_empty());
    (covered > 0).then(|| format!("{covered} triangles that emit lie on earlier ones, which hide them: left out"))
}

/// Shapes that are smaller than this part of the farthest distance are lost to single precision, whatever the unit of length: of
/// meshes textures and smooth normals first, 2^-58.
const SMALLEST: f64 = 1.0 / (1_u64 << 58) as f64;

/// A sentence where a shape is so small beside the scene that packets lose it.
fn out_of_range(spheres: &[Sphere], meshes: &[Mesh], origin: DVec3) -> Option<String> {
    let corners = |mesh: &Mesh, t: &[u32; 3]| t.map(|i| mesh.vertices[i as usize] - origin);
    let of_spheres = spheres
        .iter()
        .map(|s| ((s.center - origin).length() + s.radius, 2.0 * s.radius));
    let of_meshes = meshes.iter().map(|mesh| {
        let faces = mesh.triangles.iter().map(|t| corners(mesh, t));
        faces.fold((0.0_f64, 0.0_f64), |(reach, size), [a, b, c]| {
            let side = (a.max(b).max(c) - a.min(b).min(c)).max_element();
            (reach.max(a.length()).max(b.length()).max(c.length()), size.max(side))
        })
    });
    let (reach, smallest) = of_spheres
        .chain(of_meshes)
        .fold((0.0_f64, f64::INFINITY), |(reach, smallest), (r, s)| {
            (reach.max(r), smallest.min(s))
        });
    (smallest < SMALLEST * reach).then(|| {
        format!(
            "the scene reaches {reach:.1e} from the camera, and its smallest shape {smallest:.1e}: below {SMALLEST:.1e} of the reach \
             single precision loses textures, smooth normals and shapes: bring in what is so far away, or leave out one of the two"
        )
    })
}

/// What the TOML reader says, in our form.
fn syntax(text: &str, error: &toml::de::Error) -> Fault {
    let said = error.message().lines().next().unwrap_or("unreadable");
    let help = if said.contains("duplicate") {
        "each key and each [table] may stand once; spheres and meshes are lists: [[spheres]], [[meshes]]"
    } else {
        "in TOML a table begins with [camera], a key with `radius = `, names stand in quotes, lists in [brackets]"
    };
    let span = error.span().unwrap_or(text.len()..text.len());
    let got = match text.get(span.clone()).map(str::trim) {
        Some(got) if !got.is_empty() && got.len() <= 60 => format!(", got `{got}`"),
        _ => String::new(),
    };
    Fault::new(format!("not valid TOML: {said}{got}"), help).at(span, "here")
}
