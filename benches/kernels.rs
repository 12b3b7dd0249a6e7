//! Nanoseconds a sample of every function that the estimators are made of, from arrays in the first-level cache.
//!
//! Each function is measured three times, from the same generic source:
//!
//! - `f32x8`: eight lanes, one packet a step;
//! - `f32 one by one`: one lane. Every sample's inputs go through `black_box`, which keeps LLVM from making eight steps
//!   of the loop into one: this is the honest scalar code, not auto-vectorised. The packets go through it too, so that
//!   both pay for the same stores and loads;
//! - `f32 auto-vectorised where LLVM can`: one lane, without the barrier. Functions without branches come close to
//!   `f32x8`, which says nothing about a scalar renderer, where a ray is traced between two samples.
//!
//! Throughput counts samples, not packets.

mod common;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput};
use octolux::bsdf::{Diffuse, Ggx, Microfacets, Phong, diffuse, phong};
use octolux::estimator::density::{Average, ConeOnly, LobeInCap, Mix, Projected};
use octolux::estimator::{ShadingPoint, per_light, per_point};
use octolux::lane::{Bits, F32x8, Lane, Mask};
use octolux::light::SphereLight;
use octolux::math::elementary::{exp, expm1, ln, ln_1m, powcos, sin_cos_turn};
use octolux::math::{Frame, Vec3};
use octolux::sampling::{Pair, PassBlock, TechniqueSample, warp};
use octolux::settings::SamplerKind;

use common::{mixed, uniform};

/// Samples a run: inputs and outputs of the widest function stay below 32 KiB.
const SAMPLES: usize = 256;

/// Outputs of the widest function.
const OUTPUTS: usize = 7;

/// `K` columns of numbers.
type Columns<const K: usize> = [[f32; SAMPLES]; K];

fn columns<const K: usize>(f: impl Fn(usize, usize) -> f32) -> Columns<K> {
    std::array::from_fn(|column| std::array::from_fn(|i| f(column, i)))
}

/// The inputs of one step; `COMPILED_IN` keeps LLVM from joining steps. Number by number: an array that went through memory as
/// a whole may be read back wider than it was written, and the processor would wait for that.
#[inline(always)]
fn load<L: Lane, const COMPILED_IN: bool, const K: usize>(inputs: &Columns<K>, at: usize) -> [L; K] {
    std::array::from_fn(|k| {
        let x = L::load(&inputs[k][at..at + L::N]);
        if COMPILED_IN { black_box(x) } else { x }
    })
}

/// Keeps the outputs of one step. By index: an iterator by value copies the array to another alignment, and reading it
/// back across two stores costs ten times what is measured here.
#[inline(always)]
fn store<L: Lane, const M: usize>(outputs: &mut Columns<OUTPUTS>, at: usize, y: [L; M]) {
    for k in 0..M {
        y[k].store(&mut outputs[k][at..at + L::N]);
    }
}

/// One expression at every width: in it, the type `L` is the lane. A macro, not a function of a closure, since LLVM
/// would leave the larger closures out of line and pass the packets through memory.
macro_rules! kernel {
    ($group:expr, $name:expr, $inputs:expr, $lane:ident, |$x:pat_param| $body:expr) => {{
        let (name, inputs): (&str, _) = (&$name, $inputs);
        kernel!(@ $group, name, "f32x8", inputs, F32x8, true, $lane, |$x| $body);
        kernel!(@ $group, name, "f32 one by one", inputs, f32, true, $lane, |$x| $body);
        let vectorised = "f32 auto-vectorised where LLVM can";
        kernel!(@ $group, name, vectorised, inputs, f32, false, $lane, |$x| $body);
    }};
    (@ $group:expr, $name:expr, $width:expr, $inputs:ident, $is:ty, $held:literal, $lane:ident, |$x:pat_param| $body:expr) => {{
        type $lane = $is;
        let mut outputs = columns::<OUTPUTS>(|_, _| 0.0);
        $group.throughput(Throughput::Elements(SAMPLES as u64));
        $group.bench_function(BenchmarkId::new($name, $width), |b| {
            b.iter(|| {
                let (inputs, outputs) = (black_box(&$inputs), black_box(&mut outputs));
                for at in (0..SAMPLES).step_by(<$lane as Lane>::N) {
                    let $x = load::<$lane, $held, _>(inputs, at);
                    store(outputs, at, $body);
                }
            });
        });
    }};
}

