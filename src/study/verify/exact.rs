//! Pictures that must agree bit by bit.

use super::bench::{Bench, Cost};
use super::error::VerifyError;
use super::row::{Evidence, Row, Verdict};
use super::ties::{self, Explained};
use crate::film::Picture;
use crate::pipeline::{Settings, widest_lanes};
use crate::scene::{Effect, Effects, EstimatorKind, Features, SamplerKind, Scene, Surface};
use crate::settings::{AccelKind, Lanes};

/// Passes of each picture, and the last look of the longest.
const PASSES: u32 = 4;

/// Cost of a scalar kernel relative to a packet kernel, roughly.
const SCALAR: f64 = 6.0;

/// Renders per estimator: by scalar kernels, and in total.
const SCALARS: f64 = 4.0;
const RENDERS: f64 = 20.0;

/// Maximum number of shapes for testing the brute-force intersector beside Embree: its time grows with their number.
const MOST_IN_LINE: usize = 2048;

/// Bitwise checks. Per estimator: all widths through both intersectors, the intersectors against each other, a kernel with
/// every effect, thread counts. Once: short against long renders. Takes about `seconds`.
///
/// # Errors
/// As [`Bench::render`].
pub fn check(bench: &mut Bench<'_>, costs: &[Cost], seconds: f64) -> Result<Vec<Row>, VerifyError> {
    let shapes = Features::of(bench.scene, bench.settings.film).shapes;
    let film = bench.film(pixels(bench, costs, seconds));
    let mut rows = Vec::new();
    for cost in costs {
        bench.announce(&format!("bits of {}", cost.estimator.name()))?;
        let base = Settings {
            film,
            estimator: cost.estimator,
            lanes: Some(Lanes::Eight),
            threads: 1,
            ..bench.settings
        };
        rows.extend(widths(bench, base, shapes)?);
        rows.push(threads(bench, base)?);
    }
    if shapes > MOST_IN_LINE {
        let what = format!("{shapes} shapes are too many to be tested one by one: only Embree was checked");
        rows.push(Row::pass("intersectors", "linear").judged(Verdict::Note, what));
    }
    rows.push(looks(bench, film, costs)?);
    let order = ["lanes", "intersectors", "kernels", "threads", "looks"];
    rows.sort_by_key(|row| order.iter().position(|&check| check == row.check));
    Ok(rows)
}

/// All packet widths, through both intersectors where brute force can take the scene, the intersectors against each other, and
/// a kernel with every effect.
///
/// # Errors
/// As [`Bench::render`].
pub fn widths(bench: &mut Bench<'_>, base: Settings, shapes: usize) -> Result<Vec<Row>, VerifyError> {
    let name = base.estimator.name();
    let (mut lanes, mut kernels) = (Tally::default(), Tally::default());
    let mut by_intersector = Vec::new();
    let possible = |accel: &AccelKind| *accel == AccelKind::Embree || shapes <= MOST_IN_LINE;
    for accel in AccelKind::ALL.into_iter().filter(possible) {
        for sampler in SamplerKind::ALL {
            let base = Settings {
                accel: Some(accel),
                sampler,
                ..base
            };
            let expected = Rendered::of(bench, base)?;
            for other in [Lanes::One, widest_lanes()].map(Some) {
                if other != base.lanes {
                    lanes.compare(&expected, &Rendered::of(bench, Settings { lanes: other, ..base })?);
                }
            }
            if sampler == SamplerKind::Sobol {
                let picture = bench.holding(base, Effects::of(&Effect::ALL), &[PASSES])?.remove(0);
                let every = Rendered {
                    what: "every-effect".to_owned(),
                    picture,
                    settings: base,
                };
                kernels.compare(&expected, &every);
                by_intersector.push(expected);
            }
        }
    }
    let numbers = if widest_lanes() > Lanes::Eight {
        "1, 8, 16"
    } else {
        "1 and 8"
    };
    let through = if by_intersector.len() > 1 {
        "both intersectors"
    } else {
        "Embree"
    };
    let mut rows = vec![
        lanes.row(bench, "lanes", format!("{name}: {numbers}, {through}, both samplers"))?,
        kernels.row(bench, "kernels", format!("{name}: with every effect, {through}"))?,
    ];
    if let [embree, line] = &by_intersector[..] {
        let mut tally = Tally {
            tolerance: tolerance(bench.scene),
            ..Tally::default()
        };
        tally.compare(embree, line);
        rows.push(tally.row(bench, "intersectors", format!("{name}: embree and linear"))?);
    }
    Ok(rows)
}

