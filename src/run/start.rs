//! How a run begins: from a prepared scene and a goal, with empty films or with those of a run before.

use std::time::Duration;

use super::{Goal, Record, ResumeError, Run, Saved, Shard};
use crate::pipeline::Prepared;

impl Prepared {
    /// A run towards any goal.
    pub fn start(&self, goal: Goal) -> Run {
        Run::new(self.clone(), goal)
    }

    /// A run of so many samples of every pixel.
    pub fn passes(&self, spp: u32) -> Run {
        self.start(Goal::passes(spp))
    }

    /// A run of as many samples as `time` allows, one of every pixel at least.
    pub fn for_time(&self, time: Duration) -> Run {
        self.start(Goal::time(time))
    }

    /// A run until the noise is such a share of the picture: see [`Goal::error`].
    pub fn until_error(&self, error: f64) -> Run {
        self.start(Goal::error(error))
    }

    /// A run of so many samples a pixel on average, more where the relative error is larger: see [`Goal::adaptive`].
    pub fn adaptive(&self, spp: u32) -> Run {
        self.start(Goal::adaptive(spp))
    }

    /// A run of one shard of so many samples of every pixel.
    pub fn shard(&self, shard: Shard, spp: u32) -> Run {
        self.start(Goal::shard(shard, spp))
    }

    /// Goes on with a run that was saved. The picture has the bits of a run in one piece.
    ///
    /// # Errors
    /// [`ResumeError`] where the saved run is of another render, or of another part of it.
    pub fn resume(&self, goal: Goal, saved: Saved) -> Result<Run, ResumeError> {
        let own = Record::new(self, &goal);
        if let Some(difference) = own.difference(&saved.record, false) {
            return Err(ResumeError::OtherRender(difference));
        }
        if (&own.passes, own.shard) != (&saved.record.passes, saved.record.shard) {
            return Err(ResumeError::OtherShard);
        }
        let Saved { record, film } = saved;
        Ok(Run::resumed(self.clone(), goal, film, record.counters, record.render_s))
    }
}
