//! Cases 25 to 29: triangles and defects of meshes.

use std::fs;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::bench::{self, ACCELS, SelftestError};
use super::files::SPOT;
use super::grid_mesh::{Aim, Sheet};
use super::row::{Check, Checks, Effort};
use crate::embree::{Coherence, Device, SceneBuilder};
use crate::lane::{Bits, F32x8, Lane, Mask, Mask8, U32x8};
use crate::linear::{Candidates, LinearScene};
use crate::math::Vec3;
use crate::pipeline::Settings;
use crate::scene::{EstimatorKind, InvalidScene, Material, Mesh, Scene};
use crate::shape::{NO_SKIP_ID, Ray};

/// The share of rays aimed from 0 into the grid mesh that miss it, by Embree and by the brute-force intersector.
fn missed(aim: Aim, robust: bool, packets: u32) -> Result<[f64; 2], SelftestError> {
    let mut rng = Pcg64::seed_from_u64(25);
    let grid_mesh = Sheet::new(12, &mut rng);
    let accel = grid_mesh.accel(robust)?;
    let mut line = LinearScene::default();
    line.add_mesh(0, &grid_mesh.vertices, &grid_mesh.faces, None);
    let mut all = Candidates::default();
    line.all(&mut all);
    let mut misses = [0_u32; 2];
    for _ in 0..packets {
        let (ray, active) = (grid_mesh.rays(aim, &mut rng), Mask8::splat(true));
        misses[0] += 8 - accel.intersect(active, &ray, Coherence::Incoherent).found.count() as u32;
        misses[1] += 8 - line.intersect(&all, active, &ray).0.found.count() as u32;
    }
    Ok(misses.map(|missed| f64::from(missed) / (8.0 * f64::from(packets))))
}

/// Case 25.
pub fn edges(effort: Effort) -> Checks {
    let many = effort.of(1 << 15);
    let (vertex, edge) = (missed(Aim::Vertex, true, many)?, missed(Aim::Edge, true, many)?);
    let anywhere = missed(Aim::Anywhere, true, effort.of(1 << 17))?;
    let plain = missed(Aim::Vertex, false, many)?;
    Ok(vec![
        Check::new("rays at vertices that miss, Embree robust: share", vertex[0], 0.01),
        Check::new("rays at edges that miss, Embree robust: share", edge[0], 0.01),
        Check::new("rays at random that miss, Embree robust: share", anywhere[0], 1e-6),
        Check::new("rays at vertices that miss, brute force: share", vertex[1], 0.01),
        Check::new("rays at edges that miss, brute force: share", edge[1], 0.01),
        Check::new("rays at random that miss, brute force: share", anywhere[1], 1e-6),
        Check::new(
            "for comparison, Embree without the flag, at vertices: share",
            plain[0],
            1.0,
        ),
    ])
}

/// A plate of these triangles under a light.
fn plate(triangles: &[[u32; 3]]) -> Result<Scene, InvalidScene> {
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];
    let middle = [[0.0, 0.0], [0.5, 0.0], [1e30, 0.0], [-1e30, 0.0]];
    let vertices = corners.into_iter().chain(middle).map(|[x, z]| [x, 0.0, z]);
    let mut scene = bench::view([-3.0, 3.0, 0.0], [0.0; 3], 45.0);
    let white = scene.material(Material::diffuse("white", [1.0; 3]));
    scene.mesh(Mesh::new(vertices, triangles.to_vec(), white));
    scene.sphere(bench::light([0.0, 4.0, 0.0], 1.0, 1.0));
    scene.build()
}

