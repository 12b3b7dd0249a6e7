//! Which estimator a render takes, and why.

use crate::scene::{EstimatorKind, Scene};
use crate::settings::EstimatorAsked;

/// The estimator of a render, and the reason for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The estimator.
    pub estimator: EstimatorKind,
    /// The reason, as a clause.
    pub why: &'static str,
}

impl Chosen {
    /// What is taken where nobody names an estimator. `docs/product.md` has the measurements: on every scene of `scenes/`, no other
    /// estimator has less error for its time, beyond the noise of the comparison.
    pub const AUTO: Self = Self {
        estimator: EstimatorKind::Product,
        why: "least error for its time",
    };

    /// The estimator that is asked for, else the one that the scene names, else [`Self::AUTO`]. `auto` asks for the last, whatever
    /// the scene names.
    pub fn of(scene: &Scene, asked: Option<EstimatorAsked>) -> Self {
        match (asked, scene.render().estimator) {
            (Some(EstimatorAsked::Named(estimator)), _) => Self {
                estimator,
                why: "it was asked for",
            },
            (None, Some(estimator)) => Self {
                estimator,
                why: "the scene names it",
            },
            (Some(EstimatorAsked::Auto), _) | (None, None) => Self::AUTO,
        }
    }
}
