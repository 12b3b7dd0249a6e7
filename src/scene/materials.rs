//! `[materials.NAME]`.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use glam::DVec3;

use super::error::Fault;
use super::files::Files;
use super::rule::ALPHA;
use super::table::Table;
use super::value::Value;
use super::{Bsdf, Material, MaterialId, SceneBuilder, Surface, Texture, Wrap, texture};

pub(super) const KEYS: &[&str] = &[
    "diffuse",
    "phong",
    "exponent",
    "brdf_params",
    "base_color",
    "metallic",
    "roughness",
    "eta",
    "k",
    "one_sided",
    "texture",
    "layer",
    "wrap",
];

const MODELS: &str = "write diffuse = [r, g, b], or phong = [r, g, b] with exponent = alpha, or both; or brdf_params = \
                      [r, g, b, alpha]; or base_color = [r, g, b] with metallic and roughness; or eta and k = [r, g, b] with \
                      roughness";

/// Keys that only some models have: the key, the models, and the key to write instead of that of another model.
const PARAMETERS: [(&str, &[&str], &str); 4] = [
    ("exponent", &["phong"], "phong"),
    ("metallic", &["base_color"], "base_color"),
    ("roughness", &["base_color", "eta"], "base_color"),
    ("k", &["eta"], "eta"),
];

/// The materials of a scene by name. Look-up is quick, because a scene may have as many materials as shapes.
#[derive(Default)]
pub(super) struct Materials<'t> {
    places: HashMap<&'t str, MaterialId>,
    textured: HashSet<MaterialId>,
}

impl<'t> Materials<'t> {
    /// Reads all of them into a scene.
    pub fn read(value: Value<'t>, files: &Files, scene: &mut SceneBuilder) -> Result<Self, Fault> {
        let mut read = Self::default();
        for (name, table) in value.named_tables("material", KEYS)? {
            let (material, said) = material(name, &table, files)?;
            scene.notes.extend(said);
            let textured = material.texture.is_some();
            let id = scene.material(material);
            read.places.insert(name, id);
            read.textured.extend(textured.then_some(id));
        }
        Ok(read)
    }

    /// The material of this name.
    pub fn find(&self, name: &str) -> Option<MaterialId> {
        self.places.get(name).copied()
    }

    /// Whether a surface has a texture.
    pub fn textured(&self, surface: Surface) -> bool {
        matches!(surface, Surface::Material(id) if self.textured.contains(&id))
    }

    /// All names in the order of the file.
    pub fn names(&self) -> Vec<&'t str> {
        let mut names: Vec<_> = self.places.keys().copied().collect();
        names.sort_by_key(|name| self.places[name]);
        names
    }
}

/// A material, and notes about its texture.
fn material(name: &str, table: &Table<'_>, files: &Files) -> Result<(Material, Vec<String>), Fault> {
    let mut models = ["diffuse", "phong", "brdf_params", "base_color", "eta"]
        .into_iter()
        .filter_map(|key| table.get(key));
    let model = models
        .next()
        .ok_or_else(|| table.fault(format!("{} says nothing of reflection", table.title), MODELS))?;
    let mut specular = None;
    if let Some(second) = models.next() {
        if second.key != "phong" || model.key != "diffuse" {
            return Err(second.fault(&format!("must not stand beside {}", model.key), MODELS));
        }
        if let Some(third) = models.next() {
            return Err(third.fault("must not stand beside diffuse", MODELS));
        }
        specular = Some(second);
    }
    for (key, of, instead) in PARAMETERS {
        let belongs = |value: &Value| of.contains(&value.key);
        if !belongs(&model)
            && !specular.as_ref().is_some_and(belongs)
            && let Some(value) = table.get(key)
        {
            let help = format!("leave the {key} out, or write `{instead}` instead of `{}`", model.key);
            return Err(value.fault(&format!("belongs to {} alone", of.join(" and ")), help));
        }
    }
    let bsdf = match model.key {
        "diffuse" => {
            let rho = model.triple()?;
            match specular {
                Some(phong) => Bsdf::Blend {
                    rho,
                    specular: phong.triple()?,
                    alpha: exponent(table)?,
                },
                None => Bsdf::Diffuse { rho },
            }
        }
        "phong" => Bsdf::Phong {
            rho: model.triple()?,
            alpha: exponent(table)?,
        },
        "base_color" => Bsdf::Ggx {
            base: model.triple()?,
            metallic: table.need("metallic", "metallic = 0.0")?.number()?,
            roughness: roughness(table)?,
        },
        "eta" => Bsdf::Conductor {
            eta: model.triple()?,
            k: table.need("k", "k = [3.983, 2.386, 1.603]")?.triple()?,
            roughness: roughness(table)?,
        },
        _ => {
            let [r, g, b, alpha] = model.numbers::<4>()?;
            let rho = DVec3::new(r, g, b);
            match alpha {
                1.0 => Bsdf::Diffuse { rho },
                alpha if ALPHA.holds(alpha) => Bsdf::Phong { rho, alpha },
                _ => return Err(model.fault(ALPHA.problem(alpha), ALPHA.help)),
            }
        }
    };
    let (texture, notes) = texture(table, files)?;
    let material = Material {
        name: name.to_owned(),
        bsdf,
        one_sided: match table.get("one_sided") {
            Some(value) => value.truth()?,
            None => false,
        },
        texture,
    };
    Ok((material, notes))
}

fn texture(table: &Table<'_>, files: &Files) -> Result<(Option<Arc<Texture>>, Vec<String>), Fault> {
    let Some(file) = table.get("texture") else {
        return match ["wrap", "layer"].into_iter().find_map(|key| table.get(key)) {
            Some(key) => Err(key.fault("belongs to a texture", "add texture = \"picture.png\", or leave it out")),
            None => Ok((None, Vec::new())),
        };
    };
    let wrap = match table.get("wrap") {
        Some(wrap) => wrap.choice(&Wrap::ALL, Wrap::name)?,
        None => Wrap::Repeat,
    };
    let layer = table.get("layer").map(|value| value.string()).transpose()?;
    let (span, label) = file.place();
    let read = texture::read(files, file.string()?, layer, wrap).map_err(|fault| fault.at(span, label))?;
    Ok((Some(Arc::new(read.0)), read.1))
}

fn roughness(table: &Table<'_>) -> Result<f64, Fault> {
    table.need("roughness", "roughness = 0.3")?.number()
}

fn exponent(table: &Table<'_>) -> Result<f64, Fault> {
    table.need("exponent", "exponent = 100.0")?.number()
}
