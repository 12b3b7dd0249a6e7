//! `product` on diffuse surfaces: cosine-weighted directions, each of which brings the same amount of light. So where nothing can
//! block a light that is wholly above the horizon, no direction is sampled at all.

use std::ops::Range;

use super::Chunk;
use super::shade::{Light, Sink};
use crate::embree::TraceLane;
use crate::estimator::density::DiskOrCone;
use crate::estimator::{per_light, product};
use crate::lane::Mask;
use crate::pipeline::model;
use crate::pipeline::stream::ModelStream;

/// Samples a light for the points of a block: one direction, or the first or second of two for points that see it partially.
#[inline(always)]
pub fn toward_disk<L: TraceLane>(
    chunk: &Chunk,
    stream: &mut ModelStream<model::Diffuse>,
    block: Range<usize>,
    light: &Light,
    sink: &mut Sink,
) {
    let second = light.half.is_some_and(|half| half.second);
    for at in block.step_by(L::N) {
        let mut active = stream.lanes::<L>(at);
        if let Some(half) = light.half
            && second
        {
            active = active & mutate!(stream.partly::<L>(at, half.bit), SecondForAll => L::Mask::splat(true));
            if active.none() {
                continue;
            }
        }
        let (_, point, address) = stream.packet::<L>(at);
        let view = light.sphere.seen_from(point.p);
        active = active & per_light::may_contribute(&point, &view);
        if active.none() {
            continue;
        }
        let clears = mutate!(product::clears(&point, &view), OpenLightNeverSets => L::Mask::splat(true));
        if sink.open && (active & !clears).none() {
            let found = product::unoccluded(&point, &view, active);
            sink.take(stream, at, &light.sphere, &found);
            continue;
        }
        let mut numbers = chunk.numbers.pair(address.key, address.pass, light.pair);
        if second {
            numbers = numbers.opposite();
        }
        if let Some(mut found) = product::by_disk_or_cone(DiskOrCone, &point, &view, numbers, active) {
            if let Some(half) = light.half {
                let share = L::splat(mutate!(0.5, BothHalvesWhole => 1.0));
                let share = L::select(stream.partly::<L>(at, half.bit), share, L::one());
                found.weight = found.weight * share;
            }
            sink.take(stream, at, &light.sphere, &found);
        }
    }
}
