//! Code broken on purpose: what the proof must reject, or it proves little.
//!
//! `mutate!(plain, Name => broken)` is `plain`. Only in the crate's own tests, and only in a process that
//! `OCTOLUX_MUTANT=Name` was given to, it is `broken`. The test below starts such a process for every mutant and asks whether
//! the check of `tests/proof` that is meant for it rejects it; the checks are those of the proof itself with less effort.
//!
//! | mutant | what is broken | the check that must catch it |
//! | --- | --- | --- |
//! | `MissingCosine` | a Phong lobe without the foreshortening of its surface | weight |
//! | `DoubledDensity` | cones that say they are half as large | weight |
//! | `MixtureWithoutHalf` | the mixture's density as the sum of two, not their average | weight |
//! | `HeuristicTurned` | the power heuristic gives each technique the weight of the other | weight |
//! | `HorizonArcForgotten` | of a light that sets, the part under the arc of the horizon is forgotten | weight |
//! | `HemisphereForSphere` | `uniform` weighed as if it drew from a hemisphere | weight |
//! | `HorizonDropped` | directions below the surface count (in a picture the surface blocks them) | weight |
//! | `FlippedMask` | BRDF directions count where they miss the light | density |
//! | `AlwaysHeads` | the mixture never draws from the cone | density |
//! | `ReachTooShort` | lobes are taken for dark where they are 1e-26 of their peak | weight |
//! | `RimForgotten` | a light is dropped when its centre sets, not its rim | density |
//! | `ConeTowardsTheAxis` | cones denser towards their axis | density |
//! | `WrongNormalisation` | lobes normalised by alpha + 2 | density |
//! | `ArcUniformInItsLength` | triangles denser towards a corner | density |
//! | `PairReused` | all pairs of a sample are one Sobol sequence | numbers |
//! | `SharedKey` | all pixels have the same numbers | numbers |
//! | `OppositeForgotten` | triangles with corners at opposite sides are sampled like any others | large plates |
//! | `HalfTheTriangle` | triangles of half their solid angle | closed form |
//! | `SharesAlike` | the triangles of a mesh weighed as if each were picked as often | closed form |
//! | `ShadowingForgotten` | rough surfaces that are masked towards the eye and not shadowed towards the light | ggx |
//! | `HalfVectorForDirection` | the density of half vectors for that of directions | ggx |
//! | `LightTwice` | the first light counts twice | closed form |
//! | `LightBlocksItself` | a light is not left out of its own shadow test | closed form |
//! | `OffsetDropped` | shading points stay on their surface | closed form |
//! | `NormalNotFaced` | a smooth normal is not turned to the eye's side | closed form |
//! | `LastLightOnly` | `uniform` and `brdf` ask for the last light alone | closed form |
//! | `BarycentricsLost` | Embree's hits without barycentric coordinates | accelerators |
//! | `CornersSwapped` | smooth normals with two corners of the triangle exchanged | oracle |
//! | `ShadowsSkipped` | nothing blocks any light | exact |
//! | `OnePassOff` | means are divided by one pass too many | exact |
//! | `LaneShift` | a packet's contributions belong to the next lane's rays | lanes |
//! | `StaleTail` | behind the tail of a stream, old points count | lanes |
//! | `OneCornerBehind` | a triangle is culled when one corner is out of sight | accelerators |
//! | `OneCornerOutside` | a triangle is culled when one corner of the tile is beyond an edge | accelerators |
//! | `BallsAsPoints` | a ball is culled when its centre is out of sight | accelerators |
//! | `LightAsPoint` | a triangle is culled when the middle of the light is on the points' side of it | accelerators |
//! | `ArcTakenAsPi` | the whole ring is drawn, not its arc inside the light | rings |
//! | `FarRingForgotten` | the lobe's share beyond the light's farthest ring is drawn too | rings |
//! | `MassBetweenRingsForgotten` | a lobe's share is counted up to its edge, not to the farthest ring | rings |
//! | `ExpectedOnceEach` | a light of a list counts as if it were in every list | lists |
//! | `WayDownForgotten` | the chance of a light inside of its cluster is left out of what it is divided by | lists |
//! | `BothHalvesWhole` | each of the two directions to a light that is seen in part counts as one | oracle |
//! | `OffsetTooShort` | shading points leave their surface by 2 half-ulps | acne |
//! | `DensityOfTheNextTexel` | a texel of the environment with the density of its neighbour | density |
//! | `SquareForgotten` | points and spots shine as brightly however far away they are | closed form |
//! | `FalloffForgotten` | spots shine in all directions | closed form |
//! | `OnePercentBright` | a study measures `independent` 1 % too bright | study |
//! | `ErrorOfOneReplicate` | the error of a mean as that of one of its replicates | target |
//! | `HalfDecidesForItself` | a half of the replicates of `--target-error` ends when its own pictures look calm | target |
//!
//! "density" is the chi-square of directions against densities, "weight" the samples written out again in `f64`,
//! "lists" short lists of lights against all lights,
//! "rings" lobes inside lights against quadrature, "ggx" directions and samples of rough surfaces,
//! "numbers" the independence of random numbers, "closed form" and "exact" are the scenes of `scenes/tests`, "oracle" the
//! agreement of estimators and oracle, "lanes" the bits of eight lanes and one, "accelerators" the line of shapes against
//! Embree, "acne" the surfaces that shadow themselves, "large plates" lights far larger than they are away, "study" its search
//! for biased settings, "target" the error that `--target-error` sees. Most mutants fail several; of the 36 first ones without
//! `OneCornerOutside` nine are seen by one alone: `HorizonDropped`, `ReachTooShort`, `DensityOfTheNextTexel`, `PairReused`,
//! `SharesAlike`, `CornersSwapped`, `LightAsPoint`, `OnePercentBright` and `ErrorOfOneReplicate`.

