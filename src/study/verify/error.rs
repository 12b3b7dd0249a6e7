//! Why a verification ends without a verdict.

use crate::pipeline::SetupError;

/// What stops a verification.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// A render cannot start.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A stop was asked for.
    #[error("stopped before the end")]
    Stopped,
    /// The oracle's threads could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}
