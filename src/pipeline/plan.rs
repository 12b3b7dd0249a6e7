//! Chooses the kernel for a scene and states the reason.

use std::sync::LazyLock;

use super::intersector::{IN_LINE, Intersector};
use super::kernels::{self, Run};
use super::lists::Draws;
use super::settings::Settings;
use super::stage::{Order, RequestHandler};
use crate::embree::{Device, Packets};
use crate::estimator::density::Mix;
use crate::lane::has_avx512;
use crate::scene::{Effect, Effects, Features};
use crate::settings::{AccelKind, EstimatorKind, Lanes};

/// From this many shapes on, with Embree, packets hold all passes of a few pixels. Whole renders of a mesh of a million triangles
/// then take 0.88 of the time (`brdf`: 0.77), of `knot` with 11 207 shapes 0.93, of 100 000 spheres 0.92. But `many-spheres` with
/// 152 shapes takes 1.04 and Veach's scene 1.09, because `mis` then mixes techniques within packets (384 x 256, 15 samples a pixel,
/// 16 lanes, one thread, commit e02d658).
const NEIGHBOURS: usize = 1000;

/// The widest packets that every intersector supports: 16 if the processor has AVX-512 and Embree has packets of 16, else 8.
pub fn widest_lanes() -> Lanes {
    static EMBREE: LazyLock<bool> = LazyLock::new(|| Device::new(1).is_ok_and(|device| device.packets().sixteen));
    if has_avx512() && *EMBREE {
        Lanes::Sixteen
    } else {
        Lanes::Eight
    }
}

/// What no kernel supports, and a remedy.
pub type Refusal = (String, &'static str);

/// The hardware and library features a plan may use.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Whether the processor has AVX-512.
    pub avx512: bool,
    /// Packet sizes that Embree supports.
    pub embree: Packets,
}

impl Machine {
    /// The current machine, with the Embree of `device`.
    pub fn of(device: &Device) -> Self {
        Self {
            avx512: has_avx512(),
            embree: device.packets(),
        }
    }

    /// The lane count of a kernel, and the reason if it needs explaining. `asked` forces a lane count.
    ///
    /// Sixteen lanes require Embree's packets of sixteen: without them Embree traces rays one by one, and AVX-512 gains less than
    /// it costs. Eight lanes are used even without packets of eight: Embree then takes as long as with one lane, but all other work
    /// runs eight wide.
    fn lanes(self, accel: AccelKind, asked: Option<Lanes>) -> Result<(Lanes, Option<String>), Refusal> {
        let packets = match accel {
            AccelKind::Embree => self.embree,
            AccelKind::Linear => Packets {
                eight: true,
                sixteen: true,
            },
        };
        let widest = if self.avx512 && packets.sixteen {
            Lanes::Sixteen
        } else {
            Lanes::Eight
        };
        match asked {
            Some(Lanes::Sixteen) if !self.avx512 => {
                return Err(("16 lanes need a processor with AVX-512".to_owned(), "use --lanes 8"));
            }
            Some(Lanes::Sixteen) if !packets.sixteen => {
                let what = "16 lanes need packets of 16 rays, which this Embree does not have".to_owned();
                return Err((
                    what,
                    "use --lanes 8 or --accel linear, or see whether .embree4 sets another isa",
                ));
            }
            _ => {}
        }
        let lanes = asked.unwrap_or(widest);
        let why = if !packets.has(lanes.count()) {
            Some(format!(
                "this Embree has no packets of {lanes} rays and takes each ray alone"
            ))
        } else if asked.is_none() && lanes < Lanes::Sixteen && self.avx512 {
            Some("this Embree has no packets of 16 rays".to_owned())
        } else {
            None
        };
        Ok((lanes, why))
    }
}

