//! Measurement: each round renders every variant once with the round's own seed, so a temporary slowdown of the machine affects
//! all variants alike.

use std::sync::Arc;

use super::settings::Variant;
use crate::pipeline::{Counters, Prepared, SetupError};
use crate::run::Observer;
use crate::scene::{FilmSize, Scene};
use crate::settings::SamplerKind;

/// How much to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Effort {
    /// The film of all comparisons.
    pub film: FilmSize,
    /// Samples per pixel at which each render is recorded: powers of two, ascending.
    pub looks: Vec<u32>,
    /// Minimum number of rounds.
    pub rounds: usize,
    /// Seed of the first round.
    pub seed: u32,
}

/// One picture with its cost.
#[derive(Clone, Debug)]
pub struct Look {
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds of rendering so far, wall clock, without setup, looks and files.
    pub seconds: f64,
    /// The picture, shared between variants with the same bits.
    pub pixels: Arc<Vec<[f32; 3]>>,
}

/// One render of one variant.
#[derive(Clone, Debug)]
pub struct Run {
    /// The seed.
    pub seed: u32,
    /// The recorded pictures, by ascending samples per pixel.
    pub looks: Vec<Look>,
    /// What was traced.
    pub counters: Counters,
    /// Every look has the bits of the defaults with the same seed.
    pub same_bits: bool,
}

impl Run {
    /// Seconds per pass. With several looks, the first is skipped because it includes page faults for fresh memory.
    pub fn pass_seconds(&self) -> f64 {
        let last = &self.looks[self.looks.len() - 1];
        match &self.looks[0] {
            first if first.spp < last.spp && first.seconds < last.seconds => {
                (last.seconds - first.seconds) / f64::from(last.spp - first.spp)
            }
            _ => last.seconds / f64::from(last.spp),
        }
    }

    /// Rays a second over the whole run.
    pub fn rays_per_second(&self) -> f64 {
        let seconds = self.looks.last().map_or(0.0, |look| look.seconds);
        (self.counters.eye_rays + self.counters.shadow_rays) as f64 / seconds.max(1e-9)
    }
}

/// All runs of a variant, one a round.
pub type Runs = Vec<Run>;

/// Renders one variant with one seed.
///
/// # Errors
/// Where the render cannot start.
pub fn run(
    scene: &Scene,
    variant: &Variant,
    effort: &Effort,
    seed: u32,
    watch: &dyn Observer,
) -> Result<Run, SetupError> {
    let mut settings = variant.choice.settings;
    (settings.film, settings.seed) = (effort.film, seed);
    let mut found = Run {
        seed,
        looks: Vec::with_capacity(effort.looks.len()),
        counters: Counters::default(),
        same_bits: false,
    };
    let prepared = Prepared::new(scene, settings)?;
    let mut run = prepared.passes(0);
    for &spp in &effort.looks {
        // An adaptive render has to know its end in advance: one run per look.
        if variant.choice.adaptive {
            run = prepared.adaptive(spp);
        } else {
            run.extend(spp);
        }
        let _ = run.run(watch);
        let seconds = run.render_time().as_secs_f64();
        let mut pixels = run.picture().pixels;
        if settings.sampler == SamplerKind::Independent {
            let gain = mutate!(1.0_f32, OnePercentBright => 1.01);
            pixels.as_flattened_mut().iter_mut().for_each(|value| *value *= gain);
        }
        found.counters = run.counters();
        found.looks.push(Look {
            spp,
            seconds,
            pixels: Arc::new(pixels),
        });
    }
    Ok(found)
}

/// Renders rounds of all variants, the defaults first, until there are enough and `more` returns false; it is called after each
/// round with the number of rounds. Each round rotates the order by one, so that no variant always follows the same one. A variant
/// with the bits of the defaults in all of the first `effort.rounds` rounds is left out of further ones: its errors equal theirs,
/// and its time is known well enough.
///
/// # Errors
/// Where a render cannot start.
pub fn rounds(
    scene: &Scene,
    variants: &[Variant],
    effort: &Effort,
    watch: &dyn Observer,
    mut more: impl FnMut(usize) -> bool,
) -> Result<Vec<Runs>, SetupError> {
    let mut all: Vec<Runs> = vec![Vec::new(); variants.len()];
    let mut round = 0;
    while !watch.stopped() && (round < effort.rounds || more(round)) {
        let seed = effort.seed.wrapping_add(round as u32);
        let settled = |runs: &Runs| round >= effort.rounds && runs.iter().all(|run| run.same_bits);
        let due: Vec<usize> = (0..variants.len())
            .filter(|&which| which == 0 || !settled(&all[which]))
            .collect();
        for turn in 0..due.len() {
            let which = due[(turn + round) % due.len()];
            all[which].push(run(scene, &variants[which], effort, seed, watch)?);
        }
        share(&mut all, round);
        round += 1;
    }
    Ok(all)
}

/// Shares one copy of pictures with the bits of the defaults, and records that they are equal.
fn share(all: &mut [Runs], round: usize) {
    let Some((defaults, others)) = all.split_first_mut() else {
        return;
    };
    let default = &defaults[round];
    for run in others.iter_mut().filter_map(|runs| runs.get_mut(round)) {
        run.same_bits = true;
        for (look, plain) in run.looks.iter_mut().zip(&default.looks) {
            if bits(&look.pixels) == bits(&plain.pixels) {
                look.pixels = plain.pixels.clone();
            } else {
                run.same_bits = false;
            }
        }
    }
}

fn bits(pixels: &[[f32; 3]]) -> &[u32] {
    bytemuck::cast_slice(pixels)
}
