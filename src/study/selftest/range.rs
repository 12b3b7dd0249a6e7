//! Cases 31 to 33: large contrast, denormal numbers, long sums.

use super::bench::{self, SIGMAS};
use super::row::{Check, Checks, Effort};
use crate::film::{ChunkSum, Film};
use crate::pipeline::{Settings, widest_lanes};
use crate::scene::{EstimatorKind, FilmSize, InvalidScene, Mesh, Scene, Sphere, Surface};
use crate::settings::Lanes;
use crate::study::estimate::Estimate;

/// Case 31.
pub fn bright_beside_dim(effort: Effort) -> Checks {
    let wall = [[5.0, -9.0, -9.0], [5.0, -9.0, 9.0], [5.0, 9.0, 9.0], [5.0, 9.0, -9.0]];
    let walled = |lights: &[Sphere]| {
        let mut scene = bench::test_point();
        scene.mesh(Mesh::quadrilateral(wall, bench::PLATE));
        scene.spheres.extend_from_slice(lights);
        scene.build()
    };
    let dim = bench::light([-1.0, 4.0, 0.0], 1.0, 1e-20);
    let bright = bench::light([9.0, 4.0, 0.0], 1.0, 1e20);
    let apart = walled(&[dim])?;
    let both = walled(&[dim, bright])?;
    let (mut different, mut unsound) = (0, 0);
    for estimator in EstimatorKind::ALL {
        let settings = bench::settings(32, 32, estimator);
        let (a, b) = (
            bench::render(&apart, settings, effort.of(32))?,
            bench::render(&both, settings, effort.of(32))?,
        );
        different += bench::differences(&a.picture(), &b.picture());
        unsound += bench::invalid(&b);
    }
    // Both lights visible: their sum equals that of the bright one, and is finite.
    let open = bench::lit(&[dim, bright])?;
    let renderer = bench::render(&open, bench::settings(32, 32, EstimatorKind::Light), effort.of(32))?;
    unsound += bench::invalid(&renderer);
    unsound += renderer
        .picture()
        .pixels
        .iter()
        .flatten()
        .filter(|x| !x.is_finite())
        .count();
    Ok(vec![
        Check::none(
            "pixels lit by 1e-20 whose bits change when a light of 1e20 stands behind a wall",
            different,
        ),
        Check::none("invalid samples and pixels", unsound),
    ])
}

/// Every radiance times `factor`.
fn brighter(scene: &Scene, factor: f64) -> Result<Scene, InvalidScene> {
    let mut scene = scene.to_builder();
    for sphere in &mut scene.spheres {
        if let Surface::Emission(le) = &mut sphere.surface {
            *le *= factor;
        }
    }
    scene.build()
}

/// Case 32.
pub fn denormals(effort: Effort) -> Checks {
    let scene = bench::lit(&[
        bench::light([1.0, 4.0, 0.0], 1.0, 1.0),
        bench::light([-2.0, 2.0, 1.0], 0.3, 7.0),
    ])?;
    let (mut different, mut lanes) = (0, 0);
    for estimator in EstimatorKind::ALL {
        let settings = bench::settings(16, 16, estimator);
        let plain = bench::picture(&scene, settings, effort.of(32))?;
        for power in [-90, -60, -20, 20, 60, 100] {
            let factor = 2.0_f32.powi(power);
            let scaled = bench::picture(&brighter(&scene, f64::from(factor))?, settings, effort.of(32))?;
            let mut expected = plain.clone();
            expected.pixels.iter_mut().flatten().for_each(|x| *x *= factor);
            different += bench::differences(&scaled, &expected);
        }
        // A radiance of 1e-42 is itself denormal: every width must give the same result, on every thread.
        let dim = brighter(&scene, 1e-42)?;
        let one = bench::picture(
            &dim,
            Settings {
                lanes: Some(Lanes::One),
                ..settings
            },
            2,
        )?;
        for (lanes_of, threads) in [(Lanes::Eight, 1), (Lanes::Eight, 2), (widest_lanes(), 2)] {
            let settings = Settings {
                lanes: Some(lanes_of),
                threads,
                ..settings
            };
            lanes += bench::differences(&one, &bench::picture(&dim, settings, 2)?);
        }
    }
    Ok(vec![
        Check::none(
            "pixels that do not follow radiance times 2^-90 .. 2^100 in every bit",
            different,
        ),
        Check::none("pixels of radiance 1e-42 whose bits follow lanes or threads", lanes),
    ])
}

/// Case 33.
pub fn long_sums(effort: Effort) -> Checks {
    // Summed by chunks, like renders: 2^26 samples of 0.1 in one pixel.
    let (chunks, chunk) = (effort.of(1 << 15), 1 << 11);
    let mut film = Film::new(FilmSize { width: 1, height: 1 });
    let mut naive = 0.0_f32;
    for _ in 0..chunks {
        let mut sum = ChunkSum::new(1);
        for _ in 0..chunk {
            sum.add(0, &[0.1, 0.1, 0.1, 0.0]);
            naive += 0.1;
        }
        film.tiles_mut()[0].add(&sum, chunk);
    }
    let count = f64::from(chunks) * f64::from(chunk);
    let truth = f64::from(0.1_f32);
    let found = film.tiles()[0].sums().total(0)[1] / count;
    let stalled = (f64::from(naive) / count / truth - 1.0).abs();

    let scene = bench::lit(&[bench::light([1.0, 3.0, 0.0], 1.0, 1.0)])?;
    let size = Settings {
        film: FilmSize { width: 2, height: 2 },
        ..bench::settings(2, 2, EstimatorKind::Mis)
    };
    let long = bench::picture(&scene, Settings { seed: 1000, ..size }, effort.of(131_072))?;
    let mut short = Vec::new();
    for seed in 0..128 {
        short.push(bench::picture(&scene, Settings { seed, ..size }, effort.of(1024))?);
    }
    let mut worst = 0.0_f64;
    for pixel in 0..4 {
        let values: Vec<f64> = short.iter().map(|p| f64::from(p.pixels[pixel][1])).collect();
        let mean = Estimate::of(&values);
        // The long render has as many samples in all, and so the same standard error again.
        let long = Estimate {
            mean: f64::from(long.pixels[pixel][1]),
            ..mean
        };
        worst = worst.max(mean.sigmas(long, 1e-7));
    }
    Ok(vec![
        Check::new(
            "mean of 2^26 samples of 0.1: relative error",
            (found / truth - 1.0).abs(),
            1e-12,
        ),
        Check::new("for comparison, the same summed in f32: relative error", stalled, 1.0),
        Check::new(
            "131072 spp against 128 renders of 1024 averaged in f64: standard errors",
            worst,
            SIGMAS,
        ),
    ])
}
