//! Environments: constant radiance, or a latitude-longitude map.
//!
//! Both return, for a direction, its radiance and the reciprocal of its sampling density.

use std::f32::consts::FRAC_1_PI;
use std::sync::Arc;

use rayon::prelude::*;

use crate::lane::{Bits, Lane, Mask};
use crate::math::elementary::{angle, sin_cos_turn};
use crate::math::{Frame, Vec3};
use crate::sampling::{Discrete, Pair, warp};
use crate::texels::Texels;

/// Light from the environment.
pub trait EnvironmentLight {
    /// Whether the radiance is the same from all directions.
    const EVEN: bool = false;
    /// Samples unit directions for points with the unit normal `n`; inactive lanes are undefined.
    fn draw<L: Lane>(&self, n: Vec3<L>, numbers: Pair<L::Bits>, active: L::Mask) -> Vec3<L>;
    /// Radiance from unit directions above the surface, and the reciprocal density of [`Self::draw`] in steradians. Both are 0
    /// where nothing can be sampled, and in inactive lanes.
    fn meet<L: Lane>(&self, wi: Vec3<L>, active: L::Mask) -> (Vec3<L>, L);
}

/// The environment of a scene.
#[derive(Clone, Debug)]
pub enum Environment {
    /// Constant radiance.
    Constant(Constant),
    /// A latitude-longitude map.
    LatLong(LatLong),
}

impl Environment {
    /// Radiance from unit directions; 0 in inactive lanes.
    #[inline(always)]
    pub fn radiance<L: Lane>(&self, wi: Vec3<L>, active: L::Mask) -> Vec3<L> {
        match self {
            Self::Constant(constant) => constant.meet(wi, active).0,
            Self::LatLong(picture) => picture.meet(wi, active).0,
        }
    }
}

/// Constant radiance from all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Radiance.
    pub le: [f32; 3],
}

impl EnvironmentLight for Constant {
    const EVEN: bool = true;

    /// Uniform over the hemisphere above the surface; other directions cannot contribute.
    #[inline(always)]
    fn draw<L: Lane>(&self, n: Vec3<L>, numbers: Pair<L::Bits>, _: L::Mask) -> Vec3<L> {
        let (u, v) = numbers.unit::<L>();
        let (sine, cosine) = sin_cos_turn(v);
        Frame::about(n).direction(warp::cone(u, L::one()), sine, cosine)
    }

    #[inline(always)]
    fn meet<L: Lane>(&self, _: Vec3<L>, active: L::Mask) -> (Vec3<L>, L) {
        let le = Vec3::select(active, Vec3::splat(self.le), Vec3::zero());
        (le, warp::cone_solid_angle(L::one()).or_zero(active))
    }
}

/// A latitude-longitude map of all directions, interpolated between texel centers.
///
/// Directions are sampled by texel, uniform in its solid angle: the first number selects a row, the second a column (Pharr, Jakob,
/// Humphreys, "Physically Based Rendering", 4th edition, section 12.5). The probability of a texel is the mean of the interpolated
/// luminance over it times its solid angle, so a black texel with a bright neighbor is sampled too.
#[derive(Clone, Debug)]
pub struct LatLong {
    width: usize,
    height: usize,
    /// Radiance at texel centers, row by row from the top.
    texels: Arc<Texels>,
    rows: Discrete,
    /// The column distribution of each row; `None` for a black row.
    columns: Vec<Option<Discrete>>,
    /// `1 - |cos|` of the polar angle at each edge between rows.
    edges: Vec<f32>,
    /// Reciprocal density of each texel, in steradians; 0 where the density is 0.
    inverse: Vec<f32>,
    /// Axes of the map in the scene: right of the center, up, and opposite to the center.
    axes: [[f32; 3]; 3],
}

