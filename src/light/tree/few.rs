//! The choice between two nodes by a few probes.

use super::Node;
use super::importance::{Moments, Probes, WIDE};
use crate::lane::{F32x8, Lane};
use crate::math::Vec3;

impl Probes {
    /// A few probes spread over all, each twice; `inverses` as of [`inverses`](super::cut::inverses).
    pub(super) fn few(&self, inverses: &[f32; WIDE]) -> Few {
        // A lobe may miss what its neighbors see.
        let number = if self.phong { 8 } else { 4 };
        let packet = |first: usize| {
            // Of a whole tile one in each row and column of squares.
            let at: [usize; 4] = std::array::from_fn(|k| {
                let spread = [4, 13, 2, 11, 8, 1, 14, 7][first + k];
                if self.points == WIDE {
                    spread
                } else {
                    (first + k) * self.points / number
                }
            });
            let twice = |column: &[f32; WIDE]| std::array::from_fn(|lane| column[at[lane % 4]]);
            let three = |columns: &[[f32; WIDE]; 3]| [0, 1, 2].map(|k| twice(&columns[k]));
            Twice {
                place: three(&self.place),
                normal: three(&self.normal),
                mirror: three(&self.mirror),
                exponent: twice(&self.exponent),
                inverse: twice(inverses),
            }
        };
        Few {
            phong: self.phong,
            packets: (0..number).step_by(4).map(packet).collect(),
        }
    }
}

/// A few probes, which decide between two nodes: a vector holds both nodes for four probes. That is one evaluation or two instead of
/// four, and nodes below a cut are so small or so far that points of a tile agree about them.
#[derive(Clone, Debug, Default)]
pub(super) struct Few {
    phong: bool,
    packets: Vec<Twice>,
}

/// Four probes, once for each node.
#[derive(Clone, Debug)]
struct Twice {
    place: [[f32; 8]; 3],
    normal: [[f32; 8]; 3],
    mirror: [[f32; 8]; 3],
    exponent: [f32; 8],
    inverse: [f32; 8],
}

impl Few {
    /// For each of two nodes the root of the sum of the squared shares of the probes.
    pub fn shares(&self, [a, b]: [&Node; 2]) -> [f32; 2] {
        let half = |a: f32, b: f32| F32x8::load(&[a, a, a, a, b, b, b, b]);
        let three = |a: [f32; 3], b: [f32; 3]| Vec3::new(half(a[0], b[0]), half(a[1], b[1]), half(a[2], b[2]));
        let nodes = Moments {
            mean: three(a.mean, b.mean),
            power: half(a.power(), b.power()),
            variance: three(a.spread(), b.spread()),
            normals: std::array::from_fn(|k| {
                half(f32::from(a.normals[k]), f32::from(b.normals[k])) * F32x8::splat(1.0 / 127.0)
            }),
            facing: three(
                a.facing.map(|x| f32::from(x) * (1.0 / 127.0)),
                b.facing.map(|x| f32::from(x) * (1.0 / 127.0)),
            ),
        };
        let mut sums = [0.0; 2];
        for probes in &self.packets {
            let vector = |[x, y, z]: &[[f32; 8]; 3]| Vec3::new(F32x8::load(x), F32x8::load(y), F32x8::load(z));
            let lobe = self
                .phong
                .then(|| (vector(&probes.mirror), F32x8::load(&probes.exponent)));
            let brings = nodes.brief(vector(&probes.place), vector(&probes.normal), lobe);
            let share = brings * F32x8::load(&probes.inverse);
            let mut squares = [0.0; F32x8::N];
            (share * share).store(&mut squares);
            for (sum, squares) in sums.iter_mut().zip(squares.chunks(4)) {
                *sum += squares.iter().sum::<f32>();
            }
        }
        sums.map(f32::sqrt)
    }
}