fn elementary(c: &mut Criterion) {
    let g = &mut c.benchmark_group("kernels: elementary functions");
    let unit = |stream| columns::<1>(move |_, i| uniform(i, stream).max(1e-7));
    kernel!(g, "exp", columns(|_, i| 20.0 * uniform(i, 0) - 20.0), L, |[x]| [
        exp::<L>(x)
    ]);
    kernel!(g, "expm1", columns(|_, i| -uniform(i, 1)), L, |[x]| [expm1::<L>(x)]);
    kernel!(g, "ln", unit(2), L, |[x]| [ln::<L>(x)]);
    kernel!(g, "ln_1m", unit(3), L, |[x]| [ln_1m::<L>(x)]);
    // Exponents and angles as in Veach's scene: within the lobe mostly.
    let lobe = columns(|column, i| match column {
        0 => 1.0 - 1e-3 * uniform(i, 4),
        1 => 1e-3 * uniform(i, 4),
        _ => [100.0, 1000.0, 5000.0, 20_000.0][i / 64],
    });
    kernel!(g, "powcos", lobe, L, |[cosine, t, alpha]| [powcos::<L>(
        cosine, t, alpha
    )]);
    kernel!(g, "sin_cos_turn", unit(5), L, |[u]| <[L; 2]>::from(sin_cos_turn::<L>(
        u
    )));
}

fn warps(c: &mut Criterion) {
    let g = &mut c.benchmark_group("kernels: warps and densities");
    let pair = |stream| columns::<2>(move |column, i| uniform(i, stream + column as u32).max(1e-7));
    let powers = || columns::<2>(|column, i| if column == 0 { uniform(i, 12) } else { 5000.0 });
    kernel!(g, "sphere", pair(0), L, |[u, _]| [warp::sphere::<L>(u)]);
    kernel!(g, "cone", pair(2), L, |[u, one_minus_cos_max]| [warp::cone::<L>(
        u,
        one_minus_cos_max
    )]);
    kernel!(g, "cone_pdf", pair(4), L, |[one_minus_cos_max, _]| [
        warp::cone_pdf::<L>(one_minus_cos_max)
    ]);
    kernel!(g, "cosine", pair(6), L, |[u, _]| [warp::cosine::<L>(u)]);
    kernel!(g, "cosine_pdf", pair(8), L, |[cosine, _]| [warp::cosine_pdf::<L>(
        cosine
    )]);
    kernel!(g, "power", powers(), L, |[u, alpha]| [warp::power::<L>(u, alpha)]);
    kernel!(g, "power_pdf", powers(), L, |[p, alpha]| [warp::power_pdf::<L>(
        p, alpha
    )]);
}

/// A unit vector, the same for the same number.
fn direction(i: usize, stream: u32) -> [f32; 3] {
    let z = 1.0 - 2.0 * uniform(i, stream);
    let (sine, phi) = ((1.0 - z * z).sqrt(), std::f32::consts::TAU * uniform(i, stream + 1));
    [sine * phi.cos(), sine * phi.sin(), z]
}

const LIGHT: SphereLight = SphereLight {
    center: [1.25, 0.0, 0.0],
    radius: 0.3,
    le: [11.1, 11.1, 11.1],
    sphere: 0,
    origin_power: None,
};

/// The floor below the light of a height of 4: points, directions towards the light with some scatter, and two words.
const POINT: usize = 8;
fn points(scatter: f32) -> Columns<POINT> {
    columns(|column, i| {
        let p = [8.0 * uniform(i, 20) - 4.0, -4.0, 4.0 * uniform(i, 21) - 2.0];
        let d = direction(i, 22);
        let wr: [f32; 3] = std::array::from_fn(|k| LIGHT.center[k] - p[k] + scatter * d[k]);
        let length = wr.iter().map(|x| x * x).sum::<f32>().sqrt();
        match column {
            0..3 => p[column],
            3..6 => wr[column - 3] / length,
            _ => f32::from_bits(mixed((2 * i + column) as u32)),
        }
    })
}

