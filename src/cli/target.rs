//! `render --target-error`: replicates side by side until their spread is small enough.

use std::time::Instant;

use super::options;
use super::progress::Bar;
use super::stats::Times;
use crate::film::Picture;
use crate::pipeline::Renderer;
use crate::study::target::{self, Approach, FIRST_LOOK};

/// What was asked for and what was reached.
#[derive(Clone, Copy, Debug)]
pub struct Reached {
    /// What was asked for.
    pub asked: f64,
    /// What the replicates show.
    pub error: f64,
}

/// The other replicates of a render.
pub fn siblings(first: &Renderer, seed: u32) -> Vec<Renderer> {
    let others = 1..target::REPLICATES;
    others
        .map(|replicate| first.with_seed(target::seed(seed, replicate)))
        .collect()
}

/// The picture of all replicates together.
pub fn picture(first: &Renderer, siblings: &[Renderer]) -> Picture {
    if siblings.is_empty() {
        return first.picture();
    }
    let all = std::iter::once(first).chain(siblings);
    target::mean(&all.map(Renderer::picture).collect::<Vec<_>>())
}

/// Renders until the error is reached, a stop is asked for, or there are more samples than can be counted. `bar` shows the way to
/// so many samples a pixel. All replicates have the same passes then, unless a stop cut a block short.
pub fn render(
    first: &mut Renderer,
    siblings: &mut [Renderer],
    asked: f64,
    times: &mut Times,
    bar: impl Fn(u32) -> Bar,
) -> Reached {
    let progress = first.progress();
    let count = target::REPLICATES as u32;
    let started = Instant::now();
    let mut approach = Approach::new(asked);
    let (mut look, mut expected, mut error) = (FIRST_LOOK, FIRST_LOOK, f64::INFINITY);
    while !progress.stop_requested() && u64::from(look) * u64::from(count) <= options::MOST_SPP {
        let shown = bar(expected.saturating_mul(count));
        let mut pictures = Vec::with_capacity(target::REPLICATES);
        for renderer in std::iter::once(&mut *first).chain(&mut *siblings) {
            while renderer.passes() < look && !progress.stop_requested() {
                renderer.next_block(look);
                if times.first_pass_s == 0.0 {
                    times.first_pass_s = started.elapsed().as_secs_f64();
                }
            }
            pictures.push(renderer.picture());
        }
        drop(shown);
        error = target::error(&pictures);
        match approach.next(look, error) {
            Some(next) => (look, expected) = next,
            None => break,
        }
    }
    times.render_s = started.elapsed().as_secs_f64();
    Reached { asked, error }
}
