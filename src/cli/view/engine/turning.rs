//! Camera changes.

use super::Engine;
use crate::cli::view::message::View;

impl Engine {
    /// Changes the view, or resets it to the file's.
    pub(super) fn turn(&mut self, view: Option<View>) {
        self.changes.view = view;
        self.playing = true;
        self.begin(true);
    }

    /// Focuses on the point that a pixel shows, or orbits around it.
    pub(super) fn aim(&mut self, x: u32, y: u32) {
        let (Some(point), Some(shown)) = (self.desk.met(x, y), self.desk.shown()) else {
            return;
        };
        let camera = shown.scene.camera();
        let forward = (camera.target - camera.origin).normalize();
        let (pinhole, forward) = (camera.origin.to_array(), forward.to_array());
        let depth: f64 = [0, 1, 2]
            .iter()
            .map(|&axis| forward[axis] * (point[axis] - pinhole[axis]))
            .sum();
        let focus = camera.lens.map(|_| depth);
        self.board.interrupt();
        self.turn(Some(View {
            origin: camera.origin.to_array(),
            target: if focus.is_some() {
                camera.target.to_array()
            } else {
                point
            },
            up: camera.up.to_array(),
            focus,
        }));
    }
}
