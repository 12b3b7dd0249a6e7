//! Where the time of one render of the scene's own film goes.

use std::time::Instant;

use serde::Serialize;

use crate::film::{Attributes, write_picture};
use crate::pipeline::{Renderer, Settings, SetupError};
use crate::scene::Scene;
use crate::study::verify::Watch;

/// Seconds by wall clock, and rays.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Phases {
    /// Reading the scene and its meshes.
    pub load_s: f64,
    /// Threads, tables, and Embree's device.
    pub setup_s: f64,
    /// Building the accelerator.
    pub build_s: f64,
    /// The first pass, which pays for fresh memory.
    pub first_pass_s: f64,
    /// A pass later on.
    pub pass_s: f64,
    /// Passes that this is the mean of.
    pub passes: u32,
    /// Writing an EXR and a PNG.
    pub write_s: f64,
    /// Eye rays of a pass.
    pub eye_rays: f64,
    /// Shadow rays of a pass.
    pub shadow_rays: f64,
    /// The kernel that the plan chose.
    pub kernel: String,
    /// Why.
    pub why: String,
    /// What the kernel holds: at least what the scene calls for.
    pub held: Vec<&'static str>,
    /// Rays a packet.
    pub lanes: usize,
    /// The version of Embree.
    pub embree_version: String,
}

/// Renders the scene's own film for about so many seconds.
///
/// # Errors
/// Where the render cannot start.
pub fn measure(scene: &Scene, settings: Settings, seconds: f64, watch: &dyn Watch) -> Result<Phases, SetupError> {
    let started = Instant::now();
    let mut renderer = Renderer::new(scene, settings)?;
    let all = started.elapsed().as_secs_f64();
    watch.renders(renderer.progress());
    let timed = |renderer: &mut Renderer| {
        let started = Instant::now();
        renderer.next_block(u32::MAX);
        started.elapsed().as_secs_f64()
    };
    let first_pass_s = timed(&mut renderer);
    let (before, mut spent) = (renderer.passes(), 0.0);
    while (spent < seconds || renderer.passes() == before) && !watch.stopped() {
        spent += timed(&mut renderer);
    }
    let passes = renderer.passes();
    let counters = renderer.counters();
    let a_pass = |count: u64| count as f64 / f64::from(passes.max(1));
    let started = Instant::now();
    if let Ok(folder) = tempfile::tempdir() {
        let picture = renderer.picture();
        // Only its time is wanted: a full disk will say so when the page is written.
        let _ = write_picture(&folder.path().join("x.exr"), &picture, &Attributes::default());
        let _ = write_picture(&folder.path().join("x.png"), &picture, &Attributes::default());
    }
    Ok(Phases {
        load_s: 0.0,
        setup_s: (all - renderer.build_seconds()).max(0.0),
        build_s: renderer.build_seconds(),
        first_pass_s,
        pass_s: spent / f64::from((passes - before).max(1)),
        passes: passes - before,
        write_s: started.elapsed().as_secs_f64(),
        eye_rays: a_pass(counters.eye_rays),
        shadow_rays: a_pass(counters.shadow_rays),
        kernel: renderer.kernel().to_owned(),
        why: renderer.why().to_owned(),
        held: renderer.held().names(),
        lanes: renderer.lanes(),
        embree_version: renderer.embree_version().to_owned(),
    })
}