/// Relative difference allowed between pixels of the two intersectors, which round distances differently. Texels depend on
/// barycentric coordinates, whose last bits matter more the more often a texture repeats over a triangle.
fn tolerance(scene: &Scene) -> f64 {
    let texels = scene.meshes().iter().filter_map(|mesh| {
        let Surface::Material(material) = mesh.surface else {
            return None;
        };
        let (texture, uvs) = (scene.material(material).texture.as_ref()?, mesh.uvs.as_ref()?);
        let most = uvs.iter().map(|uv| uv.abs().max_element()).fold(0.0, f64::max);
        Some(most * f64::from(texture.width.max(texture.height)))
    });
    0.01 + texels.fold(0.0, f64::max) * TEXEL
}

/// Error of a barycentric coordinate: four roundings of 2⁻²⁴, for either intersector.
const TEXEL: f64 = 8.0 / (1 << 24) as f64;

/// One, two and three threads.
fn threads(bench: &mut Bench<'_>, base: Settings) -> Result<Row, VerifyError> {
    let mut tally = Tally::default();
    for sampler in SamplerKind::ALL {
        let base = Settings { sampler, ..base };
        let expected = Rendered::of(bench, base)?;
        for threads in [2, 3] {
            tally.compare(&expected, &Rendered::of(bench, Settings { threads, ..base })?);
        }
    }
    tally.row(
        bench,
        "threads",
        format!("{}: 1, 2, 3, both samplers", base.estimator.name()),
    )
}

/// Intermediate pictures of a render, against renders that end there.
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
            let watched = Rendered {
                what: "watched".to_owned(),
                picture: picture.clone(),
                settings,
            };
            let unwatched = Rendered {
                what: "unwatched".to_owned(),
                picture: bench.render(settings, &[passes])?.remove(0),
                settings,
            };
            tally.compare(&watched, &unwatched);
        }
    }
    tally.row(bench, "looks", format!("{}: at 2, 4, 8 passes", estimator.name()))
}

/// A picture and its settings.
struct Rendered {
    /// Its name for files.
    what: String,
    picture: Picture,
    settings: Settings,
}

impl Rendered {
    fn of(bench: &mut Bench<'_>, settings: Settings) -> Result<Self, VerifyError> {
        let Settings { lanes, threads, .. } = settings;
        let lanes = lanes.map_or(0, Lanes::count);
        let accel = settings.accel.map_or("", AccelKind::name);
        Ok(Self {
            what: format!("{accel}{lanes}x{threads}"),
            picture: bench.render(settings, &[PASSES])?.remove(0),
            settings,
        })
    }
}

/// The film size that the time allows. A single-threaded render takes `threads` times as long as measured.
fn pixels(bench: &Bench<'_>, costs: &[Cost], seconds: f64) -> f64 {
    let threads = bench.settings.threads as f64;
    let setups: f64 = costs.iter().map(|cost| RENDERS * cost.setup_s).sum();
    let pass: f64 = costs
        .iter()
        .map(|cost| (SCALARS * SCALAR + RENDERS) * threads * cost.sample_s)
        .sum();
    ((seconds - setups) / (pass * f64::from(PASSES))).clamp(200.0, 40_000.0)
}

/// Pixels that differ.
#[derive(Default)]
struct Tally {
    /// Allowed difference of two values, relative to the larger; at 0, bitwise equality.
    tolerance: f64,
    different: usize,
    pixels: usize,
    /// The differing pixels of each pair of renders.
    places: Vec<([Settings; 2], Vec<usize>)>,
    evidence: Option<([String; 2], Picture, Picture)>,
}

