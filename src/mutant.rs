//! Mutants: deliberately broken code that the proof must reject.
//!
//! `mutate!(plain, Name => broken)` is `plain`, except in the crate's own tests in a process with `OCTOLUX_MUTANT=Name`. The test
//! below starts such a process for every mutant and requires that the check of `tests/proof` meant for it fails.
//!
//! | mutant | what is broken | the check that must catch it |
//! | --- | --- | --- |
//! | `MissingCosine` | a Phong lobe without the cosine of its surface | weight |
//! | `DoubledDensity` | cones that report half their solid angle | weight |
//! | `MixtureWithoutHalf` | the mixture's density is the sum of two, not their average | weight |
//! | `HeuristicTurned` | the power heuristic swaps the weights of the techniques | weight |
//! | `HorizonArcForgotten` | a light partly below the horizon is sampled without the fan to the horizon's arc | weight |
//! | `HemisphereForSphere` | `uniform` weighted as if it sampled a hemisphere | weight |
//! | `HorizonDropped` | directions below the surface contribute (in a picture the surface occludes them) | weight |
//! | `FlippedMask` | BRDF directions contribute where they miss the light | density |
//! | `AlwaysHeads` | the mixture never samples the cone | density |
//! | `ReachTooShort` | lobes are cut off at 1e-26 of their peak | weight |
//! | `RimForgotten` | a light is dropped when its centre is below the horizon, not its whole sphere | density |
//! | `ConeTowardsTheAxis` | cones denser towards their axis | density |
//! | `WrongNormalisation` | lobes normalised by alpha + 2 | density |
//! | `ArcUniformInItsLength` | triangles denser towards a corner | density |
//! | `PairReused` | all pairs of dimensions of a sample use one Sobol sequence | numbers |
//! | `SharedKey` | all pixels have the same numbers | numbers |
//! | `OppositeForgotten` | triangles with corners in opposite directions are sampled like all others | large plates |
//! | `HalfTheTriangle` | triangles with half their solid angle | closed form |
//! | `SharesAlike` | the triangles of a mesh weighted as if all had the same probability | closed form |
//! | `ShadowingForgotten` | rough surfaces with masking but without shadowing | ggx |
//! | `HalfVectorForDirection` | the density of half vectors instead of that of directions | ggx |
//! | `LightTwice` | the first light is counted twice | closed form |
//! | `LightBlocksItself` | shadow rays do not skip their own light | closed form |
//! | `OffsetDropped` | shading points are not offset from their surface | closed form |
//! | `NormalNotFaced` | a smooth normal is not flipped to the viewer's side | closed form |
//! | `LastLightOnly` | `uniform` and `brdf` only test the last light | closed form |
//! | `BarycentricsLost` | Embree's hits without barycentric coordinates | accelerators |
//! | `CornersSwapped` | smooth normals with two corners of the triangle swapped | oracle |
//! | `ShadowsSkipped` | no light is ever occluded | exact |
//! | `OnePassOff` | means are divided by one pass too many | exact |
//! | `LaneShift` | a packet adds contributions to the next lane's rays | lanes |
//! | `StaleTail` | beyond the end of a stream, old points contribute | lanes |
//! | `OneCornerBehind` | a triangle is culled when one corner is out of view | accelerators |
//! | `OneCornerOutside` | a triangle is culled when one corner of the tile is outside an edge | accelerators |
//! | `BallsAsPoints` | a sphere is culled when its centre is out of view | accelerators |
//! | `LightAsPoint` | a triangle is culled when the centre of the light is on the points' side of it | accelerators |
//! | `ArcTakenAsPi` | the whole ring is sampled, not its arc inside the light | rings |
//! | `FarRingForgotten` | the lobe's part beyond the light's farthest ring is sampled too | rings |
//! | `MassBetweenRingsForgotten` | a lobe's part is counted up to its edge, not to the farthest ring | rings |
//! | `DiskWithoutItsSlant` | the disk of a light counts as if it was overhead | weight |
//! | `DiskDenserInTheMiddle` | directions to a light's disk denser towards its axis | density |
//! | `OpenLightOverhead` | a light that nothing can block counts as if it was overhead | oracle |
//! | `OpenLightNeverSets` | a light that nothing can block counts as if all of it was above every point's horizon | closed form |
//! | `SecondForAll` | every point has a second direction, those that see a light wholly with full weight | oracle |
//! | `RouletteWeightForgotten` | one sample in 256 of a lobe's tail, with the weight of one | rings |
//! | `TailAlwaysTaken` | all samples of a lobe's tail, with the weight of 256 | rings |
//! | `StageTakesAllTails` | the same in the stage of a render alone | tails |
//! | `ExpectedOnceEach` | a light of a list is weighted as if it were in every list | lists |
//! | `WayDownForgotten` | the probability of a light within its cluster is missing from its density | lists |
//! | `DeltaInEveryList` | a point or spot of a list is weighted as if it were in every list | lists of lamps |
//! | `WalkForgotten` | a light that a point finds by itself is weighted as if every light had the same probability | walks |
//! | `ColorsShareLists` | the two colors of a tile have the same lists | separate lists |
//! | `GroupsShareLists` | the pixels of one color of a tile have one list | separate lists |
//! | `PassesShareLists` | every pass has the list of the first | separate lists |
//! | `BothHalvesWhole` | each of the two directions to a partly occluded light has full weight | oracle |
//! | `OffsetTooShort` | shading points are offset by only 2 half-ulps | acne |
//! | `DensityOfTheNextTexel` | a texel of the environment with the density of its neighbour | density |
//! | `SquareForgotten` | points and spots without the falloff by squared distance | closed form |
//! | `FalloffForgotten` | spots emit in all directions | closed form |
//! | `OnePercentBright` | a study measures `independent` 1 % too bright | study |
//! | `ErrorOfOneReplicate` | the error of a mean is that of one of its replicates | target |
//! | `HalfDecidesForItself` | a half of the replicates of `--target-error` stops by its own pictures | target |
//!
//! The checks: "density" is the chi-square test of directions against densities, "weight" recomputes samples in `f64`, "lists", "lists of lamps" and "walks"
//! compare lists of lights and walks with all lights, "separate lists" their noise, "rings" lobes inside lights with quadrature, "tails" a picture of a lobe's tail, "ggx" tests
//! rough surfaces, "numbers" the independence of random numbers, "closed form" and "exact" are the scenes of `scenes/tests`,
//! "oracle" is the agreement of estimators and oracle, "lanes" compares the bits of eight lanes and one, "accelerators" brute force
//! and Embree, "acne" tests self-shadowing, "large plates" lights larger than their distance, "study" and "target" themselves.

