//! Rough surfaces with microfacets: directions and values against the formulas of the textbooks in `f64`.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use octolux::bsdf::{Brdf, Conductor, Ggx, Microfacets, Tint, Tints, fresnel};
use octolux::estimator::density::{Average, ConeOnly, Density, Mix};
use octolux::estimator::{ShadingPoint, per_light, per_point};
use octolux::lane::{Bits, Lane, Word};
use octolux::math::Vec3;
use octolux::sampling::PassBlock;
use octolux::scene::SamplerKind;

use super::Family;
use super::places::{light, narrow, wide};
use super::stats::{chi_square, integrate};
use super::weights::weight_over_f;

/// Rough surfaces in `f64`, of the vectors and numbers that the renderer has.
pub struct Truth {
    pub n: DVec3,
    pub wo: DVec3,
    pub alpha: f64,
}

/// What a surface says of a direction.
pub struct Said {
    pub value: f64,
    pub pdf: f64,
    pub cos_half: f64,
}

impl Truth {
    fn of(facets: &Microfacets<f32>) -> Self {
        let [n, wo] = [facets.n, facets.wo].map(|v| wide(v.lane(0)).normalize());
        let alpha = f64::from(facets.alpha);
        Self { n, wo, alpha }
    }

    /// Trowbridge and Reitz's distribution at the tangent `t` of the angle from the normal.
    pub fn distribution(&self, t: f64) -> f64 {
        let cosine = 1.0 / (1.0 + t * t);
        1.0 / (PI * (self.alpha * cosine * (1.0 + (t / self.alpha).powi(2))).powi(2))
    }

    fn lambda(&self, cosine: f64) -> f64 {
        let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
        let x = (self.alpha * tangent).powi(2);
        0.5 * x / (1.0 + (1.0 + x).sqrt())
    }

    pub fn at(&self, wi: DVec3) -> Said {
        let h = (self.wo + wi).normalize();
        let d = self.distribution(self.n.cross(h).length() / self.n.dot(h));
        let (cos_o, cos_i) = (self.n.dot(self.wo), self.n.dot(wi));
        Said {
            value: d / (1.0 + self.lambda(cos_o) + self.lambda(cos_i)) / (4.0 * cos_o),
            pdf: d / (1.0 + self.lambda(cos_o)) / (4.0 * cos_o),
            cos_half: h.dot(wi),
        }
    }

    /// The normal whose tangent is `alpha r`, at an azimuth.
    fn normal(&self, r: f64, turn: f64) -> DVec3 {
        let (a, b) = self.n.any_orthonormal_pair();
        let (s, c) = (TAU * turn).sin_cos();
        (self.n + (a * c + b * s) * (self.alpha * r)).normalize()
    }
}

fn normal() -> DVec3 {
    DVec3::new(0.3, -0.5, 0.8).normalize()
}

/// A surface seen at `tilt` from its normal.
fn facets<L: Lane>(alpha: f64, tilt: f64) -> Microfacets<L> {
    let n = normal();
    let wo = n * tilt.cos() + n.cross(DVec3::Y).normalize() * tilt.sin();
    Microfacets::new(narrow(n), narrow(wo), L::splat(alpha as f32))
}

pub fn coated<L: Lane>(alpha: f64, tilt: f64, metallic: f32) -> Ggx<L> {
    Ggx {
        facets: facets(alpha, tilt),
        rho: Vec3::splat([0.9, 0.5, 0.25]),
        metallic: L::splat(metallic),
    }
}

const ROWS: usize = 16;
const COLUMNS: usize = 16;

