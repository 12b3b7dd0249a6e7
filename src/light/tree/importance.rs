//! Closed-form importance of a node: an estimate of the light that points may receive from it.

use super::Node;
use super::walk::From;
use crate::lane::{F32x8, Lane};
use crate::math::Vec3;
use crate::math::elementary::exp;

/// Maximum number of probe points of a list of lights; they are processed together.
pub const WIDE: usize = 16;

/// Probe points of one tile and one BRDF model. Columns past the last point repeat it.
#[derive(Clone, Debug, Default)]
pub struct Probes {
    pub(super) points: usize,
    pub(super) phong: bool,
    pub(super) place: [[f32; WIDE]; 3],
    pub(super) normal: [[f32; WIDE]; 3],
    /// Axis of a lobe.
    pub(super) mirror: [[f32; WIDE]; 3],
    pub(super) exponent: [f32; WIDE],
}

impl Probes {
    /// No points yet; `phong`: whether they have lobes (Phong surfaces and conductors).
    pub fn new(phong: bool) -> Self {
        Self {
            phong,
            ..Self::default()
        }
    }

    /// Whether points have lobes.
    pub fn is_phong(&self) -> bool {
        self.phong
    }

    /// Adds a point, unless there are [`WIDE`]: its position in tree units, its normal, and of a lobe the axis and the exponent.
    pub fn push(&mut self, place: [f32; 3], normal: [f32; 3], mirror: [f32; 3], exponent: f32) {
        for at in self.points..WIDE {
            for k in 0..3 {
                (self.place[k][at], self.normal[k][at], self.mirror[k][at]) = (place[k], normal[k], mirror[k]);
            }
            self.exponent[at] = exponent;
        }
        self.points = (self.points + 1).min(WIDE);
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.points
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.points == 0
    }

    /// Position of point `i`, in tree units.
    pub fn place(&self, i: usize) -> [f32; 3] {
        self.place.map(|column| column[i])
    }

    /// The importance of a node for each point, times how far apart its lights appear from there, at most 1.
    pub(super) fn apart(&self, node: &Node, importance: &[f32; WIDE]) -> [f32; WIDE] {
        let mut apart = [0.0; WIDE];
        let [x, y, z] = node.spread();
        for at in (0..self.points).step_by(F32x8::N) {
            let q = Vec3::splat(node.mean) - Self::vector(&self.place, at);
            // The exponent tells how much sharper than a diffuse lobe a lobe is.
            let sharpness = if self.phong {
                F32x8::load(&self.exponent[at..])
            } else {
                F32x8::one()
            };
            let spread = F32x8::splat(x + y + z) * sharpness;
            let share = (spread / (spread + q.length_squared())).sqrt();
            (F32x8::load(&importance[at..]) * share).store(&mut apart[at..]);
        }
        apart
    }

    fn vector(columns: &[[f32; WIDE]; 3], at: usize) -> Vec3<F32x8> {
        let [x, y, z] = columns;
        Vec3::new(F32x8::load(&x[at..]), F32x8::load(&y[at..]), F32x8::load(&z[at..]))
    }

    /// The importance of a node for each point; columns past the last point are undefined.
    pub fn importance(&self, node: &Node) -> [f32; WIDE] {
        let mut found = [0.0; WIDE];
        for at in (0..self.points).step_by(F32x8::N) {
            let (place, normal) = (Self::vector(&self.place, at), Self::vector(&self.normal, at));
            let lobe = self
                .phong
                .then(|| (Self::vector(&self.mirror, at), F32x8::load(&self.exponent[at..])));
            node.importance(place, normal, lobe).store(&mut found[at..]);
        }
        found
    }
}

impl Node {
    /// Estimate of the light from this node that reaches points with these normals and is reflected, up to a factor common to all
    /// nodes: `power cosine / distance²` of a light like the whole node, averaged over its position in the node. `lobe` holds axis
    /// and exponent of Phong lobes. Finite and nonnegative; positive except for underflow.
    ///
    /// With `q` from the point to the mean, `s` the sum of variances, `m = n·q` and `c` the variance of `m`:
    ///
    /// - the mean of `max(n·q, 0)` under a distribution of mean `m` and variance `c` is about `(m + sqrt(m² + 2c/π)) / 2`, which is
    ///   exact at both ends and at `m = 0`; for `m < 0` in the form without cancellation;
    /// - `1 / distance³` becomes `1 / (sqrt(q² + s) (q² + s/3))`: at `q = 0`, with the cosine, it is `1/σ²` up to a factor near 1;
    /// - the mean of the cosine at the lights, as far as they emit from one side, is found in the same way from the mean and the variance of
    ///   normals; lights of other kinds have a power for which that is right too;
    /// - a lobe is a Gaussian of directions, convolved with the node's lateral variance.
    #[inline(always)]
    fn importance<L: Lane>(&self, p: Vec3<L>, n: Vec3<L>, lobe: Option<(Vec3<L>, L)>) -> L {
        self.moments().importance(p, n, lobe)
    }

