//! Validation: every rule for the values of a scene, in one place.
//!
//! Messages come from [`rule`](super::rule), so that scene files and builders report the same text.

mod lengths;
mod lights;

use glam::DVec3;
use rayon::prelude::*;

pub use lengths::Extremes;

use super::invalid::{InvalidScene, Property, Subject, Wrong};
use super::parts::{Bsdf, Camera, Environment, FilmSize, Fov, LatLong, Material, Mesh, RenderTable, Surface};
use super::rule::{ETA, EXPONENT, EXTINCTION, FINITE, NOT_NEGATIVE, POSITIVE, ROUGHNESS, Rule, SHARE, VIEW_ANGLE};
use super::texture::Texture;
use super::{SceneBuilder, memory};
use crate::texels::Texels;

/// The longest side of a picture, in pixels.
pub const LONGEST_SIDE: u32 = 65536;

/// Maximum samples per pixel: far more than any picture needs, and far below the range of `u32`.
pub const MOST_SPP: u32 = 1 << 30;

/// Minimum memory of a pixel during rendering: sums of three colours in `f64`, and the output picture.
const BYTES_PER_PIXEL: u64 = 40;

/// Below this sine `up` and the view direction count as parallel, so the picture's right side is undefined.
const LEAST_SINE: f64 = 1e-9;

/// Tolerance of the length of a normal: a unit vector rounded to single precision is closer to 1.
const NORMAL_LENGTH: f64 = 1e-5;

type Checked = Result<(), Wrong>;

/// Checks the whole scene.
pub fn all(scene: &SceneBuilder) -> Result<(), InvalidScene> {
    camera(&scene.camera).map_err(|wrong| wrong.on(Subject::Camera, ""))?;
    film(scene.film)?;
    render(scene.render).map_err(|wrong| wrong.on(Subject::Render, ""))?;
    for (index, it) in scene.materials.iter().enumerate() {
        material(it).map_err(|wrong| wrong.on(Subject::Material(index), &it.name))?;
    }
    for (index, it) in scene.spheres.iter().enumerate() {
        let check = || {
            vector("center", it.center, &FINITE)?;
            number("radius", it.radius, &POSITIVE)?;
            surface(scene, it.surface, None)
        };
        check().map_err(|wrong| wrong.on(Subject::Sphere(index), ""))?;
    }
    for (index, it) in scene.meshes.iter().enumerate() {
        let check = || mesh(it).and_then(|()| surface(scene, it.surface, Some(it)));
        check().map_err(|wrong| wrong.on(Subject::Mesh(index), &it.name))?;
    }
    for (index, it) in scene.lights.iter().enumerate() {
        lights::light(it).map_err(|wrong| wrong.on(Subject::Light(index), ""))?;
    }
    let sky = scene.environment.as_ref().map_or(Ok(()), environment);
    sky.map_err(|wrong| wrong.on(Subject::Environment, ""))?;
    lengths::ratio(scene)
}

fn single(key: &'static str) -> Property {
    Property {
        key,
        ..Property::default()
    }
}

fn broken(property: Property, x: f64, rule: &Rule) -> Wrong {
    Wrong::new(rule.problem(x), rule.remedy(x)).of(property, shown(x))
}

/// Formats large and small numbers as powers of ten, integers without a point.
fn shown(x: f64) -> String {
    let shown = format!("{x:?}");
    shown.strip_suffix(".0").unwrap_or(&shown).to_owned()
}

fn shown_vector(v: DVec3) -> String {
    format!("[{}]", v.to_array().map(shown).join(", "))
}

fn number(key: &'static str, x: f64, rule: &Rule) -> Checked {
    if rule.holds(x) {
        Ok(())
    } else {
        Err(broken(single(key), x, rule))
    }
}

fn vector(key: &'static str, v: DVec3, rule: &Rule) -> Checked {
    components(single(key), &v.to_array(), rule)
}

fn components(property: Property, numbers: &[f64], rule: &Rule) -> Checked {
    match numbers.iter().position(|&x| !rule.holds(x)) {
        None => Ok(()),
        component @ Some(at) => Err(broken(Property { component, ..property }, numbers[at], rule)),
    }
}

/// Checks vectors and reports the first that breaks a rule.
fn list<const N: usize>(key: &'static str, vectors: impl Iterator<Item = [f64; N]>, rule: &Rule) -> Checked {
    for (index, numbers) in vectors.enumerate() {
        let property = Property {
            index: Some(index),
            ..single(key)
        };
        components(property, &numbers, rule)?;
    }
    Ok(())
}

