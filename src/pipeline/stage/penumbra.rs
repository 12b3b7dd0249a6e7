//! Finds the points of a tile that see a light partially. There visibility is the only remaining noise of `product`.

use std::ops::Range;

use super::{Chunk, Request, Scratch, Stage};
use crate::embree::TraceLane;
use crate::estimator::density::ConeOnly;
use crate::estimator::per_light;
use crate::lane::{Bits, Lane, Mask};
use crate::light::SphereLight;
use crate::math::Vec3;
use crate::pipeline::model::{Diffuse, Model};
use crate::pipeline::queue::{QueuedRays, RayQueue};
use crate::pipeline::stream::{HitStream, ModelStream};
use crate::sampling::Pair;
use crate::shape::BoundingSphere;

/// Maximum number of lights that can be marked: the bits of a mark.
pub const MARKS: usize = 32;

/// Rays per point and light, evenly spaced around the rim. A straight edge that hides less than 2 % of the
/// disk may lie outside all of them.
const RAYS: u32 = 8;

/// Where the rays go within the light's cone, as the first of two random numbers: 15/16 of the solid angle are closer to the axis.
const RIM: u32 = 15 << 28;

/// Writes to `scratch.partly`, for each film index, the lights that its diffuse point sees partially.
pub struct Penumbra;

impl Stage for Penumbra {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            queue,
            points,
            set,
            partly,
            ..
        } = scratch;
        partly.clear();
        partly.resize(chunk.sum.0.len(), 0);
        let Some(stream) = Diffuse::stream(hits) else { return };
        chunk.request(Request::Survey { stream, points });
        let world = chunk.world;
        for (i, light) in world.lights.iter().enumerate().take(MARKS) {
            let ball = BoundingSphere {
                center: light.center,
                radius: light.radius,
            };
            let mut open = false;
            chunk.request(Request::Shaft {
                stream,
                points,
                ball,
                skip_id: light.sphere,
                wide: None,
                open: &mut open,
                set,
            });
            if open {
                continue;
            }
            // Each unoccluded ray adds 1 to red; each traced ray has added 1 to green.
            chunk.sum.0.fill([0.0; 4]);
            for turn in 0..RAYS {
                to_rim::<L>(chunk, stream, light, turn, queue);
                chunk.request(Request::Visible {
                    queue,
                    set,
                    light: light.sphere,
                });
            }
            for (mark, [splat_stream, all, ..]) in partly.iter_mut().zip(&chunk.sum.0) {
                *mark |= u32::from(0.0 < *splat_stream && splat_stream < all) << i;
            }
        }
    }
}

/// Queues a ray from every point to one place of the light's rim.
#[inline(always)]
fn to_rim<L: TraceLane>(
    chunk: &mut Chunk,
    stream: &ModelStream<Diffuse>,
    light: &SphereLight,
    turn: u32,
    queue: &mut RayQueue,
) {
    let numbers = Pair(L::Bits::splat(RIM), L::Bits::splat(turn * (u32::MAX / RAYS + 1)));
    for at in (0..stream.len()).step_by(L::N) {
        let (active, point, address) = stream.packet::<L>(at);
        let sampled = per_light::draw(&light.seen_from(point.p), numbers);
        let Some(found) = per_light::by_light(ConeOnly, &point, &sampled, active) else {
            continue;
        };
        for lane in found.active.lanes() {
            chunk.sum.add(address.index.lane(lane) as usize, &[0.0, 1.0, 0.0, 0.0]);
        }
        let rays = QueuedRays {
            origin: point.p,
            direction: found.wi,
            tfar: found.distance,
            value: Vec3::splat([1.0, 0.0, 0.0]),
            index: address.index,
        };
        queue.push(found.active, &rays);
    }
}

/// Selects one of two directions, for points that see a light partially.
#[derive(Clone, Copy, Debug)]
pub struct Half {
    /// Bit of the light in the marks.
    pub bit: u32,
    /// Whether it is the second direction.
    pub second: bool,
}

impl Half {
    /// The first direction to light `i`, if `partly` marks it.
    #[inline(always)]
    pub fn first(partly: u32, i: usize) -> Option<Self> {
        (i < MARKS && partly >> i & 1 == 1).then_some(Self {
            bit: i as u32,
            second: false,
        })
    }
}

/// Stores at each point of the block the lights that are partially visible around its pixel; returns their union.
#[inline(always)]
pub fn mark<L: Lane>(chunk: &Chunk, stream: &mut HitStream, block: Range<usize>) -> u32 {
    if chunk.partly.is_empty() {
        return 0;
    }
    let (mut index, mut lights, mut all) = ([0; 16], [0; 16], 0);
    for at in block.step_by(L::N) {
        stream.index::<L>(at).store(&mut index);
        for lane in 0..L::N {
            // While noise is measured, a pixel has several sums.
            lights[lane] = chunk.partly[index[lane] as usize % chunk.partly.len()];
            all |= lights[lane];
        }
        stream.set_partly::<L>(at, L::Bits::load(&lights));
    }
    all
}
