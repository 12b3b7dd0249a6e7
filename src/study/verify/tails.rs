//! What a finite number of samples may never have met.
//!
//! An estimator that hits a small light once in a million samples looks calm as long as it misses: its samples agree,
//! their standard error is small, and their mean is wrong by all that the light would have brought. No statistic of
//! the samples themselves can tell. But the oracle can: for every bit of light it knows how probable each estimator
//! finds it and what that would then count ([`Probe`]). Events that are expected fewer than [`unseen`] times in all
//! samples may all be missing; the mean that they carry is the hidden share, and every test of means grants it on top
//! of its standard errors. Where the hidden share is large, the test says that it has no power.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use super::blocks::Grid;
use crate::reference::probe::{Found, Probe, Way};
use crate::scene::EstimatorKind;

/// Whose samples are asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The renderer with an estimator.
    Renderer(EstimatorKind),
    /// The oracle.
    Oracle,
}

const SOURCES: usize = EstimatorKind::ALL.len() + 1;

/// Standard errors of what the probes say that are granted to it.
const DOUBT: f64 = 6.0;

/// Angle in radians by which single precision may turn the horizon: two roundings of a normal and of a direction. A light of which a
/// sliver rises above the horizon brings `TILT` times its solid angle more or less.
const TILT: f64 = 4.0 * (f32::EPSILON / 2.0) as f64;

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

    /// How much more than the oracle it counts for the same direction; the inverse is how much more seldom it draws it.
    fn factor(self, light: f64, brdf: f64) -> f64 {
        let both = light + brdf;
        match self {
            Self::Renderer(EstimatorKind::Uniform) => both * 4.0 * PI,
            // By cosines, directions at the horizon are drawn more seldom than uniformly, and bring as much less.
            Self::Renderer(EstimatorKind::Light | EstimatorKind::Projected) => both / light,
            Self::Renderer(EstimatorKind::Brdf) => both / brdf,
            Self::Renderer(EstimatorKind::Mis) => 2.0,
            // In a cone the light's density is at least half the cosine's; a lobe inside a light draws in proportion to what a direction
            // brings, to a factor of 2; meshes and the sky are as in `mis`.
            Self::Renderer(EstimatorKind::Product) => 3.0,
            // The more probable technique: what it counts is the larger, by 1.21 at most.
            Self::Renderer(EstimatorKind::Mis2Power) => both * light.max(brdf) / (light * light + brdf * brdf),
            Self::Renderer(EstimatorKind::Mis2Balance) | Self::Oracle => 1.0,
        }
    }
}

/// Events of about the same size.
#[derive(Clone, Copy, Debug, Default)]
struct Bin {
    /// How many of them are expected over all probes.
    count: f64,
    /// What they bring, over all probes.
    mass: [f64; 3],
    /// Sums of the squares of that, for its own uncertainty.
    squares: [f64; 3],
}

/// Bins by size, two to a doubling.
type Sizes = BTreeMap<i32, Bin>;

/// The sizes of events in each cell of a grid.
#[derive(Clone, Debug)]
pub struct Tails {
    grid: Grid,
    reflected: Vec<[Sizes; SOURCES]>,
    seen: Vec<Sizes>,
    /// Light that comes and goes with [`TILT`], over all probes.
    tilted: Vec<[f64; 3]>,
    /// What each emitter brings by reflection or by being seen, over all probes.
    emitters: Vec<f64>,
    passes: f64,
}

/// How many events may be expected and yet all be missing, with a probability of `alpha`.
pub fn unseen(alpha: f64) -> f64 {
    -alpha.ln()
}

impl Tails {
    /// Nothing is known yet.
    pub fn new(grid: Grid, probe: &Probe<'_>) -> Self {
        Self {
            reflected: vec![Default::default(); grid.cells()],
            seen: vec![Sizes::new(); grid.cells()],
            tilted: vec![[0.0; 3]; grid.cells()],
            grid,
            emitters: vec![0.0; probe.emitters()],
            passes: 0.0,
        }
    }