/// A chosen kernel.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// The reason for the choice, as a sentence.
    pub why: String,
    /// The intersector, and whether occluders are culled.
    pub intersector: Intersector,
    /// Rays per packet.
    pub lanes: Lanes,
    /// Rays that the intersector traces at a time.
    pub together: usize,
    /// Pairs of random numbers per sample.
    pub pairs: u32,
    /// How samples are grouped into packets.
    pub order: Order,
    /// The camera stage: traces the samples of a chunk to their first hits.
    pub camera: Run,
    /// The shading stages: turn hits into light samples, shading and visibility. One stage per BRDF model and, if a direction is
    /// sampled per light, per kind of light.
    pub shade: Vec<Run>,
    /// Finds partially visible lights, if the estimator samples two directions there.
    pub find_penumbrae: Option<Run>,
    /// What the intersector provides to the shading stages.
    pub handler: RequestHandler,
    /// The estimator whose stages run: the one asked for, but `mis2-power` for `product` with lists of spheres or triangles, since the forms
    /// of `product` are for a light that every point samples. Over `mis`, and without pixels that show lights, it has 1/6 of the error times
    /// seconds on `lights 1024` and `lights 4096` of `benches/scenes.py`, 0.70 to 0.94 on `rooms`, and 1.5 times on `scenes/city.toml`
    /// (`docs/product.md`).
    pub estimator: EstimatorKind,
    /// Which techniques sample each light, and how they are weighted.
    pub mix: Mix,
    /// Whether each pair of light and BRDF may choose another mix: see [`Chunk::mix_of`](super::stage::Chunk::mix_of).
    pub product: bool,
    /// Length of the list of lights, if a pass samples only some of the lights.
    pub lists: Option<u32>,
    /// Which lights the stages draw from lists.
    pub draws: Draws,
    /// Effects compiled into the stages: a superset of what the scene requires.
    pub held: Effects,
}

impl Plan {
    /// Chooses the kernel for a scene with `features`. Lanes, intersector, culling and lists are chosen unless `settings` force
    /// them. `forced` effects are compiled in even if the scene does not require them.
    ///
    /// # Errors
    /// What no kernel supports, as a sentence, and a remedy.
    pub fn choose(
        features: &Features,
        forced: Effects,
        settings: &Settings,
        machine: Machine,
    ) -> Result<Self, Refusal> {
        let Settings {
            lanes,
            accel,
            cull,
            lights,
            ..
        } = *settings;
        let lists = lights
            .list_of(features.emitters)
            .filter(|_| !features.nothing_in_sight());
        let estimator = match settings.estimator {
            EstimatorKind::Product if lists.is_some() && features.emitters > features.placed => {
                EstimatorKind::Mis2Power
            }
            asked => asked,
        };
        // Lists of delta lights alone are as long as those of all lights, which exist wherever these do.
        let draws = if lists.is_some() && estimator.per_light() {
            Draws::All
        } else if lists.is_some() && lights.list_of(features.placed).is_some() {
            Draws::Deltas
        } else {
            Draws::Nothing
        };
        let (intersector, why) = Intersector::choose(features, lists.is_some(), accel, cull);
        let accel = intersector.accel;
        let (lanes, note) = machine.lanes(accel, lanes)?;
        let together = match accel {
            AccelKind::Embree if !machine.embree.has(lanes.count()) => 1,
            _ => lanes.count(),
        };
        let why = note.into_iter().fold(why, |why, note| format!("{why}; {note}"));
        let needs = features.effects().union(forced);
        // A point that walks takes a pair for its ways, and one for each light that it finds.
        let in_lists = lists.map_or(0, |length| length.max(2));
        let pairs =
            2 + match draws {
                Draws::All => in_lists + features.unlisted() as u32,
                Draws::Deltas => in_lists,
                Draws::Nothing if estimator.per_light() => features.lights() as u32,
                Draws::Nothing => 0,
            } + u32::from(needs.has(Effect::Lens));
        let order = if draws != Draws::Nothing {
            Order::Lists
        } else if accel == AccelKind::Embree && features.shapes >= NEIGHBOURS {
            Order::Neighbours
        } else {
            Order::Passes
        };
        // Sixteen lanes imply AVX-512.
        let set = if lanes == Lanes::Eight && machine.avx512 {
            "-avx512"
        } else {
            ""
        };
        let name = format!("{}-f32x{lanes}{set}-{}", accel.name(), settings.estimator.name());
        if features.nothing_in_sight() {
            return Ok(Self {
                name: format!("{name}-blank"),
                why: "no camera ray can hit anything".to_owned(),
                intersector,
                lanes,
                together,
                pairs,
                order,
                camera: kernels::blank().run(lanes),
                shade: Vec::new(),
                find_penumbrae: None,
                handler: RequestHandler::of(accel, lanes),
                estimator,
                mix: Mix::default(),
                product: false,
                lists: None,
                draws: Draws::Nothing,
                held: Effects::default(),
            });
        }
        let (in_camera, camera) = kernels::camera(needs);
        let models: Vec<Effect> = kernels::MODELS.into_iter().filter(|&model| needs.has(model)).collect();
        let held = in_camera.union(Effects::of(&models));
        let why = format!(
            "{why}; camera rays use the smallest compiled program that can do {}",
            listed(*in_camera)
        );
        Ok(Self {
            name,
            why,
            intersector,
            lanes,
            together,
            pairs,
            order,
            camera: camera.run(intersector.of_camera_rays(features), lanes),
            shade: models
                .iter()
                .flat_map(|&model| kernels::shade(estimator, needs, draws, model))
                .map(|row| row.run(lanes))
                .collect(),
            // With more shapes rays are expensive: on `knot` second directions save 5 % of the error.
            find_penumbrae: kernels::find_penumbrae(estimator, needs)
                .filter(|_| lists.is_none())
                .filter(|_| features.shapes <= IN_LINE)
                .map(|row| row.run(lanes)),
            handler: RequestHandler::of(accel, lanes),
            estimator,
            mix: kernels::mix(estimator),
            product: estimator == EstimatorKind::Product,
            lists,
            draws,
            held,
        })
    }
}

