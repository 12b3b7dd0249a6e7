//! A mesh that emits: one of its triangles is picked in proportion to its area, then sampled as a triangle.

use super::triangle::{Triangle, Triangles};
use crate::lane::{Bits, Lane, Mask};
use crate::math::Vec3;
use crate::sampling::{Discrete, Pair, sampler};

/// A mesh that is one light.
#[derive(Clone, Debug)]
pub struct MeshLight {
    /// Its triangles.
    pub triangles: Vec<Triangle>,
    /// Their shares.
    pub shares: Discrete,
    /// Radiance.
    pub le: [f32; 3],
    /// The geometry that rays meet.
    pub geometry: u32,
    /// What shadow rays to each triangle aim at.
    pub skip_ids: Vec<u32>,
    /// Centre of a ball around it.
    pub center: [f32; 3],
    /// Radius of that ball.
    pub radius: f32,
}

/// A triangle that was picked, in each lane.
#[derive(Clone, Copy, Debug)]
pub struct Picked<L: Lane> {
    /// Where it is.
    pub triangles: Triangles<L>,
    /// The chance with which it is picked, in (0, 1].
    pub share: L,
    /// What shadow rays to it aim at.
    pub skip_id: L::Bits,
    /// Two uniform numbers, independent of the choice.
    pub numbers: (L, L),
}

impl MeshLight {
    /// Picks a triangle in each active lane; the first one in the others.
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

    /// The triangles with these numbers, and the chances with which they are picked.
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