    /// Takes one pass of the probe in.
    pub fn add(&mut self, found: &[Found]) {
        self.passes += 1.0;
        for event in found {
            let size = event.radiance.iter().fold(0.0_f64, |most, &x| most.max(x));
            let own = self.grid.block_of(event.pixel as usize);
            let whole = (own < self.grid.blocks()).then(|| self.grid.blocks());
            let cells = std::iter::once(own).chain(whole);
            match event.way {
                Way::Seen => cells.for_each(|cell| put(&mut self.seen[cell], event.radiance, size, 1.0)),
                Way::Certain { emitter, cosine } => {
                    self.emitters[emitter] += size;
                    self.tilt(cells.clone(), event.radiance, cosine);
                    cells.for_each(|cell| put(&mut self.seen[cell], event.radiance, size, 1.0));
                }
                Way::Reflected {
                    emitter,
                    light,
                    brdf,
                    cosine,
                } => {
                    self.emitters[emitter] += size;
                    self.tilt(cells.clone(), event.radiance, cosine);
                    for (source, at) in Source::ALL.into_iter().zip(0..) {
                        let factor = source.factor(light, brdf);
                        for cell in cells.clone() {
                            put(&mut self.reflected[cell][at], event.radiance, size, factor);
                        }
                    }
                }
            }
        }
    }

    /// Notes what of a direction's light a tilt of the normal may change.
    fn tilt(&mut self, cells: impl Iterator<Item = usize>, radiance: [f64; 3], cosine: f64) {
        let part = (TILT / cosine).min(1.0);
        for cell in cells {
            for (sum, radiance) in self.tilted[cell].iter_mut().zip(radiance) {
                *sum += part * radiance;
            }
        }
    }

    /// Passes so far.
    pub fn passes(&self) -> f64 {
        self.passes
    }

    /// Emitters whose light was never found by reflection.
    pub fn lights_nothing(&self) -> Vec<bool> {
        self.emitters.iter().map(|&mass| mass == 0.0).collect()
    }

    /// Mean radiance of a cell that comes by reflection.
    pub fn reflected(&self, cell: usize) -> [f64; 3] {
        let sum = self.reflected[cell][Source::Oracle.index()]
            .values()
            .fold([0.0; 3], |sum, bin| std::array::from_fn(|i| sum[i] + bin.mass[i]));
        sum.map(|mass| mass / self.probes(cell))
    }

    /// What biases are relative to: light by reflection, in the rims also what is seen.
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

    /// The part of a cell's mean that `passes` samples of every pixel may have missed altogether, with probability
    /// `alpha`. In the rims, emitters that are seen may be missed as well; elsewhere they fill their pixels. A renderer is granted the
    /// light at the horizon that single precision adds or loses, too.
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
        if source != Source::Oracle {
            for (hidden, tilted) in hidden.iter_mut().zip(self.tilted[cell]) {
                *hidden += tilted;
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

    /// A light that fills a hundredth of a thousandth of all directions is beyond `uniform` with few samples, and not
    /// with many; `light` always finds it.
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

    /// Of a light with the sine 1e-3 a strip of the height `h` = 2e-4 rises above the horizon. Its projected solid angle grows as
    /// `h^2.5`, so a horizon that is turned by `TILT` changes it by `2.5 TILT / h` of itself; the strip is no thin one, and some 800 of
    /// 8000 samples meet it, so a factor of 1.5 is granted.
    #[test]
    fn a_sliver_of_a_light_comes_and_goes_with_the_horizon() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/tests/sphere-tiny.toml");
        let mut scene = Scene::load(&path).unwrap().to_builder();
        let (sine, high) = (1e-3, 2e-4);
        scene.spheres[0].center = glam::DVec3::new(10.0, 10.0 * (high - sine), 0.0);
        let scene = scene.build().unwrap();
        let film = FilmSize { width: 1, height: 1 };
        let probe = Probe::new(&scene, film);
        let mut tails = Tails::new(Grid::new(film, &[false]), &probe);
        (0..8000).for_each(|seed| tails.add(&probe.pass(seed)));
        let all = tails.reflected(0)[1];
        let hidden = |source| tails.hidden(source, 0, 1e18, 1e-6)[1] / all;
        let tilted = hidden(Source::Renderer(EstimatorKind::Light)) - hidden(Source::Oracle);
        let expected = 2.5 * TILT / high;
        assert!(
            (expected / 1.5..1.5 * expected).contains(&tilted),
            "{tilted:e}, not {expected:e}"
        );
    }
}