/// Joins names: `a, b and c`.
fn listed(effects: Effects) -> String {
    match effects.names().split_last() {
        Some((last, [])) => (*last).to_owned(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => "nothing".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(avx512: bool, eight: bool, sixteen: bool) -> Machine {
        Machine {
            avx512,
            embree: Packets { eight, sixteen },
        }
    }

    /// The chosen width is one the intersector supports, on every kind of machine. `isa=avx2` leaves Embree packets of eight,
    /// `isa=sse2` none.
    #[test]
    fn the_plan_takes_a_width_that_is_there() {
        let (embree, line) = (AccelKind::Embree, AccelKind::Linear);
        for (machine, accel, lanes) in [
            (machine(true, true, true), embree, Lanes::Sixteen),
            (machine(true, true, false), embree, Lanes::Eight),
            (machine(true, false, false), embree, Lanes::Eight),
            (machine(false, true, false), embree, Lanes::Eight),
            // Embree has packets of sixteen if the processor has AVX-512, whatever `OCTOLUX_AVX512` says.
            (machine(false, true, true), embree, Lanes::Eight),
            (machine(true, true, false), line, Lanes::Sixteen),
            (machine(true, false, false), line, Lanes::Sixteen),
            (machine(false, true, true), line, Lanes::Eight),
        ] {
            assert_eq!(
                machine.lanes(accel, None).unwrap().0,
                lanes,
                "{machine:?} {}",
                accel.name()
            );
        }
    }

    #[test]
    fn sixteen_lanes_are_refused_where_somebody_has_none() {
        let refused = |machine: Machine, accel| machine.lanes(accel, Some(Lanes::Sixteen)).unwrap_err();
        let (what, _) = refused(machine(false, true, true), AccelKind::Linear);
        assert!(what.contains("AVX-512"), "{what}");
        let (what, remedy) = refused(machine(true, true, false), AccelKind::Embree);
        assert!(
            what.contains("Embree") && remedy.contains("--lanes 8"),
            "{what}: {remedy}"
        );
        assert!(
            machine(true, true, false)
                .lanes(AccelKind::Linear, Some(Lanes::Sixteen))
                .is_ok()
        );
    }

    #[test]
    fn the_plan_says_that_embree_takes_rays_one_by_one() {
        let (lanes, why) = machine(true, false, false)
            .lanes(AccelKind::Embree, Some(Lanes::Eight))
            .unwrap();
        assert_eq!(lanes, Lanes::Eight);
        assert!(why.unwrap().contains("each ray alone"));
        assert_eq!(
            machine(true, true, false)
                .lanes(AccelKind::Embree, Some(Lanes::Eight))
                .unwrap(),
            (Lanes::Eight, None)
        );
        assert_eq!(
            machine(true, false, false)
                .lanes(AccelKind::Embree, Some(Lanes::One))
                .unwrap(),
            (Lanes::One, None)
        );
        assert_eq!(
            machine(true, false, false)
                .lanes(AccelKind::Linear, Some(Lanes::Eight))
                .unwrap(),
            (Lanes::Eight, None)
        );
    }
}
