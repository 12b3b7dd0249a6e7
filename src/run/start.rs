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
    /// The goal may ask for more samples of every pixel than the saved run did. The run then first reaches the samples that it was to
    /// have, and goes on from there as by [`Run::extend`]: the picture has the bits of a run in one piece where these samples end a
    /// block (1, 2, 4, 8, ... up to a leaf, then every leaf), and otherwise sums the same samples in another order.
    ///
    /// A render to an error may be taken up with another error or time: time counts all that was rendered.
    ///
    /// # Errors
    /// [`ResumeError`] where the saved run is of another render, or of another part of it.
    pub fn resume(&self, goal: Goal, saved: Saved) -> Result<Run, ResumeError> {
        let (first, more) = goal.resuming(saved.record.spp);
        let own = Record::new(self, &first);
        if let Some(difference) = own.difference(&saved.record, false) {
            return Err(ResumeError::OtherRender(difference));
        }
        if (&own.passes, own.shard) != (&saved.record.passes, saved.record.shard) {
            return Err(ResumeError::OtherShard);
        }
        if let Some(replicates) = saved.record.replicates.clone() {
            return Ok(Run::resumed_replicates(self.clone(), first, saved, replicates));
        }
        let Saved { record, film, .. } = saved;
        let run = Run::resumed(self.clone(), first, film, record.counters, record.render_s);
        Ok(run.going_on_to(more))
    }
}
