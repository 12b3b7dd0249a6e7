//! Triangles that emit: directions against the solid angle, in `f64`.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use octolux::estimator::density::Density;
use octolux::estimator::per_triangle::{Numbers, sample};
use octolux::lane::{Bits, Lane, Mask, Word};
use octolux::light::Triangle;
use octolux::sampling::PassBlock;
use octolux::scene::SamplerKind;

use super::Family;
use super::places::{RHO, narrow, point, wide};
use super::runs::Estimate;
use super::stats::chi_square;
use super::weights::weight_over_f;

/// Triangles seen from the origin, by name: each map, its limits, and what is hard for it.
pub fn triangles() -> Vec<(&'static str, [DVec3; 3])> {
    let near = |height: f64| {
        [
            DVec3::new(-1.0, -0.7, height),
            DVec3::new(1.1, -0.6, height),
            DVec3::new(0.1, 1.3, height),
        ]
    };
    let far = |size: f64| near(1.0).map(|v| DVec3::new(0.2, 0.3, 0.9) + size * (v - DVec3::Z));
    let [a, b, c] = near(1.0);
    vec![
        ("a steradian", near(1.0)),
        ("the same from its other side", [b, a, c]),
        ("at an angle", [a, 3.0 * b, 0.5 * c]),
        ("a needle", [a, a + DVec3::new(0.003, 0.0, 0.001), 2.0 * c]),
        ("just above the tiny ones", far(0.03)),
        ("just below", far(0.02)),
        ("of 1e-6 steradians", far(1e-3)),
        ("of 1e-8 steradians", far(1e-4)),
        ("tiny and edge-on", [a, a + 0.01 * DVec3::X, a * 1.01 + 1e-3 * DVec3::Y]),
        ("below the huge ones", near(0.1)),
        ("above them", near(0.03)),
        ("touched", near(1e-4)),
        (
            "next to an edge",
            [[-1.0, -0.002, 0.004], [1.1, -0.002, 0.004], [0.1, 1.0, 0.004]].map(DVec3::from_array),
        ),
        ("with right angles", [DVec3::X, DVec3::Y, DVec3::Z]),
    ]
}

