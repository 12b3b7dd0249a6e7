//! The result of a case: figures with their bounds.

use std::error::Error;

use serde::Serialize;

/// One figure of a case. It passes if it is at most its bound; NaN fails.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is measured, with its unit.
    pub measured: String,
    /// What was found.
    pub figure: f64,
    /// The largest value allowed.
    pub bound: f64,
}

impl Check {
    /// A figure with its bound.
    pub fn new(measured: impl Into<String>, figure: f64, bound: f64) -> Self {
        Self {
            measured: measured.into(),
            figure,
            bound,
        }
    }

    /// A count of something that must not happen.
    pub fn none(measured: impl Into<String>, count: usize) -> Self {
        Self::new(measured, count as f64, 0.0)
    }

    /// Whether the figure is within its bound.
    pub fn passes(&self) -> bool {
        self.figure <= self.bound
    }
}

/// The figures of a case, or why it could not be run.
pub type Checks = Result<Vec<Check>, Box<dyn Error + Send + Sync>>;

/// How much work a case does.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// 1 for all of it; a divisor of sizes and samples else.
    pub divisor: u32,
}

impl Effort {
    /// The full amount of work.
    pub const FULL: Self = Self { divisor: 1 };

    /// A share of `count`, at least 1.
    pub fn of(self, count: u32) -> u32 {
        (count / self.divisor).max(1)
    }
}
