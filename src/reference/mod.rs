//! The oracle: an independent reference renderer.
//!
//! It traces one ray at a time in `f64`, with its own intersections, formulas and random numbers, and shares nothing with the
//! renderer except the scene's data and the type of a picture. So agreement of the two cannot come from a shared mistake; a
//! test checks the independence in these sources. It is slow, and it reports its accuracy: every pixel comes with the standard
//! error of its mean.
//!
//! Which of two overlapping emitter faces in one plane is hit is arbitrary, as in any ray tracer (exact duplicates of triangles
//! are removed when a scene is read).

mod brdf;
mod bvh;
mod camera;
mod crest;
mod emitter;
mod estimate;
mod geometry;
mod microfacet;
mod pick;
pub mod probe;
mod shapeless;
mod sky;
mod statistics;
pub mod ties;
mod world;

use std::sync::atomic::{AtomicU64, Ordering};

use rand::SeedableRng;
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::film::Picture;
use crate::scene::{FilmSize, Scene};
use camera::Pinhole;
use statistics::Moments;
use world::World;

/// A picture with its standard errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples per pixel.
    pub spp: u32,
    /// Mean radiance of each pixel, linear RGB, row by row from the top.
    pub picture: Vec<[f64; 3]>,
    /// Standard error of each value of `picture`: the standard deviation of its samples over the root of their number. Zero
    /// where all samples agree; infinite after a single one.
    pub stderr: Vec<[f64; 3]>,
}

/// Renders `spp` independent samples of every pixel, uniform over the pixel's square, on the threads of the current rayon pool.
/// The result only depends on `scene`, `film`, `spp` and `seed`, not on the threads.
///
/// `progress` is called, from any thread, with the number of finished samples (pixels x passes).
///
/// # Panics
/// If `spp` is 0.
pub fn render(scene: &Scene, film: FilmSize, spp: u32, seed: u64, progress: &(dyn Fn(u64) + Sync)) -> Reference {
    of_world(&World::new(scene), scene, film, spp, seed, progress)
}

/// The same with samples of some lights, by intensity, where there are many: the same mean in less time and with more noise.
pub fn render_picking(scene: &Scene, film: FilmSize, spp: u32, seed: u64) -> Reference {
    of_world(&World::new(scene).picking(), scene, film, spp, seed, &|_| ())
}

fn of_world(
    world: &World<'_>,
    scene: &Scene,
    film: FilmSize,
    spp: u32,
    seed: u64,
    progress: &(dyn Fn(u64) + Sync),
) -> Reference {
    assert!(spp > 0, "a mean of no samples");
    let camera = Pinhole::new(scene.camera(), film);
    let (width, height) = (film.width as usize, film.height as usize);
    let done = AtomicU64::new(0);
    let pixel = |index: usize| {
        let mut rng = stream(seed, index as u64);
        let (x, y) = ((index % width) as f64, (index / width) as f64);
        let mut moments = Moments::default();
        for _ in 0..spp {
            let camera_ray = camera.sampled_ray(x, y, &mut rng);
            moments.add(estimate::radiance(world, &camera_ray, &mut rng));
        }
        let before = done.fetch_add(u64::from(spp), Ordering::Relaxed);
        progress(before + u64::from(spp));
        (moments.mean().to_array(), moments.standard_error().to_array())
    };
    let (picture, stderr) = (0..width * height).into_par_iter().map(pixel).unzip();
    Reference {
        width: film.width,
        height: film.height,
        spp,
        picture,
        stderr,
    }
}

/// The random numbers of one pixel. The seed goes through a mixing function (SplitMix64: Steele, Lea, Flood, OOPSLA 2014), so
/// that pixel 1 of seed 0 and pixel 0 of seed 1 are unrelated.
fn stream(seed: u64, pixel: u64) -> Pcg64 {
    let z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    Pcg64::seed_from_u64((z ^ (z >> 31)) ^ pixel)
}

impl Reference {
    /// The means, rounded to the `f32` of a picture.
    pub fn to_picture(&self) -> Picture {
        self.rounded(&self.picture)
    }

    /// The standard errors as a picture.
    pub fn to_stderr_picture(&self) -> Picture {
        self.rounded(&self.stderr)
    }

    /// Mean of all pixels and channels.
    pub fn mean(&self) -> f64 {
        self.picture.iter().flatten().sum::<f64>() / (3 * self.picture.len()) as f64
    }

    /// Median of standard error over mean, of all values whose mean is above 0; 0 in a black picture.
    pub fn median_relative_error(&self) -> f64 {
        let values = self.stderr.iter().flatten().zip(self.picture.iter().flatten());
        let mut relative: Vec<f64> = values
            .filter(|&(_, &mean)| mean > 0.0)
            .map(|(error, mean)| error / mean)
            .collect();
        let middle = relative.len() / 2;
        if relative.is_empty() {
            0.0
        } else {
            *relative.select_nth_unstable_by(middle, f64::total_cmp).1
        }
    }

    fn rounded(&self, pixels: &[[f64; 3]]) -> Picture {
        let pixels = pixels.iter().map(|pixel| pixel.map(|value| value as f32)).collect();
        Picture {
            width: self.width,
            height: self.height,
            pixels,
        }
    }
}

#[cfg(test)]
mod tests {
    /// The oracle is only useful if it repeats no mistake of the renderer.
    #[test]
    fn the_oracle_shares_only_the_scene_and_the_picture() {
        let sources = concat!(env!("CARGO_MANIFEST_DIR"), "/src/reference");
        let mut files = 0;
        for entry in std::fs::read_dir(sources).unwrap() {
            let path = entry.unwrap().path();
            let text = std::fs::read_to_string(&path).unwrap();
            for (number, line) in text.lines().enumerate() {
                // Split in two parts, so that the search does not find this line.
                for used in line.split(concat!("crate", "::")).skip(1) {
                    let allowed = used.starts_with("scene::") || used.starts_with("film::Picture");
                    assert!(allowed, "{}:{}: {line}", path.display(), number + 1);
                }
                assert!(
                    !line.contains(concat!("safe", "_arch")),
                    "{}:{}: lanes",
                    path.display(),
                    number + 1
                );
            }
            files += 1;
        }
        assert!(files >= 8);
    }
}
