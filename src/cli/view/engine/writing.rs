//! Writes files on request, and prints the command line for the same render.

use super::{Engine, Show};
use crate::cli::view::camera::Changes;
use crate::cli::view::{said, write};

impl Engine {
    /// Writes the files named on the command line, and reports the result.
    pub(super) fn write(&mut self, page: u64, exposure: f64) {
        let Show::Picture(run) = &mut self.show else {
            return self.board.answer(
                page,
                said("error", "there is one picture to write once the race has ended"),
            );
        };
        write::complete_block(run);
        let written = write::write(&self.setup.path, run, &self.setup.outputs, exposure);
        let spp = run.passes();
        let text = match written {
            Ok(files) => {
                let turned = match &self.changes {
                    changes if *changes == Changes::default() => "",
                    changes if changes.gains.is_empty() => ", with this camera in the file,",
                    _ => ", with these changes in the file,",
                };
                let command = self.command(spp, exposure);
                said(
                    "note",
                    &format!("wrote {}. {command}{turned} gives the same bits", files.join(" and ")),
                )
            }
            Err(error) => said("error", &error.to_string()),
        };
        self.board.say(&text);
        self.look();
    }

    /// The command line that renders the current view.
    fn command(&self, spp: u32, exposure: f64) -> String {
        // Dimmed lights may leave the rule another choice.
        let shown = self.changes.of(&self.file).unwrap_or_else(|_| self.file.clone());
        let own = self.setup.options.render_options().settings(&shown);
        let mut options = self.setup.options.clone();
        if own.estimator != self.choice.estimator {
            options.estimator = Some(self.choice.estimator.into());
        }
        if own.sampler != self.choice.sampler {
            options.sampler = Some(self.choice.sampler);
        }
        let exposure = if exposure == 0.0 {
            String::new()
        } else {
            format!(" --exposure {exposure}")
        };
        let path = self.setup.path.display();
        format!("octolux render {path}{} --spp {spp}{exposure}", options.given(""))
    }
}
