//! Which kernel a scene gets, and why.

use std::sync::LazyLock;

use super::rows::{self, Run};
use super::stage::grid::Order;
use crate::embree::{Device, Packets};
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

/// The widest packets that can be asked for whoever answers rays: 16 where the processor has AVX-512 and Embree has
/// packets of 16, else 8.
pub fn widest_lanes() -> usize {
    static EMBREE: LazyLock<bool> = LazyLock::new(|| Device::new(1).is_ok_and(|device| device.packets().sixteen));
    if has_avx512() && *EMBREE { 16 } else { 8 }
}

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

    /// The lanes of a kernel, and where a choice needs a word, why; `asked` is what the user insists on, or 0.
    ///
    /// Sixteen lanes need Embree's packets of sixteen: without them Embree takes each ray alone, and AVX-512 gains less than
    /// it costs. Eight lanes are taken without packets of eight too. Embree then needs as long as with one lane, but all else
    /// is done eight at a time.
    fn lanes(self, accel: AccelKind, asked: usize) -> Result<(usize, Option<String>), (String, &'static str)> {
        let packets = match accel {
            AccelKind::Embree => self.embree,
            AccelKind::Linear => Packets {
                eight: true,
                sixteen: true,
            },
        };
        let widest = if self.avx512 && packets.sixteen { 16 } else { 8 };
        match asked {
            16 if !self.avx512 => return Err(("16 lanes need a processor with AVX-512".to_owned(), "use --lanes 8")),
            16 if !packets.sixteen => {
                let what = "16 lanes need packets of 16 rays, which this Embree does not have".to_owned();
                return Err((
                    what,
                    "use --lanes 8 or --accel linear, or see whether .embree4 sets another isa",
                ));
            }
            0 | 1 | 8 | 16 => {}
            other => return Err((format!("there is no kernel of {other} lanes"), "use --lanes 1, 8 or 16")),
        }
        let lanes = if asked == 0 { widest } else { asked };
        let why = if !packets.has(lanes) {
            Some(format!(
                "this Embree has no packets of {lanes} rays and takes each ray alone"
            ))
        } else if asked == 0 && lanes < 16 && self.avx512 {
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
    /// Who answers rays.
    pub accel: AccelKind,
    /// Rays a packet.
    pub lanes: usize,
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
    /// Which directions are drawn for each light and how they are weighed.
    pub mix: Mix,
    /// What the stages hold: at least what the scene calls for.
    pub held: Effects,
}

impl Plan {
    /// The kernel for a scene with `features`; `lanes` (if it is not 0) and `accel` are what the user insists on, `forced` are
    /// effects that it holds whether the scene calls for them or not.
    ///
    /// # Errors
    /// A sentence where no kernel supports what is asked for, and what would do.
    pub fn choose(
        features: &Features,
        forced: Effects,
        estimator: EstimatorKind,
        lanes: usize,
        accel: Option<AccelKind>,
        machine: Machine,
    ) -> Result<Self, (String, &'static str)> {
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
        let (lanes, note) = machine.lanes(accel, lanes)?;
        let together = match accel {
            AccelKind::Embree if !machine.embree.has(lanes) => 1,
            _ => lanes,
        };
        let why = note.into_iter().fold(why, |why, note| format!("{why}; {note}"));
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
        let set = if lanes == 8 && machine.avx512 { "-avx512" } else { "" };
        let name = format!("{}-f32x{lanes}{set}-{}", accel.name(), estimator.name());
        if features.nothing_in_sight() {
            return Ok(Self {
                name: format!("{name}-blank"),
                why: "no eye ray can meet anything".to_owned(),
                accel,
                lanes,
                together,
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
            lanes,
            together,
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
            (machine(true, true, true), embree, 16),
            (machine(true, true, false), embree, 8),
            (machine(true, false, false), embree, 8),
            (machine(false, true, false), embree, 8),
            // Embree has its sixteen where the processor does, whatever `OCTOLUX_AVX512` says.
            (machine(false, true, true), embree, 8),
            (machine(true, true, false), line, 16),
            (machine(true, false, false), line, 16),
            (machine(false, true, true), line, 8),
        ] {
            assert_eq!(
                machine.lanes(accel, 0).unwrap().0,
                lanes,
                "{machine:?} {}",
                accel.name()
            );
        }
    }

    #[test]
    fn sixteen_lanes_are_refused_where_somebody_has_none() {
        let refused = |machine: Machine, accel| machine.lanes(accel, 16).unwrap_err();
        let (what, _) = refused(machine(false, true, true), AccelKind::Linear);
        assert!(what.contains("AVX-512"), "{what}");
        let (what, remedy) = refused(machine(true, true, false), AccelKind::Embree);
        assert!(
            what.contains("Embree") && remedy.contains("--lanes 8"),
            "{what}: {remedy}"
        );
        assert!(machine(true, true, false).lanes(AccelKind::Linear, 16).is_ok());
        assert!(machine(true, true, true).lanes(AccelKind::Embree, 3).is_err());
    }

    #[test]
    fn the_plan_says_that_embree_takes_rays_one_by_one() {
        let (lanes, why) = machine(true, false, false).lanes(AccelKind::Embree, 8).unwrap();
        assert_eq!(lanes, 8);
        assert!(why.unwrap().contains("each ray alone"));
        assert_eq!(
            machine(true, true, false).lanes(AccelKind::Embree, 8).unwrap(),
            (8, None)
        );
        assert_eq!(
            machine(true, false, false).lanes(AccelKind::Embree, 1).unwrap(),
            (1, None)
        );
        assert_eq!(
            machine(true, false, false).lanes(AccelKind::Linear, 8).unwrap(),
            (8, None)
        );
    }
}