    /// The brief form, [`Moments::brief`].
    #[inline(always)]
    pub(super) fn brief<L: Lane>(&self, (p, n, lobe): From<L>) -> L {
        self.moments().brief(p, n, lobe)
    }

    /// The same moments in all lanes.
    #[inline(always)]
    fn moments<L: Lane>(&self) -> Moments<L> {
        Moments {
            mean: Vec3::splat(self.mean),
            power: L::splat(self.power()),
            variance: Vec3::splat(self.spread()),
            normals: self.normals.map(|x| L::splat(f32::from(x) * (1.0 / 127.0))),
            facing: Vec3::splat(self.facing.map(|x| f32::from(x) * (1.0 / 127.0))),
        }
    }
}

/// The moments of a node, or of one node in each lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moments<L: Lane> {
    pub mean: Vec3<L>,
    pub power: L,
    pub variance: Vec3<L>,
    pub normals: [L; 5],
    pub facing: Vec3<L>,
}

impl<L: Lane> Moments<L> {
    /// See [`Node::importance`].
    #[inline(always)]
    pub fn importance(&self, p: Vec3<L>, n: Vec3<L>, lobe: Option<(Vec3<L>, L)>) -> L {
        let (half, third) = (L::splat(0.5), L::splat(1.0 / 3.0));
        let q = self.mean - p;
        let variance = self.variance;
        let s = variance.x + variance.y + variance.z;
        let d2 = q.length_squared();
        let all = d2 + s;
        let m = n.dot(q);
        let c = L::splat(TWO_OVER_PI) * n.times(n).dot(variance);
        let sum = (m * m + c).sqrt() + m.abs();
        let cosine = L::select(m.ge(L::zero()), half * sum, half * c / sum);
        let length = all.sqrt();
        let mut found = self.power * cosine / (length * (d2 + s * third));
        // The emission in this direction, as the cosine: mean of the cosine of the sides that emit, and its variance.
        let m = -self.facing.dot(q) / length;
        let square = (self.across(q).max(L::zero()) + s * third) / all;
        let c = L::splat(TWO_OVER_PI) * ((square - m * m).max(L::zero()) + L::splat(LEAST_SENT));
        let sum = (m * m + c).sqrt() + m.abs();
        found = found * L::select(m.ge(L::zero()), half * sum, half * c / sum);
        if let Some((axis, alpha)) = lobe {
            let along = axis.times(axis).dot(variance);
            let lateral = ((s - along) * half).max(L::splat(super::LEAST_VARIANCE));
            let wide = (alpha * lateral) + d2;
            let peak = (lateral * half + d2) / wide;
            let apart = L::one() - axis.dot(q) / d2.max(L::splat(super::LEAST_VARIANCE)).sqrt();
            // e^-87 underflows.
            let fall = (alpha * d2 / wide * apart).min(L::splat(80.0));
            found = found * (peak * exp(-fall) + L::splat(LOBE_FLOOR));
        }
        found
    }
}

impl<L: Lane> Moments<L> {
    /// The mean square of `q` along the normals.
    #[inline(always)]
    fn across(&self, q: Vec3<L>) -> L {
        let [xx, yy, xy, xz, yz] = self.normals;
        let zz = L::one() - xx - yy;
        q.x * (xx * q.x + (xy * q.y + xz * q.z) * L::splat(2.0))
            + q.y * (yy * q.y + yz * q.z * L::splat(2.0))
            + zz * q.z * q.z
    }

    /// [`Self::importance`] for walks and for choices inside clusters, which are little else: two divisions and three roots in place of eight and four, hence other
    /// roundings. `lateral` and `-m` may cancel here; the floors are far below what matters.
    #[inline(always)]
    pub fn brief(&self, p: Vec3<L>, n: Vec3<L>, lobe: Option<(Vec3<L>, L)>) -> L {
        let (half, third) = (L::splat(0.5), L::splat(1.0 / 3.0));
        let q = self.mean - p;
        let variance = self.variance;
        let s = (variance.x + variance.y) + variance.z;
        let d2 = q.length_squared();
        let m = n.dot(q);
        let root = m.mul_add(m, L::splat(TWO_OVER_PI) * n.times(n).dot(variance)).sqrt();
        let cosine = (half * (root + m)).max(root * L::splat(1e-6));
        // Times the root of `all`.
        let (all, m) = (d2 + s, -self.facing.dot(q));
        let square = s.mul_add(third, self.across(q).max(L::zero()));
        let c = all.mul_add(L::splat(LEAST_SENT), m.mul_add(-m, square).max(L::zero()));
        let root = m.mul_add(m, L::splat(TWO_OVER_PI) * c).sqrt();
        let sent = (half * (root + m)).max(root * L::splat(1e-6));
        let mut found = self.power * cosine * sent;
        let mut over = all * s.mul_add(third, d2);
        if let Some((axis, alpha)) = lobe {
            let along = axis.times(axis).dot(variance);
            let lateral = ((s - along) * half).max(L::splat(super::LEAST_VARIANCE));
            let wide = alpha.mul_add(lateral, d2);
            let apart = (d2 - axis.dot(q) * d2.sqrt()).max(L::zero());
            let fall = (alpha * apart / wide).min(L::splat(80.0));
            found = found
                * lateral
                    .mul_add(half, d2)
                    .mul_add(exp(-fall), wide * L::splat(LOBE_FLOOR));
            over = over * wide;
        }
        found / over
    }
}