/// The first three numbers of [`points`] with a model, and the last two, as the streams give them to the estimators.
#[inline(always)]
fn shading<L: Lane, B>([px, py, pz, .., a, b]: [L; POINT], bsdf: B) -> (ShadingPoint<L, B>, Pair<L::Bits>) {
    let point = ShadingPoint {
        p: Vec3::new(px, py, pz),
        ng: Vec3::splat([0.0, 1.0, 0.0]),
        bsdf,
    };
    (point, Pair(a.to_bits(), b.to_bits()))
}

#[inline(always)]
fn diffuse<L: Lane>(_: [L; POINT]) -> Diffuse<L> {
    let n = Vec3::splat([0.0, 1.0, 0.0]);
    let rho = Vec3::splat([0.35; 3]);
    Diffuse { n, rho }
}

#[inline(always)]
fn phong<L: Lane>([_, _, _, x, y, z, ..]: [L; POINT]) -> Phong<L> {
    let alpha = L::splat(1000.0);
    Phong {
        n: Vec3::splat([0.0, 1.0, 0.0]),
        wr: Vec3::new(x, y, z),
        rho: Vec3::splat([0.35; 3]),
        alpha,
        reach: phong::reach(alpha),
    }
}

/// A metal whose mirror direction is that of [`phong`].
#[inline(always)]
fn metal<L: Lane>([_, _, _, x, y, z, ..]: [L; POINT]) -> Ggx<L> {
    let n = Vec3::splat([0.0, 1.0, 0.0]);
    Ggx {
        facets: Microfacets::new(n, Vec3::new(-x, y, -z), L::splat(0.03)),
        rho: Vec3::splat([0.35; 3]),
        metallic: L::one(),
    }
}

fn geometry(c: &mut Criterion) {
    let g = &mut c.benchmark_group("kernels: frames and cones");
    let directions = columns::<6>(|column, i| match column {
        0..3 => direction(i, 30)[column],
        3 => uniform(i, 32),
        _ => direction(i, 33)[column - 4],
    });
    kernel!(g, "Frame::about", columns::<3>(|k, i| direction(i, 36)[k]), L, |[
        x,
        y,
        z,
    ]| {
        let Frame {
            tangent: t,
            bitangent: b,
            ..
        } = Frame::<L>::about(Vec3::new(x, y, z));
        [t.x, t.y, t.z, b.x, b.y, b.z]
    });
    kernel!(g, "Frame::about and direction", directions, L, |[x, y, z, t, s, c]| {
        let wi = Frame::<L>::about(Vec3::new(x, y, z)).direction(t, s, c);
        [wi.x, wi.y, wi.z]
    });
    kernel!(g, "SphereLight::cone", points(0.5), L, |x| {
        let cone = LIGHT.cone(shading(x, diffuse::<L>(x)).0.p);
        [cone.axis.x, cone.axis.y, cone.axis.z, cone.one_minus_cos_max]
    });
    kernel!(g, "cone, t, contains, pdf and distance", points(0.5), L, |x| {
        let (point, _) = shading(x, phong::<L>(x));
        let cone = LIGHT.cone(point.p);
        let t = cone.t(point.bsdf.wr);
        [cone.pdf().or_zero(cone.contains(t)), cone.distance(t)]
    });
}

fn bsdfs(c: &mut Criterion) {
    let g = &mut c.benchmark_group("kernels: reflection models");
    let unit = || columns::<1>(|_, i| uniform(i, 40));
    kernel!(g, "diffuse::sample", unit(), L, |[u]| [diffuse::sample::<L>(u)]);
    kernel!(g, "diffuse::eval", unit(), L, |[cosine]| {
        let lobe = diffuse::eval::<L>(cosine);
        [lobe.shape, lobe.pdf]
    });
    kernel!(g, "phong::sample", unit(), L, |[u]| [phong::sample::<L>(
        u,
        L::splat(5000.0)
    )]);
    let lobes = columns::<7>(|column, i| {
        let near = direction(i, 43).map(|x| 0.01 * x);
        let axis = direction(i, 41);
        match column {
            0..3 => axis[column],
            3..6 => axis[column - 3] + near[column - 3],
            _ => uniform(i, 45),
        }
    });
    kernel!(g, "phong::eval", lobes, L, |[a, b, c, x, y, z, cosine]| {
        let lobe = phong::eval::<L>(Vec3::new(a, b, c), Vec3::new(x, y, z), cosine, L::splat(5000.0));
        [lobe.shape, lobe.pdf]
    });
}

