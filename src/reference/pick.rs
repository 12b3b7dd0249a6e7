//! A choice of some lights, where there are many: one sample of each of 65 536 lights takes a tenth of a second. For studies, which have a
//! budget; where the oracle judges, it samples all.

use rand::{Rng, RngExt};

use super::emitter::Emitter;
use super::shapeless::ShapelessLight;

/// Up to this many lights, each sample has a direction of every one.
const FEW: usize = 64;

/// Lights that a sample picks from more.
const SOME: usize = 16;

/// Emitters and, behind these, lights without shape, by their intensity. Lights without a position are in no choice.
#[derive(Debug)]
pub struct Picks {
    /// Inclusive sums of intensities.
    sums: Vec<f64>,
    /// How often each light is expected in a choice.
    expected: Vec<Option<f64>>,
}

impl Picks {
    /// `None` if there are few lights with a position, or if their intensities have no finite sum.
    pub fn new(emitters: &[Emitter], shapeless: &[ShapelessLight]) -> Option<Self> {
        let of_shapeless = shapeless.iter().map(ShapelessLight::intensity);
        let of_emitters = emitters.iter().map(|emitter| Some(emitter.intensity()));
        let intensities: Vec<_> = of_emitters.chain(of_shapeless).collect();
        let sums: Vec<f64> = (intensities.iter())
            .scan(0.0, |sum, intensity| {
                *sum += intensity.unwrap_or(0.0);
                Some(*sum)
            })
            .collect();
        let all = sums.last().copied().unwrap_or(0.0);
        let many = intensities.iter().flatten().count() > FEW;
        (many && all > 0.0 && all.is_finite()).then(|| Self {
            sums,
            expected: (intensities.iter())
                .map(|one| one.map(|intensity| SOME as f64 * (intensity / all)))
                .collect(),
        })
    }

    /// Picks lights, one in each of equal parts of the sum of intensities.
    pub fn draw(&self, rng: &mut impl Rng) -> [usize; SOME] {
        let last = self.sums.len() - 1;
        let step = self.sums[last] / SOME as f64;
        std::array::from_fn(|i| {
            let place = (i as f64 + rng.random::<f64>()) * step;
            self.sums.partition_point(|&sum| sum <= place).min(last)
        })
    }

    /// How often a light is expected in a choice; `None` for one that is in none.
    pub fn expected(&self, light: usize) -> Option<f64> {
        self.expected[light]
    }
}
