//! Time by phase of one render at the scene's own film size.

use std::time::Instant;

use serde::Serialize;

use crate::film::{Attributes, write_picture};
use crate::pipeline::{Prepared, Settings, SetupError};
use crate::run::{MOST_SPP, Observer, Run};
use crate::scene::Scene;

/// Wall-clock seconds, and ray counts.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Phases {
    /// Reading the scene and its meshes.
    pub load_s: f64,
    /// Threads, tables, and Embree's device.
    pub setup_s: f64,
    /// Building the accelerator.
    pub build_s: f64,
    /// The first pass, which includes page faults for fresh memory.
    pub first_pass_s: f64,
    /// A later pass.
    pub pass_s: f64,
    /// Number of passes averaged.
    pub passes: u32,
    /// Writing an EXR and a PNG.
    pub write_s: f64,
    /// Camera rays of a pass.
    pub eye_rays: f64,
    /// Shadow rays of a pass.
    pub shadow_rays: f64,
    /// The kernel that the plan chose.
    pub kernel: String,
    /// The reason for the choice.
    pub why: String,
    /// Effects compiled into the kernel: at least those that the scene requires.
    pub held: Vec<&'static str>,
    /// Rays per packet.
    pub lanes: usize,
    /// The version of Embree.
    pub embree_version: String,
}

/// Renders at the scene's own film size for about `seconds`.
///
/// # Errors
/// Where the render cannot start.
pub fn measure(scene: &Scene, settings: Settings, seconds: f64, watch: &dyn Observer) -> Result<Phases, SetupError> {
    let started = Instant::now();
    let prepared = Prepared::new(scene, settings)?;
    let all = started.elapsed().as_secs_f64();
    let mut run = prepared.passes(MOST_SPP);
    watch.begins(run.progress());
    let mut more = run.step().is_more();
    let (before, first_pass_s) = (run.passes(), run.render_time().as_secs_f64());
    let spent = |run: &Run| run.render_time().as_secs_f64() - first_pass_s;
    while more && (spent(&run) < seconds || run.passes() == before) && !watch.stopped() {
        more = run.step().is_more();
    }
    let spent = spent(&run);
    let passes = run.passes();
    let counters = run.counters();
    let a_pass = |count: u64| count as f64 / f64::from(passes.max(1));
    let started = Instant::now();
    if let Ok(folder) = tempfile::tempdir() {
        let picture = run.picture();
        // Only the time matters; a full disk is reported when the page is written.
        let _ = write_picture(&folder.path().join("x.exr"), &picture, &Attributes::default());
        let _ = write_picture(&folder.path().join("x.png"), &picture, &Attributes::default());
    }
    Ok(Phases {
        load_s: 0.0,
        setup_s: (all - prepared.build_time().as_secs_f64()).max(0.0),
        build_s: prepared.build_time().as_secs_f64(),
        first_pass_s,
        pass_s: spent / f64::from((passes - before).max(1)),
        passes: passes - before,
        write_s: started.elapsed().as_secs_f64(),
        eye_rays: a_pass(counters.eye_rays),
        shadow_rays: a_pass(counters.shadow_rays),
        kernel: prepared.kernel().to_owned(),
        why: prepared.why().to_owned(),
        held: prepared.held().names(),
        lanes: prepared.lanes().count(),
        embree_version: prepared.embree_version().to_owned(),
    })
}