/// What rounded normals do not tell: variance of the cosine at the lights.
const LEAST_SENT: f32 = 1.0 / 4096.0;

const TWO_OVER_PI: f32 = std::f32::consts::FRAC_2_PI;

/// Assumed value of a Phong lobe far from its axis, relative to its peak.
const LOBE_FLOOR: f32 = 1e-6;

#[cfg(test)]
mod tests {
    use super::super::{Emission, Emitter, LightTree};
    use super::*;

    fn node(mean: [f32; 3], variance: f32, emission: Emission) -> Node {
        let emitter = Emitter {
            light: 0,
            mean,
            variance: [variance; 3],
            emission,
            intensity: 1.0,
        };
        *LightTree::new(&[emitter]).root()
    }

    fn seen(node: &Node, p: [f32; 3], n: [f32; 3]) -> f32 {
        node.importance::<f32>(Vec3::splat(p), Vec3::splat(n), None)
    }

    /// A small distant light of any kind has `intensity cos / distance²`, with the power that its kind has for an intensity.
    #[test]
    fn a_small_node_is_a_point() {
        for (p, n) in [([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), ([1.0, 2.0, -1.0], [0.6, 0.0, 0.8])] {
            let q = [3.0 - p[0], 4.0 - p[1], 12.0 - p[2]];
            let d = f32::sqrt(q.iter().map(|x| x * x).sum());
            let cosine = (n[0] * q[0] + n[1] * q[1] + n[2] * q[2]) / d;
            let sent = (q[2] / d).abs();
            for (emission, sent) in [
                (Emission::Round, 1.0),
                (Emission::BothSides([0.0, 0.0, 1.0]), sent),
                (Emission::OneSide([0.0, 0.0, -1.0]), sent),
                (Emission::OneSide([0.0, 0.0, 1.0]), 0.0),
            ] {
                let found = seen(&node([3.0, 4.0, 12.0], 1e-9, emission), p, n) * emission.power() as f32;
                assert!((found * d * d / cosine - sent).abs() < 1e-2, "{emission:?}: {found}");
            }
        }
    }

    /// The two forms agree where single precision can tell.
    #[test]
    fn the_brief_form_is_the_same_importance() {
        for variance in [1e-6, 1.0, 1e4] {
            for place in [0.0, 1e-2, 1.0, 1e3] {
                for n in [[0.0, 0.0, 1.0], [0.0, 0.6, -0.8], [1.0, 0.0, 0.0]] {
                    for lobe in [None, Some(1.001_f32), Some(30.0), Some(1e3)] {
                        let lobe = lobe.map(|alpha| (Vec3::splat([0.0, 0.6, 0.8]), alpha));
                        let side = [0.0, 0.6, 0.8];
                        for emission in [Emission::Round, Emission::BothSides(side), Emission::OneSide(side)] {
                            let node = node([0.3 * place, 0.0, place], variance, emission);
                            let moments = node.moments::<f32>();
                            let (p, n) = (Vec3::<f32>::zero(), Vec3::splat(n));
                            let (brief, long) = (moments.brief(p, n, lobe), moments.importance(p, n, lobe));
                            let peak = moments.importance(p, Vec3::splat([0.287, 0.0, 0.958]), lobe);
                            assert!(
                                (brief - long).abs() <= 2e-3 * long + 1e-5 * peak,
                                "{variance} {place} {n:?} {lobe:?}: {brief}, not {long}"
                            );
                        }
                    }
                }
            }
        }
    }

    /// Inside nodes, behind points, far away and for the sharpest lobes: the importance is positive and fits `f32`.
    #[test]
    fn importance_is_a_positive_number_everywhere() {
        for variance in [0.0, 1e-12, 1.0, 1e5] {
            for place in [0.0, 1e-12, 1e-3, 1.0, 1e3] {
                for n in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]] {
                    for alpha in [None, Some(1.001_f32), Some(30.0), Some(1e6)] {
                        let lobe = alpha.map(|alpha| (Vec3::splat([0.0, 0.6, 0.8]), alpha));
                        let node = node([0.0, 0.0, place], variance, Emission::Round);
                        let found = node.importance::<f32>(Vec3::zero(), Vec3::splat(n), lobe);
                        assert!(
                            found >= 0.0 && found.is_finite(),
                            "{variance} {place} {n:?} {alpha:?}: {found}"
                        );
                        if n[2] >= 0.0 && variance > 0.0 {
                            assert!(found > 0.0, "{variance} {place} {n:?} {alpha:?}: {found}");
                        }
                    }
                }
            }
        }
    }
}
