//! `octolux info`: what files say of themselves.

use serde_json::Value;

use crate::place::{Place, stderr, stdout};

#[test]
fn pictures_tell_their_size_their_format_and_what_made_them() {
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 5 --seed 7 --size 9x7 -o a.exr -o a.npy -o a.png");
    let output = place.succeeds("info a.exr a.npy a.png --json");
    let all: Vec<Value> = stdout(&output)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    for one in &all {
        assert_eq!((&one["width"], &one["height"]), (&9.into(), &7.into()), "{one}");
    }
    assert_eq!(
        (&all[0]["spp"], &all[0]["seed"], &all[0]["estimator"]),
        (&5.into(), &7.into(), &"product".into())
    );
    assert_eq!(all[0]["channels"], "B f32, G f32, R f32");
    assert!(all[1]["format"].as_str().unwrap().contains("<f4"), "{}", all[1]);
    let text = stdout(&place.succeeds("info a.exr"));
    assert!(
        text.starts_with("file ") && text.contains("\nscene ") && text.contains("in/small.toml"),
        "{text}"
    );
}

#[test]
fn parts_and_checkpoints_tell_which_passes_they_hold() {
    let place = Place::new();
    place.succeeds("render in/small.toml --spp 8192 --shard 1/2 -o a.acc");
    let one: Value = serde_json::from_str(&stdout(&place.succeeds("info a.acc --json"))).unwrap();
    assert_eq!(
        (&one["shard"], &one["passes"], &one["spp"]),
        (&"1/2".into(), &"0 to 4096".into(), &8192.into())
    );
    assert_eq!(
        (&one["size"], &one["format"]),
        (&"8 x 6".into(), &"sums of Octolux, whole".into())
    );
    place.succeeds("render in/small.toml --target-error 0.05 --checkpoint a.state --keep -o a.npy");
    let one: Value = serde_json::from_str(&stdout(&place.succeeds("info a.state --json"))).unwrap();
    assert!(one["pictures"].as_u64().unwrap() >= 8, "{one}");
}

#[test]
fn every_part_of_an_exr_file_is_told() {
    use exr::prelude::WritableImage;
    use exr::prelude::{Encoding, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes, SpecificChannels};
    let place = Place::new();
    let layer = |name: &str, size: (usize, usize)| {
        let channels = SpecificChannels::rgb(|_| (0.5_f32, 0.5_f32, 0.5_f32));
        Layer::new(size, LayerAttributes::named(name), Encoding::FAST_LOSSLESS, channels)
    };
    let image = Image::empty(ImageAttributes::new(IntegerBounds::from_dimensions((9, 7))));
    let image = image
        .with_layer(layer("left", (9, 7)))
        .with_layer(layer("right", (5, 4)));
    image.write().to_file(place.path().join("two.exr")).unwrap();
    let one: Value = serde_json::from_str(&stdout(&place.succeeds("info two.exr --json"))).unwrap();
    let widths = (&one["left: width"], &one["right: width"]);
    assert_eq!((&one["parts"], widths), (&2.into(), (&9.into(), &5.into())), "{one}");
    assert_eq!(one["right: channels"], "B f32, G f32, R f32", "{one}");
}

#[test]
fn what_is_no_picture_is_said_and_the_others_are_told() {
    let place = Place::new();
    place.succeeds("render in/small.toml -o a.npy");
    std::fs::write(place.path().join("cut.exr"), "v/1").unwrap();
    let output = place.octolux("info cut.exr a.npy in/small.toml none.exr in");
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    for words in [
        "cut.exr: is not a whole EXR",
        "in/small.toml: is no picture",
        "none.exr: cannot be read",
        "in: is a folder",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(stdout(&output).contains("a.npy"));
}
