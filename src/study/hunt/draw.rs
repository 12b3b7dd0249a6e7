//! Random recipes: ordinary scenes whose means can be compared, and wild ones over many orders of magnitude.

mod lamps;
mod late;

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::recipe::{Body, Material, Recipe, SKIES, Shape, Sky, Surface};

/// The kind of scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Typical sizes, exponents and radiances: every effect, and noise small enough that a few hundred samples separate it from
    /// a fault.
    Ordinary,
    /// Sizes, places and radiances over many orders of magnitude; lights that touch, enclose or overlap; exponents from just
    /// above 1 to a million. The noise is too large to compare means, but the picture must be finite and the same at all
    /// widths.
    Wild,
}

/// The recipe with a number. Neighbouring numbers and seeds are unrelated.
pub fn recipe(kind: Kind, seed: u64, number: u64) -> Recipe {
    // Two words per stream; `seed_from_u64` mixes them (SplitMix64).
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number));
    match kind {
        Kind::Ordinary => ordinary(&mut Draw(&mut rng)),
        Kind::Wild => wild(&mut Draw(&mut rng)),
    }
}

struct Draw<'a>(&'a mut Pcg64);

impl Draw<'_> {
    fn chance(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    fn power(&mut self, low: f64, high: f64) -> f64 {
        10.0_f64.powf(self.between(low, high))
    }

    fn count(&mut self, low: usize, high: usize) -> usize {
        self.0.random_range(low..=high)
    }

    /// An index drawn with the given weights.
    fn pick(&mut self, weights: &[u32]) -> usize {
        let mut left = self.0.random_range(0..weights.iter().sum::<u32>());
        let chosen = weights.iter().position(|&weight| {
            let here = left < weight;
            left = left.saturating_sub(weight);
            here
        });
        chosen.unwrap_or(0)
    }

    fn each(&mut self, mut of: impl FnMut(&mut Self) -> f64) -> [f64; 3] {
        [of(self), of(self), of(self)]
    }

    fn place(&mut self, size: f64) -> [f64; 3] {
        self.each(|draw| draw.between(-size, size))
    }

    /// Log-uniform between 10^`low` and 10^`high` with random sign; or 0.
    fn magnitude(&mut self, low: f64, high: f64) -> f64 {
        let sign = if self.chance(0.5) { 1.0 } else { -1.0 };
        if self.chance(1.0 / 9.0) {
            0.0
        } else {
            sign * self.power(low, high)
        }
    }

    fn wild_place(&mut self) -> [f64; 3] {
        match self.pick(&[3, 1, 1]) {
            0 => self.place(2.0),
            1 => self.each(|draw| draw.magnitude(-6.0, 3.0)),
            _ => self.each(|draw| draw.between(-2.5, 2.5).round()),
        }
    }

    fn wild_colour(&mut self, low: f64, high: f64) -> [f64; 3] {
        match self.pick(&[6, 2, 1]) {
            0 => [self.power(low, high); 3],
            1 => self.each(|draw| draw.power(low, high)),
            _ => [0.0, 1.0, 0.0],
        }
    }
}

/// A few shapes about the origin, most with a floor, seen from a few lengths away.
fn ordinary(draw: &mut Draw<'_>) -> Recipe {
    let materials: Vec<Material> = (0..3).map(|_| material(draw)).collect();
    let mut shapes = Vec::new();
    if draw.chance(0.8) {
        let half = draw.power(0.5, 1.5);
        shapes.push(reflects(draw, floor(half, -1.0)));
    }
    for _ in 0..draw.count(1, 4) {
        let body = body(draw);
        shapes.push(reflects(draw, body));
    }
    let sky = match draw.pick(&[5, 2, 2, 1]) {
        0 => None,
        1 => Some(Sky::Constant(draw.each(|draw| draw.between(0.1, 1.0)))),
        2 => Some(Sky::Picture(0, draw.between(0.0, 360.0))),
        _ => Some(Sky::Picture(1, 0.0)),
    };
    let lamps = draw.count(
        usize::from(!matches!(sky, Some(Sky::Constant(_) | Sky::Picture(0, _)))),
        3,
    );
    for _ in 0..lamps {
        shapes.push(lamp(draw));
    }
    let turn = draw.between(0.0, TAU);
    let away = draw.between(4.0, 7.0);
    let origin = [away * turn.cos(), draw.between(0.3, 3.0), away * turn.sin()];
    let mut recipe = Recipe {
        view: [origin, draw.place(0.4), [0.1, 1.0, 0.05]],
        fov: draw.between(25.0, 60.0),
        lens: draw
            .chance(0.15)
            .then(|| [draw.between(0.02, 0.3), draw.between(3.0, 7.0)]),
        film: [draw.count(5, 12) as u32, draw.count(4, 9) as u32],
        materials: textured_where_it_can_be(materials, &mut shapes),
        shapes,
        sky,
        lamps: match draw.pick(&[3, 1, 1]) {
            0 => Vec::new(),
            count => (0..count).map(|_| lamps::delta(draw)).collect(),
        },
    };
    late::ordinary(draw, &mut recipe);
    recipe
}

