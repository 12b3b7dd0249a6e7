//! Mesh lights: one triangle is chosen in proportion to its area, then sampled.

use super::triangle::{Triangle, Triangles};
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::sampling::{Discrete, Pair, sampler};

/// An emissive mesh as a single light.
#[derive(Clone, Debug)]
pub struct MeshLight {
    /// Its triangles.
    pub triangles: Vec<Triangle>,
    /// Their area distribution.
    pub shares: Discrete,
    /// Radiance.
    pub le: [f32; 3],
    /// Geometry index for hits.
    pub geometry: u32,
    /// Skip ids of the triangles.
    pub skip_ids: Vec<u32>,
    /// Center of a bounding sphere.
    pub center: [f32; 3],
    /// Radius of the bounding sphere.
    pub radius: f32,
}

/// The chosen triangle of each lane.
#[derive(Clone, Copy, Debug)]
pub struct Picked<L: Lane> {
    /// The triangles.
    pub triangles: Triangles<L>,
    /// The probability of choosing the triangle, in (0, 1].
    pub share: L,
    /// Its skip id.
    pub skip_id: L::Bits,
    /// Two uniform random numbers, independent of the choice.
    pub numbers: (L, L),
}

impl MeshLight {
    /// Chooses a triangle in each active lane; inactive lanes get the first one.
    #[inline(always)]
    pub fn pick<L: Lane>(&self, Pair(first, second): Pair<L::Bits>, active: L::Mask) -> Picked<L> {
        let (mut index, mut place, mut skip_id) = ([0_u32; 16], [0.0_f32; 16], [0_u32; 16]);
        for lane in active.lanes() {
            (index[lane], place[lane]) = self.shares.pick(first.lane(lane));
            skip_id[lane] = self.skip_ids[index[lane] as usize];
        }
        let (triangles, share) = self.gather(&index);
        Picked {
            triangles,
            share,
            skip_id: L::Bits::load(&skip_id),
            numbers: (L::load(&place), sampler::unit(second)),
        }
    }

    /// The triangles with these indices, and the probabilities of choosing them.
    #[inline(always)]
    pub fn gather<L: Lane>(&self, index: &[u32; 16]) -> (Triangles<L>, L) {
        let mut columns = [[0.0_f32; 16]; 14];
        for lane in 0..L::N {
            let Triangle { corners, normal, area } = &self.triangles[index[lane] as usize];
            for (k, corner) in corners.iter().enumerate() {
                columns[3 * k][lane] = corner[0];
                columns[3 * k + 1][lane] = corner[1];
                columns[3 * k + 2][lane] = corner[2];
            }
            columns[9][lane] = normal[0];
            columns[10][lane] = normal[1];
            columns[11][lane] = normal[2];
            columns[12][lane] = *area;
            columns[13][lane] =
                mutate!(self.shares.chance(index[lane]), SharesAlike => 1.0 / self.triangles.len() as f32);
        }
        let [ax, ay, az, bx, by, bz, cx, cy, cz, nx, ny, nz, area, share] = &columns;
        let vector = |x: &[f32; 16], y: &[f32; 16], z: &[f32; 16]| Vec3::new(L::load(x), L::load(y), L::load(z));
        let triangles = Triangles {
            corners: [vector(ax, ay, az), vector(bx, by, bz), vector(cx, cy, cz)],
            normal: vector(nx, ny, nz),
            area: L::load(area),
        };
        (triangles, L::load(share))
    }
}
