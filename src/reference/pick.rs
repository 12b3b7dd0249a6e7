//! A choice of some lights, for pictures under many: one sample of each of 65 536 lights takes a tenth of a second.

use rand::{Rng, RngExt};

use super::emitter::Emitter;
use super::shapeless::ShapelessLight;

/// Up to this many lights, each sample of a picture has a direction of every one.
const FEW: usize = 64;

/// Lights that a sample picks from more.
const SOME: usize = 16;

/// Lights by their intensity: emitters, then lights with a position but no shape, by their indices.
#[derive(Debug)]
pub struct Picks {
    /// Inclusive sums of intensities.
    sums: Vec<f64>,
    /// Index of each light among the emitters and, behind these, the lights without shape.
    lights: Vec<usize>,
}

impl Picks {
    /// `None` if there are few lights with a position, or if their intensities have no finite sum.
    pub fn new(emitters: &[Emitter], shapeless: &[ShapelessLight]) -> Option<Self> {
        let of_shapeless = shapeless.iter().map(ShapelessLight::intensity);
        let intensities = emitters
            .iter()
            .map(|emitter| Some(emitter.intensity()))
            .chain(of_shapeless);
        let (mut sum, mut sums, mut lights) = (0.0, Vec::new(), Vec::new());
        for (light, intensity) in intensities.enumerate() {
            if let Some(intensity) = intensity {
                sum += intensity;
                sums.push(sum);
                lights.push(light);
            }
        }
        (lights.len() > FEW && sum > 0.0 && sum.is_finite()).then_some(Self { sums, lights })
    }

    /// Picks lights, one in each of equal parts of the sum of intensities: each with one over how often it is expected.
    pub fn draw(&self, rng: &mut impl Rng) -> [(usize, f64); SOME] {
        let last = self.sums.len() - 1;
        let step = self.sums[last] / SOME as f64;
        std::array::from_fn(|i| {
            let place = (i as f64 + rng.random::<f64>()) * step;
            let at = self.sums.partition_point(|&sum| sum <= place).min(last);
            let before = if at == 0 { 0.0 } else { self.sums[at - 1] };
            (self.lights[at], step / (self.sums[at] - before))
        })
    }
}