/// The solid angle by the formula of l'Huilier, from the sides: not the renderer's.
pub fn solid_angle(corners: [DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(DVec3::normalize);
    let side = |p: DVec3, q: DVec3| 2.0 * ((p - q).length() / 2.0).min(1.0).asin();
    let (x, y, z) = (side(b, c), side(c, a), side(a, b));
    let s = (x + y + z) / 2.0;
    let half = |v: f64| (v.max(0.0) / 2.0).tan();
    4.0 * (half(s) * half(s - x) * half(s - y) * half(s - z))
        .max(0.0)
        .sqrt()
        .atan()
}

/// Whether all of the hemisphere is sampled for it.
fn by_hemisphere(corners: [DVec3; 3], omega: f64) -> bool {
    let [a, b, c] = corners.map(DVec3::normalize);
    let opposite = 1.0 + a.dot(b).min(b.dot(c)).min(c.dot(a)) < f64::from(octolux::light::triangle::OPPOSITE);
    omega > f64::from(octolux::light::triangle::HUGE) || opposite
}

pub fn light(corners: [DVec3; 3]) -> Triangle {
    // What the renderer sees is rounded; so is what it is held against.
    let corners = corners.map(|v| v.to_array().map(|x| x as f32));
    let [a, b, c] = corners.map(wide);
    let normal = (b - a).cross(c - a);
    Triangle {
        corners,
        normal: normal.normalize().to_array().map(|x| x as f32),
        area: (normal.length() / 2.0) as f32,
    }
}

/// Levels of cells: each quarters the triangle.
const LEVELS: u32 = 3;

/// The cell that a direction meets and its barycentric path, or none.
fn cell([a, b, c]: [DVec3; 3], wi: DVec3) -> Option<usize> {
    let normal = (b - a).cross(c - a);
    let q = wi * (a.dot(normal) / wi.dot(normal)) - a;
    let (p, r) = (b - a, c - a);
    let (v, w) = (q.cross(r).dot(normal), p.cross(q).dot(normal));
    let (v, w) = (v / normal.length_squared(), w / normal.length_squared());
    // A direction at the rim may fall just outside by rounding; far outside it has missed.
    let slack = 1e-3;
    if v < -slack || w < -slack || v + w > 1.0 + slack {
        return None;
    }
    let n = 1 << LEVELS;
    let (v, w) = (v.max(0.0) * f64::from(n), w.max(0.0) * f64::from(n));
    let (i, j) = ((v as usize).min(n as usize - 1), (w as usize).min(n as usize - 1));
    let upper = v.fract() + w.fract() > 1.0 && i + j < n as usize - 1;
    Some(2 * (i * n as usize + j) + usize::from(upper))
}

/// The cells in the order of [`cell`]; a place that is no cell is none.
fn cells([a, b, c]: [DVec3; 3]) -> Vec<Option<[DVec3; 3]>> {
    let n = 1 << LEVELS;
    let at = |i: usize, j: usize| a + (b - a) * (i as f64 / f64::from(n)) + (c - a) * (j as f64 / f64::from(n));
    let mut all = vec![];
    for i in 0..n as usize {
        for j in 0..n as usize {
            let inside = i + j < n as usize;
            all.push(inside.then(|| [at(i, j), at(i + 1, j), at(i, j + 1)]));
            let upper = i + j + 1 < n as usize;
            all.push(upper.then(|| [at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
        }
    }
    all
}

/// Adds two tests for each triangle: `draws` directions in 64 cells of equal area and beside them, and the mean of one over the
/// density, which is the solid angle.
pub fn directions<L: Lane>(family: &mut Family, seed: u32, draws: u32) {
    for (i, (name, corners)) in triangles().into_iter().enumerate() {
        let triangle = light(corners);
        let corners = triangle.corners.map(wide);
        let view = triangle.splat::<L>().seen_from(narrow(DVec3::ZERO));
        let truth = solid_angle(corners);
        let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, 20);
        let places = cells(corners);
        let mut counts = vec![0.0; places.len()];
        let mut inverse = vec![];
        for first in (0..draws).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let (u, v) = numbers
                .pair(numbers.key(pixel), L::Bits::splat(0), i as u32)
                .unit::<L>();
            let wi = view.draw(u, v);
            let met = view.met(wi);
            let one_over = view.inverse_density(wi, view.distance(wi)).or_zero(met);
            for lane in 0..L::N {
                inverse.push(f64::from(one_over.lane(lane)));
            }
            for lane in met.lanes() {
                let place = cell(corners, wide(wi.lane(lane)));
                counts[place.unwrap_or_else(|| panic!("{name}: a direction beside the triangle"))] += 1.0;
            }
        }
        // What each cell is worth: its area where the triangle is tiny, else its solid angle.
        let area = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length() / 2.0;
        let share = |cell: [DVec3; 3]| {
            if truth < f64::from(octolux::light::triangle::TINY) {
                area(cell) / area(corners)
            } else {
                solid_angle(cell) / if by_hemisphere(corners, truth) { TAU } else { truth }
            }
        };
        let mut expected: Vec<f64> = places
            .iter()
            .map(|place| place.map_or(0.0, share) * f64::from(draws))
            .collect();
        let (count, expect): (f64, f64) = (counts.iter().sum(), expected.iter().sum());
        assert!(
            places
                .iter()
                .zip(&counts)
                .all(|(place, count)| place.is_some() || *count == 0.0),
            "{name}: a cell that is not there"
        );
        if by_hemisphere(corners, truth) {
            counts.push(f64::from(draws) - count);
            expected.push(f64::from(draws) - expect);
        }
        let test = chi_square(&counts, &expected);
        family.add(test.p, format!("{name} in {} lanes: {test:?}", L::N));
        // Of these the density is one number: how many directions miss is all there is to ask, and was.
        if !by_hemisphere(corners, truth) {
            let mean = Estimate::of(&inverse);
            let exact = Estimate::exact(truth);
            family.add(
                mean.p(exact, 1e-5),
                format!("{name}, solid angle: {}", mean.against(exact)),
            );
        }
    }
}

/// Samples of each triangle, seen by surfaces of several kinds: `le rho shape / pdf`, written out again in `f64`.
pub fn weights<D: Density>(density: D) {
    let le = [2.0, 3.0, 5.0_f32];
    let mut samples = 0;
    for (name, corners) in triangles() {
        for alpha in [1.0, 20.0] {
            let (point, triangle) = (point::<f32>(alpha, 0.3), light(corners));
            let view = triangle.splat::<f32>().seen_from(point.p);
            let corners = triangle.corners.map(wide);
            let numbers = PassBlock::new(SamplerKind::Sobol, 5, 0, 1, 2);
            let share = 0.25_f32;
            for pixel in 0..512 {
                let key = numbers.key(Word(pixel));
                let technique_sample = Numbers::from(numbers.technique_sample(key, Word(0), 1, pixel));
                let worth = (narrow(wide(le)), share);
                let Some(found) = sample(
                    density,
                    &point,
                    &view,
                    worth,
                    technique_sample,
                    view.rises_above(point.bsdf.n),
                ) else {
                    continue;
                };
                let wi = wide(found.wi.lane(0)).normalize();
                let [a, b, c] = corners;
                let vector = (b - a).cross(c - a);
                let distance = a.dot(vector) / wi.dot(vector);
                let omega = solid_angle(corners);
                let inverse = if omega < f64::from(octolux::light::triangle::TINY) {
                    wi.dot(vector).abs() / 2.0 / distance.powi(2)
                } else if by_hemisphere(corners, omega) {
                    TAU
                } else {
                    omega
                };
                let n = wide(point.bsdf.n.lane(0));
                let cosine = wi.dot(n);
                let (shape, lobe) = if alpha == 1.0 {
                    (cosine / PI, cosine / PI)
                } else {
                    let wr = wide(point.bsdf.wr.lane(0));
                    let lobe = (alpha + 1.0) / TAU * wr.dot(wi).powf(alpha);
                    (lobe * cosine, lobe)
                };
                let by_light = f64::from(share) / inverse;
                let pdf = 1.0 / weight_over_f(density.mix(), by_light, lobe, technique_sample.by_brdf_lanes);
                // Grazing directions feel the rounding of the direction itself; a lobe feels it `alpha ln cos` times.
                let depth = if alpha == 1.0 {
                    0.0
                } else {
                    (lobe / (alpha + 1.0)).ln().abs()
                };
                let error = 1e-6 * depth + 2e-5 + 2e-7 / cosine + 4e-7 * vector.length() / wi.dot(vector).abs();
                assert!(
                    (f64::from(found.distance) / distance - 1.0).abs() < error,
                    "{name}: distance"
                );
                for k in 0..3 {
                    let truth = f64::from(le[k]) * f64::from(RHO[k]) * shape / pdf;
                    let ld = f64::from(found.ld.lane(0)[k]);
                    assert!(
                        (ld - truth).abs() <= error * truth,
                        "{name}, alpha {alpha}: {ld:e} instead of {truth:e}, off by {:e}, allowed {error:e}",
                        ld / truth - 1.0
                    );
                }
                samples += 1;
            }
        }
    }
    assert!(samples > 3000, "{samples} samples to check");
}
