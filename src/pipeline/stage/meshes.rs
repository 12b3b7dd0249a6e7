//! Shading under large emissive meshes, for estimators that sample every light: each point samples one triangle per mesh. The
//! weighting of techniques is read at run time, not compiled in.

use std::marker::PhantomData;

use super::{Chunk, Request, Scratch, Stage};
use crate::bsdf::Brdf;
use crate::embree::TraceLane;
use crate::estimator::per_triangle;
use crate::lane::Mask;
use crate::math::Vec3;
use crate::pipeline::lights::Kind;
use crate::pipeline::model::Model;
use crate::pipeline::queue::QueuedRays;
use crate::shape::{BoundingSphere, NO_SKIP_ID};

/// Samples every large mesh.
pub struct PerMesh<M>(PhantomData<M>);

impl<M: Model> Stage for PerMesh<M> {
    /// A BRDF ray is traced to the first triangle that it hits; only then the density of light sampling is known.
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch {
            hits,
            aimed,
            looks,
            points,
            set,
            ..
        } = scratch;
        let world = chunk.world;
        let first = world.first(Kind::Meshes);
        let Some(stream) = M::stream(hits) else { return };
        chunk.request(Request::Survey { stream, points });
        for (i, light) in (first..).zip(&world.mesh_lights) {
            let le = Vec3::splat(light.le);
            for at in (0..stream.len()).step_by(L::N) {
                let (active, point, address) = stream.packet::<L>(at);
                for time in 0..chunk.mix.times() {
                    let technique_sample = chunk.technique_sample(chunk.mix, &address, i, time);
                    let by_brdf = if chunk.mix.mixed() {
                        technique_sample.by_brdf_lanes & active
                    } else {
                        L::Mask::splat(false)
                    };
                    let by_light = active & !by_brdf;
                    if by_light.any() {
                        let picked = light.pick::<L>(technique_sample.pair, by_light);
                        let (u, v) = picked.numbers;
                        let by_brdf_lanes = L::Mask::splat(false);
                        let numbers = per_triangle::Numbers { by_brdf_lanes, u, v };
                        let view = picked.triangles.seen_from(point.p);
                        let by_light = by_light & view.rises_above(point.bsdf.normal());
                        let le_and_share = (le, picked.share);
                        if let Some(found) =
                            per_triangle::sample(chunk.mix, &point, &view, le_and_share, numbers, by_light)
                        {
                            let rays = QueuedRays::to_light(&point, &address, &found);
                            aimed.push(found.active, &rays, L::from_bits(picked.skip_id));
                        }
                    }
                    if by_brdf.any()
                        && let Some(look) = per_triangle::look(&point, technique_sample.pair, by_brdf)
                    {
                        let rays = QueuedRays {
                            origin: point.p,
                            direction: look.wi,
                            tfar: L::splat(f32::INFINITY),
                            value: look.f_cos,
                            index: address.index,
                        };
                        looks.push(look.active, &rays, look.pdf);
                    }
                }
            }
            if aimed.len() + looks.len() > 0 {
                let (center, radius) = (light.center, light.radius);
                chunk.request(Request::Shaft {
                    stream,
                    points,
                    ball: BoundingSphere { center, radius },
                    skip_id: NO_SKIP_ID,
                    wide: None,
                    open: &mut false,
                    set,
                });
                chunk.request(Request::VisibleEach { queue: aimed, set });
                chunk.request(Request::Looked {
                    queue: looks,
                    set,
                    light,
                });
            }
        }
    }
}
