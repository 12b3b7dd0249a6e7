//! Shading under many lights at points with lobes of their own: every point walks down the tree of lights by itself, where that is
//! better than a list for its tile ([`Table::walked`]).
//!
//! A point walks some times in a pass, with one number in each of as many equal intervals: so its walks of a pass, and those of
//! several passes, represent all lights. Where `n` is the expected number of walks that end at a light, estimates and MIS weights are
//! those of lists: `f m / (n (m p + q))` for a light sample and `f / (m p + q)` for a BRDF sample, with the same `m`
//! ([`Lists::guess`]).

use std::marker::PhantomData;

use super::listed::sample_brdf;
use super::shade::prepare;
use super::{Chunk, Request, Scratch, Stage, pairs};
use crate::bsdf::{Brdf, Tint};
use crate::embree::TraceLane;
use crate::estimator::density::{ListedEach, Mix};
use crate::estimator::{ShadingPoint, per_delta, per_light, per_triangle};
use crate::lane::{Bits, Lane, Mask};
use crate::light::View;
use crate::light::delta::{Place, Placed};
use crate::light::falloff::{Cones, Falloff};
use crate::light::tree::{Digits, From, Table, Walked};
use crate::light::triangle::{Triangle, Triangles};
use crate::math::Vec3;
use crate::pipeline::columns::CAPACITY;
use crate::pipeline::lists::{Lists, Member, Probed, UNIT, level};
use crate::pipeline::queue::{QueuedRays, WideQueue};
use crate::pipeline::stream::Address;
use crate::pipeline::world::World;
use crate::sampling::Pair;
use crate::shape::NO_SKIP_ID;

/// Some lights of its own for every point.
pub struct PerWalked<M>(PhantomData<M>);

impl<M: Probed> Stage for PerWalked<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            picks,
            aimed,
            looks,
            set,
            ..
        } = scratch;
        let (Some(lists), Some(stream)) = (chunk.lists, M::stream_mut(hits)) else {
            return;
        };
        let (mix, all) = (lists.mix(chunk.mix, chunk.mix), stream.len());
        let mut divided = false;
        for pass in levels(chunk) {
            let Some(table) = lists.tabulated(chunk, M::KIND, pass) else {
                continue;
            };
            let Some(starts) = table.starts() else { continue };
            if !divided {
                picks.divide(chunk, stream);
                divided = true;
            }
            let way = Way {
                lists,
                mix,
                walks: lists.walks(),
                table: mix.mixed().then_some(table),
            };
            chunk.request(Request::All { set });
            for part in picks.neighbors(pass) {
                stream.end_at(part.end);
                prepare::<L, Mix, M>(mix, chunk, stream, part.clone());
                for at in part.clone().step_by(L::N) {
                    let (mut active, point, address) = stream.packet::<L>(at);
                    if mix == Mix::Average {
                        active = active & !stream.by_brdf_lanes::<L>(at);
                    }
                    if active.none() {
                        continue;
                    }
                    let from = seen_from::<L, M>(&point);
                    let shares = starts.shares(lists.tree(), from);
                    let pair = |i: u32| number(chunk, mix, &address, i);
                    for i in (0..way.walks).step_by(2) {
                        let other = active & L::Mask::splat(i + 1 < way.walks);
                        let digits = |i: u32| Digits::<L>::new(pair(0), i, way.walks);
                        let digits = [digits(i), digits(i + 1)];
                        let walked = lists.tree().walk([active, other], (starts, &shares), from, digits);
                        for (i, (active, walked)) in (i..way.walks).zip([active, other].into_iter().zip(&walked)) {
                            way.toward::<L, M>(chunk.world, (&point, &address), active, walked, pair(1 + i), aimed);
                        }
                    }
                    if aimed.len() + L::N * way.walks as usize > CAPACITY {
                        chunk.request(Request::VisibleEach { queue: aimed, set });
                    }
                }
                chunk.request(Request::VisibleEach { queue: aimed, set });
                if mix.mixed() {
                    sample_brdf::<L, M>(mix, chunk, stream, part, looks);
                }
                stream.end_at(all);
            }
            if looks.len() > 0 {
                chunk.request(Request::Met {
                    queue: looks,
                    set,
                    lists,
                    table,
                    spheres: true,
                });
            }
        }
    }
}

