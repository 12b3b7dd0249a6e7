//! File patterns as in a shell: `*` for any part of a name, `?` for one character. For quoted patterns, and for manifests,
//! which no shell expands.

use std::fs;
use std::path::{Component, Path, PathBuf};

use super::CliError;

/// The files of each path: itself if it exists or is no pattern, otherwise all matches, sorted.
///
/// # Errors
/// A pattern without a match.
pub fn expand(paths: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let mut all = Vec::new();
    for path in paths {
        if !is_pattern(path) || path.exists() {
            all.push(path.clone());
            continue;
        }
        let found = matches(path);
        if found.is_empty() {
            let what = format!("{}: no file matches", path.display());
            return Err(CliError::usage(what)
                .with_help("* stands for any part of a name, ? for one letter; folders are not searched"));
        }
        all.extend(found);
    }
    Ok(all)
}

fn is_pattern(path: &Path) -> bool {
    path.to_string_lossy().contains(['*', '?'])
}

fn matches(pattern: &Path) -> Vec<PathBuf> {
    let mut found = vec![PathBuf::new()];
    for component in pattern.components() {
        let name = component.as_os_str().to_string_lossy();
        found = match component {
            Component::Normal(_) if name.contains(['*', '?']) => {
                let letters: Vec<char> = name.chars().collect();
                found.iter().flat_map(|folder| in_folder(folder, &letters)).collect()
            }
            _ => found.into_iter().map(|folder| folder.join(component)).collect(),
        };
    }
    found.retain(|path| path.is_file());
    found
}

/// The matches in a folder, sorted. As in a shell, hidden names only match a pattern with a leading dot.
fn in_folder(folder: &Path, pattern: &[char]) -> Vec<PathBuf> {
    let place = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let entries = fs::read_dir(place).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name());
    let fits = |name: &std::ffi::OsString| {
        let name: Vec<char> = name.to_string_lossy().chars().collect();
        (name.first() != Some(&'.') || pattern.first() == Some(&'.')) && fits(&name, pattern)
    };
    let mut found: Vec<PathBuf> = names.filter(fits).map(|name| folder.join(name)).collect();
    found.sort();
    found
}

/// Whether a name matches: the last `*` takes as little as possible, and more on backtracking.
fn fits(name: &[char], pattern: &[char]) -> bool {
    let (mut at, mut asked, mut star) = (0, 0, None);
    while at < name.len() {
        match pattern.get(asked) {
            Some('*') => {
                star = Some((at, asked));
                asked += 1;
            }
            Some(&letter) if letter == '?' || letter == name[at] => (at, asked) = (at + 1, asked + 1),
            _ => {
                let Some((from, of)) = star else { return false };
                star = Some((from + 1, of));
                (at, asked) = (from + 1, of + 1);
            }
        }
    }
    pattern[asked..].iter().all(|&letter| letter == '*')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_and_question_marks_fit_as_in_a_shell() {
        let fits = |name: &str, pattern: &str| {
            let letters = |text: &str| text.chars().collect::<Vec<_>>();
            fits(&letters(name), &letters(pattern))
        };
        for (name, pattern) in [
            ("a.toml", "*.toml"),
            ("abcbd", "a*b?"),
            ("", "*"),
            ("ab", "a**b"),
            ("é", "?"),
        ] {
            assert!(fits(name, pattern), "{name} {pattern}");
        }
        for (name, pattern) in [("a.tom", "*.toml"), ("abc", "a*b"), ("", "?"), ("ab", "a")] {
            assert!(!fits(name, pattern), "{name} {pattern}");
        }
    }

    #[test]
    fn files_come_sorted_and_none_is_an_error() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        fs::create_dir(at("in")).unwrap();
        for name in ["in/b.toml", "in/a.toml", "in/.c.toml", "in/d.txt", "in/[x]*.toml"] {
            fs::write(at(name), "").unwrap();
        }
        let found = expand(&[at("i?/*.toml"), at("none")]).unwrap();
        assert_eq!(
            found,
            [at("in/[x]*.toml"), at("in/a.toml"), at("in/b.toml"), at("none")]
        );
        assert_eq!(
            expand(&[at("in/[x]*.toml")]).unwrap(),
            [at("in/[x]*.toml")],
            "a file of that very name"
        );
        assert!(expand(&[at("in/*.ply")]).is_err());
    }
}
