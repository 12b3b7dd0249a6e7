//! Lobes inside lights: the weights of `product` and its directions against the same lobe and cap in `f64`, in angles where the
//! renderer has `1 - cos`.

use std::f64::consts::{FRAC_PI_2, PI};

use octolux::bsdf::DiffuseOrPhong;
use octolux::estimator::density::LobeInCap;
use octolux::estimator::{ShadingPoint, per_light, product};
use octolux::lane::{Bits, F32x8, Lane, Mask, Word};
use octolux::light::{Cone, Rings, SphereLight};
use octolux::sampling::{PassBlock, TechniqueSample};
use octolux::scene::{Camera, EstimatorKind, FilmSize, Fov, Material, Mesh, SamplerKind, Scene, Sphere, Surface};

use super::Family;
use super::places::{RHO, point, wide};
use super::runs::{Runs, settings};
use super::stats::{chi_square, integrate};

/// A lobe of this exponent at the origin, and a light of this sine whose axis is so many radians from the lobe's.
fn place<L: Lane>(alpha: f64, sine: f64, apart: f64) -> (ShadingPoint<L, DiffuseOrPhong<L>>, SphereLight) {
    let point = point::<L>(alpha, 0.5);
    let axis = wide(point.bsdf.wr.lane(0)).normalize();
    let aside = axis.any_orthonormal_vector();
    let center = 3.0 * (axis * apart.cos() + aside * apart.sin());
    let light = SphereLight {
        center: center.to_array().map(|x| x as f32),
        radius: (3.0 * sine) as f32,
        le: [1.0; 3],
        sphere: 0,
        origin_power: None,
    };
    (point, light)
}

/// A lobe and a cap, in `f64` of the vectors that the renderer has.
struct Region {
    /// The exponent plus 1.
    power: f64,
    /// The angle between the axes, and half the cap's.
    apart: f64,
    half: f64,
    /// Share of the lobe beyond the nearest ring, and of that the share before the farthest.
    beyond: f64,
    share: f64,
}

fn ln_cos(angle: f64) -> f64 {
    (-2.0 * (angle / 2.0).sin().powi(2)).max(-1.0).ln_1p()
}

fn angle_of(one_minus_cos: f64) -> f64 {
    2.0 * (one_minus_cos / 2.0).sqrt().min(1.0).asin()
}

impl Region {
    fn of(point: &ShadingPoint<f32, DiffuseOrPhong<f32>>, cone: &Cone<f32>) -> Self {
        let chord = (wide(point.bsdf.wr.lane(0)) - wide(cone.axis.lane(0))).length();
        let (apart, half) = (
            2.0 * (chord / 2.0).min(1.0).asin(),
            angle_of(f64::from(cone.one_minus_cos_max)),
        );
        let power = f64::from(point.bsdf.alpha) + 1.0;
        let (first, last) = ((apart - half).max(0.0), apart + half);
        let (beyond, share) = if first >= FRAC_PI_2 {
            (0.0, 0.0)
        } else if last >= FRAC_PI_2 {
            ((power * ln_cos(first)).exp(), 1.0)
        } else {
            let share = -(power * (ln_cos(last) - ln_cos(first))).exp_m1();
            ((power * ln_cos(first)).exp(), share)
        };
        Self {
            power,
            apart,
            half,
            beyond,
            share,
        }
    }

    /// Half the arc of the ring at an angle from the lobe's axis that is inside the cap: the half-angle formula of a spherical triangle.
    fn half_arc(&self, ring: f64) -> f64 {
        let Self { apart, half, .. } = *self;
        let (above, below) = (
            ((half + apart - ring) / 2.0).sin() * ((half - apart + ring) / 2.0).sin(),
            apart.sin() * ring.sin(),
        );
        if above <= 0.0 {
            0.0
        } else if above >= below {
            PI
        } else {
            2.0 * (above / below).sqrt().asin()
        }
    }

    /// Mean of the weights and of their squares.
    fn moments(&self) -> [f64; 2] {
        let Self { power, apart, half, .. } = *self;
        // Rings up to this one are whole.
        let whole = (half - apart).clamp(0.0, FRAC_PI_2);
        let inner = if whole >= FRAC_PI_2 {
            1.0
        } else {
            -(power * ln_cos(whole)).exp_m1()
        };
        let from = (apart - half).abs().min(FRAC_PI_2);
        let start = 2.0 * (from / 2.0).sin().powi(2);
        // Beyond it less than 1e-15 of the rest of the lobe is left.
        let cut = angle_of(start + (1.0 - start) * -(-35.0 / power).exp_m1());
        let to = (apart + half).min(FRAC_PI_2).min(cut).max(from);
        let (middle, reach) = ((from + to) / 2.0, (to - from) / 2.0);
        let mass = self.beyond * self.share;
        [1, 2].map(|k| {
            let over_rings = integrate(0.0, PI, 600, |turn| {
                let ring = middle - reach * turn.cos();
                let lobe = power * ((power - 1.0) * ln_cos(ring)).exp() * ring.sin();
                lobe * (self.half_arc(ring) / PI).powi(k) * reach * turn.sin()
            });
            mass.powi(k - 1) * (inner + over_rings)
        })
    }