/// A pass of each level of tables in the chunk.
fn levels(chunk: &Chunk) -> Vec<u32> {
    let mut passes: Vec<u32> = chunk
        .pass_order
        .iter()
        .map(|pass| chunk.numbers.first() + pass)
        .collect();
    passes.sort_unstable();
    passes.dedup_by_key(|pass| level(*pass));
    passes
}

/// Numbers of the walks of a point and pass (0), and of the places on the lights that they find (from 1).
#[inline(always)]
pub fn number<L: Lane>(chunk: &Chunk, mix: Mix, address: &Address<L>, i: u32) -> Pair<L::Bits> {
    let pair = pairs::light(i as usize);
    if mix == Mix::Average {
        chunk.numbers.after_toss(address.key, address.pass, pair)
    } else {
        chunk.numbers.pair(address.key, address.pass, pair)
    }
}

/// A point in units of the tree, with its normal and its lobe.
#[inline(always)]
pub fn seen_from<L: TraceLane, M: Probed>(point: &ShadingPoint<L, M::Of<L>>) -> From<L> {
    let lobe = M::lobe::<L>(&point.bsdf);
    (point.p * L::splat(UNIT), point.bsdf.normal(), lobe)
}

/// What weighs the lights that walks find.
pub struct Way<'a> {
    pub lists: &'a Lists,
    /// How light and BRDF sampling are combined.
    pub mix: Mix,
    /// Walks of a point in a pass.
    pub walks: u32,
    /// What estimates how often a light is found, if the BRDF is sampled too.
    pub table: Option<&'a Table>,
}

impl Way<'_> {
    /// Queues a ray to the light that was found in each lane.
    #[inline(always)]
    pub fn toward<L: TraceLane, M: Probed>(
        &self,
        world: &World,
        (point, address): (&ShadingPoint<L, M::Of<L>>, &Address<L>),
        active: L::Mask,
        walked: &Walked<L>,
        pair: Pair<L::Bits>,
        aimed: &mut WideQueue,
    ) {
        let found = Found::<L>::of(world, self, active, walked);
        // A light near the camera has a view of its own; one in each lane has all other lights.
        let mut spheres = active & found.spheres;
        while spheres.any() {
            let near = (spheres & found.near).lanes().next();
            let (view, these) = match near {
                Some(lane) => (
                    world.lights[found.number[lane]].seen_from(point.p),
                    L::Mask::from_bitmask(1 << lane),
                ),
                None => (View::of(found.center - point.p, found.radius), spheres),
            };
            spheres = spheres & !these;
            let these = these & per_light::may_contribute(point, &view);
            let drawn = per_light::draw(&view, pair);
            let density = ListedEach::new(self.mix, found.guess);
            if let Some(sampled) = per_light::by_light(density, point, &drawn, these) {
                let le = found.le;
                let value = sampled.weight.colour(le.times(point.bsdf.rho()), le);
                let rays = QueuedRays {
                    origin: point.p,
                    direction: sampled.wi,
                    tfar: sampled.distance,
                    value: value.or_zero(sampled.active),
                    index: address.index,
                };
                aimed.push(sampled.active, &rays, L::from_bits(found.skip_id));
            }
        }
        let deltas = active & found.deltas;
        if deltas.any() {
            let arriving = found.delta.seen_from(point.p);
            if let Some(sampled) = per_delta::sample(point, found.le, &arriving, deltas) {
                let rays = QueuedRays::to_light(point, address, &sampled);
                aimed.push(sampled.active, &rays, L::from_bits(found.skip_id));
            }
        }
        let triangles = active & !found.spheres & !found.deltas;
        if triangles.any() {
            let view = found.triangles.seen_from(point.p);
            let triangles = triangles & view.rises_above(point.bsdf.normal());
            let (u, v) = pair.unit::<L>();
            let by_brdf_lanes = L::Mask::splat(false);
            let numbers = per_triangle::Numbers { by_brdf_lanes, u, v };
            let worth = (found.le, found.guess);
            if let Some(sampled) = per_triangle::sample(self.mix, point, &view, worth, numbers, triangles) {
                let rays = QueuedRays::to_light(point, address, &sampled);
                aimed.push(sampled.active, &rays, L::from_bits(found.skip_id));
            }
        }
    }
}

