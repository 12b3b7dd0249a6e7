//! Streams: shading points that wait for light.

use super::columns::Columns;
use crate::bsdf::Bsdf;
use crate::estimator::ShadingPoint;
use crate::estimator::density::{ConeOnly, ConeOrCap, Density, LobeInCap, Projected};
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

/// A model of reflection. Points of each have a stream of their own, which holds what that model needs and no more: what
/// treats its packets is compiled for it.
pub trait Model {
    /// Which stream is theirs.
    const STREAM: usize;
    /// Whether their lobe is Phong's.
    const PHONG: bool;
    /// The density of `projected`: a lobe of Phong's model is not in proportion to the cosine, so cones have to do for it.
    type Projected: Density;
    /// The density of `product`.
    type Product: Density;
}

/// Lambert's model.
pub struct Diffuse;

/// Phong's model.
pub struct Phong;

impl Model for Diffuse {
    const STREAM: usize = 0;
    const PHONG: bool = false;
    type Projected = Projected;
    type Product = ConeOrCap;
}

impl Model for Phong {
    const STREAM: usize = 1;
    const PHONG: bool = true;
    type Projected = ConeOnly;
    type Product = LobeInCap;
}

/// Columns that a point is pushed into; what shading finds out is in those behind them.
const PUSHED: usize = 20;

/// Shading points of one model that wait for light.
#[derive(Debug)]
pub struct HitStream(Columns<{ PUSHED + 7 }>);

impl HitStream {
    /// Room for the points of a chunk.
    pub fn new() -> Self {
        Self(Columns::new())
    }

    /// Points in the stream.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Empties it.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds the points of the mask.
    #[inline(always)]
    pub fn push<L: Lane, M: Model>(&mut self, mask: L::Mask, point: &ShadingPoint<L>, address: &Address<L>) {
        let bsdf = &point.bsdf;
        let room = self.0.grow::<L>(mask);
        self.0.put3(0, &room, point.p);
        self.0.put3(3, &room, point.ng);
        self.0.put3(6, &room, bsdf.n);
        self.0.put3(12, &room, bsdf.rho);
        if M::PHONG {
            self.0.put3(9, &room, bsdf.wr);
            self.0.put(15, &room, bsdf.alpha);
            self.0.put(16, &room, bsdf.reach);
        }
        self.0.put(17, &room, L::from_bits(address.index));
        self.0.put(18, &room, L::from_bits(address.key));
        self.0.put(19, &room, L::from_bits(address.pass));
    }

    /// Repeats the last point behind the end: idle lanes of the last packet hold it, and no place and no address that is not one of
    /// the stream's. To be called once all points are there.
    pub fn pad(&mut self) {
        self.0.pad(PUSHED);
    }

    /// Where the points of the packet at `at` are.
    #[inline(always)]
    pub fn position<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(0, at)
    }

    /// The lanes of the packet at `at`.
    #[inline(always)]
    pub fn lanes<L: Lane>(&self, at: usize) -> L::Mask {
        mutate!(self.0.lanes::<L>(at), StaleTail => crate::lane::Mask::splat(true))
    }

    /// Notes which points of the packet at `at` follow their BRDF, and the direction that it gave them.
    #[inline(always)]
    pub fn set_drawn<L: Lane>(&mut self, at: usize, heads: L::Mask, wi: Vec3<L>) {
        self.0.set(20, at, L::select(heads, -L::zero(), L::zero()));
        self.0.set3(21, at, wi);
    }

    /// The points of the packet at `at` that follow their BRDF.
    #[inline(always)]
    pub fn heads<L: Lane>(&self, at: usize) -> L::Mask {
        self.0.get::<L>(20, at).to_bits().top_bit()
    }

    /// The directions of the BRDF for the packet at `at`.
    #[inline(always)]
    pub fn drawn<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(21, at)
    }

    /// Notes the lights that the points of the packet at `at` see in part: bits. In place of what [`Self::set_drawn`] notes.
    #[inline(always)]
    pub fn set_partly<L: Lane>(&mut self, at: usize, lights: L::Bits) {
        self.0.set(20, at, L::from_bits(lights));
    }

    /// The points of the packet at `at` that see the light of bit `bit` in part.
    #[inline(always)]
    pub fn partly<L: Lane>(&self, at: usize, bit: u32) -> L::Mask {
        self.0.get::<L>(20, at).to_bits().shl(31 - bit).top_bit()
    }

    /// Sets the light that reaches the points of the packet at `at`.
    #[inline(always)]
    pub fn set_light<L: Lane>(&mut self, at: usize, light: Vec3<L>) {
        self.0.set3(24, at, light);
    }

    /// The light that reaches the points of the packet at `at`.
    #[inline(always)]
    pub fn light<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(24, at)
    }

    /// Where the pixels of the packet at `at` sum up.
    #[inline(always)]
    pub fn index<L: Lane>(&self, at: usize) -> L::Bits {
        self.0.get::<L>(17, at).to_bits()
    }

    /// The reflectance at the points of the packet at `at`.
    #[inline(always)]
    pub fn reflectance<L: Lane>(&self, at: usize) -> Vec3<L> {
        self.0.get3(12, at)
    }

    /// The packet that starts at point `at`; the stream must be [padded](Self::pad).
    #[inline(always)]
    pub fn packet<L: Lane, M: Model>(&self, at: usize) -> (L::Mask, ShadingPoint<L>, Address<L>) {
        let columns = &self.0;
        let mask = self.lanes::<L>(at);
        let (n, rho) = (columns.get3(6, at), columns.get3(12, at));
        let bsdf = if M::PHONG {
            Bsdf {
                n,
                wr: columns.get3(9, at),
                rho,
                alpha: columns.get(15, at),
                phong: mask,
                reach: columns.get(16, at),
            }
        } else {
            Bsdf::diffuse(n, rho)
        };
        let point = ShadingPoint {
            p: columns.get3(0, at),
            ng: columns.get3(3, at),
            bsdf,
        };
        let address = Address {
            index: self.index::<L>(at),
            key: columns.get::<L>(18, at).to_bits(),
            pass: columns.get::<L>(19, at).to_bits(),
        };
        (mask, point, address)
    }
}
