//! Chooses the intersector and whether to cull occluders. No other code decides this.

use crate::linear::FEW;
use crate::scene::{Effect, Features};
use crate::settings::AccelKind;

/// The brute-force intersector is the default up to this number of shapes. With 32, 64, 128 and 256 spheres strewn over a floor
/// under two lights, brute force took 0.55, 0.58, 0.59 and 0.66 of Embree's time in sixteen lanes, and 0.58, 0.53, 0.53 and 0.64 in
/// eight; with triangles, 0.48 to 0.55 and 0.38 to 0.52. The break-even lies somewhere above 256. Half of that leaves room for
/// scenes that crowd into one tile.
pub const IN_LINE: usize = 128;

/// With lists of lights and up to this many triangles, a shadow ray is tested against the shapes that culling leaves, triangles one by
/// one and spheres by a hierarchy.
const IN_SHAFT: usize = 512;

/// And up to this many spheres: a sample of `lights` takes 0.61 to 0.86 of the time with Embree at 1024 and 4096 lights, 0.87 to 1.3 times at
/// 8192 and 16 384, 1.8 times and more at 65 536 (docs/many-lights.md).
const BALLS_IN_SHAFT: usize = 8192;

/// The intersector, and whether occluders are culled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Intersector {
    /// Which intersector traces rays.
    pub accel: AccelKind,
    /// Whether occluders are culled for all rays of a tile at once; `None` if there are too many shapes to cull.
    pub cull: Option<bool>,
    /// Whether shadow rays to lights are tested against the shapes that culling leaves, although Embree traces all other rays.
    pub shafts: bool,
}

impl Intersector {
    /// Chooses for this number of shapes and states the reason. `accel` forces an intersector. `cull` requests culling where
    /// it is possible.
    pub fn choose(features: &Features, lists: bool, accel: Option<AccelKind>, cull: bool) -> (Self, String) {
        let Features { shapes, triangles, .. } = *features;
        let few = shapes <= IN_LINE;
        let why = match (accel, few) {
            (Some(forced), _) => format!("--accel {} was asked for", forced.name()),
            (None, true) if shapes == 1 => "1 shape is tested by itself".to_owned(),
            (None, true) => format!("{shapes} shapes are few enough to be tested one by one"),
            (None, false) => format!("{shapes} shapes are more than {IN_LINE}, up to which all are tested one by one"),
        };
        let accel = accel.unwrap_or(if few { AccelKind::Linear } else { AccelKind::Embree });
        let shafts = accel == AccelKind::Embree
            && lists
            && shapes > FEW
            && triangles <= IN_SHAFT
            && shapes - triangles <= BALLS_IN_SHAFT;
        let can_cull = accel == AccelKind::Linear || shapes <= FEW || shafts;
        let chosen = Self {
            accel,
            cull: can_cull.then_some(cull),
            shafts: shafts && cull,
        };
        (chosen, why)
    }

    /// Whether occluders are culled.
    pub fn culls(self) -> bool {
        self.cull == Some(true)
    }

    /// The intersector of camera rays. Where shafts are culled, the view of a tile is too: its rays meet few of the shapes. The scene
    /// decides, not the kernel: hits of the two intersectors differ in the last bits, and what a kernel could do besides must not.
    pub fn of_camera_rays(self, features: &Features) -> AccelKind {
        // Rays through a lens leave the tile's frustum.
        if self.shafts && !features.effects().has(Effect::Lens) {
            AccelKind::Linear
        } else {
            self.accel
        }
    }

    /// Whether the brute-force shape list is needed: as the intersector, or for culling before Embree traces.
    pub fn lists_shapes(self) -> bool {
        self.accel == AccelKind::Linear || self.culls()
    }
}