impl LatLong {
    /// From texels row by row from the top; the map's center is opposite to the third of `axes`. `None` if all texels are black.
    /// Width and height must be positive.
    pub fn new(width: usize, height: usize, texels: Arc<Texels>, axes: [[f32; 3]; 3]) -> Option<Self> {
        let cosine = |row: usize| (std::f64::consts::PI * row as f64 / height as f64).cos();
        let solid_angle = |row: usize| std::f64::consts::TAU / width as f64 * (cosine(row) - cosine(row + 1));
        let luminance = |row: usize| -> Vec<f64> {
            let of_row = row * width..(row + 1) * width;
            of_row.map(|index| luminance(&texels.at(index))).collect()
        };
        // Rows are processed in parallel. Each is summed separately, so threads do not change the bits.
        let rows = (0..height).into_par_iter().map(|row| {
            let near = [row.saturating_sub(1), row, (row + 1).min(height - 1)].map(luminance);
            let (mut weights, solid_angle) = (mean(&near), solid_angle(row));
            weights.iter_mut().for_each(|weight| *weight *= solid_angle);
            (weights.iter().sum::<f64>(), Discrete::new(&weights))
        });
        let (of_rows, columns): (Vec<f64>, Vec<Option<Discrete>>) = rows.unzip();
        let rows = Discrete::new(&of_rows)?;
        let mut inverse = vec![0.0; width * height];
        inverse.par_chunks_mut(width).enumerate().for_each(|(row, inverse)| {
            let (solid_angle, of_row) = (solid_angle(row), f64::from(rows.chance(row as u32)));
            let Some(columns) = &columns[row] else {
                return;
            };
            for (column, inverse) in (0..).zip(inverse) {
                let chance = of_row * f64::from(columns.chance(column));
                if chance > 0.0 {
                    *inverse = (solid_angle / chance) as f32;
                }
            }
        });
        let edge = |row: usize| {
            // 1 - cos = 2 sin^2 of half the angle, from the nearer pole.
            let from_pole = row.min(height - row) as f64 * std::f64::consts::PI / height as f64;
            (2.0 * (from_pole / 2.0).sin().powi(2)) as f32
        };
        Some(Self {
            width,
            height,
            texels,
            rows,
            columns,
            edges: (0..=height).map(edge).collect(),
            inverse,
            axes,
        })
    }

    /// `1 - |cos|` of the polar angle at a position within a row, and whether it is in the lower half. With an odd number of rows
    /// the middle row spans both halves.
    #[inline(always)]
    fn latitude(&self, row: usize, place: f32) -> (f32, bool) {
        let (above, below) = (self.edges[row], self.edges[row + 1]);
        if 2 * row + 1 == self.height {
            // The cosine goes from `1 - above` to `-(1 - below)`, which have the same magnitude.
            let cosine = (1.0 - above) * (1.0 - 2.0 * place);
            return (1.0 - cosine.abs(), cosine < 0.0);
        }
        ((below - above) * place + above, 2 * row >= self.height)
    }

    /// The interpolated radiance at a position of the map, in texels from the top left corner.
    #[inline(always)]
    fn radiance(&self, x: f32, y: f32) -> [f32; 3] {
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (across, down) = (x - left, y - top);
        let column = |c: i64| match c {
            -1 => self.width - 1,
            c if c as usize >= self.width => 0,
            c => c as usize,
        };
        let row = |r: i64| r.clamp(0, self.height as i64 - 1) as usize * self.width;
        let (left, right) = (column(left as i64), column(left as i64 + 1));
        let (top, bottom) = (row(top as i64), row(top as i64 + 1));
        let corners = [
            (self.texels.at(top + left), (1.0 - across) * (1.0 - down)),
            (self.texels.at(top + right), across * (1.0 - down)),
            (self.texels.at(bottom + left), (1.0 - across) * down),
            (self.texels.at(bottom + right), across * down),
        ];
        let mut sum = [0.0; 3];
        for (texel, weight) in corners {
            for (sum, value) in sum.iter_mut().zip(texel) {
                *sum += weight * value;
            }
        }
        sum
    }
}

