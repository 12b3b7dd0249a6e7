//! Which kernel a scene gets, and why.

use super::rows::{self, Run};
use crate::lane::has_avx512;
use crate::scene::{EstimatorKind, Features};
use crate::settings::AccelKind;

/// The most shapes that are tested in a line where the choice is free: a careful bound. With the 17 of Veach's scene the line
/// is 1.34 times as fast as Embree, with the 48 of `large-lights` still 1.24 times (16 lanes, one thread, commit 89698de); where
/// it stops to pay was not looked for yet.
const IN_LINE: usize = 32;

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
    /// Traces the samples of a chunk to what they meet first.
    pub eye: Run,
    /// Turns hits into light: shading and visibility.
    pub shade: Run,
}

impl Plan {
    /// The kernel for a scene with `features`; `accel` is what the user insists on.
    ///
    /// # Errors
    /// A sentence where no kernel supports what is asked for, and what would do.
    pub fn choose(
        features: &Features,
        estimator: EstimatorKind,
        lanes: usize,
        accel: Option<AccelKind>,
    ) -> Result<Self, (String, &'static str)> {
        let per_light = matches!(estimator, EstimatorKind::Light | EstimatorKind::Mis);
        if per_light && features.mesh_lights > 0 {
            let (name, count) = (estimator.name(), features.mesh_lights);
            let what =
                format!("estimator \"{name}\" cannot sample lights that are meshes yet, and this scene has {count}");
            return Err((what, "use --estimator brdf, or uniform"));
        }
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
        let (eye, shade) = (rows::eye().run(accel, lanes), rows::shade(estimator).run(accel, lanes));
        let pairs = 2 + if per_light { features.sphere_lights as u32 } else { 0 };
        let name = format!("{}-f32x{lanes}-{}", accel.name(), estimator.name());
        Ok(Self {
            name,
            why,
            accel,
            pairs,
            eye,
            shade,
        })
    }
}
