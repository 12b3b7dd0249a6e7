//! The output files of a render, determined and checked before it starts.

use std::path::{Path, PathBuf};

use super::CliError;
use super::inputs::{Inputs, keeps_checkpoints};
use octolux::film::{check_output, replace};
use octolux::run::MOST_SPP;

/// The placeholder of the scene's name in `--output` and `--stats`.
const NAME: &str = "{name}";

/// The files of one scene.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Targets {
    /// Pictures, each in the format of its extension.
    pub pictures: Vec<PathBuf>,
    /// The figures of the render.
    pub stats: Option<PathBuf>,
    /// The checkpoint.
    pub checkpoint: Option<PathBuf>,
    /// Intermediate pictures.
    pub snapshots: Vec<PathBuf>,
}

impl Targets {
    /// Adds the pictures that `--snapshots` may write.
    #[must_use]
    pub fn with_snapshots(mut self, wanted: bool) -> Self {
        let pictures = self.pictures.iter().filter(|path| wanted && !is_sums(path));
        let passes = (0..=MOST_SPP.ilog2()).map(|power| 1 << power);
        self.snapshots = pictures
            .flat_map(|path| passes.clone().map(|passes| snapshot(path, passes)))
            .collect();
        self
    }

    /// Every file that may be written.
    pub fn all(&self) -> impl Iterator<Item = &Path> {
        let others = self.stats.iter().chain(&self.checkpoint).chain(&self.snapshots);
        self.pictures.iter().chain(others).map(PathBuf::as_path)
    }
}

/// The output files of every scene, in order.
///
/// # Errors
/// Two pictures with one name, a name shared by several scenes, or a file that could not be written.
pub fn plan(
    scenes: &[PathBuf],
    outputs: &[PathBuf],
    stats: Option<&Path>,
    checkpoint: Option<&Path>,
    snapshots: bool,
) -> Result<Vec<Targets>, CliError> {
    if scenes.len() > 1
        && let Some(path) = outputs
            .iter()
            .map(PathBuf::as_path)
            .chain(stats)
            .chain(checkpoint)
            .find(|path| !has_name(path))
    {
        let what = format!("{}: one file for {} scenes", path.display(), scenes.len());
        return Err(CliError::usage(what).with_help("write {name} where the scene's name goes, as in out/{name}.exr"));
    }
    let of_scene = |scene: &PathBuf| Ok(of_scene(scene, outputs, stats, checkpoint)?.with_snapshots(snapshots));
    let targets: Vec<Targets> = scenes.iter().map(of_scene).collect::<Result<_, CliError>>()?;
    look(targets.iter(), &Inputs::named_by(scenes))?;
    Ok(targets)
}

/// Checks that all these files can be written without overwriting an input.
///
/// # Errors
/// The first that cannot be written, or would be written twice.
pub fn look<'a>(targets: impl Iterator<Item = &'a Targets> + Clone, inputs: &Inputs) -> Result<(), CliError> {
    inputs.are_kept_by(targets.clone().flat_map(Targets::all))?;
    for target in targets {
        target.stats.as_deref().map_or(Ok(()), stats_ending)?;
        let (sums, pictures): (Vec<_>, Vec<_>) = target.pictures.iter().partition(|path| is_sums(path));
        for path in pictures {
            check_output(path).map_err(|error| CliError::bad_path(&error))?;
        }
        for path in sums.into_iter().chain(&target.stats).chain(&target.checkpoint) {
            replace::check(path).map_err(|error| CliError::bad_path(&error))?;
        }
        for path in target.pictures.iter().chain(&target.stats).chain(&target.snapshots) {
            keeps_checkpoints(path)?;
        }
    }
    Ok(())
}

/// Checks that a file of figures ends in `.json`.
///
/// # Errors
/// If it does not.
pub fn stats_ending(path: &Path) -> Result<(), CliError> {
    if path.extension().is_some_and(|ending| ending == "json") {
        return Ok(());
    }
    let what = format!("{}: the file for --stats ends in .json", path.display());
    Err(CliError::usage(what).with_help("such as --stats render.json"))
}

/// The path of a snapshot after so many passes: `a.png` becomes `a_0016spp.png`.
pub fn snapshot(path: &Path, passes: u32) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{passes:04}spp."));
    name.push(path.extension().unwrap_or_default());
    path.with_file_name(name)
}