/// Adds a chi-square test of directions for each roughness and angle. Cells are of the half vector: equally likely under the
/// distribution of normals, so that they are as narrow as the lobe; what they expect is the renderer's own density over the
/// directions that these normals reflect to, with the Jacobian `4 (wo·h)` of a reflection.
pub fn directions<L: Lane>(family: &mut Family, alphas: &[f64], draws: u32) {
    for (i, alpha) in alphas.iter().copied().enumerate() {
        for (j, tilt) in [0.0, 0.6, 1.3, 1.5].into_iter().enumerate() {
            let bsdf = facets::<L>(alpha, tilt);
            let truth = Truth::of(&facets(alpha, tilt));
            let (a, b) = truth.n.any_orthonormal_pair();
            let numbers = PassBlock::new(SamplerKind::Independent, (70 + i) as u32, 0, 1, 8);
            let mut counts = vec![0.0; ROWS * COLUMNS];
            for first in (0..draws).step_by(L::N) {
                let pixel = L::Bits::from_fn(|lane| first + lane as u32);
                let (u, v) = numbers
                    .pair(numbers.key(pixel), L::Bits::splat(0), j as u32)
                    .unit::<L>();
                let wi = bsdf.draw(u, v);
                for lane in 0..L::N {
                    let h = truth.wo + wide(wi.lane(lane)).normalize();
                    let (x, y) = (h.dot(a) / h.dot(truth.n), h.dot(b) / h.dot(truth.n));
                    let r = (x * x + y * y) / (truth.alpha * truth.alpha);
                    let row = ((r / (1.0 + r) * ROWS as f64) as usize).min(ROWS - 1);
                    let column = (y.atan2(x) / TAU).rem_euclid(1.0) * COLUMNS as f64;
                    counts[row * COLUMNS + (column as usize).min(COLUMNS - 1)] += 1.0;
                }
            }
            let density = |share: f64, turn: f64| {
                let tangent = truth.alpha * (share / (1.0 - share)).sqrt();
                let h = truth.normal(tangent / truth.alpha, turn);
                let cosine = truth.wo.dot(h);
                if cosine <= 0.0 {
                    return 0.0;
                }
                let wi = 2.0 * cosine * h - truth.wo;
                let pdf = f64::from(bsdf.eval(narrow(wi), L::splat(truth.n.dot(wi) as f32)).pdf.lane(0));
                // Solid angle of normals where `share` and `turn` are uniform: they are so in `D cos`.
                pdf * 4.0 * cosine / (truth.distribution(tangent) * truth.n.dot(h))
            };
            let mut expected = Vec::new();
            for row in 0..ROWS {
                // The last row holds the far tail, where the density falls to 0 at an edge: it is cut finer towards 1.
                let edge = |k: i32| 1.0 - 0.5_f64.powi(k) / ROWS as f64;
                let spans: Vec<(f64, f64)> = if row + 1 < ROWS {
                    vec![(row as f64 / ROWS as f64, (row + 1) as f64 / ROWS as f64)]
                } else {
                    (0..18).map(|k| (edge(k), edge(k + 1))).collect()
                };
                for column in 0..COLUMNS {
                    let (from, to) = (column as f64 / COLUMNS as f64, (column + 1) as f64 / COLUMNS as f64);
                    let of = |(low, high): &(f64, f64)| {
                        integrate(*low, *high, 4, |share| {
                            integrate(from, to, 4, |turn| density(share, turn))
                        })
                    };
                    expected.push(f64::from(draws) * spans.iter().map(of).sum::<f64>());
                }
            }
            let test = chi_square(&counts, &expected);
            let what = format!("alpha {alpha} seen at {tilt} in {} lanes: {test:?}", L::N);
            family.add(test.p, what);
        }
    }
}

/// Adds a chi-square test of the directions of coated bodies: in rows of the cosine and columns of the azimuth, and one cell below the
/// horizon.
pub fn mixtures<L: Lane>(family: &mut Family, draws: u32) {
    for (i, (alpha, tilt, metallic)) in [(0.3, 0.5, 0.0), (0.6, 1.2, 0.0), (0.5, 0.9, 0.5), (1.0, 0.2, 0.2)]
        .into_iter()
        .enumerate()
    {
        let bsdf = coated::<L>(alpha, tilt, metallic);
        let n = wide(bsdf.facets.n.lane(0)).normalize();
        let (a, b) = n.any_orthonormal_pair();
        let numbers = PassBlock::new(SamplerKind::Independent, 90, 0, 1, 4);
        let mut counts = vec![0.0; ROWS * COLUMNS + 1];
        for first in (0..draws).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let (u, v) = numbers
                .pair(numbers.key(pixel), L::Bits::splat(0), i as u32)
                .unit::<L>();
            let wi = bsdf.draw(u, v);
            for lane in 0..L::N {
                let wi = wide(wi.lane(lane));
                let cosine = wi.dot(n);
                let column = (wi.dot(b).atan2(wi.dot(a)) / TAU).rem_euclid(1.0) * COLUMNS as f64;
                let row = (cosine * ROWS as f64) as usize;
                let cell = row.min(ROWS - 1) * COLUMNS + (column as usize).min(COLUMNS - 1);
                counts[if cosine <= 0.0 { ROWS * COLUMNS } else { cell }] += 1.0;
            }
        }
        let density = |cosine: f64, turn: f64| {
            let (sine, (s, c)) = ((1.0 - cosine * cosine).sqrt(), (TAU * turn).sin_cos());
            let wi = n * cosine + (a * c + b * s) * sine;
            TAU * f64::from(bsdf.eval(narrow(wi), L::splat(cosine as f32)).pdf.lane(0))
        };
        let mut expected = Vec::new();
        for row in 0..ROWS {
            for column in 0..COLUMNS {
                let [(low, high), (from, to)] =
                    [(row, ROWS), (column, COLUMNS)].map(|(i, of)| (i as f64 / of as f64, (i + 1) as f64 / of as f64));
                let share = integrate(low, high, 4, |cosine| {
                    integrate(from, to, 4, |turn| density(cosine, turn))
                });
                expected.push(f64::from(draws) * share);
            }
        }
        expected.push(f64::from(draws) - expected.iter().sum::<f64>());
        let test = chi_square(&counts, &expected);
        family.add(
            test.p,
            format!("alpha {alpha} seen at {tilt}, metallic {metallic}: {test:?}"),
        );
    }
}

