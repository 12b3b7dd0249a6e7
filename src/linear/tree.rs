//! A hierarchy over many spheres, to cull those that rays from some points to one target cannot hit.
//!
//! Spheres are in the order of a space-filling curve, and every eight of them in a row are a node, as are every eight nodes: there
//! are no pointers. A walk tests eight boxes at a time.

use super::balls::Packet;
use super::columns::Columns;
use super::cull::{Bounds, Plane, balls_between};
use crate::lane::{Bits, F32x8, Lane, Mask};
use crate::math::Vec3;
use crate::shape::BoundingSphere;

/// Children of a node.
const WIDE: usize = F32x8::N;

/// The spheres of a packet that a test kept.
type Kept = <F32x8 as Lane>::Mask;

/// Bits of a cell of the curve along each axis.
const DIGITS: u32 = 21;

/// Spheres in the order of the curve, with boxes around every 8, 64, 512 and so on.
#[derive(Clone, Debug, Default)]
pub struct SphereTree {
    /// Center and radius, in order.
    balls: Columns<4>,
    /// For each sphere in order, its index in the scene; padded by a packet.
    numbers: Vec<u32>,
    /// Boxes of nodes, the smallest nodes first: the low corner, the high corner, and the largest sum of absolute coordinates.
    levels: Vec<Columns<7>>,
}

impl SphereTree {
    /// Sorts spheres.
    pub fn new(balls: &[BoundingSphere]) -> Self {
        let mut tree = Self {
            numbers: order(balls),
            ..Self::default()
        };
        let mut boxes = Vec::with_capacity(balls.len());
        for &number in &tree.numbers {
            let ball = &balls[number as usize];
            let [x, y, z] = ball.center;
            tree.balls.push([x, y, z, ball.radius]);
            boxes.push(Bounds::of_ball(ball));
        }
        tree.numbers.resize(balls.len() + WIDE, 0);
        while boxes.len() > 1 {
            boxes = (boxes.chunks(WIDE))
                .map(|children| children[1..].iter().fold(children[0], Bounds::around))
                .collect();
            let mut level = Columns::default();
            for Bounds { low, high } in &boxes {
                let reach = (0..3).map(|k| low[k].abs().max(high[k].abs())).sum();
                level.push([low[0], low[1], low[2], high[0], high[1], high[2], reach]);
            }
            tree.levels.push(level);
        }
        tree
    }

    /// Visits the spheres that are neither outside a box nor behind a plane.
    pub fn visit(&self, around: &Bounds, planes: &[Plane], visit: &mut impl FnMut(Kept, &Packet)) {
        if self.balls.len() == 0 {
            return;
        }
        let mut open = vec![(self.levels.len(), 0)];
        while let Some((level, node)) = open.pop() {
            let at = WIDE * node;
            let Some(below) = level.checked_sub(1) else {
                self.visit_balls(at, around, planes, visit);
                continue;
            };
            let level = &self.levels[below];
            let lanes = Kept::first(level.len() - at);
            let (low, high) = (level.get3::<F32x8>(0, at), level.get3::<F32x8>(3, at));
            let mut kept = lanes & !around.apart(low, high);
            for plane in planes {
                if kept.none() {
                    break;
                }
                let limit = plane.limit(level.get::<F32x8>(6, at));
                kept = kept & !farthest(plane.normal, low, high).lt(limit);
            }
            open.extend(kept.lanes().map(|lane| (below, at + lane)));
        }
    }

    fn visit_balls(&self, at: usize, around: &Bounds, planes: &[Plane], visit: &mut impl FnMut(Kept, &Packet)) {
        let packet = Packet {
            numbers: Bits::load(&self.numbers[at..]),
            center: self.balls.get3(0, at),
            radius: self.balls.get(3, at),
        };
        let lanes = Kept::first(self.balls.len() - at);
        let kept = balls_between(packet.ball(), lanes, (around, planes));
        if kept.any() {
            visit(kept, &packet);
        }
    }
}

/// The largest product of a normal with a point of boxes.
fn farthest<L: Lane>(normal: [f32; 3], low: Vec3<L>, high: Vec3<L>) -> L {
    let along = |n: f32, low: L, high: L| L::splat(n) * if n > 0.0 { high } else { low };
    along(normal[0], low.x, high.x) + along(normal[1], low.y, high.y) + along(normal[2], low.z, high.z)
}

/// Indices of spheres along a Morton curve through their centers. Coincident cells keep the order of indices.
fn order(balls: &[BoundingSphere]) -> Vec<u32> {
    let mut around = balls.iter().map(|ball| Bounds {
        low: ball.center,
        high: ball.center,
    });
    let first = around.next().unwrap_or_default();
    let Bounds { low, high } = around.fold(first, |all, one| all.around(&one));
    // One scale for all axes, so that cells are cubes.
    let size = (0..3)
        .map(|k| f64::from(high[k]) - f64::from(low[k]))
        .fold(0.0, f64::max);
    let scale = if size > 0.0 {
        f64::from((1 << DIGITS) - 1) / size
    } else {
        0.0
    };
    let cell = |ball: &BoundingSphere| {
        (0..3)
            .map(|k| spaced(((f64::from(ball.center[k]) - f64::from(low[k])) * scale) as u64) << k)
            .sum::<u64>()
    };
    let mut keys: Vec<(u64, u32)> = balls.iter().map(cell).zip(0..).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, number)| number).collect()
}

/// The [`DIGITS`] low bits with two zeros between each.
fn spaced(x: u64) -> u64 {
    let mut x = x & ((1 << DIGITS) - 1);
    for (shift, mask) in [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn none_one_and_many_spheres_are_visited_once_each() {
        for count in [0, 1, 7, 8, 9, 64, 65, 600] {
            let ball = |i: u16| BoundingSphere {
                center: [f32::from(i % 7), f32::from(i / 7), f32::from(i % 11)],
                radius: 0.25,
            };
            let balls: Vec<BoundingSphere> = (0..count).map(ball).collect();
            let everywhere = Bounds {
                low: [-1e3; 3],
                high: [1e3; 3],
            };
            let mut seen = Vec::new();
            SphereTree::new(&balls).visit(&everywhere, &[], &mut |kept, packet| {
                for lane in kept.lanes() {
                    let number = packet.numbers.lane(lane);
                    let (center, radius) = packet.ball();
                    let center = [center.x, center.y, center.z].map(|x| x.lane(lane));
                    assert_eq!((center, radius.lane(lane)), (balls[number as usize].center, 0.25));
                    seen.push(number);
                }
            });
            seen.sort_unstable();
            assert_eq!(seen, (0..u32::from(count)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn digits_are_spaced_by_two_zeros() {
        for x in [0, 1, 5, 0x1f_ffff, 0x15_5555, 0x12_3456] {
            let slowly = (0..DIGITS).map(|i| (x >> i & 1) << (3 * i)).sum::<u64>();
            assert_eq!(spaced(x), slowly);
        }
    }
}
