//! Shading under the lights of one kind, for estimators that sample every light: one loop serves all kinds. The weighting of
//! techniques is read at run time, not compiled in.

use std::marker::PhantomData;
use std::slice;

use super::{Chunk, Request, Scratch, Stage, shadow};
use crate::embree::TraceLane;
use crate::estimator::density::Mix;
use crate::estimator::kind::LightKind;
use crate::lane::{Bits, Lane, Mask};
use crate::light::{Environment, Reach};
use crate::pipeline::lights::Kind;
use crate::pipeline::lists::Lists;
use crate::pipeline::model::Model;
use crate::pipeline::queue::QueuedRays;
use crate::pipeline::space::Space;
use crate::pipeline::stream::Address;
use crate::sampling::{Pair, TechniqueSample};

/// Samples every triangle of small meshes.
pub struct PerTriangle<M>(PhantomData<M>);

/// Samples the environment.
pub struct PerEnvironment<M>(PhantomData<M>);

/// Samples every sun.
pub struct PerSun<M>(PhantomData<M>);

/// Samples every delta light that is in no list: in all estimators, because no other technique can find them.
pub struct PerDelta<M>(PhantomData<M>);

impl<M: Model> Stage for PerTriangle<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let first = chunk.world.first(Kind::Triangles);
        each::<L, M, _>(chunk, scratch, first, &chunk.world.triangle_lights);
    }
}

impl<M: Model> Stage for PerEnvironment<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let first = chunk.world.first(Kind::Environment);
        match &chunk.world.environment {
            Some(Environment::Constant(constant)) => {
                each::<L, M, _>(chunk, scratch, first, slice::from_ref(constant));
            }
            Some(Environment::LatLong(picture)) => each::<L, M, _>(chunk, scratch, first, slice::from_ref(picture)),
            None => {}
        }
    }
}

impl<M: Model> Stage for PerSun<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let first = chunk.world.first(Kind::Suns);
        each::<L, M, _>(chunk, scratch, first, &chunk.world.suns);
    }
}

impl<M: Model> Stage for PerDelta<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        // Delta lights have no random numbers, so they have no index among the lights that do.
        let lights = chunk.lists.map_or(&*chunk.world.delta_lights, Lists::others);
        each::<L, M, _>(chunk, scratch, 0, lights);
    }
}

/// The random numbers for [`LightKind::sample`] of light `i`, in the first or second call; unused for a delta light.
#[inline(always)]
pub fn technique_sample<L: Lane, K: LightKind>(
    chunk: &Chunk,
    address: &Address<L>,
    mix: Mix,
    i: usize,
    time: u32,
) -> TechniqueSample<L::Bits> {
    if !K::DELTA {
        return chunk.technique_sample(mix, address, i, time);
    }
    let nothing = Bits::splat(0);
    TechniqueSample {
        by_brdf_lanes: L::Mask::splat(false),
        pair: Pair(nothing, nothing),
    }
}

/// Shades the lights of a kind; the first has index `first`. Lights are the outer loop: one light serves a whole stream, so its
/// shadow rays are as coherent as possible.
#[inline(always)]
fn each<L: TraceLane, M: Model, K: LightKind>(chunk: &mut Chunk, scratch: &mut Scratch, first: usize, lights: &[K]) {
    let Scratch {
        hits,
        queue,
        points,
        set,
        ..
    } = scratch;
    let Some(stream) = M::stream(hits) else { return };
    let mix = chunk.mix_of::<L, K, M::Of<L>>();
    let mut surveyed = false;
    for (i, light) in (first..).zip(lights) {
        let spread = light.spread::<L>();
        let times = if K::DELTA { 1 } else { mix.times() };
        for time in 0..times {
            for at in (0..stream.len()).step_by(L::N) {
                let (active, point, address) = stream.packet::<L>(at);
                let view = light.seen_from(&spread, point.p);
                let active = active & light.may_contribute(&point, &view);
                if active.none() {
                    continue;
                }
                let technique_sample = technique_sample::<L, K>(chunk, &address, mix, i, time);
                let Some(found) = light.sample(mix, &point, &view, technique_sample, active) else {
                    continue;
                };
                queue.push(found.active, &QueuedRays::to_light(&point, &address, &found));
            }
            if queue.len() == 0 {
                continue;
            }
            let mut open = false;
            let reach = light.bounds();
            if !surveyed && reach != Reach::Everywhere {
                chunk.request(Request::Survey { stream, points });
                surveyed = true;
            }
            match reach.bounding_sphere(&points.around(), Space::BEYOND) {
                None => chunk.request(Request::All { set }),
                Some(ball) => chunk.request(Request::Shaft {
                    stream,
                    points,
                    ball,
                    skip_id: light.id(),
                    wide: None,
                    open: &mut open,
                    set,
                }),
            }
            if open {
                shadow::unoccluded::<L>(chunk, queue);
            } else {
                chunk.request(Request::Visible {
                    queue,
                    set,
                    light: light.id(),
                });
            }
        }
    }
}
