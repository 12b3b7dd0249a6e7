//! A hunt: random scenes, and properties that must hold for every one of them.
//!
//! A number and a seed determine a recipe ([`draw`]), a recipe determines a scene file ([`recipe`]), and [`check`] tests it:
//! finite values, the same bits at all widths and with every effect compiled in, the same picture through both intersectors and
//! with or without culling, the same bits at other scales, and means that agree with the oracle. A failing recipe is made
//! smaller while it still fails ([`shrink`]).
//!
//! Bitwise comparisons have no false alarms except ties, which are told from faults in `f64` ([`crate::reference::ties`]). All
//! comparisons of means of a hunt together raise a false alarm with a probability of [`FALSE_ALARMS`] at most: scenes share it
//! equally, then the rows of a scene, and the values of a row by Šidák. Combinations of a scene and an estimator with too heavy
//! tails are excluded by rule: every bound includes what as many samples may have missed, as in `verify`
//! ([`crate::study::verify::tails`]).

pub mod check;
pub mod draw;
pub mod lamp;
pub mod recipe;
pub mod shrink;

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::scene::{EstimatorKind, SamplerKind};
use crate::study::verify::VerifyError;
use check::{Effort, Fault};
use draw::Kind;
use recipe::Recipe;

/// The probability that any comparison of means of a hunt fails without a fault.
pub const FALSE_ALARMS: f64 = 1e-3;

/// Largest scale of scenes, as an exponent of two: lengths of 2^30 and 2^-30 leave room for squares in `f32`.
const SCALE: i32 = 30;

/// Which scenes to check.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Ordinary or wild ones.
    pub kind: Kind,
    /// Common seed of all scenes.
    pub seed: u64,
    /// The number of the first.
    pub first: u64,
    /// How many.
    pub scenes: u64,
}

/// A scene that breaks a rule.
#[derive(Clone, Debug)]
pub struct Catch {
    /// Its number.
    pub number: u64,
    /// What it breaks.
    pub faults: Vec<Fault>,
    /// As it was drawn.
    pub recipe: Recipe,
    /// A small one that breaks the first of these rules.
    pub small: Recipe,
}

/// The result of a hunt.
#[derive(Clone, Debug, Default)]
pub struct Bag {
    /// Scenes checked.
    pub scenes: u64,
    /// Recipes that were no valid scene.
    pub none: u64,
    /// Scenes that break rules.
    pub catches: Vec<Catch>,
}

/// The effort for a scene, drawn from its number and so reproducible.
pub fn effort(options: &Options, number: u64) -> Effort {
    let mut rng = Pcg64::seed_from_u64(options.seed ^ number.wrapping_mul(0xd134_2543_de82_ef95));
    let estimators = EstimatorKind::ALL;
    Effort {
        kind: options.kind,
        // Half of the scenes use the largest scale.
        scale: if rng.random() {
            SCALE
        } else {
            rng.random_range(1..SCALE)
        },
        estimator: estimators[rng.random_range(0..estimators.len())],
        sampler: SamplerKind::ALL[rng.random_range(0..2)],
        seed: rng.random(),
        alpha: FALSE_ALARMS / options.scenes.max(1) as f64,
    }
}

/// Checks scene after scene. `heard` receives each with what it broke and returns whether to go on. `folder` holds the pictures
/// of [`recipe::write_pictures`].
///
/// # Errors
/// Where a render cannot start.
pub fn hunt(
    options: &Options,
    folder: &Path,
    mut heard: impl FnMut(u64, Option<&Catch>) -> bool,
) -> Result<Bag, VerifyError> {
    let mut bag = Bag::default();
    for number in options.first..options.first + options.scenes {
        let effort = effort(options, number);
        let recipe = draw::recipe(options.kind, options.seed, number);
        let faults = match check::check(&recipe, folder, effort)? {
            None => {
                bag.none += 1;
                continue;
            }
            Some(faults) => faults,
        };
        bag.scenes += 1;
        let caught = faults.first().map(|fault| {
            let rule = fault.rule;
            let small = shrink::shrink(&recipe, |simpler| {
                let again = check::check(simpler, folder, effort);
                matches!(again, Ok(Some(faults)) if faults.iter().any(|fault| fault.rule == rule))
            });
            Catch {
                number,
                faults: faults.clone(),
                recipe,
                small,
            }
        });
        let go_on = heard(number, caught.as_ref());
        bag.catches.extend(caught);
        if !go_on {
            break;
        }
    }
    Ok(bag)
}