/// The estimators' samples, all of what happens between a hit and its shadow ray.
fn estimators(c: &mut Criterion) {
    let g = &mut c.benchmark_group("kernels: estimators");
    macro_rules! per_light {
        ($name:expr, $density:expr, $model:ident, $inputs:expr) => {
            kernel!(g, $name, $inputs, L, |x| {
                let (point, numbers) = shading(x, $model::<L>(x));
                let all = <L as Lane>::Mask::splat(true);
                let technique_sample = TechniqueSample {
                    by_brdf_lanes: numbers.0.top_bit(),
                    pair: Pair(numbers.0.shl(1), numbers.1),
                };
                per_light::sample($density, &point, &LIGHT, technique_sample, all).map_or([L::zero(); 7], |c| {
                    [c.wi.x, c.wi.y, c.wi.z, c.distance, c.ld.x, c.ld.y, c.ld.z]
                })
            })
        };
    }
    macro_rules! per_point {
        ($name:expr, $density:ty, $model:ident) => {
            kernel!(g, $name, points(0.5), L, |x| {
                let (point, numbers) = shading(x, $model::<L>(x));
                let all = <L as Lane>::Mask::splat(true);
                per_point::sample::<L, $density>(&point, numbers, all).map_or([L::zero(); 6], |c| {
                    [
                        c.wi.x,
                        c.wi.y,
                        c.wi.z,
                        c.throughput.x,
                        c.throughput.y,
                        c.throughput.z,
                    ]
                })
            })
        };
    }
    // One technique for eight samples in a row, alternating: what a stratified choice comes to.
    let alternating = || {
        let mut inputs = points(0.5);
        for (i, x) in inputs[6].iter_mut().enumerate() {
            *x = f32::from_bits(x.to_bits() & !(1 << 31) | (i as u32 / 8 % 2) << 31);
        }
        inputs
    };
    per_light!("light, diffuse", ConeOnly, diffuse, points(0.5));
    per_light!("light, Phong 1000", ConeOnly, phong, points(0.5));
    per_light!("mis2-power, diffuse", Mix::Power, diffuse, points(0.5));
    per_light!("projected, diffuse", Projected, diffuse, points(0.5));
    per_light!("product, Phong 1000", LobeInCap, phong, points(0.5));
    per_light!("mis, diffuse", Average, diffuse, points(0.5));
    per_light!("mis, Phong 1000", Average, phong, points(0.5));
    per_light!("mis, Phong 1000, one technique a packet", Average, phong, alternating());
    per_light!("mis, Phong 1000, lobe far from the light", Average, phong, points(8.0));
    per_light!("mis, metal of roughness 0.17", Average, metal, points(0.5));
    per_point!("uniform, diffuse", per_point::Sphere, diffuse);
    per_point!("uniform, Phong 1000", per_point::Sphere, phong);
    per_point!("brdf, diffuse", per_point::Lobe, diffuse);
    per_point!("brdf, Phong 1000", per_point::Lobe, phong);
    per_point!("brdf, metal of roughness 0.17", per_point::Lobe, metal);
}

fn numbers(c: &mut Criterion) {
    let g = &mut c.benchmark_group("kernels: random numbers");
    let pixels = || columns::<1>(|_, i| f32::from_bits(i as u32));
    for kind in SamplerKind::ALL {
        let block = PassBlock::new(kind, 1, 0, 16, 6);
        kernel!(g, format!("PassBlock::pair, {}", kind.name()), pixels(), L, |[
            pixel,
        ]| {
            let pass = <L as Lane>::Bits::splat(5);
            <[L; 2]>::from(block.pair(block.key(Lane::to_bits(pixel)), pass, 3).unit::<L>())
        });
        // Packets of several passes: the edges of tiles whose size is no multiple of eight.
        kernel!(
            g,
            format!("PassBlock::pair, {}, mixed passes", kind.name()),
            pixels(),
            L,
            |[pixel]| {
                let pixel = Lane::to_bits(pixel);
                let pass = pixel & <L as Lane>::Bits::splat(15);
                <[L; 2]>::from(block.pair(block.key(pixel), pass, 3).unit::<L>())
            }
        );
    }
}

fn main() {
    let mut c = common::criterion();
    for part in [elementary, warps, geometry, bsdfs, estimators, numbers] {
        part(&mut c);
    }
    c.final_summary();
    common::note_circumstances("kernels", &std::collections::BTreeMap::new());
}
