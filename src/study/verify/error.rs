//! Errors that end a verification without a verdict.

use crate::pipeline::SetupError;
use crate::study::error::NotFinite;

/// Why a verification stopped.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// A render cannot start.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A stop was requested.
    #[error("stopped before the end")]
    Stopped,
    /// A picture needed for verdicts has NaN or infinite values.
    #[error("{whose} picture cannot be judged: {wrong}; this is a fault of Octolux, please report the scene")]
    NotFinite {
        /// Which picture.
        whose: &'static str,
        /// What is wrong with it.
        wrong: NotFinite,
    },
    /// The oracle's threads could not be started.
    #[error("cannot start the threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

impl VerifyError {
    /// Rejects a picture in which a value is NaN or infinite.
    ///
    /// # Errors
    /// [`Self::NotFinite`].
    pub fn unless_finite<T: Copy + Into<f64>>(whose: &'static str, pixels: &[[T; 3]], width: u32) -> Result<(), Self> {
        NotFinite::find(pixels, width).map_or(Ok(()), |wrong| Err(Self::NotFinite { whose, wrong }))
    }
}
