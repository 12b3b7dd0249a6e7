//! The rivals of lists (feature `rival`): every point walks down the tree of lights by itself, half as often as a list is long, and
//! traces one ray to each light that it finds. For measurements only, and for `light` only.

use std::marker::PhantomData;

use super::{Chunk, Request, Scratch, Stage, pairs};
use crate::bsdf::{Brdf, Tint};
use crate::embree::TraceLane;
use crate::estimator::density::{ConeOnly, Mix};
use crate::estimator::{per_light, per_triangle};
use crate::lane::{Bits, Lane, Mask};
use crate::light::View;
use crate::light::triangle::{Triangle, Triangles};
use crate::math::Vec3;
use crate::pipeline::lists::{Lists, Probed, UNIT};
use crate::pipeline::queue::QueuedRays;
use crate::pipeline::world::World;

/// One light of its own for every point.
pub struct PerWalked<M>(PhantomData<M>);

impl<M: Probed> Stage for PerWalked<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { hits, aimed, set, .. } = scratch;
        let world = chunk.world;
        let (Some(lists), Some(stream)) = (&world.lists, M::stream(hits)) else {
            return;
        };
        let Some(guide) = &lists.guide else { return };
        let times = (lists.length() / 2).max(1);
        chunk.request(Request::All { set });
        for i in 0..times as usize {
            for at in (0..stream.len()).step_by(L::N) {
                let (active, point, address) = stream.packet::<L>(at);
                let pair = |i: usize| chunk.numbers.pair(address.key, address.pass, pairs::light(i));
                let (number, _) = pair(2 * i).unit::<L>();
                let from = (point.p * L::splat(UNIT), point.bsdf.normal(), M::lobe::<L>(&point.bsdf));
                let walked = lists.tree().walk(guide, active, from, number);
                let active = active & walked.chance.gt(L::zero());
                let expected = walked.chance * L::splat(times as f32);
                let lamps = Lamps::<L>::of(world, lists, active, &walked.leaf);
                let spheres = active & lamps.spheres;
                if spheres.any() {
                    let view = View::of(lamps.center - point.p, lamps.radius);
                    let spheres = spheres & per_light::may_contribute(&point, &view);
                    let drawn = per_light::draw(&view, pair(2 * i + 1));
                    if let Some(found) = per_light::by_light(ConeOnly, &point, &drawn, spheres) {
                        let le = lamps.le * (L::one() / expected);
                        let rays = QueuedRays {
                            origin: point.p,
                            direction: found.wi,
                            tfar: found.distance,
                            value: found
                                .weight
                                .colour(le.times(point.bsdf.rho()), le)
                                .or_zero(found.active),
                            index: address.index,
                        };
                        aimed.push(found.active, &rays, L::from_bits(lamps.skip_id));
                    }
                }
                let triangles = active & !lamps.spheres;
                if triangles.any() {
                    let view = lamps.triangles.seen_from(point.p);
                    let triangles = triangles & view.rises_above(point.bsdf.normal());
                    let (u, v) = pair(2 * i + 1).unit::<L>();
                    let by_brdf_lanes = L::Mask::splat(false);
                    let numbers = per_triangle::Numbers { by_brdf_lanes, u, v };
                    let worth = (lamps.le, expected);
                    if let Some(found) = per_triangle::sample(Mix::Light, &point, &view, worth, numbers, triangles) {
                        let rays = QueuedRays::to_light(&point, &address, &found);
                        aimed.push(found.active, &rays, L::from_bits(lamps.skip_id));
                    }
                }
            }
            chunk.request(Request::VisibleEach { queue: aimed, set });
        }
    }
}

/// A light in each lane.
struct Lamps<L: Lane> {
    spheres: L::Mask,
    center: Vec3<L>,
    radius: L,
    le: Vec3<L>,
    triangles: Triangles<L>,
    skip_id: L::Bits,
}

impl<L: Lane> Lamps<L> {
    #[inline(always)]
    fn of(world: &World, lists: &Lists, active: L::Mask, leaf: &[u32; 16]) -> Self {
        let mut columns = [[0.0_f32; 16]; 20];
        let (mut skip_id, mut spheres) = ([0_u32; 16], 0);
        for lane in active.lanes() {
            let mut put = |first: usize, numbers: [f32; 3]| {
                for (k, number) in numbers.into_iter().enumerate() {
                    columns[first + k][lane] = number;
                }
            };
            match lists.kind(lists.tree().light(leaf[lane])) {
                (true, i) => {
                    let light = &world.lights[i];
                    put(0, light.center);
                    put(4, light.le);
                    columns[3][lane] = light.radius;
                    skip_id[lane] = light.sphere;
                    spheres |= 1 << lane;
                }
                (false, i) => {
                    let light = &world.triangle_lights[i];
                    let Triangle { corners, normal, area } = light.triangle;
                    put(4, light.le);
                    (0..3).for_each(|k| put(7 + 3 * k, corners[k]));
                    put(16, normal);
                    columns[19][lane] = area;
                    skip_id[lane] = light.skip_id;
                }
            }
        }
        let vector = |k: usize| Vec3::new(L::load(&columns[k]), L::load(&columns[k + 1]), L::load(&columns[k + 2]));
        Self {
            spheres: L::Mask::from_bitmask(spheres),
            center: vector(0),
            radius: L::load(&columns[3]),
            le: vector(4),
            triangles: Triangles {
                corners: [vector(7), vector(10), vector(13)],
                normal: vector(16),
                area: L::load(&columns[19]),
            },
            skip_id: L::Bits::load(&skip_id),
        }
    }
}