/// The plain expression; in tests of mutants, the broken one if its mutant is active.
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
mod checks;

#[cfg(test)]
pub(crate) use tests::{Mutant, is};

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
    use std::process::Command;
    use std::sync::LazyLock;

    use octolux::proof;

    use super::checks::CHECKS;

    const VARIABLE: &str = "OCTOLUX_MUTANT";

    /// The environment variable with the one check to run; without it, all are run.
    const ONLY: &str = "OCTOLUX_MUTANT_CHECK";

    macro_rules! mutants {
        ($($name:ident $check:literal,)*) => {
            /// The mutants.
            #[derive(Clone, Copy, Debug, PartialEq, Eq)]
            pub(crate) enum Mutant { $($name,)* }
            /// Each mutant with the check that must catch it.
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
        DiskWithoutItsSlant "weight",
        DiskDenserInTheMiddle "density",
        OpenLightOverhead "oracle",
        OpenLightNeverSets "closed form",
        SecondForAll "oracle",
        RouletteWeightForgotten "rings",
        TailAlwaysTaken "rings",
        StageTakesAllTails "tails",
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
        DeltaInEveryList "lists of lamps",
        WalkForgotten "walks",
        ColorsShareLists "separate lists",
        GroupsShareLists "separate lists",
        PassesShareLists "separate lists",
        OffsetTooShort "acne",
        OppositeForgotten "large plates",
        SquareForgotten "closed form",
        FalloffForgotten "closed form",
        OnePercentBright "study",
        ErrorOfOneReplicate "target",
        HalfDecidesForItself "target",
    }

    /// Whether this process runs this mutant.
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

    /// Also what a mutant's process runs; it then prints the names of the failed checks.
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

    /// Only runs the check meant for each mutant: whether others catch it too is not claimed, and would take eleven times as
    /// long.
    #[test]
    fn every_mutant_is_rejected_by_the_check_meant_for_it() {
        try_mutants(true);
    }

    /// `cargo test --release --lib which_checks -- --ignored` prints which check catches which mutant.
    #[test]
    #[ignore = "runs every check on every mutant; the suite runs the one meant for it"]
    fn which_checks_reject_which_mutant() {
        try_mutants(false);
    }

    /// Starts a process for every mutant, which runs the check meant for it or all checks.
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