/// Case 26.
pub fn degenerate(effort: Effort) -> Checks {
    let clean = plate(&[[0, 1, 2], [0, 2, 3]])?;
    // Collinear, a single point, and a needle of length 1e30 without area.
    let flat = plate(&[[0, 4, 2], [0, 1, 2], [4, 4, 4], [0, 2, 3], [6, 4, 7], [4, 5, 5]])?;
    let dropped = clean.meshes()[0]
        .triangles
        .len()
        .abs_diff(flat.meshes()[0].triangles.len());
    let unsaid = usize::from(flat.notes().len() != 1);
    let mut different = 0;
    for accel in ACCELS {
        let settings = Settings {
            accel: Some(accel),
            ..bench::settings(64, 64, EstimatorKind::Mis)
        };
        different += bench::differences(
            &bench::picture(&clean, settings, 2)?,
            &bench::picture(&flat, settings, 2)?,
        );
    }
    // Needles with area, thinner and thinner: hit points must lie in their bounding box.
    let mut outside = 0;
    let device = Device::new(1)?;
    let mut rng = Pcg64::seed_from_u64(26);
    for power in 1..=7 {
        let thin = 10.0_f32.powi(-power);
        let corners = [[-1.0, 0.0, 5.0], [1.0, thin, 5.5], [1.0, -thin, 4.5]];
        let mut builder = SceneBuilder::new(&device, true)?;
        builder.add_mesh(&corners, &[[0, 1, 2]])?;
        let accel = builder.commit()?;
        for _ in 0..effort.of(20_000) {
            let mut side = |reach: f32| F32x8::from_fn(|_| rng.random_range(-reach..reach));
            let direction = Vec3::new(side(1.5), side(4.0 * thin), F32x8::splat(5.0));
            let ray = Ray {
                origin: Vec3::zero(),
                direction,
                tfar: F32x8::splat(f32::INFINITY),
                skip_id: U32x8::splat(NO_SKIP_ID),
            };
            let hit = accel.intersect(Mask8::splat(true), &ray, Coherence::Incoherent);
            for lane in hit.found.lanes() {
                let [x, y, z] = (direction * hit.t).lane(lane);
                let inside = x.abs() <= 1.0 + 1e-3 && y.abs() <= thin * 1.001 + 1e-5 && (4.4..=5.6).contains(&z);
                outside += usize::from(!inside);
            }
        }
    }
    Ok(vec![
        Check::none(
            "triangles without area that are kept, and others that are dropped",
            dropped,
        ),
        Check::none("scenes that do not say what was dropped", unsaid),
        Check::none("pixels whose bits change by triangles without area", different),
        Check::none("hits on needles 1e-1 to 1e-7 thin outside of their box", outside),
    ])
}

/// Scenes that must be rejected, each with words that the message must contain. Counts failures.
fn unless_refused(scenes: &[(String, &str)]) -> usize {
    let said = |text: &str| bench::scene(text).err().map(|error| error.to_string());
    scenes
        .iter()
        .filter(|(text, words)| !said(text).is_some_and(|said| said.contains(words)))
        .count()
}

/// Case 27.
pub fn without_area(_: Effort) -> Checks {
    let mesh = |faces: &str| {
        SPOT.to_owned()
            + &format!(
                "[[meshes]]\nemission = [1, 1, 1]\nvertices = [[0, 2, 0], [1, 2, 0], [2, 2, 0]]\nfaces = {faces}\n"
            )
    };
    let sphere = |radius: &str| {
        SPOT.to_owned() + &format!("[[spheres]]\ncenter = [0, 4, 0]\nradius = {radius}\nemission = [1, 1, 1]\n")
    };
    let cases = [
        (mesh("[[0, 1, 2]]"), "[[meshes]] 2"),
        (mesh("[]"), "faces"),
        (sphere("0"), "radius"),
        (sphere("0.0"), "radius"),
        (sphere("-1"), "radius"),
        (sphere("1e-46"), "radius"),
    ];
    Ok(vec![Check::none(
        "lights without area or radius that are taken, or whose message does not name them",
        unless_refused(&cases),
    )])
}

