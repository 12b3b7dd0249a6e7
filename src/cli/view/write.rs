//! Writes the files named on the command line, with the bits of `octolux render`.

use std::path::{Path, PathBuf};

use crate::cli::CliError;
use crate::cli::stats::{Stats, Times};
use octolux::film::write_picture;
use octolux::run::Run;

/// Runs until all pixels have the same sample count, unless adaptive: at the end of a block, a render of as many samples has
/// the same bits.
pub fn complete_block(run: &mut Run) {
    let ragged = |run: &Run| {
        let (least, _, most) = run.spread();
        least == 0 || (least != most && !run.goal().is_adaptive())
    };
    while ragged(run) && run.step().is_more() {}
}

/// Writes each file; returns the names of written files.
///
/// # Errors
/// The first that cannot be written.
pub fn write(scene: &Path, run: &Run, paths: &[PathBuf], exposure: f64) -> Result<Vec<String>, CliError> {
    if let Some(error) = run.failure() {
        return Err(CliError::failed(format!(
            "{error}: the picture would be wrong and is not written"
        )));
    }
    let picture = run.picture();
    let mut attributes = Stats::new(scene, run, Times::default(), false).attributes(exposure);
    if run.goal().is_adaptive() {
        attributes.samples = Some(run.samples());
    }
    let mut written = Vec::new();
    for path in paths {
        write_picture(path, &picture, &attributes)?;
        written.push(path.display().to_string());
    }
    Ok(written)
}
