//! The ray queries that `octolux` for Python calls, on arrays that exist already: what `rates.py` holds its own figures against.
//!
//! `layer SCENE ORIGINS DIRECTIONS` reads a scene and rays, as raw `f32` rows; then for each line on standard input, which is
//! `intersect` or `occluded`, followed by `coherent` or nothing, it asks all rays once and prints the seconds.

use std::error::Error;
use std::io::{BufRead, Write};
use std::time::Instant;

use octolux::pipeline::{Prepared, Settings};
use octolux::rays::{HitsMut, NOTHING, RayQueries, Rays};
use octolux::scene::Scene;

fn rows(path: &str) -> Result<Vec<[f32; 3]>, Box<dyn Error>> {
    let bytes = std::fs::read(path)?;
    let number = |bytes: &[u8; 4]| f32::from_le_bytes(*bytes);
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(number).collect();
    Ok(numbers.as_chunks().0.to_vec())
}

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    let [scene, origins, directions] = &paths[..] else {
        return Err("layer SCENE ORIGINS DIRECTIONS".into());
    };
    let scene = Scene::load(scene.as_ref())?;
    let queries = RayQueries::new(&Prepared::new(&scene, Settings::of(&scene))?);
    let (origins, directions) = (rows(origins)?, rows(directions)?);
    let n = origins.len();
    let (mut t, mut normals, mut uv) = (vec![0.0; n], vec![[0.0; 3]; n], vec![[0.0; 2]; n]);
    let (mut objects, mut primitives, mut occluded) = (vec![NOTHING; n], vec![NOTHING; n], vec![false; n]);
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let rays = Rays::new(&origins, &directions);
        let rays = if line.ends_with("coherent") {
            rays.coherent()
        } else {
            rays
        };
        let begun = Instant::now();
        if line.starts_with("intersect") {
            let hits = HitsMut {
                t: &mut t,
                normals: &mut normals,
                uv: &mut uv,
                objects: &mut objects,
                primitives: &mut primitives,
            };
            queries.intersect_into(rays, hits)?;
        } else {
            queries.occluded_into(rays, &mut occluded)?;
        }
        let mut out = std::io::stdout().lock();
        writeln!(out, "{}", begun.elapsed().as_secs_f64())?;
        out.flush()?;
    }
    Ok(())
}
