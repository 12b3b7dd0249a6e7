//! A scene as data that can be drawn, scaled, simplified and written as a scene file.

use std::fmt::Write as _;
use std::path::Path;

use super::lamp::Light;
use crate::film::{Attributes, Picture, PictureError, write_picture};

/// The texture that recipes use, in the folder of the scene file.
pub const TEXTURE: &str = "hunt-cloth.exr";
/// Environment maps: a small sun over a gradient, and a black one.
pub const SKIES: [&str; 2] = ["hunt-sun.exr", "hunt-black.exr"];

/// A whole scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Origin, target, up.
    pub view: [[f64; 3]; 3],
    /// Horizontal field of view in degrees.
    pub fov: f64,
    /// Lens radius and focus distance.
    pub lens: Option<[f64; 2]>,
    /// Width and height in pixels.
    pub film: [u32; 2],
    /// Materials; shapes refer to them by index.
    pub materials: Vec<Material>,
    /// Spheres and meshes.
    pub shapes: Vec<Shape>,
    /// The environment.
    pub sky: Option<Sky>,
    /// Lights without shape.
    pub lamps: Vec<Light>,
}

/// How surfaces reflect.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Reflectance of the diffuse part.
    pub diffuse: Option<[f64; 3]>,
    /// Reflectance and exponent of a Phong lobe.
    pub phong: Option<([f64; 3], f64)>,
    /// A microfacet model in place of both.
    pub rough: Option<Rough>,
    /// Reflects on the front side only.
    pub one_sided: bool,
    /// The material's texture, if it has one; `true` if the texture repeats.
    pub texture: Option<bool>,
}

/// A microfacet model.
#[derive(Clone, Debug, PartialEq)]
pub struct Rough {
    /// Metal or coated body.
    pub body: RoughBody,
    /// The square root of its roughness.
    pub roughness: f64,
}

/// What a microfacet model covers.
#[derive(Clone, Debug, PartialEq)]
pub enum RoughBody {
    /// Base colour and share of metal.
    Coated([f64; 3], f64),
    /// Index of refraction and extinction coefficient.
    Metal([f64; 3], [f64; 3]),
}

/// A shape with its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Its geometry.
    pub body: Body,
    /// Its emission or material.
    pub surface: Surface,
}

/// Emission or material of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// It emits this radiance.
    Emission([f64; 3]),
    /// Index of its material.
    Material(usize),
}

/// Geometry of a shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Body {
    /// A sphere.
    Sphere {
        /// Centre.
        center: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// Triangles.
    Mesh {
        /// Corners.
        vertices: Vec<[f64; 3]>,
        /// Three vertex indices each.
        faces: Vec<[u32; 3]>,
        /// Texture coordinates of the corners.
        uvs: Option<Vec<[f64; 2]>>,
        /// Whether normals are interpolated.
        smooth: bool,
    },
}

/// The environment.
#[derive(Clone, Debug, PartialEq)]
pub enum Sky {
    /// The same radiance from everywhere.
    Constant([f64; 3]),
    /// One of [`SKIES`], rotated by so many degrees.
    Picture(usize, f64),
}

impl Recipe {
    /// The scene file, with all lengths times `scale`.
    pub fn toml(&self, scale: f64) -> String {
        let scaled = |v: &[f64; 3]| v.map(|x| x * scale);
        let [origin, target, up] = &self.view;
        let [width, height] = self.film;
        let mut text = format!(
            "[camera]\norigin = {:?}\ntarget = {:?}\nup = {up:?}\nfov_x = {:?}\n",
            scaled(origin),
            scaled(target),
            self.fov
        );
        if let Some([radius, focus]) = self.lens {
            _ = writeln!(
                text,
                "lens_radius = {:?}\nfocus_distance = {:?}",
                radius * scale,
                focus * scale
            );
        }
        _ = writeln!(text, "[film]\nwidth = {width}\nheight = {height}");
        for (number, material) in self.materials.iter().enumerate() {
            text += &material.toml(number);
        }
        for shape in &self.shapes {
            text += &shape.toml(scale);
        }
        for lamp in &self.lamps {
            text += &lamp.toml(scale);
        }
        match self.sky {
            None => {}
            Some(Sky::Constant(le)) => _ = writeln!(text, "[environment]\nemission = {le:?}"),
            Some(Sky::Picture(which, turn)) => {
                _ = writeln!(text, "[environment]\nfile = {:?}\nrotate_y = {turn:?}", SKIES[which]);
            }
        }
        text
    }

