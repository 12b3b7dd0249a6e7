//! Octolux renders direct illumination in packets of rays, and verifies its results.
//!
//! ```
//! # use octolux::{RenderOptions, scene::Scene};
//! # let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! # let size = Some(octolux::scene::FilmSize { width: 48, height: 32 });
//! # let options = RenderOptions { size, ..Default::default() };
//! let picture = octolux::render(&scene, &RenderOptions { spp: 64, ..Default::default() })?;
//! # assert_eq!(picture.pixels.len(), (picture.width * picture.height) as usize);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # A scene
//!
//! A [`scene::Scene`] is a checked value. A builder makes one:
//!
//! ```
//! use octolux::scene::{Camera, FilmSize, Fov, Material, Mesh, Scene, Sphere, Surface};
//!
//! let camera = Camera::new([0.0, 2.0, 6.0], [0.0, 0.5, 0.0], Fov::X(40.0));
//! let mut scene = Scene::builder(camera, FilmSize { width: 96, height: 64 });
//! let grey = scene.material(Material::diffuse("grey", [0.5; 3]));
//! let corners = [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]];
//! scene.mesh(Mesh::quadrilateral(corners, grey));
//! scene.sphere(Sphere::new([0.0, 3.0, 0.0], 0.5, Surface::emission([8.0, 7.0, 6.0])));
//! let scene = scene.build()?;
//! # assert_eq!(scene.spheres().len(), 1);
//! # Ok::<(), octolux::scene::InvalidScene>(())
//! ```
//!
//! or it is loaded from a file, with errors that name the line, the value and a remedy:
//!
//! ```
//! use octolux::scene::Scene;
//!
//! let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! assert_eq!(scene.film().width, 768);
//! # Ok::<(), octolux::scene::SceneError>(())
//! ```
//!
//! # Pictures
//!
//! [`render`] returns linear radiance as an array of `height x width x 3` numbers, top row first. It can be written as `.exr`,
//! `.npy` (both linear, `f32`) or `.png`:
//!
//! ```
//! # use octolux::{RenderOptions, scene::{FilmSize, Scene}};
//! # let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! # let folder = tempfile::tempdir()?;
//! use octolux::film::{Attributes, write_picture};
//!
//! let size = Some(FilmSize { width: 48, height: 32 });
//! let picture = octolux::render(&scene, &RenderOptions { spp: 4, size, ..Default::default() })?;
//! let values: &[f32] = picture.pixels.as_flattened();
//! assert_eq!(values.len(), 32 * 48 * 3);
//!
//! write_picture(&folder.path().join("veach.exr"), &picture, &Attributes::default())?;
//! write_picture(&folder.path().join("veach.png"), &picture, &Attributes::default())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Runs
//!
//! A scene is prepared once, and any number of runs share it. A run advances step by step, with a picture after each step:
//!
//! ```
//! # use octolux::scene::{FilmSize, Scene};
//! # let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! use octolux::pipeline::{Prepared, Settings};
//!
//! let film = FilmSize { width: 48, height: 32 };
//! let prepared = Prepared::new(&scene, Settings { film, ..Settings::of(&scene) })?;
//! let mut run = prepared.passes(16);
//! while run.step().is_more() {
//!     let so_far = run.picture();
//!     println!("{} samples a pixel, {} pixels", run.passes(), so_far.pixels.len());
//! }
//! assert_eq!(run.passes(), 16);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A run can be stopped from any thread, which ends it; the picture so far is unbiased. A saved run can be resumed, and the
//! picture has the bits of an uninterrupted run:
//!
//! ```
//! # use octolux::scene::{FilmSize, Scene};
//! # use octolux::pipeline::{Prepared, Settings};
//! # let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! # let film = FilmSize { width: 48, height: 32 };
//! # let prepared = Prepared::new(&scene, Settings { film, ..Settings::of(&scene) })?;
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("veach.state");
//! use octolux::run::{Goal, Saved, Step};
//!
//! let mut run = prepared.passes(16);
//! let progress = run.progress().clone();
//! assert!(run.step().is_more());
//! std::thread::spawn(move || progress.request_stop()).join().unwrap();
//! assert_eq!(run.step(), Step::Stopped);
//! run.save(&path, Vec::new())?;
//!
//! let resumed = prepared.resume(Goal::passes(16), Saved::read(&path)?)?.finish();
//! assert!(resumed.picture().pixels == prepared.passes(16).finish().picture().pixels);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`run::Goal`] can also be a time, an error, or a shard. [`run::Observer`] observes a run: a progress bar, a live view.
//!
//! # Custom cameras
//!
//! Scenes are immutable; a builder makes a copy with another camera:
//!
//! ```
//! # use octolux::{RenderOptions, scene::{FilmSize, Scene}};
//! # let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! # let size = Some(FilmSize { width: 48, height: 32 });
//! use octolux::scene::Fov;
//!
//! let mut turned = scene.to_builder();
//! turned.camera.origin.x += 2.0;
//! turned.camera.fov = Fov::Y(30.0);
//! let picture = octolux::render(&turned.build()?, &RenderOptions { spp: 4, size, ..Default::default() })?;
//! # assert!(picture.pixels.iter().flatten().all(|x| x.is_finite()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Any other camera is an array of rays: [`rays::RayQueries`] traces them in packets, and its page has an example.
//!
//! # The oracle
//!
//! An independent `f64` renderer, one ray at a time, computes reference pictures with standard errors:
//!
//! ```
//! # use octolux::{RenderOptions, scene::{FilmSize, Scene}};
//! # let scene = Scene::load("scenes/veach-mis.toml".as_ref())?;
//! use octolux::reference;
//! use octolux::study::error::{Errors, relmse_of_reference};
//!
//! let film = FilmSize { width: 24, height: 16 };
//! let options = RenderOptions { spp: 256, size: Some(film), ..Default::default() };
//! let picture = octolux::render(&scene, &options)?;
//! let oracle = reference::render(&scene, film, 256, 0, &|_| ());
//!
//! let errors = Errors::between(&picture.pixels, &oracle.picture);
//! let noise_of_the_oracle = relmse_of_reference(&oracle.picture, &oracle.stderr);
//! // A lamp fills a fraction of a pixel, so the means differ by some percent.
//! assert!(errors.relative.abs() < 0.1 && errors.relmse < 2.0 * noise_of_the_oracle + 0.1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Features
//!
//! `cli` (default) is the program `octolux`; `lab` (part of it) has verification and measurements: `study::verify`,
//! `study::selftest` and `study::cost`. Without both, the crate needs no clap, miette, indicatif, plotters or ctrlc.
//!
//! # Architecture
//!
//! Data flows one way: a scene determines the required effects, the plan selects a kernel, streams of packets pass through
//! the intersector and the estimators, and a film accumulates the sums.
//!
//! Layers, lowest first; a module uses only those before it, which `tests/layers.rs` checks:
//! [`cpu`], [`about`], [`machine`], [`settings`] and [`texels`] · [`lane`] · [`math`] · [`sampling`] and [`shape`] ·
//! [`bsdf`] and [`light`] · [`embree`] and [`linear`] · [`scene`] · [`estimator`] · [`film`] and [`pipeline`] · [`run`] ·
//! [`mod@reference`] (uses only scene data) · [`study`]. The command line (`src/cli`) belongs to the program.
//!
//! Modules that the documentation hides (`lane`, `math`, `sampling`, `bsdf`, `light`, `shape`, `embree`, `linear`, `estimator` and
//! some more) are public only for the tests and benchmarks of the repository: they may change at any time.

#[macro_use]
mod mutant;

#[cfg(test)]
extern crate self as octolux; // the checks of `tests/proof` name the crate
#[cfg(test)]
#[path = "../tests/proof/mod.rs"]
mod proof;

#[doc(hidden)]
pub mod about;
#[doc(hidden)]
pub mod bsdf;
#[doc(hidden)]
pub mod cpu;
#[doc(hidden)]
pub mod embree;
#[doc(hidden)]
pub mod estimator;
pub mod film;
#[doc(hidden)]
pub mod lane;
#[doc(hidden)]
pub mod light;
#[doc(hidden)]
pub mod linear;
#[doc(hidden)]
pub mod machine;
#[doc(hidden)]
pub mod math;
pub mod pipeline;
pub mod reference;
pub mod run;
#[doc(hidden)]
pub mod sampling;
pub mod scene;
pub mod settings;
#[doc(hidden)]
pub mod shape;
pub mod study;
pub mod texels;

pub use pipeline::rays;
pub use run::{RenderError, RenderOptions, render};