/// The numbers of the two-colour tint in `f64`, and the density, of a coated body.
fn tints(bsdf: &Ggx<f32>, wi: DVec3, share_of_body: f64) -> ([f64; 2], f64) {
    let truth = Truth::of(&bsdf.facets);
    let (said, cos_i) = (truth.at(wi), truth.n.dot(wi));
    let (m, s) = (f64::from(bsdf.metallic), (1.0 - said.cos_half).powi(5));
    let g = 1.0 / (1.0 + 4.0 * truth.alpha + 15.0 * truth.alpha * truth.alpha);
    let through = |c: f64| 1.0 - g * (1.0 - c).powi(5);
    let body = (1.0 - m) * 0.96 * through(truth.n.dot(truth.wo)) * through(cos_i) * cos_i / PI;
    let tinted = m * (1.0 - s) * said.value + body;
    let white = (m * s + (1.0 - m) * (0.04 + 0.96 * s)) * said.value;
    let pdf = share_of_body * cos_i / PI + (1.0 - share_of_body) * said.pdf;
    ([tinted, white], pdf)
}

/// Relative error that single precision leaves a value at `wi`: a stored direction is off by 1.2e-7 to any side, which moves the half
/// vector by as much of the width of the lobe; at grazing angles also cosines.
fn error(alpha: f64, cosines: f64) -> f64 {
    3e-6 + 1.5e-6 / alpha + 4e-7 / cosines
}

fn compare(x: f32, truth: f64, error: f64, what: &str) {
    assert!(
        (f64::from(x) - truth).abs() <= error * truth.abs() + 1e-30,
        "{what}: {x:e} instead of {truth:e}, relative error {:e}, allowed {error:e}",
        f64::from(x) / truth - 1.0
    );
}

/// Every sample of `brdf` and of the estimators with lights is `f_cos / pdf` as the mix has it, written out again in `f64`, to the
/// error that single precision has there.
pub fn every_sample_is_the_answer() {
    fn of_lights<D: Density + per_light::Directions<f32, Ggx<f32>>>(density: D) {
        for (alpha, tilt, metallic, sine) in [
            (0.01, 0.5, 1.0, 0.02),
            (0.1, 0.5, 1.0, 0.1),
            (0.1, 1.4, 0.0, 0.3),
            (0.5, 0.9, 0.5, 0.5),
            (1.0, 0.3, 0.0, 0.9),
        ] {
            let bsdf = coated::<f32>(alpha, tilt, metallic);
            let point = at(bsdf);
            let mirrored = super::places::point::<f32>(2.0, tilt);
            let light = light(&mirrored, sine, 0.4, 0.0);
            let ratio = f64::from(light.radius) / wide(light.center).length();
            let cone = 1.0 / (TAU * ratio * ratio / (1.0 + (1.0 - ratio * ratio).sqrt()));
            let numbers = PassBlock::new(SamplerKind::Sobol, 15, 0, 1, 2);
            let mut samples = 0;
            for pixel in 0..2048 {
                let technique_sample = numbers.technique_sample(numbers.key(Word(pixel)), Word(0), 0, pixel);
                let Some(found) = per_light::sample(density, &point, &light, technique_sample, true) else {
                    continue;
                };
                let wi = wide(found.wi.lane(0)).normalize();
                let ([tinted, white], pdf) = tints(&bsdf, wi, share(&bsdf));
                let weight = weight_over_f(density.mix(), cone, pdf, technique_sample.by_brdf_lanes);
                let error = error(alpha, wi.dot(normal())) + 1e-6;
                for (channel, ld) in found.ld.lane(0).into_iter().enumerate() {
                    let rho = f64::from(bsdf.rho.lane(0)[channel]);
                    let truth = f64::from(light.le[channel]) * (rho * tinted + white) * weight;
                    compare(ld, truth, error, &format!("alpha {alpha}, {:?}", density.mix()));
                }
                samples += 1;
            }
            assert!(samples > 200, "alpha {alpha}: only {samples} samples to check");
        }
    }
    of_lights(Average);
    of_lights(ConeOnly);
    of_lights(Mix::Balance);
    of_lights(Mix::Power);
    of_points();
}