    /// The numbers in [0, 1] that the direction `wi` is drawn from.
    fn numbers(&self, point: &ShadingPoint<f32, DiffuseOrPhong<f32>>, cone: &Cone<f32>, wi: [f32; 3]) -> [f64; 2] {
        let (axis, toward, wi) = (
            wide(point.bsdf.wr.lane(0)).normalize(),
            wide(cone.axis.lane(0)).normalize(),
            wide(wi).normalize(),
        );
        let t = (wi - axis).length_squared() / 2.0;
        let first = 2.0 * ((self.apart - self.half).max(0.0) / 2.0).sin().powi(2);
        let part = ((t - first) / (1.0 - first)).clamp(0.0, 1.0);
        let u = -(self.power * (-part).max(-1.0 + 1e-15).ln_1p()).exp_m1() / self.share;
        let azimuth = axis
            .dot(toward.cross(wi))
            .atan2(toward.dot(wi) - toward.dot(axis) * wi.dot(axis));
        [u, (azimuth / self.half_arc(angle_of(t)) + 1.0) / 2.0]
    }
}

const ALPHAS: [f64; 8] = [1.5, 5.0, 30.0, 300.0, 5e3, 2e4, 1e5, 1e6];
const SINES: [f64; 10] = [1e-7, 1e-5, 1e-3, 0.02, 0.1, 0.4, 0.7, 0.9, 0.99, 0.9999];
/// Angles between the axes in half-angles of the light: coincident, inside, at the rim, outside.
const APART: [f64; 12] = [0.0, 0.1, 0.5, 0.9, 0.999, 1.0, 1.001, 1.1, 1.5, 2.0, 4.0, 10.0];
const DRAWS: u32 = 4096;

/// Mean and relative variance of 4096 weights, evenly spaced in the number that decides them, are those of a quadrature; every direction
/// is inside the cap. Returns of each sine the largest relative error of a mean, the largest error of a relative variance and the
/// largest relative variance.
///
/// A mean is asked to 2e-4, most of which is the 4096 points', and to 5e-4 where the cap is nearly half the sky: the rim's rounding
/// is then `6e-8 / cos` of the half-angle. The relative variance is asked to 1e-3, and never to be above 0.38. Lights whose nearest ring
/// is beyond 45 degrees have more allowed to them (`edge` below), and are left out of the first figure of the table.
pub fn weights_are_those_of_a_quadrature() -> Vec<[f64; 4]> {
    SINES.map(of_sine).into()
}

