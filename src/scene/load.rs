//! Loads a [`Scene`] from a file.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use toml::de::DeTable;

use super::error::Fault;
use super::files::{Files, Outside};
use super::materials::Materials;
use super::table::Table;
use super::{
    FilmSize, InvalidScene, RenderTable, Scene, SceneError, check, environment, light_cloud, lights, places, shapes,
    view,
};

/// Maximum size of a scene file in bytes. Larger data belongs in a mesh file, which is ten times smaller.
const LONGEST_FILE: u64 = 64 << 20;

const KEYS: &[&str] = &[
    "camera",
    "film",
    "render",
    "materials",
    "spheres",
    "light_clouds",
    "meshes",
    "boxes",
    "lights",
    "environment",
];

impl Scene {
    /// Reads a scene file and the files that it names in its folder.
    ///
    /// # Errors
    /// If a file cannot be read or is invalid; the error names the file, the line, the key, the value and a remedy.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_with(path, Outside::Refused)
    }

    /// The same; `outside` says whether files may be outside the scene's folder.
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

    /// Reads only `[film]` and `[render]` of a scene file, to estimate the work.
    ///
    /// # Errors
    /// As for [`Scene::load`], for the parts that are read.
    pub fn outline(path: &Path) -> Result<(FilmSize, RenderTable), SceneError> {
        let text = read(path).map_err(|fault| SceneError::of_file(path, fault))?;
        let text = String::from_utf8_lossy(&text);
        let look = || {
            let tree = DeTable::parse(&text).map_err(|error| syntax(&text, &error))?;
            let root = Table::root(&text, tree.get_ref(), KEYS)?;
            let (film, render) = view::film_and_render(&root)?;
            check::film(film).map_err(|error| places::fault(&error, &root))?;
            Ok((film, render))
        };
        look().map_err(|fault| SceneError::of_text(path, &text, fault))
    }

    /// Parses a scene from `text`. Mesh files are searched beside `path`, which also gives the scene its name.
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
    let files = Files::new(path, outside);
    let tree = DeTable::parse(text).map_err(|error| syntax(text, &error))?;
    let root = Table::root(text, tree.get_ref(), KEYS)?;
    let placed = |error: InvalidScene| places::fault(&error, &root);

    let help = "add [camera] with origin, target, up and fov_x";
    let no_camera = || Fault::new("the scene has no [camera]", help).at(0..0, "in this file");
    let camera = root.get("camera").ok_or_else(no_camera)?;
    let camera = view::camera(&camera.table("[camera]".to_owned(), "camera", view::CAMERA_KEYS)?)?;
    let (film, render) = view::film_and_render(&root)?;
    let mut scene = Scene::builder(camera, film);
    scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    scene.render = render;

    let materials = match root.get("materials") {
        Some(value) => Materials::read(value, &files, &mut scene)?,
        None => Materials::default(),
    };
    if let Some(value) = root.get("spheres") {
        for table in value.tables("sphere", shapes::SPHERE_KEYS)? {
            scene.sphere(shapes::sphere(&table, &materials)?);
        }
    }
    if let Some(value) = root.get("lights") {
        for table in value.tables("light", lights::KEYS)? {
            scene.light(lights::light(&table)?);
        }
    }
    if let Some(value) = root.get("light_clouds") {
        for table in value.tables("light_cloud", light_cloud::KEYS)? {
            light_cloud::add(&table, &files, &mut scene)?;
        }
    }
    // Report earlier problems before reading big files.
    check::all(&scene).map_err(placed)?;
    if let Some(value) = root.get("meshes") {
        for table in value.tables("mesh", shapes::MESH_KEYS)? {
            let (mesh, said) = shapes::mesh(&table, &materials, &files)?;
            scene.mesh(mesh);
            scene.notes.extend(said);
        }
    }
    if let Some(value) = root.get("boxes") {
        for table in value.tables("box", shapes::BOX_KEYS)? {
            scene.mesh(shapes::cuboid(&table, &materials)?);
        }
    }
    if let Some(value) = root.get("environment") {
        let table = value.table("[environment]".to_owned(), "environment", environment::KEYS)?;
        let (environment, said) = environment::environment(&table, &files)?;
        scene.environment(environment);
        scene.notes.extend(said);
    }
    scene.files = files.all_read();
    scene.build().map_err(placed)
}

/// Converts a syntax error of the TOML reader.
fn syntax(text: &str, error: &toml::de::Error) -> Fault {
    let said = error.message().lines().next().unwrap_or("unreadable");
    let help = if said.contains("duplicate") {
        "each key and each [table] may stand once; spheres, meshes and lights are lists: [[spheres]], [[meshes]], [[lights]]"
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
