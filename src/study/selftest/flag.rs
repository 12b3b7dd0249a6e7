//! The cost of Embree's flag ROBUST: `--robust on` against `--robust off`.

use std::hint::black_box;
use std::time::Instant;

use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::bench::SelftestError;
use super::grid_mesh::{Aim, Sheet};
use super::prices::Price;
use crate::embree::{Accel, Coherence};
use crate::lane::{F32x8, Mask, Mask8};
use crate::shape::Ray;

/// Squares along each side: 131 072 triangles, too large for a core's private caches.
const SQUARES: u32 = 256;

const PACKETS: usize = 1024;

/// Nearest hits of incoherent rays from one point through a closed grid mesh, in packets of 8. A ray that misses it counts as
/// an error of 1.
///
/// # Errors
/// Errors from Embree.
pub fn measure() -> Result<Vec<Price>, SelftestError> {
    let mut rng = Pcg64::seed_from_u64(25);
    let grid_mesh = Sheet::new(SQUARES, &mut rng);
    let accels = [grid_mesh.accel(false)?, grid_mesh.accel(true)?];
    let ranges = [
        ("anywhere", Aim::Anywhere),
        ("edges", Aim::Edge),
        ("vertices", Aim::Vertex),
    ];
    let rows = ranges.into_iter().flat_map(|(range, aim)| {
        let rays: Vec<Ray<F32x8>> = (0..PACKETS).map(|_| grid_mesh.rays(aim, &mut rng)).collect();
        let (mut best, mut missed) = ([f64::INFINITY; 2], [0.0; 2]);
        // Alternates the two, so that both see the same machine state.
        for _ in 0..15 {
            for ((accel, best), missed) in accels.iter().zip(&mut best).zip(&mut missed) {
                let started = Instant::now();
                *missed = share_missed(accel, &rays);
                *best = best.min(started.elapsed().as_secs_f64() * 1e9 / (8 * PACKETS) as f64);
            }
        }
        [("off", 0), ("on", 1)].map(|(form, i)| Price {
            quantity: "Embree, --robust",
            form,
            range: range.to_owned(),
            nanoseconds: best[i],
            ratio: best[i] / best[0],
            largest: if missed[i] > 0.0 { 1.0 } else { 0.0 },
            rms: missed[i].sqrt(),
        })
    });
    Ok(rows.collect())
}

fn share_missed(accel: &Accel, rays: &[Ray<F32x8>]) -> f64 {
    let found = |ray: &Ray<F32x8>| {
        accel
            .intersect(Mask8::splat(true), black_box(ray), Coherence::Incoherent)
            .found
            .count()
    };
    1.0 - rays.iter().map(found).sum::<usize>() as f64 / (8 * rays.len()) as f64
}
