//! What tests of lanes share: hard numbers, vectors of lanes, and a table of the differences.

use octolux::embree::{LaneWork, TraceLane, in_eight_of_avx512, in_sixteen};
use octolux::lane::{F32x8, Lane, has_avx512};
use octolux::math::Vec3;
use rand::{Rng, RngExt};
use rand_pcg::Pcg64;

/// NaN is one value: which of its bits survive an operation is the compiler's choice in both forms.
pub fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

/// What breaks functions: zeros, subnormals, the ends of the range, infinities, NaN.
pub const HARD: [f32; 14] = [
    0.0,
    -0.0,
    1e-45,
    -1e-45,
    f32::MIN_POSITIVE,
    f32::EPSILON,
    1.0,
    -1.0,
    2.0,
    1.0 - f32::EPSILON / 2.0,
    f32::MAX,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

/// Fails with the table of differences, if there are any.
pub fn verdict(name: &str, wrong: &str) {
    if !wrong.is_empty() {
        let path = super::artefact(&format!("lanes-{name}.txt"));
        std::fs::write(&path, wrong).expect("a table can be written to the target folder");
        panic!(
            "{name}: {} differences, listed in {}",
            wrong.lines().count(),
            path.display()
        );
    }
}

pub fn uniform(rng: &mut Pcg64) -> f32 {
    rng.random::<f32>()
}

/// Of any magnitude and sign.
pub fn any_number(rng: &mut Pcg64) -> f32 {
    f32::from_bits(rng.next_u32())
}

pub fn vector<L: Copy>(x: &[L]) -> Vec3<L> {
    Vec3 {
        x: x[0],
        y: x[1],
        z: x[2],
    }
}

pub fn flat<L: Lane>(vectors: &[Vec3<L>]) -> Vec<L> {
    vectors.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

pub fn indicator<L: Lane>(mask: L::Mask) -> L {
    L::one().or_zero(mask)
}

/// A computation in lanes of any width, whose result says what each lane got.
pub trait InLanes {
    /// What one lane gets.
    type Said;
    /// Takes the inputs from number `first` on, one for each lane.
    fn run<L: TraceLane>(&self, first: usize) -> Vec<Self::Said>;
}

struct Into<'a, J: InLanes>(&'a J, usize, &'a mut Vec<J::Said>);

impl<J: InLanes> LaneWork for Into<'_, J> {
    #[inline(always)]
    fn run<L: TraceLane>(self) {
        self.2.extend(self.0.run::<L>(self.1));
    }
}

/// What sixteen inputs get by themselves, by eight, and where the processor has AVX-512 by eight and by sixteen with that.
pub fn in_all_widths<J: InLanes>(job: &J) -> Vec<(usize, Vec<J::Said>)> {
    let one = (0..16).flat_map(|first| job.run::<f32>(first)).collect();
    let eight = [0, 8].into_iter().flat_map(|first| job.run::<F32x8>(first)).collect();
    let mut all = vec![(1, one), (8, eight)];
    if has_avx512() {
        let (mut eight, mut sixteen) = (vec![], vec![]);
        for first in [0, 8] {
            in_eight_of_avx512(Into(job, first, &mut eight));
        }
        in_sixteen(Into(job, 0, &mut sixteen));
        all.extend([(8, eight), (16, sixteen)]);
    }
    all
}