    /// How many triangles and spheres there are.
    pub fn size(&self) -> usize {
        let count = |shape: &Shape| match &shape.body {
            Body::Sphere { .. } => 1,
            Body::Mesh { faces, .. } => faces.len(),
        };
        self.shapes.iter().map(count).sum()
    }
}

impl Material {
    fn toml(&self, number: usize) -> String {
        let mut text = format!("[materials.m{number}]\n");
        if let Some(rho) = self.diffuse {
            _ = writeln!(text, "diffuse = {rho:?}");
        }
        if let Some((rho, exponent)) = self.phong {
            _ = writeln!(text, "phong = {rho:?}\nexponent = {exponent:?}");
        }
        if let Some(Rough { body, roughness }) = &self.rough {
            _ = match body {
                RoughBody::Coated(base, metallic) => writeln!(text, "base_color = {base:?}\nmetallic = {metallic:?}"),
                RoughBody::Metal(eta, k) => writeln!(text, "eta = {eta:?}\nk = {k:?}"),
            };
            _ = writeln!(text, "roughness = {roughness:?}");
        }
        if self.one_sided {
            text += "one_sided = true\n";
        }
        if let Some(repeats) = self.texture {
            let wrap = if repeats { "repeat" } else { "clamp" };
            _ = writeln!(text, "texture = {TEXTURE:?}\nwrap = \"{wrap}\"");
        }
        text
    }
}

impl Shape {
    fn toml(&self, scale: f64) -> String {
        let mut text = match &self.body {
            Body::Sphere { center, radius } => {
                let center = center.map(|x| x * scale);
                format!("[[spheres]]\ncenter = {center:?}\nradius = {:?}\n", radius * scale)
            }
            Body::Mesh {
                vertices,
                faces,
                uvs,
                smooth,
            } => {
                let vertices: Vec<[f64; 3]> = vertices.iter().map(|v| v.map(|x| x * scale)).collect();
                let mut text = format!("[[meshes]]\nvertices = {vertices:?}\nfaces = {faces:?}\n");
                if let Some(uvs) = uvs {
                    _ = writeln!(text, "uvs = {uvs:?}");
                }
                if *smooth {
                    text += "normals = \"smooth\"\n";
                }
                text
            }
        };
        match self.surface {
            Surface::Emission(le) => _ = writeln!(text, "emission = {le:?}"),
            Surface::Material(number) => _ = writeln!(text, "material = \"m{number}\""),
        }
        text
    }
}

/// Writes the pictures that recipes use into a folder.
///
/// # Errors
/// Where one cannot be written.
pub fn write_pictures(folder: &Path) -> Result<(), PictureError> {
    let picture = |width: u32, height: u32, of: &dyn Fn(u32, u32) -> [f32; 3]| Picture {
        width,
        height,
        pixels: (0..width * height).map(|i| of(i % width, i / width)).collect(),
    };
    let cloth = picture(8, 8, &|x, y| {
        let wave = |k: u32| 0.5 + 0.4 * (0.8 * (x * k + y) as f32 + k as f32).sin();
        [wave(1), wave(2), wave(3)]
    });
    let sun = picture(16, 8, &|x, y| {
        let sun = if (x, y) == (5, 2) { 20.0 } else { 0.0 };
        let up = 1.0 - y as f32 / 8.0;
        [sun + 0.4 * up, sun + 0.5 * up, sun + 0.3 + 0.5 * up]
    });
    let black = picture(4, 2, &|_, _| [0.0; 3]);
    for (name, picture) in [(TEXTURE, &cloth), (SKIES[0], &sun), (SKIES[1], &black)] {
        write_picture(&folder.join(name), picture, &Attributes::default())?;
    }
    Ok(())
}