/// The output files of one scene, with names filled in.
///
/// # Errors
/// An unknown placeholder.
pub fn of_scene(
    scene: &Path,
    outputs: &[PathBuf],
    stats: Option<&Path>,
    checkpoint: Option<&Path>,
) -> Result<Targets, CliError> {
    // A path without a name (`..`) is no scene; loading it reports the error.
    let name = scene.file_stem().map_or("scene".into(), |name| name.to_string_lossy());
    let pictures = if outputs.is_empty() {
        vec![format!("{name}.exr").into(), format!("{name}.png").into()]
    } else {
        outputs.iter().map(|path| fill(path, &name)).collect::<Result<_, _>>()?
    };
    Ok(Targets {
        pictures,
        stats: stats.map(|path| fill(path, &name)).transpose()?,
        checkpoint: checkpoint.map(|path| fill(path, &name)).transpose()?,
        snapshots: Vec::new(),
    })
}

/// The file of one picture of a scene, with its name filled in.
///
/// # Errors
/// An unknown placeholder.
pub fn of_picture(scene: &Path, output: &Path) -> Result<PathBuf, CliError> {
    Ok(of_scene(scene, &[output.to_owned()], None, None)?.pictures.remove(0))
}

/// Whether a file contains sums, by its extension.
pub fn is_sums(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("acc"))
}

fn has_name(path: &Path) -> bool {
    path.to_str().is_some_and(|path| path.contains(NAME))
}

fn fill(path: &Path, name: &str) -> Result<PathBuf, CliError> {
    let Some(text) = path.to_str() else {
        return Ok(path.to_owned());
    };
    match placeholder(&text.replace(NAME, "")) {
        None => Ok(text.replace(NAME, name).into()),
        Some(unknown) => {
            let what = format!("{}: {unknown} is no placeholder", path.display());
            Err(CliError::usage(what).with_help("the only one is {name}, which stands for the scene's name"))
        }
    }
}

/// Checks that a file of a command that fills in no names has no placeholder.
///
/// # Errors
/// If it has one.
pub fn without_placeholder(path: &Path) -> Result<(), CliError> {
    path.to_str().and_then(placeholder).map_or(Ok(()), |word| {
        let what = format!("{}: {word} is not filled in by this command", path.display());
        Err(CliError::usage(what).with_help("write a name without braces"))
    })
}

/// The first word of letters in braces. Other braces are part of a file's name.
fn placeholder(text: &str) -> Option<&str> {
    text.match_indices('{').find_map(|(start, _)| {
        let length = text[start + 1..].find(|c: char| !c.is_ascii_alphabetic() && c != '_')?;
        let end = start + 1 + length;
        (length > 0 && text[end..].starts_with('}')).then(|| &text[start..=end])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_filled_in_for_every_scene() {
        let scenes = ["a/veach.toml".into(), "b.v2.toml".into()];
        let targets = plan(&scenes, &[], None, None, false).unwrap();
        assert_eq!(targets[0].pictures, [PathBuf::from("veach.exr"), "veach.png".into()]);
        assert_eq!(targets[1].pictures, [PathBuf::from("b.v2.exr"), "b.v2.png".into()]);
        let targets = plan(
            &scenes,
            &["{name}-x.npy".into()],
            Some(Path::new("{name}.json")),
            None,
            false,
        )
        .unwrap();
        assert_eq!(targets[1].pictures, [PathBuf::from("b.v2-x.npy")]);
        assert_eq!(targets[1].stats, Some("b.v2.json".into()));
    }

    #[test]
    fn words_in_braces_are_placeholders_and_other_braces_are_not() {
        for (text, found) in [
            ("{nam}.npy", Some("{nam}")),
            ("a{1}/{{Name}.png", Some("{Name}")),
            ("{}", None),
            ("{a", None),
            ("a}", None),
            ("{a-b}", None),
            ("{1}{\u{e9}}", None),
        ] {
            assert_eq!(placeholder(text), found, "{text}");
        }
    }

    #[test]
    fn names_that_clash_are_refused() {
        let says = |scenes: &[&str], outputs: &[&str]| {
            let paths = |list: &[&str]| list.iter().map(PathBuf::from).collect::<Vec<_>>();
            plan(&paths(scenes), &paths(outputs), None, None, false)
                .unwrap_err()
                .to_string()
        };
        assert_eq!(says(&["a.toml", "b.toml"], &["x.exr"]), "x.exr: one file for 2 scenes");
        assert_eq!(says(&["p/a.toml", "q/a.toml"], &[]), "a.exr: would be written twice");
        assert_eq!(says(&["a.toml"], &["x.exr", "x.exr"]), "x.exr: would be written twice");
    }

    #[test]
    fn snapshots_sort_by_their_passes() {
        assert_eq!(snapshot(Path::new("out/a.b.png"), 16), Path::new("out/a.b_0016spp.png"));
    }
}
