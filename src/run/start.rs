//! Starts or resumes a run from a prepared scene and a goal.

use std::time::Duration;

use super::{Goal, Record, ResumeError, Run, Saved, Shard};
use crate::pipeline::Prepared;

impl Prepared {
    /// A run to any goal.
    pub fn start(&self, goal: Goal) -> Run {
        Run::new(self.clone(), goal)
    }

    /// A run of `spp` samples of every pixel.
    pub fn passes(&self, spp: u32) -> Run {
        self.start(Goal::passes(spp))
    }

    /// A run of as many samples as fit into `time`, at least one of every pixel.
    pub fn for_time(&self, time: Duration) -> Run {
        self.start(Goal::time(time))
    }

    /// A run until the noise falls to this share of the picture: see [`Goal::error`].
    pub fn until_error(&self, error: f64) -> Run {
        self.start(Goal::error(error))
    }

    /// A run of `spp` samples per pixel on average, more where the relative error is larger: see [`Goal::adaptive`].
    pub fn adaptive(&self, spp: u32) -> Run {
        self.start(Goal::adaptive(spp))
    }

    /// A run of one shard of `spp` samples of every pixel.
    pub fn shard(&self, shard: Shard, spp: u32) -> Run {
        self.start(Goal::shard(shard, spp))
    }

    /// Resumes a saved run. With the same goal, the picture has the bits of an uninterrupted run.
    ///
    /// The goal may have more samples of every pixel than the saved run's. The run then first reaches the saved run's goal, and
    /// continues as by [`Run::extend`]. The picture has the bits of an uninterrupted run if the saved run's goal ends a block
    /// (1, 2, 4, 8, ... up to a leaf, then every leaf); otherwise it sums the same samples in another order.
    ///
    /// A render to an error may be resumed with another error or time limit; the limit includes the time of the saved run.
    ///
    /// # Errors
    /// [`ResumeError`] where the saved run belongs to another render, or to another part of it.
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
