//! Streams: shading points that wait for light, one stream for each model of reflection.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Range};

use super::columns::{Columns, Room};
use super::model::Model;
use crate::bsdf::Brdf;
use crate::estimator::ShadingPoint;
use crate::lane::{Bits, Lane};
use crate::math::Vec3;

/// What a shading point needs to be found again on the film and in the sequence of random numbers.
#[derive(Clone, Copy, Debug)]
pub struct Address<L: Lane> {
    /// Where the pixel sums up in its chunk.
    pub index: L::Bits,
    /// What stands for the pixel among random numbers.
    pub key: L::Bits,
    /// Pass, counted from the block's first.
    pub pass: L::Bits,
}

/// A packet of points: the lanes that hold any, the points, and where they belong.
pub type Packet<L, B> = (<L as Lane>::Mask, ShadingPoint<L, B>, Address<L>);

/// The most columns that a model has of its own.
const MOST_OWN: usize = 10;

/// The columns of every stream. Points are pushed into those up to [`FOLLOWS`]; what shading finds out is in the others.
mod column {
    pub const POSITION: usize = 0;
    pub const GEOMETRIC_NORMAL: usize = 3;
    pub const NORMAL: usize = 6;
    pub const RHO: usize = 9;
    pub const INDEX: usize = 12;
    pub const KEY: usize = 13;
    pub const PASS: usize = 14;
    /// The first of the model's own.
    pub const OWN: usize = 15;
    /// Which points follow their BRDF.
    pub const FOLLOWS: usize = OWN + super::MOST_OWN;
    pub const DRAWN: usize = FOLLOWS + 1;
    pub const LIGHT: usize = DRAWN + 3;
    pub const COUNT: usize = LIGHT + 3;
}

/// Shading points that wait for light, without what is special to their model.
#[derive(Debug)]
pub struct HitStream(Columns<{ column::COUNT }>);

/// Shading points of one model that wait for light: what treats their packets is compiled for it.
#[derive(Debug)]
pub struct ModelStream<M> {
    hits: HitStream,
    model: PhantomData<M>,
}

/// The columns of a model, to be filled with a packet of points.
pub struct Fill<'a, L: Lane> {
    columns: &'a mut Columns<{ column::COUNT }>,
    room: Room<L>,
}

/// The columns of a model at a packet of points.
pub struct Own<'a> {
    columns: &'a Columns<{ column::COUNT }>,
    at: usize,
}

impl<L: Lane> Fill<'_, L> {
    /// Fills the model's column `i`.
    #[inline(always)]
    pub fn put(&mut self, i: usize, value: L) {
        self.columns.put(column::OWN + i, &self.room, value);
    }

    /// Fills the model's columns `i` to `i + 2`.
    #[inline(always)]
    pub fn put3(&mut self, i: usize, value: Vec3<L>) {
        self.columns.put3(column::OWN + i, &self.room, value);
    }
}

impl Own<'_> {
    /// The model's column `i`.
    #[inline(always)]
    pub fn get<L: Lane>(&self, i: usize) -> L {
        self.columns.get(column::OWN + i, self.at)
    }

    /// The model's columns `i` to `i + 2`.
    #[inline(always)]
    pub fn get3<L: Lane>(&self, i: usize) -> Vec3<L> {
        self.columns.get3(column::OWN + i, self.at)
    }
}

impl<M> Deref for ModelStream<M> {
    type Target = HitStream;
    #[inline(always)]
    fn deref(&self) -> &HitStream {
        &self.hits
    }
}

impl<M> DerefMut for ModelStream<M> {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut HitStream {
        &mut self.hits
    }
}

impl<M: Model> ModelStream<M> {
    /// Room for the points of a chunk.
    pub fn new() -> Self {
        const { assert!(M::COLUMNS <= MOST_OWN, "a model has more columns than there are") };
        Self {
            hits: HitStream(Columns::new()),
            model: PhantomData,
        }
    }

    /// Adds the points of the mask.
    #[inline(always)]
    pub fn push<L: Lane>(&mut self, mask: L::Mask, point: &ShadingPoint<L, M::Of<L>>, address: &Address<L>) {
        let columns = &mut self.hits.0;
        let room = columns.grow::<L>(mask);
        columns.put3(column::POSITION, &room, point.p);
        columns.put3(column::GEOMETRIC_NORMAL, &room, point.ng);
        columns.put3(column::NORMAL, &room, point.bsdf.normal());
        columns.put3(column::RHO, &room, point.bsdf.rho());
        columns.put(column::INDEX, &room, L::from_bits(address.index));
        columns.put(column::KEY, &room, L::from_bits(address.key));
        columns.put(column::PASS, &room, L::from_bits(address.pass));
        M::put(&point.bsdf, &mut Fill { columns, room });
    }

