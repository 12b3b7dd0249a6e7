//! Mistakes in the manifest of a batch, told as mistakes in scenes are.

use std::fs;

use crate::place::Place;

#[test]
fn a_manifest_that_makes_no_sense_is_refused() {
    let place = Place::new();
    for (text, words) in [
        ("", "jobs.toml: has no [[pictures]]"),
        ("[[pictures]]\nspp = 3\n", "jobs.toml:1: [[pictures]] 1 names no scene"),
        ("[[pictures]]\nscene = 3 4\n", "jobs.toml:2: not valid TOML"),
        (
            "[[pictures]]\nscene = \"in/small.toml\"\noutputs = [\"in/small.toml/a/x.png\"]\n",
            "its folder in/small.toml/a cannot be made",
        ),
        (
            "[[pictures]]\nscene = \"in/small.toml\"\noutputs = [\"new/deep/a.exr\", \"new/other/a.jpg\"]\n",
            "a.jpg: ",
        ),
        (
            "[[pictures]]\nscenes = [\"in/small.toml\", \"in/small.toml\"]\n",
            "small.exr: would be written twice",
        ),
        ("[[pictures]]\nscene = \"in/*.tom\"\n", "in/*.tom: no file matches"),
        (
            "[[pictures]]\nscene = \"in/small.toml\"\nadaptive = true\ntime = \"1s\"\n",
            "cannot be used with --time, unless --target-error is given",
        ),
        (
            "[[pictures]]\nscene = \"in/small.toml\"\nshard = \"1/2\"\noutputs = [\"half.npy\"]\n",
            "--shard writes sums, and needs one output that ends in .acc",
        ),
        ("[defaults]\n[[picture]]\n", "jobs.toml:2: has no key \"picture\""),
        ("defaults = 3\n[[pictures]]\n", "jobs.toml:1: defaults is no table"),
        (
            "[pictures]\nscene = \"in/small.toml\"\n",
            "jobs.toml:1: pictures is no list of tables",
        ),
        ("pictures = [3]\n", "jobs.toml:1: [[pictures]] 1 is no table"),
    ] {
        fs::write(place.path().join("jobs.toml"), text).unwrap();
        let said = place.refused("batch jobs.toml");
        assert!(said.contains(words), "{text}: {said}");
    }
    place.refused("batch nowhere.toml");
    assert!(place.refused("batch in").contains("in: is no file"));
}

/// As errors of scenes: the file, the line, the key, the value, and what would do.
#[test]
fn a_key_or_value_of_a_manifest_that_no_picture_can_have_is_named_with_its_line() {
    let place = Place::new();
    for (line, what, help) in [
        (
            "sppp = 3",
            "[[pictures]] 1 has no key `sppp`",
            "did you mean `spp`? the keys are scene, scenes, outputs, spp,",
        ),
        (
            "temperature = 3",
            "[[pictures]] 1 has no key `temperature`",
            "the keys are scene, ",
        ),
        (
            "spp = 0",
            "[[pictures]] 1: spp cannot be 0",
            "samples a pixel are a whole number from 1 to 1073741824",
        ),
        (
            "spp = true",
            "[[pictures]] 1: spp cannot be true",
            "write a value, or leave the key out",
        ),
        (
            "spp = []",
            "[[pictures]] 1: spp cannot be []",
            "write a value, or leave the key out",
        ),
        (
            "adaptive = \"yes\"",
            "[[pictures]] 1: adaptive cannot be \"yes\"",
            "write true or false, without quotes",
        ),
        (
            "estimator = \"best\"",
            "[[pictures]] 1: estimator cannot be \"best\"",
            "write one of auto, uniform, light, ",
        ),
        (
            "size = 1979-05-27",
            "[[pictures]] 1 has a size that no option takes",
            "write a number, true, false, a text in quotes",
        ),
        (
            "quiet = true",
            "[[pictures]] 1 has no key `quiet`",
            "it is for a command line alone",
        ),
        (
            "output = \"a.exr\"",
            "[[pictures]] 1 has no key `output`",
            "pictures go to outputs = [",
        ),
        (
            "keep = true",
            "[[pictures]] 1 needs checkpoint, too",
            "another key has no meaning without it",
        ),
        (
            "outputs = \"{nam}.exr\"",
            "{nam}.exr: {nam} is no placeholder",
            "the only one is {name}, which stands for the scene's name",
        ),
        (
            "stats = \"a.txt\"",
            "a.txt: the file for --stats ends in .json",
            "such as --stats render.json",
        ),
        (
            "outputs = \"a.jpg\"",
            "a.jpg: a picture ends in .exr, .png or .npy",
            "the ending chooses the format",
        ),
        (
            "scenes = \"no*.toml\"",
            "no*.toml: no file matches",
            "* stands for any part of a name",
        ),
    ] {
        let text = format!("# A line more.\n[[pictures]]\n{line}\nscene = \"in/small.toml\"\n");
        fs::write(place.path().join("jobs.toml"), text).unwrap();
        let said = place.refused("batch jobs.toml");
        let number = if line.starts_with("keep") { 2 } else { 3 };
        let (what, help) = (
            format!("error: jobs.toml:{number}: {what}\n"),
            format!("\nhelp: {help}"),
        );
        assert!(said.starts_with(&what) && said.contains(&help), "{line}: {said}");
    }
    // Defaults have their own lines, and a picture is told apart from those before it.
    let text = "[defaults]\nseed = -1\n[[pictures]]\nscene = \"in/small.toml\"\n";
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    let said = place.refused("batch jobs.toml");
    assert!(
        said.starts_with("error: jobs.toml:2: [[pictures]] 1: seed cannot be -1\n"),
        "{said}"
    );
    let one = "[[pictures]]\nscene = \"in/small.toml\"\noutputs = \"a.exr\"\n";
    fs::write(place.path().join("jobs.toml"), one.repeat(3)).unwrap();
    let said = place.refused("batch jobs.toml");
    assert!(
        said.starts_with("error: jobs.toml:6: a.exr: would be written twice\n"),
        "{said}"
    );
    let text = "[[pictures]]\nscene = \"in/small.toml\"\nspp = 3\ntime = \"1s\"\n";
    fs::write(place.path().join("jobs.toml"), text).unwrap();
    let said = place.refused("batch jobs.toml");
    assert!(
        said.contains("[[pictures]] 1: ") && said.contains("cannot be used with"),
        "{said}"
    );
}