impl EnvironmentLight for LatLong {
    #[inline(always)]
    fn draw<L: Lane>(&self, _: Vec3<L>, Pair(first, second): Pair<L::Bits>, active: L::Mask) -> Vec3<L> {
        let (mut t, mut sign, mut turn) = ([0.0_f32; 16], [1.0_f32; 16], [0.0_f32; 16]);
        for lane in active.lanes() {
            let (row, place) = self.rows.pick(first.lane(lane));
            let (from_pole, lower) = self.latitude(row as usize, place);
            t[lane] = from_pole;
            sign[lane] = if lower { -1.0 } else { 1.0 };
            if let Some(columns) = &self.columns[row as usize] {
                let (column, place) = columns.pick(second.lane(lane));
                turn[lane] = (column as f32 + place) / self.width as f32;
            }
        }
        let (t, sign) = (L::load(&t), L::load(&sign));
        let (sine, cosine) = sin_cos_turn(L::load(&turn));
        let radius = (t * (L::splat(2.0) - t)).safe_sqrt();
        let [right, up, back] = self.axes;
        let across = Vec3::splat(right) * -(radius * sine);
        let along = Vec3::splat(back) * (radius * cosine);
        Vec3::splat(up)
            .mul_add(sign * (L::one() - t), across + along)
            .normalize()
    }

    #[inline(always)]
    fn meet<L: Lane>(&self, wi: Vec3<L>, active: L::Mask) -> (Vec3<L>, L) {
        let [right, up, back] = self.axes;
        let (x, y, z) = (
            wi.dot(Vec3::splat(right)),
            wi.dot(Vec3::splat(up)),
            wi.dot(Vec3::splat(back)),
        );
        let radius = (x * x + z * z).sqrt();
        let down = angle(radius, y) * L::splat(FRAC_1_PI * self.height as f32);
        let around = angle(x.abs(), z) * L::splat(0.5 * FRAC_1_PI);
        let turn = L::select(x.gt(L::zero()), L::one() - around, around) * L::splat(self.width as f32);
        let (mut rows, mut columns) = ([0.0_f32; 16], [0.0_f32; 16]);
        down.store(&mut rows);
        turn.store(&mut columns);
        let mut le = [[0.0_f32; 16]; 3];
        let mut inverse = [0.0_f32; 16];
        for lane in active.lanes() {
            let row = (rows[lane] as usize).min(self.height - 1);
            let column = (columns[lane] as usize).min(self.width - 1);
            let texel = row * self.width + column;
            inverse[lane] =
                mutate!(self.inverse[texel], DensityOfTheNextTexel => self.inverse[(texel + 1) % self.inverse.len()]);
            [le[0][lane], le[1][lane], le[2][lane]] = self.radiance(columns[lane], rows[lane]);
        }
        let [red, green, blue] = &le;
        (
            Vec3::new(L::load(red), L::load(green), L::load(blue)),
            L::load(&inverse),
        )
    }
}

/// Luminance of linear RGB (ITU-R BT.709).
fn luminance([r, g, b]: &[f32; 3]) -> f64 {
    0.2126 * f64::from(*r) + 0.7152 * f64::from(*g) + 0.0722 * f64::from(*b)
}

/// Means of the interpolated map over the texels of a row, from the rows above and below: weights of three quarters for the texel
/// and an eighth for each neighbor, in both directions.
fn mean(rows: &[Vec<f64>; 3]) -> Vec<f64> {
    let width = rows[1].len();
    let shares = [0.125, 0.75, 0.125];
    let of_column = |column: usize| {
        let columns = [(column + width - 1) % width, column, (column + 1) % width];
        let across = |row: &Vec<f64>| -> f64 {
            let of = columns.iter().zip(shares);
            of.map(|(&column, share)| share * row[column]).sum()
        };
        rows.iter().zip(shares).map(|(row, share)| share * across(row)).sum()
    };
    (0..width).map(of_column).collect()
}
