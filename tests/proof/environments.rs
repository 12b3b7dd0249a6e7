//! Pictures that surround a scene: directions, densities and radiance against the same picture in `f64`.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DMat3, DVec3};
use octolux::lane::{Bits, Lane, Mask};
use octolux::light::environment::{EnvironmentLight, LatLong};
use octolux::sampling::PassBlock;
use octolux::scene::{SamplerKind, Texels};

use super::Family;
use super::places::{narrow, wide};
use super::stats::chi_square;

/// Columns and rows: an odd number of rows has one across the horizon.
const SIZES: [(usize, usize); 3] = [(1, 1), (5, 3), (12, 6)];

/// A quarter of a texel is a cell: half of its width and half of its solid angle.
const PARTS: usize = 4;

/// Texels from 0.1 to 6.1 with a sun of 400 in the last row but one; in the largest picture the top three rows are black.
fn texels(width: usize, height: usize) -> Vec<[f32; 3]> {
    let value = |index: usize| match (index / width, index % width) {
        (row, _) if height > 5 && row < 3 => 0.0,
        (row, 2) if row + 2 == height => 400.0,
        _ => 0.1 + (index * 7 % 13) as f32 / 2.0,
    };
    let colour = |x: f32| [x, 0.5 * x, 0.25 * x];
    (0..width * height).map(|index| colour(value(index))).collect()
}

struct Sky {
    width: usize,
    height: usize,
    texels: Vec<[f32; 3]>,
    to_scene: DMat3,
}

impl Sky {
    /// Columns and rows of a direction, from the top left corner.
    fn place(&self, wi: DVec3) -> (f64, f64) {
        let local = self.to_scene.transpose() * wi.normalize();
        let turn = (local.x.atan2(-local.z) / TAU + 0.5) * self.width as f64;
        (turn, local.y.clamp(-1.0, 1.0).acos() / PI * self.height as f64)
    }

    /// Radiance between the centres of texels.
    fn at(&self, x: f64, y: f64) -> DVec3 {
        let texel = |column: f64, row: f64| {
            let column = (column as i64).rem_euclid(self.width as i64) as usize;
            let row = (row as i64).clamp(0, self.height as i64 - 1) as usize;
            wide(self.texels[row * self.width + column])
        };
        let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
        let row = |y: f64| texel(left, y).lerp(texel(left + 1.0, y), x - 0.5 - left);
        row(top).lerp(row(top + 1.0), y - 0.5 - top)
    }

    fn cosine(&self, row: f64) -> f64 {
        (PI * row / self.height as f64).cos()
    }

    fn solid_angle(&self, row: usize) -> f64 {
        TAU / self.width as f64 * (self.cosine(row as f64) - self.cosine(row as f64 + 1.0))
    }

    /// With which chance each texel is drawn. The middles of its quarters are enough for a mean of what is linear in each.
    fn chances(&self) -> Vec<f64> {
        let luminance = DVec3::new(0.2126, 0.7152, 0.0722);
        let weight = |index: usize| {
            let (row, column) = (index / self.width, index % self.width);
            let middles = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
            let of = middles.map(|(x, y)| self.at(column as f64 + x, row as f64 + y).dot(luminance));
            of.iter().sum::<f64>() / 4.0 * self.solid_angle(row)
        };
        let weights: Vec<f64> = (0..self.width * self.height).map(weight).collect();
        let total: f64 = weights.iter().sum();
        weights.iter().map(|weight| weight / total).collect()
    }
}

/// Adds a test for each picture: `draws` directions in quarters of texels. Of each direction the density and the radiance must be
/// those of the picture.
pub fn directions<L: Lane>(family: &mut Family, seed: u32, draws: u32) {
    for (i, (width, height)) in SIZES.into_iter().enumerate() {
        let to_scene = DMat3::from_rotation_z(0.4) * DMat3::from_rotation_x(-1.1) * DMat3::from_rotation_y(2.0);
        let texels = texels(width, height);
        let axes = to_scene.to_cols_array_2d().map(|axis| axis.map(|x| x as f32));
        let light = LatLong::new(width, height, Arc::new(Texels::Single(texels.clone())), axes)
            .expect("a picture with light in it");
        let sky = Sky {
            width,
            height,
            texels,
            to_scene,
        };
        let chances = sky.chances();
        let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, 20);
        let mut counts = vec![0.0; chances.len() * PARTS];
        for first in (0..draws).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let pair = numbers.pair(numbers.key(pixel), L::Bits::splat(0), i as u32);
            let all = L::Mask::splat(true);
            let drawn = light.draw::<L>(narrow(DVec3::Z), pair, all);
            let (le, inverse) = light.meet(drawn, all);
            for lane in all.lanes() {
                let wi = wide(drawn.lane(lane));
                let (x, y) = sky.place(wi);
                let (column, row) = ((x as usize).min(width - 1), (y as usize).min(height - 1));
                let texel = row * width + column;
                let lower = (sky.to_scene.transpose() * wi.normalize()).y
                    < (sky.cosine(row as f64) + sky.cosine(row as f64 + 1.0)) / 2.0;
                counts[PARTS * texel + 2 * usize::from(lower) + usize::from(x.fract() > 0.5)] += 1.0;

                let exact = sky.at(x, y);
                let difference = (wide(le.lane(lane)) - exact).abs().max_element();
                assert!(
                    difference < 2e-3,
                    "{width} x {height}: radiance {exact} at ({x}, {y}), off by {difference:e}"
                );
                // By single precision a direction at an edge may be on its other side.
                let at_edge = |place: f64| (place - place.round()).abs() < 1e-4;
                if !at_edge(x) && !at_edge(y) {
                    let density = chances[texel] / sky.solid_angle(row);
                    let off = f64::from(inverse.lane(lane)) * density - 1.0;
                    assert!(
                        off.abs() < 1e-5,
                        "{width} x {height}: density {density:e} at ({x}, {y}), off by {off:e}"
                    );
                }
            }
        }
        let expected: Vec<f64> = (0..counts.len())
            .map(|cell| chances[cell / PARTS] / PARTS as f64 * f64::from(draws))
            .collect();
        let test = chi_square(&counts, &expected);
        family.add(
            test.p,
            format!("a picture of {width} x {height} in {} lanes: {test:?}", L::N),
        );
    }
}