impl Tally {
    fn compare(&mut self, a: &Rendered, b: &Rendered) {
        let differ = |a: &f32, b: &f32| {
            if self.tolerance == 0.0 {
                a.to_bits() != b.to_bits()
            } else {
                f64::from((a - b).abs()) > self.tolerance * f64::from(a.abs().max(b.abs()))
            }
        };
        let pairs = a.picture.pixels.iter().zip(&b.picture.pixels);
        let different: Vec<usize> = (0..)
            .zip(pairs)
            .filter(|(_, (a, b))| a.iter().zip(*b).any(|(a, b)| differ(a, b)))
            .map(|(pixel, _)| pixel)
            .collect();
        self.pixels += a.picture.pixels.len();
        self.different += different.len();
        if different.is_empty() {
            return;
        }
        if self.evidence.is_none() {
            let names = [&a.what, &b.what].map(String::clone);
            self.evidence = Some((names, a.picture.clone(), b.picture.clone()));
        }
        self.places.push(([a.settings, b.settings], different));
    }

    fn row(self, bench: &Bench<'_>, check: &'static str, compared: String) -> Result<Row, VerifyError> {
        let bound = if self.tolerance > 0.0 {
            super::row::percent(self.tolerance)
        } else {
            "0".to_owned()
        };
        let row = Row::pass(check, compared)
            .figures(format!("{} of {} differ", self.different, self.pixels), bound)
            .number("different", self.different as f64)
            .number("pixels", self.pixels as f64);
        let Some((names, a, b)) = self.evidence else {
            return Ok(row);
        };
        let mut explained = Explained::default();
        for (settings, pixels) in &self.places {
            explained.add(ties::explain(bench, *settings, pixels, PASSES, self.tolerance)?);
        }
        let row = row.number("unexplained", explained.unexplained as f64);
        if explained.unexplained == 0 && explained.counts.is_empty() {
            let what = "pixels differ where both intersectors hit one point: its last bits turn the frame that directions are drawn in, or change a sharp lobe";
            return Ok(row.judged(Verdict::Note, what));
        }
        if explained.unexplained == 0 {
            let what = format!(
                "pixels differ where a ray meets two faces at one distance, or an edge: {}; which of them is seen is not defined",
                ties::worst(bench.scene, &explained.counts)
            );
            return Ok(row.judged(Verdict::Note, what));
        }
        let what = if self.tolerance > 0.0 {
            "the intersectors see different scenes, and neither a tie nor rounding explains it; this is a fault of Octolux"
        } else {
            "these pictures have to be the same bits, and no tie explains it; this is a fault of Octolux"
        };
        let mut row = row.judged(Verdict::Fail, what);
        row.evidence = Some(Evidence::of_bits(&a, &b, names.map(|name| format!("{check}-{name}"))));
        Ok(row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendered(pixels: Vec<[f32; 3]>) -> Rendered {
        let film = crate::scene::FilmSize { width: 2, height: 1 };
        Rendered {
            what: "x".to_owned(),
            picture: Picture {
                width: 2,
                height: 1,
                pixels,
            },
            settings: Settings {
                film,
                estimator: EstimatorKind::Mis,
                ..Settings::default()
            },
        }
    }

    #[test]
    fn one_bit_is_found() {
        let a = rendered(vec![[0.0, 1.0, 2.0]; 2]);
        let mut tally = Tally::default();
        tally.compare(&a, &rendered(a.picture.pixels.clone()));
        assert_eq!((tally.different, tally.pixels), (0, 2));
        let b = rendered(vec![[0.0, 1.0, 2.0], [-0.0, 1.0, 2.0]]);
        tally.compare(&a, &b);
        assert_eq!((tally.different, tally.pixels), (1, 4));
        assert_eq!(tally.places[0].1, [1]);
    }

    #[test]
    fn roundings_are_granted_where_they_are_and_no_more() {
        let a = rendered(vec![[1.0; 3], [1.0; 3]]);
        for (value, expected) in [(1.005, 0), (1.02, 1), (0.0, 1)] {
            let mut tally = Tally {
                tolerance: 0.01,
                ..Tally::default()
            };
            tally.compare(&a, &rendered(vec![[1.0; 3], [1.0, value, 1.0]]));
            assert_eq!(tally.different, expected, "{value}");
        }
    }
}
