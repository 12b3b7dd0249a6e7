//! Pictures that must be the same to the last bit.

use super::bench::{Bench, Cost};
use super::error::VerifyError;
use super::row::{Evidence, Row, Verdict};
use crate::film::Picture;
use crate::pipeline::{Settings, widest_lanes};
use crate::scene::{EstimatorKind, SamplerKind};
use crate::settings::Lanes;

/// Passes of each picture; the last look of the longest.
const PASSES: u32 = 4;

/// A scalar kernel costs about so many packet kernels.
const SCALAR: f64 = 6.0;

/// One, eight and, where the processor has them, sixteen lanes; one, two and three threads; short and long renders. Spends about `seconds`.
///
/// # Errors
/// As [`Bench::render`].
pub fn check(bench: &mut Bench<'_>, costs: &[Cost], seconds: f64) -> Result<Vec<Row>, VerifyError> {
    let film = bench.film(pixels(bench, costs, seconds));
    let mut rows = Vec::new();
    for cost in costs {
        let (mut lanes, mut threads) = (Tally::default(), Tally::default());
        for sampler in SamplerKind::ALL {
            bench.announce(&format!("bits of {}", cost.estimator.name()))?;
            let base = Settings {
                film,
                estimator: cost.estimator,
                sampler,
                lanes: Some(Lanes::Eight),
                threads: 1,
                ..bench.settings
            };
            let expected = one(bench, base, PASSES)?;
            let scalar = one(
                bench,
                Settings {
                    lanes: Some(Lanes::One),
                    ..base
                },
                PASSES,
            )?;
            lanes.compare(&expected, &scalar, "lanes8", "lanes1");
            if widest_lanes() > Lanes::Eight {
                let widest = one(
                    bench,
                    Settings {
                        lanes: Some(widest_lanes()),
                        ..base
                    },
                    PASSES,
                )?;
                lanes.compare(&expected, &widest, "lanes8", "lanes16");
            }
            for (count, name) in [(2, "threads2"), (3, "threads3")] {
                let other = one(bench, Settings { threads: count, ..base }, PASSES)?;
                threads.compare(&expected, &other, "threads1", name);
            }
        }
        let name = cost.estimator.name();
        let widths = if widest_lanes() > Lanes::Eight {
            "1, 8, 16"
        } else {
            "1 and 8"
        };
        rows.push(lanes.row("lanes", format!("{name}: {widths}, both samplers"), name));
        rows.push(threads.row("threads", format!("{name}: 1, 2, 3, both samplers"), name));
    }
    rows.push(looks(bench, film, costs)?);
    rows.sort_by_key(|row| {
        ["lanes", "threads", "looks"]
            .iter()
            .position(|&check| check == row.check)
    });
    Ok(rows)
}

/// A render that is looked at on its way, against renders that end there.
fn looks(bench: &mut Bench<'_>, film: crate::scene::FilmSize, costs: &[Cost]) -> Result<Row, VerifyError> {
    let estimator = costs.last().map_or(EstimatorKind::Mis, |cost| cost.estimator);
    let mut tally = Tally::default();
    for sampler in SamplerKind::ALL {
        bench.announce("looks on the way")?;
        let settings = Settings {
            film,
            estimator,
            sampler,
            ..bench.settings
        };
        let stops = [1, 2, PASSES, 2 * PASSES];
        let watched = bench.render(settings, &stops)?;
        for (picture, passes) in watched.iter().zip(stops).skip(1) {
            let unwatched = one(bench, settings, passes)?;
            tally.compare(picture, &unwatched, "watched", "unwatched");
        }
    }
    Ok(tally.row("looks", format!("{}: at 2, 4, 8 passes", estimator.name()), "looks"))
}

fn one(bench: &mut Bench<'_>, settings: Settings, passes: u32) -> Result<Picture, VerifyError> {
    let mut pictures = bench.render(settings, &[passes])?;
    Ok(pictures.remove(0))
}

/// As many pixels as the time allows. One thread does what `threads` did when the costs were measured.
fn pixels(bench: &Bench<'_>, costs: &[Cost], seconds: f64) -> f64 {
    let threads = bench.settings.threads as f64;
    let setups: f64 = costs.iter().map(|cost| 8.0 * cost.setup_s).sum();
    let pass: f64 = costs
        .iter()
        .map(|cost| 2.0 * (SCALAR + 3.0) * threads * cost.sample_s)
        .sum();
    ((seconds - setups) / (pass * f64::from(PASSES))).clamp(400.0, 40_000.0)
}

/// Values that differ.
#[derive(Default)]
struct Tally {
    different: u64,
    values: u64,
    evidence: Option<([&'static str; 2], Picture, Picture)>,
}

impl Tally {
    fn compare(&mut self, a: &Picture, b: &Picture, name_a: &'static str, name_b: &'static str) {
        let pairs = a.pixels.as_flattened().iter().zip(b.pixels.as_flattened());
        let different = pairs.filter(|(a, b)| a.to_bits() != b.to_bits()).count() as u64;
        self.values += a.pixels.as_flattened().len() as u64;
        self.different += different;
        if different > 0 && self.evidence.is_none() {
            self.evidence = Some(([name_a, name_b], a.clone(), b.clone()));
        }
    }

    fn row(self, check: &'static str, compared: String, prefix: &str) -> Row {
        let row = Row::pass(check, compared)
            .figures(format!("{} of {} differ", self.different, self.values), "0")
            .number("different", self.different as f64)
            .number("values", self.values as f64);
        let Some((names, a, b)) = self.evidence else {
            return row;
        };
        let mut row = row.judged(
            Verdict::Fail,
            "these pictures have to be the same bits; this is a fault of Octolux",
        );
        row.evidence = Some(Evidence::of_bits(&a, &b, names.map(|name| format!("{prefix}-{name}"))));
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_is_found() {
        let a = Picture {
            width: 2,
            height: 1,
            pixels: vec![[0.0, 1.0, 2.0]; 2],
        };
        let mut b = a.clone();
        let mut tally = Tally::default();
        tally.compare(&a, &b, "a", "b");
        assert_eq!((tally.different, tally.values), (0, 6));
        b.pixels[1][0] = -0.0;
        tally.compare(&a, &b, "a", "b");
        let row = tally.row("lanes", "x".into(), "mis");
        assert_eq!((row.verdict, row.figure.as_str()), (Verdict::Fail, "1 of 12 differ"));
        assert_eq!(row.evidence.unwrap().names, ["mis-a", "mis-b"]);
    }
}
