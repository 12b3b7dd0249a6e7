//! Scenes ready to be rendered and asked, and their runs.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use numpy::{PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadwriteArray1, PyReadwriteArray2};
use octolux::pipeline::{self, Chosen, Settings};
use octolux::rays::{HitsMut, RayQueries, Rays, RaysError, Vectors};
use octolux::run::{Goal, Step};
use octolux::scene::{FilmSize, SamplerKind};
use octolux::settings::{AccelKind, EstimatorAsked};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::errors;
use crate::picture::array;
use crate::scene::Scene;
use crate::threads::detached;

type Rows<'py> = PyReadonlyArray2<'py, f32>;
/// Origins, directions, and ends where there are any.
type Told<'py> = (Rows<'py>, Rows<'py>, Option<PyReadonlyArray1<'py, f32>>);

/// As many threads as the machine offers.
#[pyfunction]
pub fn all_threads() -> usize {
    pipeline::all_threads()
}

/// A scene with its accelerator, for one size and estimator.
#[pyclass(frozen, module = "octolux._native")]
pub struct Prepared {
    prepared: pipeline::Prepared,
    queries: RayQueries,
}

fn chosen<T: Copy>(what: &str, name: Option<&str>, all: &[T], named: fn(T) -> &'static str) -> PyResult<Option<T>> {
    let Some(name) = name else { return Ok(None) };
    match all.iter().find(|one| named(**one) == name) {
        Some(one) => Ok(Some(*one)),
        None => {
            let names: Vec<_> = all.iter().map(|one| named(*one)).collect();
            let names = names.join(", ");
            Err(PyValueError::new_err(format!(
                "{what} is \"{name}\"; there are {names}"
            )))
        }
    }
}

#[pymethods]
impl Prepared {
    #[new]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        scene: &Scene,
        size: Option<(u32, u32)>,
        estimator: Option<&str>,
        sampler: Option<&str>,
        seed: Option<u32>,
        threads: Option<usize>,
        accel: Option<&str>,
    ) -> PyResult<Self> {
        let of = Settings::of(&scene.0);
        let asked = chosen("estimator", estimator, &EstimatorAsked::ALL, EstimatorAsked::name)?;
        let settings = Settings {
            film: size.map_or(of.film, |(width, height)| FilmSize { width, height }),
            estimator: Chosen::of(&scene.0, asked).estimator,
            sampler: chosen("sampler", sampler, &SamplerKind::ALL, SamplerKind::name)?.unwrap_or(of.sampler),
            seed: seed.unwrap_or(of.seed),
            threads: threads.unwrap_or(of.threads),
            accel: chosen("accel", accel, &AccelKind::ALL, AccelKind::name)?,
            ..of
        };
        let prepared = detached(py, || pipeline::Prepared::new(&scene.0, settings))?;
        let prepared = prepared.map_err(|error| errors::setup(&error))?;
        let queries = RayQueries::new(&prepared);
        Ok(Self { prepared, queries })
    }

    #[getter]
    fn kernel(&self) -> &str {
        self.prepared.kernel()
    }

    #[getter]
    fn embree_version(&self) -> &str {
        self.prepared.embree_version()
    }

    fn start(&self, spp: u32, seconds: Option<f64>, adaptive: bool, error: Option<f64>) -> Run {
        let goal = match error {
            Some(error) => Goal::error(error),
            None if adaptive => Goal::adaptive(spp),
            None => Goal::passes(spp),
        };
        let time = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
        let goal = time.map_or(goal, |time| goal.within(time));
        Run(Mutex::new(self.prepared.start(goal)))
    }

    /// Distance, normal, barycentric coordinates, object and triangle of what the rays meet first, into arrays of the caller: every
    /// number of them is written.
    #[allow(clippy::too_many_arguments)]
    fn intersect(
        &self,
        py: Python<'_>,
        rays: Told<'_>,
        coherent: bool,
        mut t: PyReadwriteArray1<'_, f32>,
        mut normals: PyReadwriteArray2<'_, f32>,
        mut uv: PyReadwriteArray2<'_, f32>,
        mut objects: PyReadwriteArray1<'_, u32>,
        mut primitives: PyReadwriteArray1<'_, u32>,
    ) -> PyResult<()> {
        let into = HitsMut {
            t: t.as_slice_mut()?,
            normals: normals.as_slice_mut()?.as_chunks_mut().0,
            uv: uv.as_slice_mut()?.as_chunks_mut().0,
            objects: objects.as_slice_mut()?,
            primitives: primitives.as_slice_mut()?,
        };
        let rays = told(&rays, coherent)?;
        py.detach(|| self.queries.intersect_into(rays, into))
            .map_err(|error| uneven(&error))
    }

    /// Whether anything is met before the end of each ray, into an array of the caller.
    fn occluded(
        &self,
        py: Python<'_>,
        rays: Told<'_>,
        coherent: bool,
        mut occluded: PyReadwriteArray1<'_, bool>,
    ) -> PyResult<()> {
        let (rays, into) = (told(&rays, coherent)?, occluded.as_slice_mut()?);
        py.detach(|| self.queries.occluded_into(rays, into))
            .map_err(|error| uneven(&error))
    }
}

fn uneven(error: &RaysError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn told<'a>((origins, directions, tmax): &'a Told<'_>, coherent: bool) -> PyResult<Rays<'a>> {
    let vectors = |array: &'a Rows<'_>| Ok::<_, PyErr>(Vectors::Rows(array.as_slice()?.as_chunks().0));
    let rays = Rays::new(vectors(origins)?, vectors(directions)?);
    let rays = if coherent { rays.coherent() } else { rays };
    let tmax = tmax.as_ref().map(|tmax| tmax.as_slice()).transpose()?;
    Ok(tmax.map_or(rays, |tmax| rays.within(tmax)))
}

/// One render, step by step.
#[pyclass(frozen, module = "octolux._native")]
pub struct Run(Mutex<octolux::run::Run>);

impl Run {
    fn with<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut octolux::run::Run) -> T + Send) -> T {
        py.detach(|| work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Run {
    /// Renders for about so many seconds, to the end of a block at most; whether there is more to do.
    fn step(&self, py: Python<'_>, seconds: f64) -> PyResult<bool> {
        let pause = Duration::try_from_secs_f64(seconds)
            .ok()
            .map(|pause| Instant::now() + pause);
        let step = self.with(py, |run| match run.step_until(pause) {
            Step::More => Ok(true),
            Step::Done | Step::Stopped => run.failure().map_or(Ok(false), |error| Err(error.to_string())),
        });
        step.map_err(|error| PyRuntimeError::new_err(format!("{error}: the picture would be wrong")))
    }

    #[getter]
    fn passes(&self, py: Python<'_>) -> u32 {
        self.with(py, |run| run.passes())
    }

    /// Radiance so far, `(h, w, 3)`.
    fn picture<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let picture = self.with(py, |run| run.picture());
        array(py, picture.width, picture.height, &picture.pixels)
    }
}
