//! Properties that must hold for every scene.

use std::path::Path;

use super::draw::Kind;
use super::recipe::Recipe;
use crate::film::Picture;
use crate::pipeline::{Prepared, Settings};
use crate::reference::probe::Probe;
use crate::scene::{EstimatorKind, Features, SamplerKind, Scene};
use crate::settings::{AccelKind, Lanes};
use crate::study::family::Family;
use crate::study::verify::agreement::{Judge, TESTS_OF_A_PAIR, Verdicts};
use crate::study::verify::blocks::Grid;
use crate::study::verify::oracle::Oracle;
use crate::study::verify::replicates::Series;
use crate::study::verify::tails::Tails;
use crate::study::verify::{Bench, Row, Verdict, VerifyError, exact, silhouettes, ties};

/// A rule that a scene breaks.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// A short name of the rule.
    pub rule: &'static str,
    /// How it was broken.
    pub what: String,
}

/// Parameters of a check besides the scene.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Ordinary scenes are also compared in the mean; wild scenes are not.
    pub kind: Kind,
    /// The exponent of two that scales the scene up; a second copy is scaled down by the same factor.
    pub scale: i32,
    /// The estimator of bitwise comparisons.
    pub estimator: EstimatorKind,
    /// The sampler of bitwise comparisons.
    pub sampler: SamplerKind,
    /// The seed of everything.
    pub seed: u32,
    /// The false-alarm probability of all comparisons of means of this scene.
    pub alpha: f64,
}

/// Passes of pictures that are compared bit by bit.
const PASSES: u32 = 4;

/// Replicates of a mean, and samples per pixel of each.
const REPLICATES: u32 = 16;
const SPP: u32 = 16;

/// Samples per pixel of the oracle.
const ORACLE: f64 = 512.0;

/// Probes per pixel for light that samples may have missed.
const PROBES: u64 = 64;

/// Checks a recipe; `None` where it is no valid scene (its camera may look along its own up vector).
///
/// # Errors
/// Where a render cannot start.
pub fn check(recipe: &Recipe, folder: &Path, effort: Effort) -> Result<Option<Vec<Fault>>, VerifyError> {
    let path = folder.join("hunt.toml");
    let Ok(scene) = Scene::parse(&recipe.toml(1.0), &path) else {
        return Ok(None);
    };
    let settings = Settings {
        film: scene.film(),
        estimator: effort.estimator,
        sampler: effort.sampler,
        seed: effort.seed,
        lanes: Some(Lanes::Eight),
        threads: 1,
        accel: None,
        robust: true,
        cull: true,
        lights: Default::default(),
    };
    let mut bench = Bench::new(&scene, settings, f64::INFINITY, &());
    let shapes = Features::of(&scene, scene.film()).shapes;
    let mut faults: Vec<Fault> = match exact::widths(&mut bench, settings, shapes) {
        Ok(rows) => failed(&rows),
        Err(VerifyError::NotFinite { whose, wrong }) => vec![Fault {
            rule: "finite",
            what: format!("{whose} picture: {wrong}"),
        }],
        Err(error) => return Err(error),
    };
    if bench.invalid() > 0 {
        let what = format!(
            "{} contributions or values are NaN, infinite or negative",
            bench.invalid()
        );
        faults.push(Fault { rule: "finite", what });
    }
    faults.extend(culling(&scene, settings)?);
    if effort.kind == Kind::Ordinary {
        faults.extend(scales(recipe, &path, &scene, settings, effort.scale)?);
        faults.extend(means(&mut bench, effort)?);
    }
    Ok(Some(faults))
}

fn failed(rows: &[Row]) -> Vec<Fault> {
    let wrong = rows.iter().filter(|row| row.verdict == Verdict::Fail);
    let fault = |row: &Row| Fault {
        rule: row.check,
        what: format!("{}: {}; {}", row.compared, row.figure, row.sentence),
    };
    wrong.map(fault).collect()
}

fn render(scene: &Scene, settings: Settings) -> Result<Picture, VerifyError> {
    Ok(Prepared::new(scene, settings)?.passes(PASSES).finish().picture())
}

/// Number of pixels that differ by more than `tolerance`, relative; bit by bit if it is 0.
fn apart(a: &Picture, b: &Picture, tolerance: f32) -> usize {
    let differ = |(a, b): (&f32, &f32)| {
        if tolerance == 0.0 {
            a.to_bits() != b.to_bits()
        } else {
            (a - b).abs() > tolerance * a.abs().max(b.abs())
        }
    };
    let pixels = a.pixels.iter().zip(&b.pixels);
    pixels.filter(|(a, b)| a.iter().zip(*b).any(differ)).count()
}

/// Culling for a tile or a light must not remove anything its rays hit: pictures differ only by rounding of a few sums.
fn culling(scene: &Scene, settings: Settings) -> Result<Option<Fault>, VerifyError> {
    let accel = Some(AccelKind::Linear);
    let [on, off] = [true, false].map(|cull| {
        render(
            scene,
            Settings {
                cull,
                accel,
                ..settings
            },
        )
    });
    let different = apart(&on?, &off?, 1e-5);
    Ok((different > 0).then(|| Fault {
        rule: "culling",
        what: format!("{different} pixels differ with --cull off"),
    }))
}

/// A scene scaled by a power of two gives the same bits, through both intersectors.
fn scales(
    recipe: &Recipe,
    path: &Path,
    scene: &Scene,
    settings: Settings,
    scale: i32,
) -> Result<Vec<Fault>, VerifyError> {
    let mut faults = Vec::new();
    for accel in AccelKind::ALL {
        let settings = Settings {
            accel: Some(accel),
            ..settings
        };
        let expected = render(scene, settings)?;
        for power in [scale, -scale] {
            let Ok(scaled) = Scene::parse(&recipe.toml(2.0_f64.powi(power)), path) else {
                continue;
            };
            let different = apart(&expected, &render(&scaled, settings)?, 0.0);
            if different > 0 {
                let what = format!("{different} pixels differ at 2^{power}, by {}", accel.name());
                faults.push(Fault { rule: "scale", what });
            }
        }
    }
    Ok(faults)
}