    /// Repeats the last point behind the end: idle lanes of the last packet hold it, and no place and no address that is not one of
    /// the stream's. To be called once all points are there.
    pub fn pad(&mut self) {
        self.hits.0.pad(column::OWN + M::COLUMNS);
    }

    /// Becomes a part of another stream, padded.
    pub fn copy(&mut self, other: &Self, part: Range<usize>) {
        self.hits.0.copy(&other.hits.0, part);
        self.pad();
    }

    /// The packet that starts at point `at`; the stream must be [padded](Self::pad).
    #[inline(always)]
    pub fn packet<L: Lane>(&self, at: usize) -> Packet<L, M::Of<L>> {
        let columns = &self.hits.0;
        let point = ShadingPoint {
            p: columns.get3(column::POSITION, at),
            ng: columns.get3(column::GEOMETRIC_NORMAL, at),
            bsdf: M::get(
                columns.get3(column::NORMAL, at),
                columns.get3(column::RHO, at),
                &Own { columns, at },
            ),
        };
        let address = Address {
            index: self.index::<L>(at),
            key: columns.get::<L>(column::KEY, at).to_bits(),
            pass: columns.get::<L>(column::PASS, at).to_bits(),
        };
        (self.lanes::<L>(at), point, address)
    }
}

impl HitStream {
    /// Points in the stream.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Where the pixel of the point at `at` sums up, and its pass, counted from the block's first.
    #[inline(always)]
    pub fn place(&self, at: usize) -> (u32, u32) {
        let number = |column: usize| self.0.get::<f32>(column, at).to_bits();
        (number(column::INDEX), number(column::PASS))
    }

    /// Where the points of the packet at `at` are.
    #[inline(always)]
    pub fn position<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::POSITION, at)
    }

    /// The lanes of the packet at `at`.
    #[inline(always)]
    pub fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        mutate!(self.0.lanes::<L>(at), StaleTail => crate::lane::Mask::splat(true))
    }

    /// Notes which points of the packet at `at` follow their BRDF, and the direction that it gave them.
    #[inline(always)]
    pub fn set_drawn<L: Lane>(&mut self, at: usize, by_brdf_lanes: L::Mask, wi: Vec3<L>) {
        self.0
            .set(column::FOLLOWS, at, L::select(by_brdf_lanes, -L::zero(), L::zero()));
        self.0.set3(column::DRAWN, at, wi);
    }

    /// The points of the packet at `at` that follow their BRDF.
    #[inline(always)]
    pub fn by_brdf_lanes<L: Lane>(&self, at: usize) -> L::Mask {
        self.0.get::<L>(column::FOLLOWS, at).to_bits().top_bit()
    }

    /// The directions of the BRDF for the packet at `at`.
    #[inline(always)]
    pub fn sampled<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::DRAWN, at)
    }

    /// Notes the lights that the points of the packet at `at` see in part: bits. In place of what [`Self::set_drawn`] notes.
    #[inline(always)]
    pub fn set_partly<L: Lane>(&mut self, at: usize, lights: L::Bits) {
        self.0.set(column::FOLLOWS, at, L::from_bits(lights));
    }

    /// The points of the packet at `at` that see the light of bit `bit` in part.
    #[inline(always)]
    pub fn partly<L: Lane>(&self, at: usize, bit: u32) -> L::Mask {
        self.0.get::<L>(column::FOLLOWS, at).to_bits().shl(31 - bit).top_bit()
    }

    /// Sets the light that reaches the points of the packet at `at`.
    #[inline(always)]
    pub fn set_light<L: Lane>(&mut self, at: usize, light: Vec3<L>) {
        self.0.set3(column::LIGHT, at, light);
    }

    /// The light that reaches the points of the packet at `at`.
    #[inline(always)]
    pub fn light<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::LIGHT, at)
    }

    /// Where the pixels of the packet at `at` sum up.
    #[inline(always)]
    pub fn index<L: Lane>(&self, at: usize) -> L::Bits {
        self.0.get::<L>(column::INDEX, at).to_bits()
    }

    /// The reflectance at the points of the packet at `at`.
    #[inline(always)]
    pub fn reflectance<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::RHO, at)
    }
}
