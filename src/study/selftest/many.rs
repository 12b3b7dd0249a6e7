//! Case 34: many lights, of which a pass samples a list.

use std::f64::consts::PI;

use glam::DVec3;

use super::bench::{self, SIGMAS, SelftestError};
use super::row::{Check, Checks, Effort};
use super::truth;
use crate::light::tree::{Emission, Emitter, LightTree, Probes, Table};
use crate::pipeline::{Prepared, Settings};
use crate::sampling::hash::mix;
use crate::scene::{EstimatorKind, Sphere, Surface};
use crate::study::estimate::Estimate;

/// Seeds of a mean. Pixels of a tile share their lists, so the independent unit is a render, not a pixel.
const SEEDS: u32 = 24;

/// Case 34.
pub fn many_lights(effort: Effort) -> Checks {
    let mut worst = 0.0_f64;
    for count in [65, 1000] {
        worst = worst.max(dome(count, effort)?);
    }
    let [root, power] = drawn(effort.of(1_000_000), effort.of(20_000));
    Ok(vec![
        Check::new(
            "65 and 1000 lights of powers over six orders of magnitude, estimators that sample lights: standard errors off",
            worst,
            SIGMAS,
        ),
        Check::new(
            "a million lights: roots of their powers by picks over expectations, standard errors off",
            root,
            SIGMAS,
        ),
        Check::new(
            "a million lights: their power by picks over expectations, standard errors off",
            power,
            SIGMAS,
        ),
    ])
}

/// A number in [0, 1) for each `i`.
fn unit(i: u32) -> f64 {
    f64::from(mix(i)) / 4_294_967_296.0
}

/// A power over six orders of magnitude.
fn power(i: u32) -> f64 {
    10_f64.powf(6.0 * unit(i ^ 0x5bd1_e995) - 6.0)
}

/// Lights on a dome around the plate, spaced by the golden angle: none occludes another, so the closed forms of single spheres
/// add up.
fn dome(count: u32, effort: Effort) -> Result<f64, SelftestError> {
    let (distance, sine) = (5.0, 0.4 / f64::from(count).sqrt());
    let (mut lights, mut answer) = (Vec::new(), 0.0);
    for i in 0..count {
        let height = 0.1 + 0.9 * (f64::from(i) + 0.5) / f64::from(count);
        let (level, turn) = (
            (1.0 - height * height).sqrt(),
            PI * (3.0 - 5.0_f64.sqrt()) * f64::from(i),
        );
        let wi = DVec3::new(level * turn.cos(), height, level * turn.sin());
        let le = power(i) / (sine * sine);
        answer += le * 0.5 / PI * truth::clipped_sphere(sine, height.acos());
        lights.push(Sphere::new(distance * wi, distance * sine, Surface::emission([le; 3])));
    }
    let scene = bench::lit(&lights)?;
    let mut worst = 0.0_f64;
    for estimator in EstimatorKind::ALL.into_iter().filter(|estimator| estimator.per_light()) {
        let settings = Settings {
            seed: 1,
            ..bench::settings(16, 16, estimator)
        };
        let prepared = Prepared::new(&scene, settings)?;
        let mean = |seed| {
            let run = prepared.with_seed(seed).passes(effort.of(32)).finish();
            bench::mean_of_pixels(&run.picture()).mean
        };
        let found = Estimate::of(&(1..=SEEDS).map(mean).collect::<Vec<_>>());
        // Allow for single precision of the offset and of radiances, as for one light.
        let off = (found.mean - answer).abs() - 1e-5 * answer;
        worst = worst.max(off.max(0.0) / found.variance.sqrt().max(1e-9 * answer));
    }
    Ok(worst)
}

/// Deviations, in standard errors, of the power of all lights and of its roots as estimated from lists. Sixteen points see a box
/// full of lights from below.
fn drawn(lights: u32, lists: u32) -> [f64; 2] {
    let emitter = |i: u32| Emitter {
        light: i,
        mean: std::array::from_fn(|k| (10.0 * unit(7 * i + k as u32)) as f32),
        variance: [1e-5; 3],
        emission: Emission::Round,
        intensity: power(i),
    };
    let emitters: Vec<Emitter> = (0..lights).map(emitter).collect();
    let tree = LightTree::new(&emitters);
    let mut probes = Probes::new(false);
    for i in 0..16 {
        let at = |k: u32| (10.0 * unit(lights + 2 * i + k)) as f32;
        probes.push([at(0), -1.0, at(1)], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], 1.0);
    }
    let table = Table::new(&tree, probes, 256, 16, None);
    let (mut list, mut sums) = (Vec::new(), [Vec::new(), Vec::new()]);
    for round in 0..lists {
        table.draw(&tree, |stratum| unit(mix(round) ^ (977 * stratum)), &mut list);
        // Roots, not numbers of lights: powers span six orders of magnitude, and picks follow power.
        sums[0].push(
            list.iter()
                .map(|pick| emitters[pick.light as usize].intensity.sqrt() / pick.expected)
                .sum(),
        );
        sums[1].push(
            list.iter()
                .map(|pick| emitters[pick.light as usize].intensity / pick.expected)
                .sum(),
        );
    }
    let truths =
        [f64::sqrt, |x| x].map(|of: fn(f64) -> f64| emitters.iter().map(|emitter| of(emitter.intensity)).sum::<f64>());
    std::array::from_fn(|k| {
        let found = Estimate::of(&sums[k]);
        (found.mean - truths[k]).abs() / found.variance.sqrt()
    })
}