fn reflects(draw: &mut Draw<'_>, body: Body) -> Shape {
    Shape {
        body,
        surface: Surface::Material(draw.count(0, 2)),
    }
}

fn material(draw: &mut Draw<'_>) -> Material {
    let rho = draw.each(|draw| draw.between(0.1, 0.9));
    let exponent = draw.power(0.3, 3.0);
    let (diffuse, phong) = match draw.pick(&[4, 3, 2]) {
        0 => (Some(rho), None),
        1 => (None, Some((rho, exponent))),
        _ => (Some(rho.map(|x| 0.5 * x)), Some((rho.map(|x| 0.5 * x), exponent))),
    };
    Material {
        diffuse,
        phong,
        rough: None,
        one_sided: draw.chance(0.15),
        texture: draw.chance(0.3).then(|| draw.chance(0.7)),
    }
}

/// Only meshes with texture coordinates can have a texture: other shapes get a copy of their material without it.
fn textured_where_it_can_be(mut materials: Vec<Material>, shapes: &mut [Shape]) -> Vec<Material> {
    let plain: Vec<Material> = materials
        .iter()
        .map(|m| Material {
            texture: None,
            ..m.clone()
        })
        .collect();
    let count = materials.len();
    for shape in shapes {
        let mapped = matches!(shape.body, Body::Mesh { uvs: Some(_), .. });
        if let Surface::Material(number) = &mut shape.surface
            && materials[*number].texture.is_some()
            && !mapped
        {
            *number += count;
        }
    }
    materials.extend(plain);
    materials
}

fn floor(half: f64, height: f64) -> Body {
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
    Body::Mesh {
        vertices: corners.map(|[x, z]| [half * x, height, half * z]).to_vec(),
        faces: vec![[0, 1, 2], [0, 2, 3]],
        uvs: Some(corners.map(|[x, z]| [0.5 * half * x, 0.5 * half * z]).to_vec()),
        smooth: false,
    }
}

fn body(draw: &mut Draw<'_>) -> Body {
    match draw.pick(&[3, 2, 2, 1]) {
        0 => Body::Sphere {
            center: draw.place(1.5),
            radius: draw.power(-1.0, 0.0),
        },
        1 => {
            let corners: Vec<[f64; 3]> = (0..4).map(|_| draw.place(1.5)).collect();
            Body::Mesh {
                vertices: corners,
                faces: vec![[0, 1, 2], [0, 2, 3]],
                uvs: draw
                    .chance(0.5)
                    .then(|| vec![[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 1.0]]),
                smooth: draw.chance(0.4),
            }
        }
        2 => bump(draw),
        _ => chest(draw),
    }
}

