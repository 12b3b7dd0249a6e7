//! Estimators against each other and against the oracle.

use octolux::reference;
use octolux::scene::{EstimatorKind, FilmSize, Scene};

use super::Family;
use super::runs::{Estimate, Runs, leave, names, oracle_estimates, settings};

/// Parts of a film that are compared each.
pub const COLUMNS: u32 = 4;
/// Rows of them.
pub const ROWS: u32 = 3;

/// What single precision and the offset of shading points may move a mean (`proof_closed_forms.rs`).
const ROUNDING: f64 = 1e-5;

/// Compares all pairs of estimators, `[uniform, light, brdf, mis]` with their passes a seed (0: left out), those beyond the
/// hand-out with as many directions as the one that they are like, and each with the oracle of `spp` samples a pixel.
pub fn agree(scene: &Scene, table: &'static str, film: FilmSize, seeds: u32, passes: [u32; 4], spp: u32) {
    judge(Family::new(table), table, scene, film, seeds, passes, spp);
}

/// As [`agree`], into a family of one's own; what the pictures are called is `table`.
pub fn judge(mut family: Family, table: &str, scene: &Scene, film: FilmSize, seeds: u32, passes: [u32; 4], spp: u32) {
    let FilmSize { width, height } = film;
    let oracle = reference::render(scene, film, spp, 99, &|_| ());
    let mut columns = vec![("oracle", oracle_estimates(&oracle, COLUMNS, ROWS), oracle.to_picture())];
    let [uniform, light, brdf, mis] = passes;
    let of = |estimator: EstimatorKind| match estimator {
        EstimatorKind::Uniform => uniform,
        EstimatorKind::Light | EstimatorKind::Projected => light,
        EstimatorKind::Brdf => brdf,
        EstimatorKind::Mis | EstimatorKind::Product => mis,
        // Twice as many directions.
        EstimatorKind::Mis2Balance | EstimatorKind::Mis2Power => mis / 2,
    };
    let each = EstimatorKind::ALL
        .into_iter()
        .map(|estimator| (estimator, of(estimator)));
    for (estimator, passes) in each.filter(|(_, passes)| *passes > 0) {
        let runs = Runs::new(scene, settings(width, height, estimator), passes, 1, seeds);
        columns.push((estimator.name(), runs.estimates(COLUMNS, ROWS), runs.mean_picture()));
    }
    for (name, _, picture) in &columns {
        leave(picture, &format!("{table}-{name}"));
    }
    let brightest = columns[0].1.iter().fold(0.0_f64, |most, part| most.max(part.mean));
    for (i, (a, ours, _)) in columns.iter().enumerate() {
        for (b, theirs, _) in &columns[..i] {
            for ((x, y), name) in ours.iter().zip(theirs).zip(names(COLUMNS, ROWS)) {
                // Directions that are not aimed at lights may all miss them, in every seed: such a mean has no error that it could be held
                // to. It is let pass where next to nothing is to be found.
                let missed = |who: &str, one: &Estimate| {
                    matches!(who, "uniform" | "brdf") && one.mean == 0.0 && one.variance == 0.0
                };
                let dark = x.mean.max(y.mean) < 1e-3 * brightest;
                let excused = dark && (missed(a, x) || missed(b, y));
                let p = if excused { 1.0 } else { x.p(*y, ROUNDING) };
                family.add(p, format!("{a} {b} {name}: {}", x.against(*y)));
            }
        }
    }
    family.judge();
}
