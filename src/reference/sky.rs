//! The environment: the oracle's sampling and evaluation.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rand::{Rng, RngExt};

use crate::scene::{Environment, LatLong};

/// The environment of a scene.
#[derive(Debug)]
pub enum Sky<'s> {
    /// Constant radiance, sampled over the whole sphere.
    Constant(DVec3),
    /// A picture, sampled by texel: with cumulative sums of brightness times solid angle.
    Picture(&'s LatLong, Vec<f64>),
}

impl<'s> Sky<'s> {
    /// Computes the cumulative sums of a picture.
    pub fn new(environment: &'s Environment) -> Self {
        match environment {
            Environment::Constant(le) => Self::Constant(*le),
            Environment::Picture(picture) => {
                let texels = (0..picture.texels.len()).map(|index| {
                    // The maximum that interpolation can reach in the texel, so that no light is missed.
                    let (row, column) = (index / picture.width as usize, index % picture.width as usize);
                    let near = (-1..=1).flat_map(|y| (-1..=1).map(move |x| (row as i64 + y, column as i64 + x)));
                    let brightest = near
                        .map(|(y, x)| texel(picture, x, y).max_element())
                        .fold(0.0, f64::max);
                    brightest * solid_angle(picture, row)
                });
                let sums = texels.scan(0.0, |sum, weight| {
                    *sum += weight;
                    Some(*sum)
                });
                Self::Picture(picture, sums.collect())
            }
        }
    }

    /// Radiance of a direction.
    pub fn radiance(&self, wi: DVec3) -> DVec3 {
        match self {
            Self::Constant(le) => *le,
            Self::Picture(picture, _) => {
                let (x, y) = place(picture, wi);
                let (x, y) = (x - 0.5, y - 0.5);
                let (left, top) = (x.floor(), y.floor());
                let at = |dx: i64, dy: i64| texel(picture, left as i64 + dx, top as i64 + dy);
                let above = at(0, 0).lerp(at(1, 0), x - left);
                above.lerp(at(0, 1).lerp(at(1, 1), x - left), y - top)
            }
        }
    }

    /// Samples a direction; `None` if the picture is black.
    pub fn sample(&self, rng: &mut impl Rng) -> Option<DVec3> {
        match self {
            Self::Constant(_) => {
                let (z, turn): (f64, f64) = (2.0 * rng.random::<f64>() - 1.0, rng.random());
                let radius = (1.0 - z * z).sqrt();
                Some(DVec3::new(radius * (TAU * turn).cos(), radius * (TAU * turn).sin(), z))
            }
            Self::Picture(picture, sums) => {
                let chosen = rng.random::<f64>() * sums.last()?;
                let index = sums.partition_point(|&sum| sum <= chosen);
                if index >= sums.len() {
                    return None;
                }
                let (row, column) = (index / picture.width as usize, index % picture.width as usize);
                let [top, bottom] = [row, row + 1].map(|edge| (PI * edge as f64 / f64::from(picture.height)).cos());
                let up = top + (bottom - top) * rng.random::<f64>();
                let azimuth = TAU * ((column as f64 + rng.random::<f64>()) / f64::from(picture.width) - 0.5);
                let radius = (1.0 - up * up).max(0.0).sqrt();
                Some(picture.to_scene * DVec3::new(radius * azimuth.sin(), up, -radius * azimuth.cos()))
            }
        }
    }

    /// Density of [`sample`](Self::sample), sr⁻¹; 0 where the picture is black.
    pub fn density(&self, wi: DVec3) -> f64 {
        match self {
            Self::Constant(_) => 1.0 / (4.0 * PI),
            Self::Picture(picture, sums) => {
                let (x, y) = place(picture, wi);
                let row = (y as usize).min(picture.height as usize - 1);
                let column = (x as usize).min(picture.width as usize - 1);
                let index = row * picture.width as usize + column;
                let weight = sums[index] - if index == 0 { 0.0 } else { sums[index - 1] };
                let total = sums[sums.len() - 1];
                // A black picture is never sampled; 0 / 0 would be NaN.
                if total > 0.0 {
                    weight / total / solid_angle(picture, row)
                } else {
                    0.0
                }
            }
        }
    }
}

/// The position of a direction in the picture, in texels from its top left corner: its centre is -z, its top is +y.
fn place(picture: &LatLong, wi: DVec3) -> (f64, f64) {
    let local = picture.to_scene.transpose() * wi.normalize();
    let turn = local.x.atan2(-local.z) / TAU + 0.5;
    let down = local.y.clamp(-1.0, 1.0).acos() / PI;
    (turn * f64::from(picture.width), down * f64::from(picture.height))
}

/// A texel; columns wrap around, rows are clamped at the poles.
fn texel(picture: &LatLong, x: i64, y: i64) -> DVec3 {
    let (width, height) = (i64::from(picture.width), i64::from(picture.height));
    let index = y.clamp(0, height - 1) * width + x.rem_euclid(width);
    DVec3::from_array(picture.texels.at(index as usize).map(f64::from))
}

/// Solid angle of a texel in a row, in steradians.
fn solid_angle(picture: &LatLong, row: usize) -> f64 {
    let cos = |edge: usize| (PI * edge as f64 / f64::from(picture.height)).cos();
    TAU / f64::from(picture.width) * (cos(row) - cos(row + 1))
}
