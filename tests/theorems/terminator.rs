//! A coarse mesh with smooth normals, lit from the side: with a smooth terminator it is lit as the sphere that it stands for, which
//! is in the scene format too and shares no line of its code.

use crate::proof::runs::{picture, settings};
use octolux::scene::{EstimatorKind, Scene};

const VIEW: &str = "[camera]\norigin = [0, 0, 8]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_y = 17\n\
    [film]\nwidth = 96\nheight = 96\n[materials.m]\ndiffuse = [1, 1, 1]\n\
    [[spheres]]\ncenter = [300, 120, 100]\nradius = 3\nemission = [10000, 10000, 10000]\n";

/// The sphere, or a mesh of 16 x 8 faces of it.
fn scene(mesh: Option<&str>) -> Scene {
    let ball = match mesh {
        None => "[[spheres]]\nmaterial = \"m\"\ncenter = [0, 0, 0]\nradius = 1\n".to_owned(),
        Some(terminator) => format!(
            "[[meshes]]\nmaterial = \"m\"\nfile = \"meshes/sphere-16x8.obj\"\nnormals = \"smooth\"\n\
            shadow_terminator = \"{terminator}\"\n"
        ),
    };
    Scene::parse(&format!("{VIEW}{ball}"), std::path::Path::new("scenes/s.toml")).unwrap()
}

/// What a mesh shows beside the sphere, inside of both.
struct Compared {
    /// Pixels where the sphere has at least 1 % of its brightest light.
    lit: usize,
    /// Those of them that are black on the mesh.
    black: usize,
    /// The mean of the mesh over that of the sphere, where that has less than 30 % of its brightest light.
    grazing: f64,
}

fn compared(terminator: &str) -> Compared {
    let pixels = |scene: &Scene| {
        let picture = picture(scene, settings(96, 96, EstimatorKind::Light), 16);
        picture.pixels.iter().map(|p| f64::from(p[0])).collect::<Vec<f64>>()
    };
    let (sphere, mesh) = (pixels(&scene(None)), pixels(&scene(Some(terminator))));
    let brightest = sphere.iter().copied().fold(0.0, f64::max);
    // 0.9 of the radius, which is 48 pixels over the tangent of half the angle of view, at a distance of 8.
    let radius = 0.9 * 48.0 / (8.5_f64.to_radians().tan() * 8.0);
    let (mut lit, mut black, mut sums) = (0, 0, [0.0, 0.0]);
    for (i, (s, m)) in sphere.into_iter().zip(mesh).enumerate() {
        let (x, y) = ((i % 96) as f64 - 47.5, (i / 96) as f64 - 47.5);
        if x.hypot(y) > radius {
            continue;
        }
        if s > 0.01 * brightest {
            lit += 1;
            black += usize::from(m == 0.0);
        }
        if s < 0.3 * brightest {
            sums = [sums[0] + s, sums[1] + m];
        }
    }
    Compared {
        lit,
        black,
        grazing: sums[1] / sums[0],
    }
}

/// Nothing is statistical here: the light is so small that 16 samples have 1 % of noise in single pixels, and the bounds are far off.
#[test]
fn a_coarse_sphere_is_lit_as_a_sphere_is() {
    let facets = compared("facets");
    let share = facets.black as f64 / facets.lit as f64;
    assert!(
        share > 0.02 && facets.grazing < 0.95,
        "the fault is there: {share} black, {}",
        facets.grazing
    );
    let smooth = compared("smooth");
    assert_eq!(smooth.black, 0, "of {} lit pixels", smooth.lit);
    assert!((smooth.grazing - 1.0).abs() < 0.05, "{}", smooth.grazing);
}