fn camera(camera: &Camera) -> Checked {
    let &Camera { origin, target, up, .. } = camera;
    vector("origin", origin, &FINITE)?;
    vector("target", target, &FINITE)?;
    vector("up", up, &FINITE)?;
    match camera.fov {
        Fov::X(degrees) => number("fov_x", degrees, &VIEW_ANGLE)?,
        Fov::Y(degrees) => number("fov_y", degrees, &VIEW_ANGLE)?,
    }
    direction(origin, target, up)?;
    let Some(lens) = camera.lens else { return Ok(()) };
    number("lens_radius", lens.radius, &POSITIVE)?;
    number("focus_distance", lens.focus, &POSITIVE)
}

/// Checks that the view direction exists and that `up` is not parallel to it.
fn direction(origin: DVec3, target: DVec3, up: DVec3) -> Checked {
    let wrong = |key, v: DVec3, problem: &'static str, remedy: &'static str| {
        Err(Wrong::new(problem, remedy).of(single(key), shown_vector(v)))
    };
    if origin == target {
        let remedy = "point the camera at something: move the target";
        return wrong("target", target, "must differ from the origin", remedy);
    }
    if up == DVec3::ZERO {
        let remedy = "write a direction that points up, such as [0, 1, 0]";
        return wrong("up", up, "must not be zero", remedy);
    }
    // Scale to about 1 first: squares of single-precision values fit into f64, products of squares may not.
    let unit = |v: DVec3| (v / v.abs().max_element()).normalize();
    if unit(target - origin).cross(unit(up)).length() < LEAST_SINE {
        let remedy = if up.y == 0.0 {
            "the view goes along this direction: choose another one, such as [0, 1, 0]"
        } else {
            "the view goes along this direction: choose another one, such as [0, 0, 1]"
        };
        return wrong("up", up, "must not be parallel to the view", remedy);
    }
    Ok(())
}

/// Checks the film size.
pub fn film(film: FilmSize) -> Result<(), InvalidScene> {
    film_size(film).map_err(|wrong| wrong.on(Subject::Film, ""))
}

fn film_size(film: FilmSize) -> Checked {
    let FilmSize { width, height } = film;
    for (key, side) in [("width", width), ("height", height)] {
        if !(1..=LONGEST_SIDE).contains(&side) {
            let problem = format!("must be a whole number from 1 to {LONGEST_SIDE}");
            let wrong = Wrong::new(problem, "give the picture a size such as 768 x 512");
            return Err(wrong.of(single(key), side));
        }
    }
    let bytes = u64::from(width) * u64::from(height) * BYTES_PER_PIXEL;
    if memory::fits(bytes) {
        return Ok(());
    }
    let gib = bytes as f64 / f64::from(1 << 30);
    let problem = format!("of {width} x {height} pixels needs {gib:.1} GiB of memory, more than is free");
    let remedy = "make width and height smaller, or close other programs";
    Err(Wrong::new(problem, remedy))
}

fn render(render: RenderTable) -> Checked {
    match render.spp {
        Some(spp) if !(1..=MOST_SPP).contains(&spp) => {
            let problem = format!("must be a whole number from 1 to {MOST_SPP}");
            Err(Wrong::new(problem, "ask for a sample or more").of(single("spp"), spp))
        }
        _ => Ok(()),
    }
}

fn material(material: &Material) -> Checked {
    match material.bsdf {
        Bsdf::Diffuse { rho } => vector("diffuse", rho, &NOT_NEGATIVE)?,
        Bsdf::Phong { rho, alpha } => {
            vector("phong", rho, &NOT_NEGATIVE)?;
            number("exponent", alpha, &EXPONENT)?;
        }
        Bsdf::Blend { rho, specular, alpha } => {
            vector("diffuse", rho, &NOT_NEGATIVE)?;
            vector("phong", specular, &NOT_NEGATIVE)?;
            number("exponent", alpha, &EXPONENT)?;
        }
        Bsdf::Ggx {
            base,
            metallic,
            roughness,
        } => {
            vector("base_color", base, &NOT_NEGATIVE)?;
            number("metallic", metallic, &SHARE)?;
            number("roughness", roughness, &ROUGHNESS)?;
        }
        Bsdf::Conductor { eta, k, roughness } => {
            vector("eta", eta, &ETA)?;
            vector("k", k, &EXTINCTION)?;
            number("roughness", roughness, &ROUGHNESS)?;
        }
    }
    match material.texture.as_deref() {
        Some(&Texture {
            width,
            height,
            ref texels,
            ..
        }) => picture("texture", width, height, texels),
        None => Ok(()),
    }
}

/// Checks that a list of texels is a picture of this size with finite, nonnegative values.
fn picture(key: &'static str, width: u32, height: u32, texels: &Texels) -> Checked {
    let wrong = |problem: String, remedy| Err(Wrong::new(format!("has a {key} {problem}"), remedy));
    if width == 0 || height == 0 {
        return wrong(
            "without texels".to_owned(),
            "a picture has at least one row and one column",
        );
    }
    if width as usize * height as usize != texels.len() {
        let count = texels.len();
        let remedy = "list the texels row by row from the top, none more and none less";
        return wrong(
            format!("of {width} x {height} texels and {count} values for them"),
            remedy,
        );
    }
    let sound = |at: usize| texels.at(at).iter().all(|x| x.is_finite() && *x >= 0.0);
    match (0..texels.len()).into_par_iter().position_first(|at| !sound(at)) {
        None => Ok(()),
        Some(at) => {
            let (x, y, [r, g, b]) = (at % width as usize, at / width as usize, texels.at(at));
            let remedy = "every texel must be finite and not negative: mend the picture";
            wrong(format!("with [{r}, {g}, {b}] at ({x}, {y})"), remedy)
        }
    }
}

