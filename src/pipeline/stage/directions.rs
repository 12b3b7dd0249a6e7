//! Which densities apply to which BRDF models.

use std::ops::Range;

use super::Chunk;
use super::disks::toward_disk;
use super::rings::RingBlock;
use super::shade::{Light, Sink, in_lobe, sample_light};
use crate::embree::TraceLane;
use crate::estimator::density::{Average, ConeOnly, Density, DiskOrCone, LobeInCap, Mix, Projected};
use crate::pipeline::model::{self, Model};
use crate::pipeline::stream::ModelStream;

/// Samples the directions of a light for all points of a stream. A density is implemented only for the models it supports.
pub trait Directions<M: Model>: Density {
    /// The density for lists of lights: the mixes of cones share a stage, which reads the mix at run time. `product` is `mis` there
    /// ([`Plan::estimator`](crate::pipeline::plan::Plan)).
    type Listed: Directions<M>;

    /// Samples a light direction for each point of the block that uses light sampling.
    fn toward_light<L: TraceLane>(
        self,
        chunk: &Chunk,
        stream: &mut ModelStream<M>,
        rings: &mut RingBlock,
        block: Range<usize>,
        light: &Light,
        sink: &mut Sink,
    );
}

/// Densities that sample packet by packet: for all models, or for one. Behind the arrow, [`Directions::Listed`].
macro_rules! packet_by_packet {
    ($($density:ty: $(<$any:ident>)? $([$model:ty])? => $listed:ty;)*) => {$(
        impl$(<$any: Model>)? Directions<$($any)? $($model)?> for $density {
            type Listed = $listed;

            #[inline(always)]
            fn toward_light<L: TraceLane>(
                self,
                chunk: &Chunk,
                stream: &mut ModelStream<$($any)? $($model)?>,
                _: &mut RingBlock,
                block: Range<usize>,
                light: &Light,
                sink: &mut Sink,
            ) {
                sample_light::<L, Self, $($any)? $($model)?>(self, chunk, stream, block, light, sink);
            }
        }
    )*};
}

packet_by_packet! {
    ConeOnly: <M> => Mix;
    Average: <M> => Mix;
    Mix: <M> => Mix;
    Projected: [model::Diffuse] => Projected;
}

impl Directions<model::Phong> for LobeInCap {
    type Listed = Mix;

    #[inline(always)]
    fn toward_light<L: TraceLane>(
        self,
        chunk: &Chunk,
        stream: &mut ModelStream<model::Phong>,
        rings: &mut RingBlock,
        block: Range<usize>,
        light: &Light,
        sink: &mut Sink,
    ) {
        in_lobe::<L>(chunk, stream, rings, block, light, sink);
    }
}

impl Directions<model::Diffuse> for DiskOrCone {
    type Listed = Mix;

    #[inline(always)]
    fn toward_light<L: TraceLane>(
        self,
        chunk: &Chunk,
        stream: &mut ModelStream<model::Diffuse>,
        _: &mut RingBlock,
        block: Range<usize>,
        light: &Light,
        sink: &mut Sink,
    ) {
        toward_disk::<L>(chunk, stream, block, light, sink);
    }
}