/// Every estimator against the oracle and against `mis`. The bound includes what samples may have missed ([`Tails`]), which
/// excludes combinations with too heavy tails: their bound exceeds any difference.
fn means(bench: &mut Bench<'_>, effort: Effort) -> Result<Vec<Fault>, VerifyError> {
    let (scene, film) = (bench.scene, bench.settings.film);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let seed = u64::from(effort.seed);
    let probe = Probe::new(scene, film);
    let passes: Vec<_> = pool.install(|| (0..PROBES).map(|pass| probe.pass(seed << 16 | pass)).collect());
    let (left_out, _) = pool.install(|| ties::pixels(scene, film, seed));
    let grid = Grid::without(film, &silhouettes::find(scene, &probe, film, &passes), &left_out);
    if grid.pixels(grid.blocks()) == 0.0 {
        return Ok(Vec::new());
    }
    let mut tails = Tails::new(grid.clone(), &probe);
    passes.iter().for_each(|found| tails.add(found));
    let oracle = match Oracle::render(bench, &pool, &grid, film, ORACLE) {
        Err(VerifyError::NotFinite { whose, wrong }) => {
            let what = format!("{whose} picture: {wrong}");
            return Ok(vec![Fault { rule: "finite", what }]);
        }
        oracle => oracle?,
    };
    let all = bench.estimators();
    let series: Result<Vec<Series>, VerifyError> = all
        .iter()
        .map(|&estimator| replicates(bench, &grid, estimator))
        .collect();
    let series = series?;
    let mut family: Family<Verdicts<'_>> = Family::new(effort.alpha);
    // The last is the best one.
    if let Some((best, others)) = series.split_last() {
        for one in others {
            family.add_several(Oracle::tests(false), Box::new(|judge| oracle.rows(judge, one, false)));
            family.add_several(TESTS_OF_A_PAIR, Box::new(|judge| judge.estimators(one, best)));
        }
        family.add_several(Oracle::tests(true), Box::new(|judge| oracle.rows(judge, best, true)));
    }
    let (alpha, tests) = family.close();
    let judge = Judge {
        grid: &grid,
        tails: &tails,
        alpha,
        width: film.width,
    };
    Ok(tests.iter().flat_map(|test| failed(&test(&judge))).collect())
}

fn replicates(bench: &mut Bench<'_>, grid: &Grid, estimator: EstimatorKind) -> Result<Series, VerifyError> {
    let (weight, settings) = match estimator {
        EstimatorKind::Uniform => (4, bench.settings),
        EstimatorKind::Brdf => (2, bench.settings),
        _ => (1, bench.settings),
    };
    let settings = Settings {
        estimator,
        sampler: SamplerKind::Sobol,
        ..settings
    };
    let prepared = Prepared::new(bench.scene, settings)?;
    let mut series = Series::new(estimator, SamplerKind::Sobol, SPP * weight);
    for number in 1..=REPLICATES {
        let seed = settings.seed.wrapping_add(number.wrapping_mul(0x9e37_79b1));
        let mut run = prepared.with_seed(seed).passes(series.early_spp);
        let _ = run.run(&());
        let early = run.picture();
        run.extend(series.spp);
        let _ = run.run(&());
        series.take(grid, &early, &run.picture());
    }
    Ok(series)
}

#[cfg(test)]
mod tests {
    use super::super::recipe::{Body, Material, Shape, Surface};
    use super::super::{Options, effort};
    use super::*;

    /// Scene 1597 of seed 20261129, reduced. Of a lamp that cuts a triangle, a crest rises above it for some points: `projected` and
    /// `product` draw the crest alone, all others miss it in most replicates, so their spread says nothing of their error. The
    /// hunt had accused them, 11 times beyond the bound.
    #[test]
    fn a_lamp_that_barely_rises_breaks_no_rule() {
        let triangle = Body::Mesh {
            vertices: vec![
                [-1.2038219488520392, 0.20633786251526365, 1.1956442308087625],
                [1.4552013468123315, 1.1158683144890138, 0.33033238209424964],
                [0.3981367922690162, -1.4230904962160449, -1.123036329220245],
            ],
            faces: vec![[0, 1, 2]],
            uvs: None,
            smooth: false,
        };
        let lamp = Body::Sphere {
            center: [-0.042, 0.81, 1.7],
            radius: 0.53,
        };
        let view = [
            [-2.4016927861325152, 0.5511637929915123, -5.032773642045006],
            [-0.3108747158062773, -0.22236053746303608, -0.2892039172616618],
            [0.1, 1.0, 0.05],
        ];
        let recipe = Recipe {
            view,
            fov: 41.18339448935481,
            lens: None,
            film: [3, 3],
            materials: vec![Material {
                diffuse: Some([0.5; 3]),
                phong: None,
                rough: None,
                one_sided: false,
                texture: None,
            }],
            shapes: vec![
                Shape {
                    body: triangle,
                    surface: Surface::Material(0),
                },
                Shape {
                    body: lamp,
                    surface: Surface::Emission([1.0; 3]),
                },
            ],
            sky: None,
            lamps: Vec::new(),
        };
        let options = Options {
            kind: Kind::Ordinary,
            seed: 20261129,
            first: 1597,
            scenes: 1,
        };
        let found = check(&recipe, Path::new("."), effort(&options, 1597)).unwrap();
        assert_eq!(found, Some(Vec::new()));
    }
}