/// Checks the surface of a sphere or of a mesh: its material must exist, and a mesh with a texture needs texture coordinates.
fn surface(scene: &SceneBuilder, surface: Surface, mesh: Option<&Mesh>) -> Checked {
    let id = match surface {
        Surface::Emission(radiance) => return vector("emission", radiance, &NOT_NEGATIVE),
        Surface::Material(id) => id,
    };
    let Some(material) = scene.materials.get(id.index()) else {
        let remedy = "take the handle that `material` of the same builder returned";
        let wrong = Wrong::new("must be a material of this scene", remedy);
        let count = scene.materials.len();
        return Err(wrong.of(single("material"), format!("number {} of {count}", id.index() + 1)));
    };
    // Spheres have coordinates by longitude and latitude.
    if material.texture.is_none() || mesh.is_none_or(|mesh| mesh.uvs.is_some()) {
        return Ok(());
    }
    let remedy = "add uvs = [[0, 0], ...], one for each vertex; of files .obj (vt), .ply (s, t or u, v) and glTF (TEXCOORD_0) bring them";
    Err(Wrong::new(
        "has a material with a texture, and no texture coordinates",
        remedy,
    ))
}

fn mesh(mesh: &Mesh) -> Checked {
    let count = mesh.vertices.len();
    list("vertices", mesh.vertices.iter().map(DVec3::to_array), &FINITE)?;
    for (index, corners) in mesh.triangles.iter().enumerate() {
        if let Some(component) = corners.iter().position(|&corner| corner as usize >= count) {
            let property = Property {
                key: "triangles",
                index: Some(index),
                component: Some(component),
            };
            let wrong = Wrong::new(
                format!("must have corners among the {count} vertices"),
                "vertices are counted from 0",
            );
            return Err(wrong.of(property, corners[component]));
        }
    }
    if let Some(uvs) = &mesh.uvs {
        as_many("uvs", "pairs", uvs.len(), count)?;
        list("uvs", uvs.iter().map(|uv| uv.to_array()), &FINITE)?;
    }
    let Some(normals) = &mesh.normals else {
        return terminator_without_normals(mesh.smooth_terminator);
    };
    as_many("normals", "vectors", normals.len(), count)?;
    list("normals", normals.iter().map(DVec3::to_array), &FINITE)?;
    match normals.iter().position(|n| (n.length() - 1.0).abs() > NORMAL_LENGTH) {
        None => Ok(()),
        index @ Some(at) => {
            let property = Property {
                index,
                ..single("normals")
            };
            let wrong = Wrong::new(
                "must have length 1",
                "`Mesh::smooth` makes unit normals of those that there are",
            );
            Err(wrong.of(property, shown_vector(normals[at])))
        }
    }
}

fn terminator_without_normals(smooth: bool) -> Checked {
    if !smooth {
        return Ok(());
    }
    let remedy = "`Mesh::smooth` gives the mesh normals; or leave it out: a flat mesh is lit as it is";
    Err(Wrong::new("belongs to smooth normals", remedy).of(single("shadow_terminator"), "\"smooth\""))
}

fn as_many(key: &'static str, what: &str, found: usize, count: usize) -> Checked {
    if found == count {
        return Ok(());
    }
    let problem = format!("must have as many {what} as there are vertices, {count}");
    let remedy = match key {
        "uvs" => "write a pair for each vertex, such as [[0, 0], [1, 0], [1, 1]]",
        _ => "give a normal for each vertex",
    };
    Err(Wrong::new(problem, remedy).of(single(key), found))
}

fn environment(environment: &Environment) -> Checked {
    match environment {
        Environment::Constant(radiance) => vector("emission", *radiance, &NOT_NEGATIVE),
        Environment::Picture(sky) => {
            let LatLong {
                width,
                height,
                texels,
                to_scene,
            } = sky;
            picture("picture", *width, *height, texels)?;
            let away = (to_scene.transpose() * *to_scene - glam::DMat3::IDENTITY).to_cols_array();
            if away.iter().all(|x| x.abs() <= NORMAL_LENGTH) && to_scene.determinant() > 0.0 {
                return Ok(());
            }
            let remedy = "a rotation has three columns of length 1 at right angles, and no mirror";
            Err(Wrong::new("must be turned by a rotation", remedy))
        }
    }
}
