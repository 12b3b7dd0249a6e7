//! `render --target-error`: replicates side by side until their spread is small enough.

use std::time::Instant;

use super::options;
use super::progress::Bar;
use super::stats::Times;
use crate::film::Picture;
use crate::pipeline::Renderer;
use crate::study::target;

/// What was asked for and what was reached.
#[derive(Clone, Copy, Debug)]
pub struct Reached {
    /// What was asked for.
    pub asked: f64,
    /// What the replicates show.
    pub error: f64,
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
/// so many samples a pixel. `siblings` are the further replicates, none at the start. All have the same passes then, unless a
/// stop cut a block short; `None` where it came before the first look, else the error is that of the last look.
pub fn render(
    first: &mut Renderer,
    siblings: &mut Vec<Renderer>,
    seed: u32,
    asked: f64,
    times: &mut Times,
    bar: impl Fn(u32) -> Bar,
) -> Option<Reached> {
    let progress = first.progress();
    let started = Instant::now();
    let (mut work, mut expected, mut error) = (target::FIRST, target::FIRST.samples() as f64, None);
    while !progress.stop_requested() && work.samples() <= options::MOST_SPP {
        let shown = bar(expected as u32);
        for replicate in siblings.len() + 1..work.replicates {
            siblings.push(first.with_seed(target::seed(seed, replicate)));
        }
        let mut pictures = Vec::with_capacity(work.replicates);
        for renderer in std::iter::once(&mut *first).chain(&mut *siblings) {
            while renderer.passes() < work.passes && !progress.stop_requested() {
                renderer.next_block(work.passes);
                if times.first_pass_s == 0.0 {
                    times.first_pass_s = started.elapsed().as_secs_f64();
                }
            }
            pictures.push(renderer.picture());
        }
        drop(shown);
        if progress.stop_requested() {
            break;
        }
        let seen = target::error(&pictures);
        error = Some(seen.error);
        match target::next(asked, work, seen) {
            Some(next) => {
                expected = (work.samples() as f64 * (seen.error / asked).powi(2)).max(next.samples() as f64);
                work = next;
            }
            None => break,
        }
    }
    // A stop leaves some without a pass, which is no picture.
    siblings.retain(|sibling| sibling.passes() > 0);
    times.render_s = started.elapsed().as_secs_f64();
    error.map(|error| Reached { asked, error })
}