fn of_sine(sine: f64) -> [f64; 4] {
    let mut worst = [sine, 0.0, 0.0, 0.0_f64];
    let mut held = 0;
    for alpha in ALPHAS {
        // Also apart as the lobe is wide, and at right angles.
        let wide_as_lobe = (2.0 / alpha).sqrt().min(1.0);
        let apart = APART.map(|times| times * sine.asin());
        for apart in apart
            .into_iter()
            .chain([wide_as_lobe, 3.0 * wide_as_lobe, FRAC_PI_2, 2.0])
        {
            let (point, light) = place::<f32>(alpha, sine, apart.min(PI));
            let cone = light.cone(point.p);
            let region = Region::of(&point, &cone);
            let rings = Rings::of(point.bsdf.wr, point.bsdf.alpha, &cone);
            let what = format!("exponent {alpha:e}, sine {sine:e}, {apart:e} apart");
            // Below that single precision rounds to 0.
            if region.beyond * region.share < 1e-30 {
                assert!(rings.mass < 1e-29, "{what}: {:e} of nothing", rings.mass);
                continue;
            }
            // Close to 90 degrees the cosine of the nearest ring is a difference of nearly equal numbers, and so is the sine between
            // axes that are nearly opposite.
            let first = (region.apart - region.half).max(0.0);
            let edge = 3e-7 * region.power / (ln_cos(first).exp() * region.apart.sin());
            let edge = if first > 0.78 { edge } else { 0.0 };
            if edge > 0.01 {
                continue;
            }
            held += 1;
            let (mut sums, mut outside) = ([0.0; 2], 0);
            for i in 0..DRAWS {
                let ring = rings.draw(point.bsdf.alpha, (i as f32 + 0.5) / DRAWS as f32);
                let weight = f64::from(rings.weight(&ring));
                assert!((0.0..=1.0 + 1e-6).contains(&weight), "{what}: a weight of {weight:e}");
                sums = [sums[0] + weight, sums[1] + weight * weight];
                let v = (i.wrapping_mul(2_654_435_769) >> 8) as f32 / (1 << 24) as f32;
                let wi = wide(ring.direction(point.bsdf.wr, cone.axis, v).lane(0));
                assert!((wi.length() - 1.0).abs() < 1e-6, "{what}: not of unit length");
                let from_axis = angle_of((wi.normalize() - wide(cone.axis.lane(0)).normalize()).length_squared() / 2.0);
                outside += u32::from(weight > 0.0 && from_axis > region.half + 1e-6);
            }
            let near = sine > 0.9;
            assert!(
                outside <= if near { DRAWS / 1000 } else { 0 },
                "{what}: {outside} directions outside of the light"
            );
            let [mean, second] = sums.map(|sum| sum / f64::from(DRAWS));
            let [true_mean, true_second] = region.moments();
            let error = (mean / true_mean - 1.0).abs();
            let (variance, truth) = (
                second / (mean * mean) - 1.0,
                true_second / (true_mean * true_mean) - 1.0,
            );
            assert!(
                error <= edge + if near { 5e-4 } else { 2e-4 },
                "{what}: mean {mean:e} instead of {true_mean:e}, off by {error:e}"
            );
            assert!(
                (variance - truth).abs() <= edge + 1e-3 && variance <= 0.38,
                "{what}: relative variance {variance} instead of {truth}"
            );
            if edge == 0.0 {
                worst[1] = worst[1].max(error);
            }
            worst[2] = worst[2].max((variance - truth).abs());
            worst[3] = worst[3].max(variance);
        }
    }
    assert!(held > 30, "sine {sine:e}: only {held} places are held against it");
    worst
}

/// From inside a light it is the whole lobe: every weight is 1.
pub fn from_inside_it_is_the_lobe() {
    for alpha in ALPHAS {
        let (point, light) = place::<f32>(alpha, 1.2, 0.4);
        let rings = Rings::of(point.bsdf.wr, point.bsdf.alpha, &light.cone(point.p));
        for i in 0..DRAWS {
            let u = (i as f32 + 0.5) / DRAWS as f32;
            let ring = rings.draw(point.bsdf.alpha, u);
            let weight = rings.weight(&ring);
            assert!((weight - 1.0).abs() < 1e-6, "exponent {alpha}: {weight}");
            let drawn = point.bsdf.sample(u);
            assert!(
                (ring.t - drawn).abs() <= 3e-6 * drawn,
                "exponent {alpha}: {} where the lobe draws {drawn}",
                ring.t
            );
        }
    }
}

/// In the tail of a lobe one sample in 256 is taken: it must bring as much as all of them would.
///
/// The mean of 2^20 samples has a standard error of 1.6 % (255 over their number, rooted), a little more with the weights' own: beyond 9 %
/// with a probability below 1e-6.
pub fn a_tail_brings_what_all_its_samples_would() {
    let numbers = PassBlock::new(SamplerKind::Independent, 77, 0, 1, 3);
    for (alpha, depth) in [(300.0, 40.0), (2e4, 33.0), (1e5, 60.0)] {
        // As deep as the lobe is `e^-depth` of its peak, at a small light.
        let (point, light) = place::<f32>(alpha, 1e-4, f64::sqrt(2.0 * depth / alpha));
        let (cone, phong) = (light.cone(point.p), point.with(point.bsdf.as_phong()));
        let rings = Rings::of(phong.bsdf.wr, phong.bsdf.alpha, &cone);
        let (mut taken, mut some, mut all) = (0, 0.0, 0.0);
        for pixel in 0..1 << 20 {
            let pair = numbers.pair(Word(pixel), Word(0), 2);
            let technique_sample = TechniqueSample {
                by_brdf_lanes: false,
                pair,
            };
            if let Some(found) = per_light::sample(LobeInCap, &point, &light, technique_sample, true) {
                taken += 1;
                some += f64::from(found.ld.x) / f64::from(RHO[0]);
            }
            let (u, v) = pair.unit::<f32>();
            let ring = rings.draw(phong.bsdf.alpha, u);
            if let Some(found) = product::on_ring(&phong, &cone, &ring, rings.weight(&ring), v, true) {
                all += f64::from(found.weight);
            }
        }
        // 4096 of them, with a standard deviation of 64.
        assert!((3700..4500).contains(&taken), "exponent {alpha}: {taken} samples");
        assert!(
            all > 0.0 && (some / all - 1.0).abs() < 0.09,
            "exponent {alpha}: {some:e} for {all:e}"
        );
    }
}

