//! Which kernel a scene gets, and why.

use super::rows::{self, Run};
use super::stage::grid::Order;
use crate::estimator::density::Mix;
use crate::lane::has_avx512;
use crate::scene::{Effect, Effects, EstimatorKind, Features};
use crate::settings::AccelKind;

/// The most shapes that are tested in a line where the choice is free. With 32, 64, 128 and 256 spheres strewn over a floor under
/// two lights the line took 0.55, 0.58, 0.59 and 0.66 of Embree's time in sixteen lanes, 0.58, 0.53, 0.53 and 0.64 in eight; with
/// triangles 0.48 to 0.55 and 0.38 to 0.52. Somewhere above 256 it stops to pay; half of that leaves room for scenes that crowd
/// into one tile.
const IN_LINE: usize = 128;

/// From so many shapes on packets hold all passes of a few pixels, where Embree answers them. Whole renders of a mesh of a
/// million triangles take 0.88 of the time then (`brdf`: 0.77), of `knot` with 11 207 shapes 0.93, of 100 000 spheres 0.92;
/// but of `many-spheres` with 152 1.04 and of Veach's scene 1.09, because `mis` then mixes techniques in its packets (384 x
/// 256, 15 samples a pixel, 16 lanes, one thread, commit e02d658).
const NEIGHBOURS: usize = 1000;

/// The widest packets that this processor has kernels for.
pub fn widest_lanes() -> usize {
    if has_avx512() { 16 } else { 8 }
}

/// A kernel that was chosen.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// Why, in a sentence.
    pub why: String,
    /// Who answers rays.
    pub accel: AccelKind,
    /// Pairs of random numbers that a sample takes.
    pub pairs: u32,
    /// How samples make packets.
    pub order: Order,
    /// Traces the samples of a chunk to what they meet first.
    pub eye: Run,
    /// Turns hits into light, shading and visibility: a stage for each model of reflection and, where a direction is drawn for
    /// every light, each kind of light that there is.
    pub shade: Vec<Run>,
    /// Which directions are drawn for each light and how they are weighed.
    pub mix: Mix,
    /// What the stages hold: at least what the scene calls for.
    pub held: Effects,
}

impl Plan {
    /// The kernel for a scene with `features`; `accel` is what the user insists on, `forced` are effects that it holds
    /// whether the scene calls for them or not.
    ///
    /// # Errors
    /// A sentence where no kernel supports what is asked for, and what would do.
    pub fn choose(
        features: &Features,
        forced: Effects,
        estimator: EstimatorKind,
        lanes: usize,
        accel: Option<AccelKind>,
    ) -> Result<Self, (String, &'static str)> {
        match lanes {
            1 | 8 => {}
            16 if has_avx512() => {}
            16 => return Err(("16 lanes need a processor with AVX-512".to_owned(), "use --lanes 8")),
            other => return Err((format!("there is no kernel of {other} lanes"), "use --lanes 1, 8 or 16")),
        }
        let few = features.shapes <= IN_LINE;
        let free_choice = if few { AccelKind::Linear } else { AccelKind::Embree };
        let why = match (accel, few) {
            (Some(forced), _) => format!("--accel {} was asked for", forced.name()),
            (None, true) => format!("{} shapes are few enough to be tested in a line", features.shapes),
            (None, false) => format!(
                "{} shapes are more than the {IN_LINE} up to which a line is chosen",
                features.shapes
            ),
        };
        let accel = accel.unwrap_or(free_choice);
        let needs = features.effects().and(forced);
        let pairs =
            2 + if estimator.per_light() {
                features.lights() as u32
            } else {
                0
            } + u32::from(needs.has(Effect::Lens));
        let order = if accel == AccelKind::Embree && features.shapes >= NEIGHBOURS {
            Order::Neighbours
        } else {
            Order::Passes
        };
        // Sixteen lanes say so by themselves.
        let set = if lanes == 8 && has_avx512() { "-avx512" } else { "" };
        let name = format!("{}-f32x{lanes}{set}-{}", accel.name(), estimator.name());
        if features.nothing_in_sight() {
            return Ok(Self {
                name: format!("{name}-blank"),
                why: "no eye ray can meet anything".to_owned(),
                accel,
                pairs,
                order,
                eye: rows::blank().run(accel, lanes),
                shade: Vec::new(),
                mix: Mix::default(),
                held: Effects::default(),
            });
        }
        let (in_eye, eye) = rows::eye(needs);
        let models: Vec<Effect> = rows::MODELS.into_iter().filter(|&model| needs.has(model)).collect();
        let held = in_eye.and(Effects::of(&models));
        let why = format!(
            "{why}; of the eye stages, this one holds {} and no more",
            listed(*in_eye)
        );
        Ok(Self {
            name,
            why,
            accel,
            pairs,
            order,
            eye: eye.run(accel, lanes),
            shade: models
                .iter()
                .flat_map(|&model| rows::shade(estimator, needs, model))
                .map(|row| row.run(accel, lanes))
                .collect(),
            mix: rows::mix(estimator),
            held,
        })
    }
}

/// Names in a row: `a, b and c`.
fn listed(effects: Effects) -> String {
    match effects.names().split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => "nothing".to_owned(),
    }
}