pub fn at<L: Lane, B: Brdf<L>>(bsdf: B) -> ShadingPoint<L, B> {
    ShadingPoint {
        p: Vec3::zero(),
        ng: bsdf.normal(),
        bsdf,
    }
}

/// The share of directions for the body: what is left of the density where no mirror reflects.
fn share(bsdf: &Ggx<f32>) -> f64 {
    let (n, facets) = (bsdf.facets.n, bsdf.facets);
    let (all, shine) = (bsdf.eval(n, 1.0).pdf, facets.eval(n, 1.0).pdf);
    let (all, shine) = (f64::from(all), f64::from(shine));
    ((all - shine) / (1.0 / PI - shine)).max(0.0)
}

/// As far as grazing angles and roughnesses down to that of `1e-4`, whose lobe is narrower than the spacing of directions.
fn of_points() {
    for alpha in [1e-8, 1e-6, 1e-4, 0.01, 0.2, 0.7, 1.0] {
        for tilt in [0.0, 0.7, 1.4, 1.57, 1.8] {
            let bsdf = coated::<f32>(alpha, tilt, 1.0);
            let metal = Conductor {
                facets: bsdf.facets,
                rho: Vec3::splat([1.0; 3]),
                eta: Vec3::splat([0.143, 0.375, 1.442]),
                k: Vec3::splat([3.983, 2.386, 1.603]),
            };
            let truth = Truth::of(&bsdf.facets);
            let numbers = PassBlock::new(SamplerKind::Sobol, 16, 0, 1, 1);
            for pixel in 0..1024 {
                let pair = numbers.pair(numbers.key(Word(pixel)), Word(0), 0);
                let Some(found) = per_point::sample::<f32, per_point::Lobe>(&at(bsdf), pair, true) else {
                    continue;
                };
                let wi = wide(found.wi.lane(0)).normalize();
                let (said, cos_i, cos_o) = (truth.at(wi), truth.n.dot(wi), truth.n.dot(truth.wo).max(1e-9));
                // The density cancels: what is left is as exact for the narrowest lobe.
                let weight = (1.0 + truth.lambda(cos_o)) / (1.0 + truth.lambda(cos_o) + truth.lambda(cos_i));
                let s = (1.0 - said.cos_half).powi(5);
                let error = 1e-5 + 1e-6 / cos_i.min(cos_o.max(1e-3));
                let what = format!("alpha {alpha} seen at {tilt}, cosine {cos_i}");
                for (rho, value) in [0.9_f32, 0.5, 0.25].into_iter().zip(found.throughput.lane(0)) {
                    let rho = f64::from(rho);
                    compare(value, (rho + (1.0 - rho) * s) * weight, error, &what);
                }
                let found = per_point::sample::<f32, per_point::Lobe>(&at(metal), pair, true).expect("as before");
                for (i, value) in found.throughput.lane(0).into_iter().enumerate() {
                    let (eta, k) = (metal.eta.lane(0)[i], metal.k.lane(0)[i]);
                    let reflectance = f64::from(fresnel(said.cos_half as f32, eta, k));
                    compare(value, reflectance * weight, error, &what);
                }
            }
        }
    }
}

/// That tints add and scale as colours do.
pub fn tints_are_colours() {
    let [rho, white] = [[0.7, 0.2, 0.1], [2.0, 3.0, 4.0]].map(Vec3::<f32>::splat);
    let tint = Tints {
        tinted: 0.5_f32,
        white: 0.25,
    };
    let colour = tint.scaled(3.0).over(2.0).plus(tint).colour(rho, white).lane(0);
    for (i, x) in colour.into_iter().enumerate() {
        let expected = 2.5 * (0.5 * rho.lane(0)[i] + 0.25 * white.lane(0)[i]);
        assert!((x - expected).abs() < 1e-6);
    }
    assert!(tint.lit() && !tint.kept(false).lit());
}
