//! Renders of whole scenes: under many seeds, with means and the errors of these means.

use std::path::Path;
use std::sync::Arc;

use octolux::film::{Attributes, Picture, write_picture};
use octolux::pipeline::{Prepared, Settings};
use octolux::reference::Reference;
use octolux::run::Run;
use octolux::scene::{EstimatorKind, FilmSize, SamplerKind, Scene};
use octolux::settings::Lanes;
pub use octolux::study::estimate::Estimate;

/// A scene of the repository.
pub fn load(path: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(path);
    Scene::load(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A square plate, all of the picture, whose vertex normals lean different ways: every pixel has a normal of its own.
pub fn leaning_normals() -> Scene {
    let mut scene = load("tests/underside-smooth.toml").to_builder();
    scene.camera.fov = octolux::scene::Fov::X(25.0);
    let lean = |x: f64, z: f64| glam::DVec3::new(x, 1.0, z).normalize();
    let normals = vec![lean(0.6, 0.1), lean(-0.3, 0.4), lean(0.1, -0.7), lean(-0.2, -0.1)];
    Arc::make_mut(&mut scene.meshes[0]).normals = Some(normals);
    scene.build().expect("a scene with unit normals")
}

/// Settings of one thread and eight lanes; a test changes what it is about.
pub fn settings(width: u32, height: u32, estimator: EstimatorKind) -> Settings {
    Settings {
        film: FilmSize { width, height },
        estimator,
        sampler: SamplerKind::Sobol,
        seed: 1,
        lanes: Some(Lanes::Eight),
        threads: 1,
        ..Settings::default()
    }
}

/// The widths of packets besides eight: one, and sixteen where the processor has AVX-512.
pub fn other_widths() -> Vec<Lanes> {
    let widest = octolux::pipeline::widest_lanes();
    let others = [Lanes::One, Lanes::Sixteen].into_iter();
    others.filter(|&lanes| lanes <= widest).collect()
}

/// A run of `passes` passes. Nothing invalid may have come up on the way.
pub fn rendered(scene: &Scene, settings: Settings, passes: u32) -> Run {
    finished(scene, &prepared(scene, settings), passes)
}

fn prepared(scene: &Scene, settings: Settings) -> Prepared {
    Prepared::new(scene, settings).unwrap_or_else(|error| panic!("{}: {error}", scene.name()))
}

fn finished(scene: &Scene, prepared: &Prepared, passes: u32) -> Run {
    let run = prepared.passes(passes).finish();
    let counters = run.counters();
    let invalid = counters.invalid_nan + counters.invalid_inf + counters.invalid_negative;
    let settings = prepared.settings();
    assert_eq!(invalid, 0, "{}, {settings:?}: invalid contributions", scene.name());
    run
}

/// The picture after `passes` passes.
pub fn picture(scene: &Scene, settings: Settings, passes: u32) -> Picture {
    rendered(scene, settings, passes).picture()
}

/// Pictures of one setting under several seeds.
pub struct Runs {
    pub pictures: Vec<Picture>,
}

impl Runs {
    /// Renders with the seeds `first .. first + count`. Seeds are the independent unit: pixels share tables of points. Packets are the
    /// widest that there are: other tests prove that their width changes no bit.
    pub fn new(scene: &Scene, settings: Settings, passes: u32, first: u32, count: u32) -> Self {
        let prepared = prepared(
            scene,
            Settings {
                lanes: None,
                ..settings
            },
        );
        let pictures = (first..first + count)
            .map(|seed| finished(scene, &prepared.with_seed(seed), passes).picture())
            .collect();
        Self { pictures }
    }

    /// The means of the whole film, channel by channel, then green in each of `columns x rows` parts of it.
    pub fn estimates(&self, columns: u32, rows: u32) -> Vec<Estimate> {
        quantities(columns, rows)
            .map(|(column, row, channel)| {
                let values = self.pictures.iter().map(|p| mean(p, column, row, channel));
                Estimate::of(&values.collect::<Vec<_>>())
            })
            .collect()
    }

    /// The mean of the pictures.
    pub fn mean_picture(&self) -> Picture {
        let mut sum = self.pictures[0].clone();
        for (i, pixel) in sum.pixels.iter_mut().enumerate() {
            for (channel, value) in pixel.iter_mut().enumerate() {
                let total: f64 = self.pictures.iter().map(|p| f64::from(p.pixels[i][channel])).sum();
                *value = (total / self.pictures.len() as f64) as f32;
            }
        }
        sum
    }
}

/// Leaves a picture to be looked at, as EXR and as PNG, and says where.
pub fn leave(picture: &Picture, name: &str) -> String {
    let exr = super::artefact(&format!("{name}.exr"));
    for path in [&exr, &exr.with_extension("png")] {
        write_picture(path, picture, &Attributes::default()).expect("a picture can be written to the target folder");
    }
    exr.display().to_string()
}

/// The `i`-th of so many equal parts of a side.
type Part = [u32; 2];

/// What is measured of a picture: all of it in each channel, then green in each part.
fn quantities(columns: u32, rows: u32) -> impl Iterator<Item = (Part, Part, usize)> {
    let whole = (0..3).map(|channel| ([0, 1], [0, 1], channel));
    let green = (0..rows).flat_map(move |row| (0..columns).map(move |column| ([column, columns], [row, rows], 1)));
    whole.chain(green)
}

/// The names of these quantities.
pub fn names(columns: u32, rows: u32) -> impl Iterator<Item = String> {
    quantities(columns, rows).map(|([column, n], [row, m], channel)| {
        let name = ["red", "green", "blue"][channel];
        if n * m == 1 {
            format!("all {name}")
        } else {
            format!("part {column},{row} {name}")
        }
    })
}

fn range([index, count]: Part, size: u32) -> std::ops::Range<u32> {
    index * size / count..(index + 1) * size / count
}

fn mean(picture: &Picture, columns: Part, rows: Part, channel: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for y in range(rows, picture.height) {
        for x in range(columns, picture.width) {
            sum += f64::from(picture.pixels[(y * picture.width + x) as usize][channel]);
            count += 1.0;
        }
    }
    sum / count
}

/// The oracle's picture in the same quantities as [`Runs::estimates`].
pub fn oracle_estimates(reference: &Reference, columns: u32, rows: u32) -> Vec<Estimate> {
    quantities(columns, rows)
        .map(|(column, row, channel)| {
            let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
            for y in range(row, reference.height) {
                for x in range(column, reference.width) {
                    let index = (y * reference.width + x) as usize;
                    sum += reference.picture[index][channel];
                    squares += reference.stderr[index][channel].powi(2);
                    count += 1.0;
                }
            }
            Estimate {
                mean: sum / count,
                variance: squares / (count * count),
                dof: f64::INFINITY,
            }
        })
        .collect()
}
