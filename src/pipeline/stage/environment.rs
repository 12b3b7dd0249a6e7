//! Shading under what lies beyond the scene, by estimators that draw a direction for every light. How it is weighed is looked up when
//! the stage runs: it is no part of what is compiled.

use std::marker::PhantomData;

use super::{Ask, Chunk, Scratch, Stage};
use crate::embree::TraceLane;
use crate::estimator::per_environment;
use crate::light::Environment;
use crate::light::environment::Beyond;
use crate::linear::Candidates;
use crate::pipeline::model::Model;
use crate::pipeline::queue::{QueuedRays, RayQueue};
use crate::pipeline::stream::ModelStream;
use crate::shape::NO_SPHERE;

/// A direction for the environment.
pub struct PerEnvironment<M>(PhantomData<M>);

impl<M: Model> Stage for PerEnvironment<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { hits, queue, set, .. } = scratch;
        let hits = M::stream(hits);
        match &chunk.world.environment {
            Some(Environment::Constant(constant)) => under::<L, M, _>(chunk, hits, queue, set, constant),
            Some(Environment::LatLong(picture)) => under::<L, M, _>(chunk, hits, queue, set, picture),
            None => {}
        }
    }
}

#[inline(always)]
fn under<L: TraceLane, M: Model, B: Beyond>(
    chunk: &mut Chunk,
    stream: &ModelStream<M>,
    queue: &mut RayQueue,
    set: &mut Candidates,
    beyond: &B,
) {
    let world = chunk.world;
    let light = world.lights.len() + world.triangle_lights.len() + world.mesh_lights.len();
    for time in 0..chunk.tosses() {
        for at in (0..stream.len()).step_by(L::N) {
            let (active, point, address) = stream.packet::<L>(at);
            let toss = chunk.toss(&address, light, time);
            let Some(found) = per_environment::sample(chunk.mix, &point, beyond, toss, active) else {
                continue;
            };
            queue.push(found.active, &QueuedRays::to_light(&point, &address, &found));
        }
        if queue.len() > 0 {
            chunk.ask(Ask::All { set });
            chunk.ask(Ask::Visible {
                queue,
                set,
                light: NO_SPHERE,
            });
        }
    }
}
