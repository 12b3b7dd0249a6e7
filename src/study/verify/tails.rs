//! Bounds on the light that a finite number of samples may have missed.
//!
//! An estimator that hits a small light once in a million samples looks noise-free until it does: its samples agree, their
//! standard error is small, and their mean lacks the light's whole contribution. No statistic of the samples themselves can
//! tell. The oracle can: for every bit of light it knows how probably each estimator finds it and how much that would then
//! contribute ([`Probe`]). Events that are expected fewer than [`unseen`] times in all samples may all be missing. The mean
//! that they carry is the hidden share, and every test of means adds it to its bound. Where the hidden share is large, the test
//! reports that it has no power.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::blocks::Grid;
use crate::reference::probe::{Found, Probe, Way};
use crate::scene::EstimatorKind;

/// The source of the samples in question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The renderer with an estimator.
    Renderer(EstimatorKind),
    /// The oracle.
    Oracle,
}

const SOURCES: usize = EstimatorKind::ALL.len() + 1;

/// Safety margin for the probes' own uncertainty, in standard errors.
const DOUBT: f64 = 6.0;

impl Source {
    const ALL: [Self; SOURCES] = [
        Self::Renderer(EstimatorKind::Uniform),
        Self::Renderer(EstimatorKind::Light),
        Self::Renderer(EstimatorKind::Brdf),
        Self::Renderer(EstimatorKind::Mis),
        Self::Renderer(EstimatorKind::Mis2Balance),
        Self::Renderer(EstimatorKind::Mis2Power),
        Self::Renderer(EstimatorKind::Projected),
        Self::Renderer(EstimatorKind::Product),
        Self::Oracle,
    ];

    fn index(self) -> usize {
        Self::ALL
            .iter()
            .position(|&source| source == self)
            .unwrap_or(SOURCES - 1)
    }

    /// Contribution of a sample relative to the oracle's for the same direction; the inverse is the ratio of the probabilities
    /// of sampling it. The densities are those of [`Way::Reflected`].
    fn factor(self, light: f64, brdf: f64, oracle: f64) -> f64 {
        let both = light + brdf;
        let own = match self {
            Self::Renderer(EstimatorKind::Uniform) => 1.0 / (4.0 * PI),
            // Cosine-weighted sampling draws directions near the horizon more rarely than uniform sampling, and they contribute
            // proportionally less.
            Self::Renderer(EstimatorKind::Light | EstimatorKind::Projected) => light,
            Self::Renderer(EstimatorKind::Brdf) => brdf,
            Self::Renderer(EstimatorKind::Mis) => both / 2.0,
            // In a cone the light's density is at least half the cosine's; a lobe inside a light samples proportionally to the
            // contribution, within a factor of 2; of meshes and pictured environments there is a sample of both techniques. A constant
            // environment is sampled by the BRDF alone, and a direction that is rare there brings no more than any other.
            Self::Renderer(EstimatorKind::Product) => both / 3.0,
            // The more probable technique, whose contribution is larger by 1.21 at most.
            Self::Renderer(EstimatorKind::Mis2Power) => (light * light + brdf * brdf) / light.max(brdf),
            Self::Renderer(EstimatorKind::Mis2Balance) => both,
            Self::Oracle => oracle,
        };
        oracle / own
    }
}

/// Events of about the same contribution.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    /// Their expected number over all probes.
    count: f64,
    /// Their total contribution over all probes.
    mass: [f64; 3],
    /// Sums of squared contributions, for the uncertainty of `mass`.
    squares: [f64; 3],
}

/// Bins by contribution, two per doubling.
type Sizes = BTreeMap<i32, Bin>;

/// The distribution of contributions in each cell of a grid.
#[derive(Clone, Debug)]
pub struct Tails {
    grid: Grid,
    reflected: Vec<[Sizes; SOURCES]>,
    seen: Vec<Sizes>,
    /// Each emitter's contribution, reflected or seen directly, over all probes.
    emitters: Vec<f64>,
    passes: f64,
}

/// The largest expected number of events that may all be missing with a probability of `alpha`.
pub fn unseen(alpha: f64) -> f64 {
    -alpha.ln()
}

impl Tails {
    /// Empty statistics.
    pub fn new(grid: Grid, probe: &Probe<'_>) -> Self {
        Self {
            reflected: vec![Default::default(); grid.cells()],
            seen: vec![Sizes::new(); grid.cells()],
            grid,
            emitters: vec![0.0; probe.emitters()],
            passes: 0.0,
        }
    }

    /// Adds one pass of the probe.
    pub fn add(&mut self, found: &[Found]) {
        self.passes += 1.0;
        for event in found {
            let size = event.radiance.iter().fold(0.0_f64, |most, &x| most.max(x));
            let own = self.grid.block_of(event.pixel as usize);
            let whole = (own < self.grid.blocks()).then(|| self.grid.blocks());
            let cells = std::iter::once(own).chain(whole);
            match event.way {
                Way::Seen => cells.for_each(|cell| put(&mut self.seen[cell], event.radiance, size, 1.0)),
                Way::Certain { emitter } => {
                    self.emitters[emitter] += size;
                    cells.for_each(|cell| put(&mut self.seen[cell], event.radiance, size, 1.0));
                }
                Way::Reflected {
                    emitter,
                    light,
                    brdf,
                    oracle,
                } => {
                    self.emitters[emitter] += size;
                    for (source, at) in Source::ALL.into_iter().zip(0..) {
                        let factor = source.factor(light, brdf, oracle);
                        for cell in cells.clone() {
                            put(&mut self.reflected[cell][at], event.radiance, size, factor);
                        }
                    }
                }
            }
        }
    }

    /// Passes so far.
    pub fn passes(&self) -> f64 {
        self.passes
    }