/// A picture that shows nothing but a lobe's tail, at `e^-38` to `e^-42` of its peak, of a light that makes up for it: `product` is as
/// bright as `light`, which thins nothing out.
///
/// Of 2.4e6 samples one in 256 counts: a standard error of 1.0 %, and 12 % between it and the bound.
pub fn a_tail_in_a_picture_is_as_bright_as_by_light_sampling() {
    let film = FilmSize { width: 48, height: 48 };
    let mut scene = Scene::builder(Camera::new([0.0, 3.0, 3.0], [0.0; 3], Fov::X(1.0)), film);
    let plate = scene.material(Material::phong("plate", [0.5; 3], 300.0));
    let corners = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
    scene.mesh(Mesh::quadrilateral(corners, plate));
    // 0.505 from the mirror direction (0, 1, -1), upwards.
    let elevation = PI / 4.0 + 0.505;
    let center = [0.0, 3.0 * elevation.sin(), -3.0 * elevation.cos()];
    scene.sphere(Sphere::new(center, 0.03, Surface::emission([1e13; 3])));
    let scene = scene.build().expect("a plate and a lamp");
    let [product, light] = [EstimatorKind::Product, EstimatorKind::Light]
        .map(|estimator| Runs::new(&scene, settings(48, 48, estimator), 256, 1, 4).estimates(1, 1)[1].mean);
    assert!(
        light > 0.0 && (product / light - 1.0).abs() < 0.12,
        "{product:e} instead of {light:e}"
    );
}

const ROWS: usize = 16;
const COLUMNS: usize = 12;

/// Adds a test for each place: `draws` directions in cells of equal lobe mass and, in each row, of equal arc.
pub fn directions<L: Lane>(family: &mut Family, seed: u32, draws: u32) {
    // Exponent, sine, half-angles apart: lights larger and smaller than the lobe, the axis inside, at the rim and outside.
    let places = [
        (1.5, 0.9, 0.5),
        (1.5, 0.3, 2.0),
        (5.0, 0.99, 1.0),
        (30.0, 0.5, 0.3),
        (30.0, 0.5, 1.3),
        (30.0, 0.02, 5.0),
        (1e3, 0.1, 0.9),
        (1e3, 0.1, 1.1),
        (1e3, 0.01, 3.0),
        (2e4, 0.02, 1.0),
        (2e4, 0.3, 1.02),
        (1e5, 0.01, 0.7),
    ];
    for (i, (alpha, sine, off)) in (0..).zip(places) {
        let apart = off * f64::asin(sine);
        let (point, light) = place::<L>(alpha, sine, apart);
        let (one, _) = place::<f32>(alpha, sine, apart);
        let cone_of_one = light.cone(one.p);
        let region = Region::of(&one, &cone_of_one);
        let cone = light.cone(point.p);
        let rings = Rings::of(point.bsdf.wr, point.bsdf.alpha, &cone);
        let numbers = PassBlock::new(SamplerKind::Independent, seed, 0, 1, 40);
        let mut counts = vec![0.0; ROWS * COLUMNS];
        for first in (0..draws).step_by(L::N) {
            let pixel = L::Bits::from_fn(|lane| first + lane as u32);
            let (u, v) = numbers.pair(pixel, L::Bits::splat(0), i).unit::<L>();
            let wi = rings.draw(point.bsdf.alpha, u).direction(point.bsdf.wr, cone.axis, v);
            for lane in L::Mask::splat(true).lanes() {
                let found = region.numbers(&one, &cone_of_one, wi.lane(lane));
                let [row, column] = [(found[0], ROWS), (found[1], COLUMNS)]
                    .map(|(at, cells)| ((at * cells as f64).max(0.0) as usize).min(cells - 1));
                counts[row * COLUMNS + column] += 1.0;
            }
        }
        let expected = vec![f64::from(draws) / (ROWS * COLUMNS) as f64; ROWS * COLUMNS];
        let test = chi_square(&counts, &expected);
        let what = format!("exponent {alpha}, sine {sine}, {off} half-angles apart");
        family.add(test.p, format!("{what}, {} lanes: {test:?}", L::N));
    }
}

/// What a mutant's process runs.
pub fn both() {
    for sine in [1e-3, 0.1, 0.7] {
        of_sine(sine);
    }
    from_inside_it_is_the_lobe();
    a_tail_brings_what_all_its_samples_would();
    let mut family = Family::rarely("rings", 1e-6);
    directions::<F32x8>(&mut family, 83, 1 << 15);
    family.judge();
}
