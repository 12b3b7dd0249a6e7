//! Which estimator a render takes, and why.

use crate::scene::{Effect, Effects, EstimatorKind, Features, Scene};
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
    /// [`Self::by_rule`] in words.
    pub const RULE: &str = "product where a sphere emits and a surface is diffuse or Phong, else mis";

    /// The estimator that is asked for, else the one that the scene names, else the one by the rule. `auto` asks for the rule,
    /// whatever the scene names.
    ///
    /// It depends on names and on what [`Scene::hash`] covers alone. So a saved run can only be resumed with the same estimator.
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
            (Some(EstimatorAsked::Auto), _) | (None, None) => Self::by_rule(Features::of_shapes(scene)),
        }
    }

    /// The estimator for a scene whose shapes have these effects ([`Features::of_shapes`]), where none is named.
    ///
    /// Elsewhere `product` would draw the directions of `mis`, to the bit. `docs/product.md` has the measurements.
    pub const fn by_rule(shapes: Effects) -> Self {
        let suits = shapes.has(Effect::Diffuse) || shapes.has(Effect::Phong);
        let (estimator, why) = match (shapes.has(Effect::SphereLights), suits) {
            (true, true) => (
                EstimatorKind::Product,
                "a sphere emits, and a surface is diffuse or Phong",
            ),
            (true, false) => (EstimatorKind::Mis, "no surface is diffuse or Phong"),
            (false, _) => (EstimatorKind::Mis, "no sphere emits"),
        };
        Self { estimator, why }
    }
}