/// Case 28.
pub fn hostile_meshes(_: Effort) -> Checks {
    let inline = |vertices: &str, faces: &str| {
        SPOT.to_owned() + &format!("[[meshes]]\nmaterial = \"plate\"\nvertices = {vertices}\nfaces = {faces}\n")
    };
    let three = "[[0, 0, 0], [1, 0, 0], [0, 0, 1]]";
    let cases = [
        (
            inline("[[nan, 0, 0], [1, 0, 0], [0, 0, 1]]", "[[0, 1, 2]]"),
            "vertices[0]",
        ),
        (
            inline("[[0, 0, 0], [1, inf, 0], [0, 0, 1]]", "[[0, 1, 2]]"),
            "vertices[1]",
        ),
        (
            inline("[[0, 0, 0], [1, 0, 0], [0, -inf, 1]]", "[[0, 1, 2]]"),
            "vertices[2]",
        ),
        (
            inline("[[0, 0, 0], [1, 0, 0], [0, 1e39, 1]]", "[[0, 1, 2]]"),
            "vertices[2]",
        ),
        (inline(three, "[[0, 1, 3]]"), "faces[0][2]"),
        (inline(three, "[[0, 1, 2], [4294967295, 1, 2]]"), "faces[1][0]"),
        (inline(three, "[[-1, 1, 2]]"), "faces[0][0]"),
    ];
    let folder = tempfile::tempdir()?;
    let mut taken = unless_refused(&cases);
    for (name, text, words) in [
        ("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 0 1 2\n", "zero.obj"),
        ("far.obj", "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 4\n", "far.obj"),
        ("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", "nan.obj"),
        ("word.obj", "v 0 0 x\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", "word.obj"),
    ] {
        fs::write(folder.path().join(name), text)?;
        let scene = SPOT.to_owned() + &format!("[[meshes]]\nmaterial = \"plate\"\nfile = \"{name}\"\n");
        let said = Scene::parse(&scene, &folder.path().join("scene.toml"))
            .err()
            .map(|error| error.to_string());
        taken += usize::from(!said.is_some_and(|said| said.contains(words)));
    }
    Ok(vec![Check::none(
        "of 11 meshes with NaN, inf, wrong or missing corners: taken, or not named",
        taken,
    )])
}

/// Case 29.
pub fn winding(effort: Effort) -> Checks {
    let faces = [
        [[0, 1, 2], [0, 2, 3]],
        [[0, 2, 1], [0, 2, 3]],
        [[2, 1, 0], [3, 2, 0]],
        [[1, 2, 0], [2, 0, 3]],
    ];
    let mut pictures = Vec::new();
    for faces in faces {
        let scene = plate(&faces)?;
        let settings = Settings {
            accel: Some(ACCELS[0]),
            ..bench::settings(64, 64, EstimatorKind::Mis)
        };
        pictures.push(bench::picture(&scene, settings, effort.of(8))?);
    }
    let flipped = bench::differences(&pictures[0], &pictures[1]);
    // Rotating the corners only changes rounding.
    let off = pictures[2..]
        .iter()
        .flat_map(|p| p.pixels.iter().zip(&pictures[0].pixels));
    let largest = off.map(|(a, b)| f64::from((a[1] - b[1]).abs())).fold(0.0, f64::max);
    // Three triangles at one edge, and one alone: neither closed nor a manifold.
    let open = plate(&[[0, 1, 2], [0, 2, 3], [2, 0, 5], [0, 2, 4]]);
    let unsound = bench::invalid(&bench::render(
        &open?,
        bench::settings(64, 64, EstimatorKind::Mis),
        effort.of(8),
    )?);
    Ok(vec![
        Check::none(
            "pixels whose bits change when triangles are wound the other way (surfaces have two sides)",
            flipped,
        ),
        Check::new(
            "largest change of a pixel when triangles begin at another corner",
            largest,
            1e-6,
        ),
        Check::none(
            "invalid samples on an open mesh with three triangles at one edge",
            unsound,
        ),
    ])
}