/// The plain expression; in a test of mutants, the broken one beside it.
#[cfg(not(test))]
macro_rules! mutate {
    ($plain:expr, $name:ident => $broken:expr) => {
        $plain
    };
}

#[cfg(test)]
macro_rules! mutate {
    ($plain:expr, $name:ident => $broken:expr) => {
        if $crate::mutant::is($crate::mutant::Mutant::$name) {
            $broken
        } else {
            $plain
        }
    };
}

#[cfg(test)]
pub(crate) use tests::{Mutant, is};

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
    use std::process::Command;
    use std::sync::LazyLock;

    use octolux::estimator::density::{Average, ConeOnly};
    use octolux::lane::F32x8;
    use octolux::pipeline::Settings;
    use octolux::proof::{
        self, Family, accelerators, agreement, caps, closed_forms, costs, environments, ggx, many_lights, pictures,
        rings, samplers, strategies, triangles, weights,
    };
    use octolux::scene::{EstimatorKind, FilmSize, SamplerKind};
    use octolux::settings::AccelKind;
    use octolux::study::selftest::{Effort, panels, places};

    const VARIABLE: &str = "OCTOLUX_MUTANT";

    /// The name of the one check that a process makes; without it, it makes all.
    const ONLY: &str = "OCTOLUX_MUTANT_CHECK";

    macro_rules! mutants {
        ($($name:ident $check:literal,)*) => {
            /// Which code is broken.
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub(crate) enum Mutant { $($name,)* }
            /// Each with the check that must catch it.
            const MUTANTS: &[(Mutant, &str)] = &[$((Mutant::$name, $check),)*];
        };
    }

    mutants! {
        MissingCosine "weight",
        DoubledDensity "weight",
        MixtureWithoutHalf "weight",
        HeuristicTurned "weight",
        HorizonArcForgotten "weight",
        HemisphereForSphere "weight",
        HorizonDropped "weight",
        FlippedMask "density",
        AlwaysHeads "density",
        ReachTooShort "weight",
        RimForgotten "density",
        ConeTowardsTheAxis "density",
        WrongNormalisation "density",
        ArcUniformInItsLength "density",
        DensityOfTheNextTexel "density",
        PairReused "numbers",
        SharedKey "numbers",
        HalfTheTriangle "closed form",
        SharesAlike "closed form",
        ShadowingForgotten "ggx",
        HalfVectorForDirection "ggx",
        LightTwice "closed form",
        LightBlocksItself "closed form",
        OffsetDropped "closed form",
        NormalNotFaced "closed form",
        LastLightOnly "closed form",
        CornersSwapped "oracle",
        BarycentricsLost "accelerators",
        ArcTakenAsPi "rings",
        FarRingForgotten "rings",
        BothHalvesWhole "oracle",
        MassBetweenRingsForgotten "rings",
        ShadowsSkipped "exact",
        OnePassOff "exact",
        LaneShift "lanes",
        StaleTail "lanes",
        OneCornerBehind "accelerators",
        OneCornerOutside "accelerators",
        BallsAsPoints "accelerators",
        LightAsPoint "accelerators",
        ExpectedOnceEach "lists",
        WayDownForgotten "lists",
        OffsetTooShort "acne",
        OppositeForgotten "large plates",
        SquareForgotten "closed form",
        FalloffForgotten "closed form",
        OnePercentBright "study",
        ErrorOfOneReplicate "target",
        HalfDecidesForItself "target",
    }

    /// Whether this process is one of that mutant.
    #[inline]
    pub(crate) fn is(mutant: Mutant) -> bool {
        static ACTIVE: LazyLock<Option<Mutant>> = LazyLock::new(|| {
            let name = std::env::var(VARIABLE).ok()?;
            let known = MUTANTS.iter().find(|(mutant, _)| format!("{mutant:?}") == name);
            Some(
                known
                    .unwrap_or_else(|| panic!("{VARIABLE}: no mutant is called {name}"))
                    .0,
            )
        });
        *ACTIVE == Some(mutant)
    }

    /// The checks of the proof, at an effort of a second together.
    const CHECKS: [(&str, fn()); 15] = [
        ("density", density),
        ("weight", weight),
        ("rings", rings::both),
        ("ggx", rough),
        ("numbers", || samplers::numbers_of_a_sample(1 << 13)),
        ("closed form", closed_form),
        ("exact", closed_forms::noise_free_scenes),
        ("oracle", oracle),
        ("lanes", lanes),
        ("accelerators", accelerators_agree),
        ("acne", acne),
        ("lists", || {
            many_lights::agree(Family::new("lists"), (500, 40), 4, 16, 4)
        }),
        ("large plates", large_plates),
        ("study", costs::nothing_is_harmful),
        ("target", target_error),
    ];

    fn target_error() {
        costs::target_errors_are_those_of_the_mean();
        crate::run::halves::tests::pictures_are_not_too_dark();
    }

    fn density() {
        const LIGHTS: [proof::places::Place; 5] = [
            (0.1, 1.5, 0.3, 0.0),
            (0.5, 1.0, 0.0, 1.3),
            (0.5, 1.0, 0.0, 1.8),
            (0.5, 30.0, 0.3, 0.0),
            (0.01, 1.0, 0.0, 1.5608),
        ];
        let mut family = Family::new("density");
        strategies::lobes::<F32x8>(&mut family, &[1.0, 1.5, 300.0], 1 << 14);
        strategies::mixtures::<F32x8, _>(Average, &mut family, &LIGHTS, 1, 1 << 14);
        strategies::mixtures::<F32x8, _>(ConeOnly, &mut family, &LIGHTS, 2, 1 << 14);
        triangles::directions::<F32x8>(&mut family, 3, 1 << 12);
        environments::directions::<F32x8>(&mut family, 4, 1 << 12);
        family.judge();
    }

    fn weight() {
        weights::samples_of_lights();
        caps::every_sample_is_the_answer();
        weights::samples_of_points();
        weights::nothing_is_dropped();
    }

    fn rough() {
        let mut family = Family::new("ggx");
        ggx::directions::<F32x8>(&mut family, &[0.01, 0.5], 1 << 14);
        family.judge();
        ggx::every_sample_is_the_answer();
    }

    fn accelerators_agree() {
        accelerators::random_scenes("random", &[2.0], 6, 1);
        accelerators::a_lamp_through_a_table();
        let normals = proof::runs::leaning_normals();
        let base = proof::runs::settings(12, 9, EstimatorKind::Light);
        let (count, files) = accelerators::compare(&normals, base, 4, "leaning-normals");
        assert_eq!(count, 0, "normals that lean: {}", files.join(", "));
    }

    fn closed_form() {
        closed_forms::test_scenes(
            "closed-form",
            (SamplerKind::Sobol, AccelKind::Embree),
            10,
            |scene, estimator| {
                let tiny = matches!(scene.name(), "sphere-tiny" | "square-tiny" | "sun-narrow");
                let hopeless = tiny && matches!(estimator, EstimatorKind::Uniform | EstimatorKind::Brdf);
                (!hopeless).then_some(64)
            },
        );
    }

    fn acne() {
        let lost = ["mesh", "far floor"].map(|name| {
            places::moved_about(name, &[-6, 0, 5], &[0.0, 1.0, 10.0], Effort { divisor: 2 }).expect("it renders")
        });
        assert_eq!(lost, [0, 0]);
    }

    fn large_plates() {
        let sigmas = panels::large(Effort { divisor: 32 }).expect("they render");
        assert!(sigmas < 5.5, "{sigmas}");
    }

    fn oracle() {
        let film = FilmSize { width: 12, height: 9 };
        agreement::agree(
            &proof::runs::leaning_normals(),
            "oracle-normals",
            film,
            10,
            [64, 16, 64, 16],
            256,
        );
        agreement::agree(
            &proof::runs::load("large-lights.toml"),
            "oracle",
            film,
            10,
            [256, 64, 128, 64],
            256,
        );
    }

    fn lanes() {
        for name in ["tests/two-lights.toml", "large-lights.toml"] {
            let scene = proof::runs::load(name);
            for estimator in EstimatorKind::ALL {
                for (width, height) in [(1, 7), (9, 1), (17, 18)] {
                    let eight = proof::runs::settings(width, height, estimator);
                    pictures::both(
                        &scene,
                        eight,
                        Settings {
                            lanes: Some(crate::settings::Lanes::One),
                            ..eight
                        },
                        5,
                        &format!("{width}x{height}"),
                    );
                }
            }
        }
    }

    /// Also what a mutant's process runs; it then says by name which checks failed.
    #[test]
    fn unbroken_code_passes_every_check() {
        let hook = take_hook();
        let (mutant, only) = (std::env::var(VARIABLE), std::env::var(ONLY));
        if mutant.is_ok() {
            set_hook(Box::new(|_| ())); // dozens of expected failures
        }
        let failed: Vec<&str> = CHECKS
            .iter()
            .filter(|(name, _)| !only.as_ref().is_ok_and(|only| only != name))
            .filter(|(_, check)| catch_unwind(AssertUnwindSafe(check)).is_err())
            .map(|(name, _)| *name)
            .collect();
        set_hook(hook);
        println!("\ncaught by: {}", failed.join(", "));
        assert!(failed.is_empty(), "{mutant:?} fails {failed:?}");
    }

    /// Only the check meant for a mutant is made: that the others see it too is no part of the claim, and eleven times the work.
    #[test]
    fn every_mutant_is_rejected_by_the_check_meant_for_it() {
        try_mutants(true);
    }

    /// `cargo test --release --lib which_checks -- --ignored` writes the table of who catches what.
    #[test]
    #[ignore = "makes every check of every mutant; the suite makes the one meant for it"]
    fn which_checks_reject_which_mutant() {
        try_mutants(false);
    }

    /// Starts a process for every mutant, which makes the check meant for it or all checks.
    fn try_mutants(only_its_own: bool) {
        let (mut faults, mut table) = (vec![], String::new());
        // Two at a time.
        for some in MUTANTS.chunks(2) {
            let running: Vec<_> = some
                .iter()
                .map(|(mutant, check)| {
                    let mut process = Command::new(std::env::current_exe().expect("this program has a path"));
                    process.args([
                        "--exact",
                        "mutant::tests::unbroken_code_passes_every_check",
                        "--nocapture",
                    ]);
                    if only_its_own {
                        process.env(ONLY, check);
                    }
                    process
                        .env(VARIABLE, format!("{mutant:?}"))
                        .stdout(std::process::Stdio::piped());
                    process
                        .stderr(std::process::Stdio::piped())
                        .spawn()
                        .expect("this program can start itself")
                })
                .collect();
            for ((mutant, check), process) in some.iter().zip(running) {
                let output = process.wait_with_output().expect("a process ends");
                let said = String::from_utf8_lossy(&output.stdout).into_owned();
                let caught = said.lines().find_map(|line| line.strip_prefix("caught by: "));
                table += &format!("{mutant:?}: {}\n", caught.unwrap_or("no answer"));
                if !caught.is_some_and(|checks| checks.split(", ").any(|c| c == *check)) {
                    faults.push(format!("{mutant:?}: not by {check:?}, but {caught:?}"));
                }
            }
        }
        let path = proof::artefact("mutants.txt");
        std::fs::write(&path, &table).expect("a table can be written");
        assert!(
            faults.is_empty(),
            "{}\nall in {}:\n{table}",
            faults.join("\n"),
            path.display()
        );
    }
}
