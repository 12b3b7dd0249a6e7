//! Streams of shading points that await lighting, one stream per BRDF model.

use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use super::columns::{Columns, Room};
use super::model::Model;
use crate::bsdf::Brdf;
use crate::estimator::ShadingPoint;
use crate::lane::{Bits, Lane};
use crate::math::Vec3;

/// Locates a shading point on the film and in the random sequence.
#[derive(Clone, Copy, Debug)]
pub struct Address<L: Lane> {
    /// Index of the pixel's sum in the chunk.
    pub index: L::Bits,
    /// The pixel's key for random numbers.
    pub key: L::Bits,
    /// Pass, relative to the first of the block.
    pub pass: L::Bits,
}

/// A packet of points: active lanes, points and addresses.
pub type Packet<L, B> = (<L as Lane>::Mask, ShadingPoint<L, B>, Address<L>);

/// Maximum number of columns specific to a model.
const MOST_OWN: usize = 10;

/// Column layout of all streams. Shading writes the columns from [`FOLLOWS`] to [`OWN`]; pushing a point writes the others. A model's
/// own columns are last, so that copies leave out those that it lacks.
mod column {
    pub const POSITION: usize = 0;
    pub const GEOMETRIC_NORMAL: usize = 3;
    pub const NORMAL: usize = 6;
    pub const RHO: usize = 9;
    pub const INDEX: usize = 12;
    pub const KEY: usize = 13;
    pub const PASS: usize = 14;
    /// Which points sample their BRDF.
    pub const FOLLOWS: usize = 15;
    pub const DRAWN: usize = FOLLOWS + 1;
    pub const LIGHT: usize = DRAWN + 3;
    /// First of the model's columns.
    pub const OWN: usize = LIGHT + 3;
    pub const COUNT: usize = OWN + super::MOST_OWN;
}

/// Shading points that await lighting, without the model-specific columns.
#[derive(Debug)]
pub struct HitStream(Columns<{ column::COUNT }>);

/// Shading points of one model. Code that processes them is compiled for the model.
#[derive(Debug)]
pub struct ModelStream<M> {
    hits: HitStream,
    model: PhantomData<M>,
}

/// The model's columns, to be written for a packet of points.
pub struct Fill<'a, L: Lane> {
    columns: &'a mut Columns<{ column::COUNT }>,
    room: Room<L>,
}

/// The model's columns of a packet of points.
pub struct Own<'a> {
    columns: &'a Columns<{ column::COUNT }>,
    at: usize,
}

impl<L: Lane> Fill<'_, L> {
    /// Writes the model's column `i`.
    #[inline(always)]
    pub fn put(&mut self, i: usize, value: L) {
        self.columns.put(column::OWN + i, &self.room, value);
    }

    /// Writes the model's columns `i` to `i + 2`.
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
    /// A stream with room for the points of a chunk.
    pub fn new() -> Self {
        const { assert!(M::COLUMNS <= MOST_OWN, "a model has more columns than there are") };
        Self {
            hits: HitStream(Columns::new()),
            model: PhantomData,
        }
    }

    /// Pushes the active points of the mask.
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

    /// Repeats the last point past the end, so that idle lanes of the last packet hold a valid point and address. Call it after the
    /// last push.
    pub fn pad(&mut self) {
        self.hits.0.pad(column::OWN + M::COLUMNS);
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
    /// Number of points in the stream.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Lets the stream end before point `end`; later points stay where they are, and a later `end` brings them back.
    pub fn end_at(&mut self, end: usize) {
        self.0.end_at(end);
    }

    /// Empties the stream.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Sum index of the point at `at`, and its pass relative to the first of the block.
    #[inline(always)]
    pub fn place(&self, at: usize) -> (u32, u32) {
        let number = |column: usize| self.0.get::<f32>(column, at).to_bits();
        (number(column::INDEX), number(column::PASS))
    }

    /// Positions of the packet at `at`.
    #[inline(always)]
    pub fn position<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::POSITION, at)
    }

    /// Active lanes of the packet at `at`.
    #[inline(always)]
    pub fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        mutate!(self.0.lanes::<L>(at), StaleTail => crate::lane::Mask::splat(true))
    }

    /// Stores which points of the packet at `at` sample their BRDF, and the sampled directions.
    #[inline(always)]
    pub fn set_drawn<L: Lane>(&mut self, at: usize, by_brdf_lanes: L::Mask, wi: Vec3<L>) {
        self.0
            .set(column::FOLLOWS, at, L::select(by_brdf_lanes, -L::zero(), L::zero()));
        self.0.set3(column::DRAWN, at, wi);
    }

    /// The points of the packet at `at` that sample their BRDF.
    #[inline(always)]
    pub fn by_brdf_lanes<L: Lane>(&self, at: usize) -> L::Mask {
        self.0.get::<L>(column::FOLLOWS, at).to_bits().top_bit()
    }

    /// The BRDF-sampled directions of the packet at `at`.
    #[inline(always)]
    pub fn sampled<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::DRAWN, at)
    }

    /// Stores, as bits, the lights that the points of the packet at `at` see partially. Overwrites what [`Self::set_drawn`] stored.
    #[inline(always)]
    pub fn set_partly<L: Lane>(&mut self, at: usize, lights: L::Bits) {
        self.0.set(column::FOLLOWS, at, L::from_bits(lights));
    }

    /// The points of the packet at `at` that see the light of bit `bit` partially.
    #[inline(always)]
    pub fn partly<L: Lane>(&self, at: usize, bit: u32) -> L::Mask {
        self.0.get::<L>(column::FOLLOWS, at).to_bits().shl(31 - bit).top_bit()
    }

    /// Stores the reflected light of the packet at `at`.
    #[inline(always)]
    pub fn set_light<L: Lane>(&mut self, at: usize, light: Vec3<L>) {
        self.0.set3(column::LIGHT, at, light);
    }

    /// The stored light of the packet at `at`.
    #[inline(always)]
    pub fn light<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::LIGHT, at)
    }

    /// Sum indices of the packet at `at`.
    #[inline(always)]
    pub fn index<L: Lane>(&self, at: usize) -> L::Bits {
        self.0.get::<L>(column::INDEX, at).to_bits()
    }

    /// Reflectances of the packet at `at`.
    #[inline(always)]
    pub fn reflectance<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(column::RHO, at)
    }
}
