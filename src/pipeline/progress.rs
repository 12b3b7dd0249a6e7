//! Progress and counters of a render.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use serde::{Deserialize, Serialize};

use crate::embree::EmbreeError;

/// Shared between a run and its observers, in any thread: a progress bar reads the counts, ctrl-c requests a stop.
#[derive(Debug, Default)]
pub struct Progress {
    samples: AtomicU64,
    rays: AtomicU64,
    expected: AtomicU64,
    stop: AtomicBool,
    failure: OnceLock<EmbreeError>,
}

impl Progress {
    /// Requests a stop after the current tiles. The film is then a correct picture. A stop cannot be withdrawn.
    pub fn request_stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether a stop was requested.
    pub fn stop_requested(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Samples (pixels x passes) finished so far.
    pub fn samples(&self) -> u64 {
        self.samples.load(Ordering::Relaxed)
    }

    /// Camera and shadow rays traced so far.
    pub fn rays(&self) -> u64 {
        self.rays.load(Ordering::Relaxed)
    }

    /// The error of the first Embree query that failed, if any. The picture is then wrong.
    pub fn failure(&self) -> Option<&EmbreeError> {
        self.failure.get()
    }

    pub(crate) fn fail(&self, error: EmbreeError) {
        // Later errors follow from the first.
        let _ = self.failure.set(error);
    }

    /// Number of samples (pixels x passes) of the whole render, as far as known; 0 if a time limit ends it.
    pub fn expected(&self) -> u64 {
        self.expected.load(Ordering::Relaxed)
    }

    pub(crate) fn expect(&self, samples: u64) {
        self.expected.store(samples, Ordering::Relaxed);
    }

    pub(crate) fn add(&self, samples: u64, rays: u64) {
        self.samples.fetch_add(samples, Ordering::Relaxed);
        self.rays.fetch_add(rays, Ordering::Relaxed);
    }
}

/// Counts of traced rays and rejected contributions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Pixels x passes.
    pub samples: u64,
    /// Camera rays traced by the intersector.
    pub eye_rays: u64,
    /// Shadow rays resolved, by the intersector or by culling that left no occluder.
    pub shadow_rays: u64,
    /// Contributions that were not a number; never written into a picture.
    pub invalid_nan: u64,
    /// Contributions that were infinite; never written into a picture.
    pub invalid_inf: u64,
    /// Contributions below zero; never written into a picture.
    pub invalid_negative: u64,
}

impl Counters {
    /// Counts a contribution that is NaN, infinite or negative, by its worst component.
    pub(crate) fn reject(&mut self, value: [f32; 3]) {
        if value.iter().any(|x| x.is_nan()) {
            self.invalid_nan += 1;
        } else if value.iter().any(|x| x.is_infinite()) {
            self.invalid_inf += 1;
        } else {
            self.invalid_negative += 1;
        }
    }
}

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.samples += other.samples;
        self.eye_rays += other.eye_rays;
        self.shadow_rays += other.shadow_rays;
        self.invalid_nan += other.invalid_nan;
        self.invalid_inf += other.invalid_inf;
        self.invalid_negative += other.invalid_negative;
    }
}