/// A light in each lane.
struct Found<L: Lane> {
    spheres: L::Mask,
    near: L::Mask,
    number: [usize; 16],
    center: Vec3<L>,
    radius: L,
    /// The radiance, or of a delta light the irradiance, that the light counts for.
    le: Vec3<L>,
    /// A factor for the density of light sampling.
    guess: L,
    triangles: Triangles<L>,
    deltas: L::Mask,
    delta: Placed<L>,
    skip_id: L::Bits,
}

impl<L: Lane> Found<L> {
    #[inline(always)]
    fn of(world: &World, way: &Way, active: L::Mask, walked: &Walked<L>) -> Self {
        let lists = way.lists;
        let mut columns = [[0.0_f32; 16]; 21];
        let (mut skip_id, mut number, mut spheres, mut deltas, mut near) = ([0_u32; 16], [0; 16], 0, 0, 0);
        for lane in active.lanes() {
            let leaf = walked.leaf[lane];
            let mut put = |first: usize, numbers: &[f32]| {
                for (column, &number) in columns[first..].iter_mut().zip(numbers) {
                    column[lane] = number;
                }
            };
            let guess = || way.table.map_or(1.0, |table| table.guess(lists.tree(), leaf));
            match lists.kind(lists.tree().light(leaf)) {
                Member::Sphere(i) => {
                    let light = &world.lights[i];
                    put(0, &light.center);
                    put(3, &[light.radius]);
                    put(4, &light.le);
                    put(20, &[guess()]);
                    skip_id[lane] = light.sphere;
                    number[lane] = i;
                    spheres |= 1 << lane;
                    near |= u32::from(light.origin_power.is_some()) << lane;
                }
                Member::Triangle(i) => {
                    let light = &world.triangle_lights[i];
                    let Triangle { corners, normal, area } = light.triangle;
                    put(4, &light.le);
                    put(7, corners.as_flattened());
                    put(16, &normal);
                    put(19, &[area]);
                    put(20, &[guess()]);
                    skip_id[lane] = light.skip_id;
                }
                Member::Delta(i) => {
                    let light = &world.delta_lights[i];
                    if let Place::At { position, unit, spot } = light.place {
                        put(0, &position);
                        put(3, &[unit]);
                        put(7, &spot.unwrap_or(Falloff::NONE).columns());
                    }
                    put(4, &light.le);
                    put(20, &[way.mix.alone()]);
                    skip_id[lane] = NO_SKIP_ID;
                    deltas |= 1 << lane;
                }
            }
        }
        let vector = |k: usize| Vec3::new(L::load(&columns[k]), L::load(&columns[k + 1]), L::load(&columns[k + 2]));
        let guess = L::select(active, L::load(&columns[20]), L::one());
        let chance = mutate!(walked.chance, WalkForgotten => L::splat(1.0 / lists.tree().len() as f32));
        let expected = chance * L::splat(way.walks as f32);
        Self {
            spheres: L::Mask::from_bitmask(spheres),
            near: L::Mask::from_bitmask(near),
            number,
            center: vector(0),
            radius: L::load(&columns[3]),
            le: vector(4) * (guess / expected),
            guess,
            triangles: Triangles {
                corners: [vector(7), vector(10), vector(13)],
                normal: vector(16),
                area: L::load(&columns[19]),
            },
            deltas: L::Mask::from_bitmask(deltas),
            delta: Placed {
                position: vector(0),
                unit: L::load(&columns[3]),
                cones: Cones {
                    axis: vector(7),
                    outer: L::load(&columns[10]),
                    slope: L::load(&columns[11]),
                },
            },
            skip_id: L::Bits::load(&skip_id),
        }
    }
}
