//! Which kernel a scene gets, and why.

use std::sync::LazyLock;

use super::intersector::{IN_LINE, Intersector};
use super::kernels::{self, Run};
use super::settings::Settings;
use super::stage::{Answers, Order};
use crate::embree::{Device, Packets};
use crate::estimator::density::Mix;
use crate::lane::has_avx512;
use crate::scene::{Effect, Effects, Features};
use crate::settings::{AccelKind, Lanes};

/// From so many shapes on packets hold all passes of a few pixels, where Embree answers them. Whole renders of a mesh of a
/// million triangles take 0.88 of the time then (`brdf`: 0.77), of `knot` with 11 207 shapes 0.93, of 100 000 spheres 0.92;
/// but of `many-spheres` with 152 1.04 and of Veach's scene 1.09, because `mis` then mixes techniques in its packets (384 x
/// 256, 15 samples a pixel, 16 lanes, one thread, commit e02d658).
const NEIGHBOURS: usize = 1000;

/// The widest packets that can be asked for whoever answers rays: 16 where the processor has AVX-512 and Embree has
/// packets of 16, else 8.
pub fn widest_lanes() -> Lanes {
    static EMBREE: LazyLock<bool> = LazyLock::new(|| Device::new(1).is_ok_and(|device| device.packets().sixteen));
    if has_avx512() && *EMBREE {
        Lanes::Sixteen
    } else {
        Lanes::Eight
    }
}

/// What no kernel does, and what would do.
pub type Refusal = (String, &'static str);

/// What a plan may choose from.
#[derive(Clone, Copy, Debug)]
pub struct Machine {
    /// Whether the processor has AVX-512.
    pub avx512: bool,
    /// The packets that Embree has.
    pub embree: Packets,
}

impl Machine {
    /// This one, with the Embree of `device`.
    pub fn of(device: &Device) -> Self {
        Self {
            avx512: has_avx512(),
            embree: device.packets(),
        }
    }

    /// The lanes of a kernel, and where a choice needs a word, why; `asked` is what the user insists on.
    ///
    /// Sixteen lanes need Embree's packets of sixteen: without them Embree takes each ray alone, and AVX-512 gains less than
    /// it costs. Eight lanes are taken without packets of eight too. Embree then needs as long as with one lane, but all else
    /// is done eight at a time.
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

/// A kernel that was chosen.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Its name.
    pub name: String,
    /// Why, in a sentence.
    pub why: String,
    /// Who answers rays, and whether occluders are culled before.
    pub intersector: Intersector,
    /// Rays a packet.
    pub lanes: Lanes,
    /// Rays that whoever answers them takes at a time.
    pub together: usize,
    /// Pairs of random numbers that a sample takes.
    pub pairs: u32,
    /// How samples make packets.
    pub order: Order,
    /// Traces the samples of a chunk to what they meet first.
    pub eye: Run,
    /// Turns hits into light, shading and visibility: a stage for each model of reflection and, where a direction is drawn for
    /// every light, each kind of light that there is.
    pub shade: Vec<Run>,
    /// Finds where lights are seen in part, where the estimator takes two directions there.
    pub find_penumbrae: Option<Run>,
    /// What the intersector answers to the shading stages.
    pub answers: Answers,
    /// Which directions are drawn for each light and how they are weighed.
    pub mix: Mix,
    /// Lights of a list, where not all are asked in every pass.
    pub lists: Option<u32>,
    /// What the stages hold: at least what the scene calls for.
    pub held: Effects,
}

impl Plan {
    /// Whether shading asks lists of lights.
    pub fn asks_lists(&self) -> bool {
        self.order == Order::Lists
    }

    /// The kernel for a scene with `features`; lanes, intersector, culling and lists are chosen where `settings` do not insist, `forced`
    /// are effects that it holds whether the scene calls for them or not.
    ///
    /// # Errors
    /// A sentence where no kernel supports what is asked for, and what would do.
    pub fn choose(
        features: &Features,
        forced: Effects,
        settings: &Settings,
        machine: Machine,
    ) -> Result<Self, Refusal> {
        let Settings {
            estimator,
            lanes,
            accel,
            cull,
            lights,
            ..
        } = *settings;
        let (intersector, why) = Intersector::choose(features.shapes, accel, cull);
        let accel = intersector.accel;
        let (lanes, note) = machine.lanes(accel, lanes)?;
        let together = match accel {
            AccelKind::Embree if !machine.embree.has(lanes.count()) => 1,
            _ => lanes.count(),
        };
        let why = note.into_iter().fold(why, |why, note| format!("{why}; {note}"));
        let needs = features.effects().union(forced);
        let lists = lights
            .list_of(features.emitters)
            .filter(|_| !features.nothing_in_sight());
        let pairs =
            2 + if let (true, Some(length)) = (estimator.per_light(), lists) {
                length + features.unlisted() as u32
            } else if estimator.per_light() {
                features.lights() as u32
            } else {
                0
            } + u32::from(needs.has(Effect::Lens));
        let order = if lists.is_some() && estimator.per_light() {
            Order::Lists
        } else if accel == AccelKind::Embree && features.shapes >= NEIGHBOURS {
            Order::Neighbours
        } else {
            Order::Passes
        };
        // Sixteen lanes say so by themselves.
        let set = if lanes == Lanes::Eight && machine.avx512 {
            "-avx512"
        } else {
            ""
        };
        let name = format!("{}-f32x{lanes}{set}-{}", accel.name(), estimator.name());
        if features.nothing_in_sight() {
            return Ok(Self {
                name: format!("{name}-blank"),
                why: "no eye ray can meet anything".to_owned(),
                intersector,
                lanes,
                together,
                pairs,
                order,
                eye: kernels::blank().run(lanes),
                shade: Vec::new(),
                find_penumbrae: None,
                answers: Answers::of(accel, lanes),
                mix: Mix::default(),
                lists: None,
                held: Effects::default(),
            });
        }
        let (in_camera, eye) = kernels::camera(needs);
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
            eye: eye.run(accel, lanes),
            shade: models
                .iter()
                .flat_map(|&model| kernels::shade(estimator, needs, lists.is_some(), model))
                .map(|row| row.run(lanes))
                .collect(),
            // With more shapes rays are dear: on `knot` second directions save 5 % of the error.
            find_penumbrae: kernels::find_penumbrae(estimator, needs)
                .filter(|_| lists.is_none())
                .filter(|_| features.shapes <= IN_LINE)
                .map(|row| row.run(lanes)),
            answers: Answers::of(accel, lanes),
            mix: kernels::mix(estimator),
            lists,
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

#[cfg(test)]
mod tests {
    use super::*;

    fn machine(avx512: bool, eight: bool, sixteen: bool) -> Machine {
        Machine {
            avx512,
            embree: Packets { eight, sixteen },
        }
    }

    /// A width that whoever answers rays has, on every kind of machine; `isa=avx2` leaves Embree packets of eight, `isa=sse2` none.
    #[test]
    fn the_plan_takes_a_width_that_is_there() {
        let (embree, line) = (AccelKind::Embree, AccelKind::Linear);
        for (machine, accel, lanes) in [
            (machine(true, true, true), embree, Lanes::Sixteen),
            (machine(true, true, false), embree, Lanes::Eight),
            (machine(true, false, false), embree, Lanes::Eight),
            (machine(false, true, false), embree, Lanes::Eight),
            // Embree has its sixteen where the processor does, whatever `OCTOLUX_AVX512` says.
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
