//! Who answers rays, and whether occluders are culled before: decided here and nowhere else.

use crate::linear::FEW;
use crate::settings::AccelKind;

/// The most shapes that are tested in a line where the choice is free. With 32, 64, 128 and 256 spheres strewn over a floor under
/// two lights the line took 0.55, 0.58, 0.59 and 0.66 of Embree's time in sixteen lanes, 0.58, 0.53, 0.53 and 0.64 in eight; with
/// triangles 0.48 to 0.55 and 0.38 to 0.52. Somewhere above 256 it stops to pay; half of that leaves room for scenes that crowd
/// into one tile.
pub const IN_LINE: usize = 128;

/// Who answers rays, and whether occluders are culled before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Intersector {
    /// Who answers rays.
    pub accel: AccelKind,
    /// Whether occluders are culled for all rays of a tile at once; `None` where there are too many shapes for it.
    pub cull: Option<bool>,
}

impl Intersector {
    /// For so many shapes, with the reason; `accel` is what the user insists on, `cull` whether occluders are culled where that can
    /// be.
    pub fn choose(shapes: usize, accel: Option<AccelKind>, cull: bool) -> (Self, String) {
        let few = shapes <= IN_LINE;
        let why = match (accel, few) {
            (Some(forced), _) => format!("--accel {} was asked for", forced.name()),
            (None, true) => format!("{shapes} shapes are few enough to be tested one by one"),
            (None, false) => format!("{shapes} shapes are more than {IN_LINE}, up to which all are tested one by one"),
        };
        let accel = accel.unwrap_or(if few { AccelKind::Linear } else { AccelKind::Embree });
        let can_cull = accel == AccelKind::Linear || shapes <= FEW;
        let cull = can_cull.then_some(cull);
        (Self { accel, cull }, why)
    }

    /// Whether occluders are culled.
    pub fn culls(self) -> bool {
        self.cull == Some(true)
    }

    /// Whether all shapes have to be listed in a line: to answer rays, or to be culled before Embree is asked.
    pub fn lists_shapes(self) -> bool {
        self.accel == AccelKind::Linear || self.culls()
    }
}
