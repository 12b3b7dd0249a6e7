//! Requests of the shading stages to the intersector, a whole queue at a time.
//!
//! Request handlers are compiled for every lane width and intersector. The shading loops call them through a function pointer once
//! per queue, so these loops are compiled for lane widths only: half as many copies, none of which contain tracing code. One call
//! serves hundreds of rays.

use std::marker::PhantomData;

use super::chunk::Chunk;
use super::{met, shadow};
use crate::embree::{LaneWork, TraceLane, in_eight_of_avx512, in_sixteen};
use crate::lane::{F32x8, has_avx512};
use crate::light::MeshLight;
use crate::light::tree::Table;
use crate::linear::Candidates;
use crate::linear::cull::{Bounds, Points};
use crate::pipeline::lists::{Kind, Lists};
use crate::pipeline::queue::{RayQueue, WideQueue};
use crate::pipeline::stream::HitStream;
use crate::pipeline::tracer::{BruteForce, ByEmbree, Tracer};
use crate::settings::{AccelKind, Lanes};
use crate::shape::BoundingSphere;

/// A request.
pub enum Request<'a> {
    /// Bounds the points of a stream, which must not be empty.
    Survey {
        stream: &'a HitStream,
        points: &'a mut Points,
    },
    /// Culls occluders for rays from the points of a bounded stream into a sphere; the shape `skip_id` never occludes them. Sets
    /// `open` if nothing can block them, so that no ray needs tracing.
    Shaft {
        stream: &'a HitStream,
        points: &'a mut Points,
        ball: BoundingSphere,
        skip_id: u32,
        /// What [`Self::Bundle`] kept, if it was asked.
        wide: Option<&'a Candidates>,
        open: &'a mut bool,
        set: &'a mut Candidates,
    },
    /// Culls occluders for rays from the points of a bounded stream into a box, to be culled again for each light in it.
    Bundle {
        stream: &'a HitStream,
        points: &'a mut Points,
        bounds: Bounds,
        /// What was kept for a larger box, if anything.
        wide: Option<&'a Candidates>,
        set: &'a mut Candidates,
    },
    /// Keeps all shapes, for arbitrary rays.
    All { set: &'a mut Candidates },
    /// See [`shadow::splat_unoccluded`].
    Visible {
        queue: &'a mut RayQueue,
        set: &'a Candidates,
        light: u32,
    },
    /// See [`shadow::visible_each`].
    VisibleEach {
        queue: &'a mut WideQueue,
        set: &'a Candidates,
    },
    /// See [`shadow::resolve_mesh_hits`].
    Looked {
        queue: &'a mut WideQueue,
        set: &'a Candidates,
        light: &'a MeshLight,
    },
    /// See [`met::met`].
    Met {
        queue: &'a mut WideQueue,
        set: &'a Candidates,
        lists: &'a Lists,
        table: &'a Table,
        spheres: bool,
    },
    /// See [`Lists::tabulate`].
    Tabulate { lists: &'a Lists, kind: Kind, pass: u32 },
    /// See [`shadow::resolve_emitter_hits`].
    Emitted {
        queue: &'a mut RayQueue,
        set: &'a Candidates,
    },
}

/// Request handler of one intersector and packet width.
#[derive(Clone, Copy, Debug)]
pub struct RequestHandler {
    handle: fn(&mut Chunk, Request),
    /// Points per block; a block is shaded for all lights before the next one.
    pub block: usize,
}

impl RequestHandler {
    /// For packets of 1, 8 or 16 lanes. Eight lanes use AVX-512 if the processor has it.
    pub fn of(accel: AccelKind, lanes: Lanes) -> Self {
        match accel {
            AccelKind::Embree => Self::by::<ByEmbree>(lanes),
            AccelKind::Linear => Self::by::<BruteForce>(lanes),
        }
    }

    fn by<T: Tracer>(lanes: Lanes) -> Self {
        let handle: fn(&mut Chunk, Request) = match lanes {
            Lanes::Sixteen => |chunk, request| in_sixteen(Handling::<T>(chunk, request, PhantomData)),
            Lanes::Eight if has_avx512() => {
                |chunk, request| in_eight_of_avx512(Handling::<T>(chunk, request, PhantomData))
            }
            Lanes::Eight => |chunk, request| Handling::<T>(chunk, request, PhantomData).run::<F32x8>(),
            Lanes::One => |chunk, request| Handling::<T>(chunk, request, PhantomData).run::<f32>(),
        };
        let block = T::BLOCK;
        Self { handle, block }
    }
}

impl Chunk<'_> {
    /// Sends a request to the intersector of the plan.
    pub fn request(&mut self, request: Request) {
        (self.handler.handle)(self, request);
    }
}

/// A request with its chunk, generic over the lane width.
struct Handling<'a, 'c, T>(&'a mut Chunk<'c>, Request<'a>, PhantomData<T>);

impl<T: Tracer> LaneWork for Handling<'_, '_, T> {
    #[inline(always)]
    fn run<L: TraceLane>(self) {
        let Self(chunk, request, _) = self;
        match request {
            Request::Survey { stream, points } => T::bound_points::<L>(chunk.world, stream, points),
            Request::Shaft {
                stream,
                points,
                ball,
                skip_id,
                wide,
                open,
                set,
            } => *open = T::face_ball::<L>(chunk.world, stream, points, (&ball, skip_id), wide, set),
            Request::Bundle {
                stream,
                points,
                bounds,
                wide,
                set,
            } => T::face_box::<L>(chunk.world, stream, points, &bounds, wide, set),
            Request::All { set } => T::keep_all(chunk.world, set),
            Request::Visible { queue, set, light } => shadow::splat_unoccluded::<L, T>(chunk, queue, set, light),
            Request::VisibleEach { queue, set } => shadow::visible_each::<L, T>(chunk, queue, set),
            Request::Looked { queue, set, light } => shadow::resolve_mesh_hits::<L, T>(chunk, queue, set, light),
            Request::Met {
                queue,
                set,
                lists,
                table,
                spheres,
            } => met::met::<L, T>(chunk, queue, set, (lists, table), spheres),
            Request::Tabulate { lists, kind, pass } => lists.tabulate::<T>(chunk, kind, pass),
            Request::Emitted { queue, set } => shadow::resolve_emitter_hits::<L, T>(chunk, queue, set),
        }
    }
}