/// A wavy grid mesh of many small triangles, smooth or not.
fn bump(draw: &mut Draw<'_>) -> Body {
    let (across, size, center) = (draw.count(3, 9), draw.between(0.4, 1.2), draw.place(1.0));
    let (high, waves) = (draw.between(0.0, 0.4), draw.between(1.0, 4.0));
    let side = across + 1;
    let at = |k: usize| k as f64 / across as f64;
    let test_point = |i: usize| [at(i % side), at(i / side)];
    let vertices = (0..side * side).map(|i| {
        let [u, v] = test_point(i);
        let y = high * (waves * (u + 0.3)).sin() * (waves * (v + 0.1)).cos();
        let local = [size * (u - 0.5), size * y, size * (v - 0.5)];
        std::array::from_fn(|k| center[k] + local[k])
    });
    let corner = |x: usize, y: usize| (y * side + x) as u32;
    let faces = (0..across * across).flat_map(|i| {
        let (x, y) = (i % across, i / across);
        let quad = [corner(x, y), corner(x, y + 1), corner(x + 1, y + 1), corner(x + 1, y)];
        [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
    });
    Body::Mesh {
        vertices: vertices.collect(),
        faces: faces.collect(),
        uvs: draw.chance(0.5).then(|| (0..side * side).map(test_point).collect()),
        smooth: draw.chance(0.6),
    }
}

/// An axis-aligned box: it has faces parallel to rays, and shared edges.
fn chest(draw: &mut Draw<'_>) -> Body {
    let (low, size) = (draw.place(1.0), draw.each(|draw| draw.between(0.1, 1.0)));
    let corner = |i: usize| std::array::from_fn(|k| low[k] + if i >> k & 1 == 1 { size[k] } else { 0.0 });
    let quads = [
        [0, 1, 3, 2],
        [4, 6, 7, 5],
        [0, 4, 5, 1],
        [2, 3, 7, 6],
        [0, 2, 6, 4],
        [1, 5, 7, 3],
    ];
    Body::Mesh {
        vertices: (0..8).map(corner).collect(),
        faces: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        uvs: None,
        smooth: false,
    }
}

fn lamp(draw: &mut Draw<'_>) -> Shape {
    let (center, size) = (draw.place(2.0), draw.power(-0.8, 0.0));
    let center = [center[0], center[1] + 2.0, center[2]];
    let body = match draw.pick(&[4, 2, 1]) {
        0 => Body::Sphere { center, radius: size },
        1 => {
            let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
            Body::Mesh {
                vertices: corners
                    .map(|[x, z]| [center[0] + size * x, center[1], center[2] + size * z])
                    .to_vec(),
                faces: vec![[0, 1, 2], [0, 2, 3]],
                uvs: None,
                smooth: false,
            }
        }
        // More than four triangles, so light sampling picks one per point.
        _ => bump(draw),
    };
    let bright = draw.power(0.0, 1.2);
    Shape {
        body,
        surface: Surface::Emission(draw.each(|draw| bright * draw.between(0.5, 1.0))),
    }
}

fn wild(draw: &mut Draw<'_>) -> Recipe {
    let exponent = match draw.pick(&[1, 1, 1]) {
        0 => draw.power(1e-7, 6.0),
        1 => 1e6,
        _ => 1.0 + 1e-9,
    };
    let rho = draw.wild_colour(-3.0, 0.0);
    let plain = Material {
        diffuse: Some(rho),
        phong: None,
        rough: None,
        one_sided: draw.chance(0.1),
        texture: None,
    };
    let phong = Material {
        diffuse: draw.chance(0.2).then_some(rho),
        phong: Some((rho, exponent)),
        ..plain.clone()
    };
    let mut shapes = Vec::new();
    if draw.chance(0.5) {
        shapes.push(Shape {
            body: floor(9.0, -1.0),
            surface: Surface::Material(1),
        });
    }
    for _ in 0..draw.count(1, 4) {
        let radius = match draw.pick(&[1, 1, 1]) {
            0 => draw.power(-7.0, 2.0),
            1 => 1.0,
            _ => 1000.0,
        };
        let center = draw.wild_place();
        let surface = match draw.pick(&[2, 1, 1]) {
            0 => Surface::Emission(draw.wild_colour(-20.0, 20.0)),
            other => Surface::Material(other - 1),
        };
        let body = Body::Sphere { center, radius };
        shapes.push(Shape { body, surface });
    }
    for _ in 0..draw.count(0, 2) {
        let surface = match draw.pick(&[8, 8, 1]) {
            2 => Surface::Emission(draw.wild_colour(-3.0, 3.0)),
            material => Surface::Material(material),
        };
        let body = Body::Mesh {
            vertices: (0..4).map(|_| draw.wild_place()).collect(),
            faces: vec![[0, 1, 2], [0, 2, 3]],
            uvs: None,
            smooth: draw.chance(0.5),
        };
        shapes.push(Shape { body, surface });
    }
    let mut recipe = Recipe {
        // The camera is on no surface: there every ray would start in a tie.
        view: [draw.place(2.0), draw.wild_place(), draw.wild_place()],
        fov: if draw.chance(0.5) {
            40.0
        } else {
            draw.between(1e-3, 170.0)
        },
        lens: draw.chance(0.1).then(|| [draw.power(-3.0, 0.0), draw.power(-1.0, 1.0)]),
        film: [5, 3],
        materials: vec![plain, phong],
        shapes,
        sky: match draw.pick(&[6, 1, 1, 1]) {
            0 => None,
            1 => Some(Sky::Constant(draw.wild_colour(-20.0, 20.0))),
            which => Some(Sky::Picture((which - 2) % SKIES.len(), 30.0)),
        },
        lamps: match draw.pick(&[3, 1, 1]) {
            0 => Vec::new(),
            count => (0..count).map(|_| lamps::wild_delta(draw)).collect(),
        },
    };
    late::wild(draw, &mut recipe);
    recipe
}