    /// Emitters without any reflected light found.
    pub fn lights_nothing(&self) -> Vec<bool> {
        self.emitters.iter().map(|&mass| mass == 0.0).collect()
    }

    /// Mean reflected radiance of a cell.
    pub fn reflected(&self, cell: usize) -> [f64; 3] {
        let sum = self.reflected[cell][Source::Oracle.index()]
            .values()
            .fold([0.0; 3], |sum, bin| std::array::from_fn(|i| sum[i] + bin.mass[i]));
        sum.map(|mass| mass / self.probes(cell))
    }

    /// The reference of relative biases: reflected light; for silhouettes also directly visible light.
    pub fn light(&self, cell: usize) -> [f64; 3] {
        let mut light = self.reflected(cell);
        if cell == self.grid.silhouettes() {
            for bin in self.seen[cell].values() {
                for (light, mass) in light.iter_mut().zip(bin.mass) {
                    *light += mass / self.probes(cell);
                }
            }
        }
        light
    }

    /// The part of a cell's mean that `passes` samples per pixel may have missed entirely, with probability `alpha`. In
    /// silhouettes, samples may also miss visible emitters; elsewhere emitters fill their pixels.
    pub fn hidden(&self, source: Source, cell: usize, passes: f64, alpha: f64) -> [f64; 3] {
        let scale = passes / self.passes;
        let mut left = unseen(alpha);
        let mut bins: Vec<(i32, Bin)> = self.reflected[cell][source.index()]
            .iter()
            .map(|(&k, &v)| (k, v))
            .collect();
        if cell == self.grid.silhouettes() {
            bins.extend(self.seen[cell].iter().map(|(&k, &v)| (k, v)));
        }
        bins.sort_by_key(|&(size, _)| std::cmp::Reverse(size));
        let (mut hidden, mut squares) = ([0.0; 3], [0.0; 3]);
        for (_, bin) in bins {
            let expected = bin.count * scale;
            let share = if expected > left { left / expected } else { 1.0 };
            for channel in 0..3 {
                hidden[channel] += share * bin.mass[channel];
                squares[channel] += share * share * bin.squares[channel];
            }
            left -= expected;
            if left <= 0.0 {
                break;
            }
        }
        std::array::from_fn(|i| (hidden[i] + DOUBT * squares[i].sqrt()) / self.probes(cell))
    }

    fn probes(&self, cell: usize) -> f64 {
        (self.passes * self.grid.pixels(cell)).max(1.0)
    }
}

fn put(sizes: &mut Sizes, mass: [f64; 3], size: f64, factor: f64) {
    let bin = sizes.entry((2.0 * (size * factor).log2()).floor() as i32).or_default();
    bin.count += 1.0 / factor;
    for (channel, mass) in mass.into_iter().enumerate() {
        bin.mass[channel] += mass;
        bin.squares[channel] += mass * mass;
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::scene::{FilmSize, Scene};

    /// With few samples `uniform` may miss a light that fills 1e-5 of all directions, with many it does
    /// not; `light` always finds it.
    #[test]
    fn what_is_seldom_hit_may_be_missing() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/sphere-tiny.toml");
        let scene = Scene::load(&path).unwrap();
        let film = FilmSize { width: 1, height: 1 };
        let probe = Probe::new(&scene, film);
        let mut tails = Tails::new(Grid::new(film, &[false]), &probe);
        (0..500).for_each(|seed| tails.add(&probe.pass(seed)));
        let all = tails.reflected(0)[1];
        assert!(all > 0.0 && tails.passes() == 500.0);
        let share = |kind, passes| tails.hidden(Source::Renderer(kind), 0, passes, 1e-6)[1] / all;
        assert!(share(EstimatorKind::Uniform, 100.0) >= 1.0);
        assert!(share(EstimatorKind::Uniform, 1e18) < 1e-3);
        assert!(share(EstimatorKind::Light, 1e6) < 1e-3);
        assert_eq!(tails.lights_nothing(), [false]);
    }

    /// Of a light with the sine `s` = 1e-3 a crest of height `h` = 2e-6 rises above the horizon: one direction in 20 000 of its
    /// cone. Its projected solid angle is `8/15 sqrt(2 s) h^2.5`. Probes find it, and tell that a thousand samples may all miss it.
    /// The bound on the radiance is 4.8 standard deviations of 500 directions, 8/15 of which meet the light.
    #[test]
    fn a_light_that_barely_rises_may_be_missing() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/sphere-tiny.toml");
        let mut scene = Scene::load(&path).unwrap().to_builder();
        let (sine, high) = (1e-3, 2e-6);
        scene.spheres[0].center = glam::DVec3::new(10.0, 10.0 * (high - sine), 0.0);
        let scene = scene.build().unwrap();
        let film = FilmSize { width: 1, height: 1 };
        let probe = Probe::new(&scene, film);
        let mut tails = Tails::new(Grid::new(film, &[false]), &probe);
        (0..500).for_each(|seed| tails.add(&probe.pass(seed)));
        let all = tails.reflected(0)[1];
        let expected = 0.5 / PI * 1e6 * 8.0 / 15.0 * (2.0 * sine).sqrt() * high.powf(2.5);
        assert!((all / expected - 1.0).abs() < 0.2, "{all} {expected}");
        let share = |kind, passes| tails.hidden(Source::Renderer(kind), 0, passes, 1e-6)[1] / all;
        for kind in [EstimatorKind::Light, EstimatorKind::Mis, EstimatorKind::Uniform] {
            assert!(share(kind, 1000.0) >= 1.0 && share(kind, 1e18) < 1e-3, "{kind:?}");
        }
        assert!(tails.hidden(Source::Oracle, 0, 1000.0, 1e-6)[1] < 0.2 * all);
    }
}
