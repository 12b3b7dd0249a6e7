//! Messages of the engine to the pages: available choices, and progress.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{Engine, Show};
use crate::cli::view::board::Topic;
use crate::cli::view::camera;
use octolux::run::Run;
use octolux::scene::FilmSize;
use octolux::settings::{EstimatorKind, SamplerKind};

impl Engine {
    /// Sends the available choices.
    pub(super) fn hello(&self) {
        let names = |files: &[PathBuf]| files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>();
        let hello = json!({
            "kind": "hello",
            "scene": self.file.name(),
            "estimators": EstimatorKind::ALL.map(EstimatorKind::name),
            "samplers": SamplerKind::ALL.map(SamplerKind::name),
            "outputs": names(&self.setup.outputs),
            "lights": camera::lights(&self.file),
            "notes": self.file.notes(),
            "reference": self.setup.reference.is_some(),
            "reference_seconds": self.setup.reference_time.as_secs_f64(),
            "version": octolux::about::VERSION,
        });
        self.board.tell(Topic::Hello, hello.to_string());
    }

    /// Sends the progress of the render.
    pub(super) fn tell(&self) {
        let state = match (&self.show, self.playing) {
            (Show::Nothing, _) => "failed",
            (Show::Picture(run), _) if run.failure().is_some() => "failed",
            (_, false) => "stopped",
            (_, true) if self.halted && !self.is_given_up() => "done",
            (_, true) => "rendering",
        };
        let FilmSize { width, height } = self.film();
        let (picture, race) = match &self.show {
            Show::Nothing => (Value::Null, Value::Null),
            Show::Picture(run) => (picture(run), Value::Null),
            Show::Race(race) => (Value::Null, race.told()),
        };
        let shown = self.desk.shown();
        let looks_at = shown.as_ref().map_or(&self.file, |shown| &shown.scene);
        let status = json!({
            "kind": "status",
            "epoch": self.epoch,
            "state": state,
            "width": width,
            "height": height,
            "estimator": self.choice.estimator.name(),
            "sampler": self.choice.sampler.name(),
            "kernel": shown.as_ref().map(|shown| shown.prepared[0].kernel().to_owned()),
            "camera": camera::told(looks_at.camera()),
            "turned": self.changes.view.is_some(),
            "gains": self.changes.gains,
            "spp": self.setup.spp,
            "picture": picture,
            "race": race,
        });
        self.board.tell(Topic::Status, status.to_string());
    }
}

fn picture(run: &Run) -> Value {
    let (least, total, most) = run.spread();
    let seconds = run.render_time().as_secs_f64();
    json!({
        "least": least,
        "most": most,
        "samples": total,
        "seconds": seconds,
        "per_second": if seconds > 0.0 { run.progress().samples() as f64 / seconds } else { 0.0 },
        "rays": run.progress().rays(),
    })
}
