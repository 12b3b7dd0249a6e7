//! What picture files say, for textures and environments: made here by another program's rules, or by OpenEXR's own library
//! (`tests/pictures`: half floats, written by its Python package 3.5.3), and read back as linear Rec. 709.

use std::path::Path;

use exr::meta::attribute::{Chromaticities, EnvironmentMap};
use exr::prelude::*;
use octolux::scene::{Environment, Scene};

const VIEW: &str =
    "[camera]\norigin = [0, 0, 9]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_y = 30\n[film]\nwidth = 4\nheight = 4\n";

/// The texels of a picture by rows, its width, and what is said of it; or the error.
type Found = std::result::Result<(Vec<[f32; 3]>, u32, Vec<String>), String>;

fn texture(folder: &Path, name: &str, more: &str) -> Found {
    let text = format!("{VIEW}[materials.m]\ndiffuse = [1, 1, 1]\ntexture = \"{name}\"\n{more}\n");
    let scene = Scene::parse(&text, &folder.join("s.toml")).map_err(|error| format!("{error:?}"))?;
    let texture = scene.materials()[0].texture.clone().unwrap();
    Ok((texture.texels.iter().collect(), texture.width, notes(&scene)))
}

fn environment(folder: &Path, name: &str, more: &str) -> Found {
    let text = format!("{VIEW}[environment]\nfile = \"{name}\"\n{more}\n");
    let scene = Scene::parse(&text, &folder.join("s.toml")).map_err(|error| format!("{error:?}"))?;
    let Some(Environment::Picture(picture)) = scene.environment() else {
        panic!("a picture");
    };
    Ok((picture.texels.iter().collect(), picture.width, notes(&scene)))
}

/// All that is said but that nothing is lit.
fn notes(scene: &Scene) -> Vec<String> {
    let notes = scene
        .notes()
        .iter()
        .filter(|note| !note.contains("nothing in the scene emits"));
    notes.cloned().collect()
}

/// Both uses of a picture read the same of it.
#[track_caller]
pub fn both(folder: &Path, name: &str, more: &str) -> (Vec<[f32; 3]>, u32, Vec<String>) {
    let [a, b] = [texture(folder, name, more), environment(folder, name, more)].map(std::result::Result::unwrap);
    assert!(a.0 == b.0 && a.1 == b.1, "{name}");
    (a.0, a.1, b.2)
}

#[track_caller]
pub fn near(a: [f32; 3], b: [f64; 3], tolerance: f64) {
    assert!(
        a.iter().zip(b).all(|(a, b)| (f64::from(*a) - b).abs() <= tolerance),
        "{a:?} is not {b:?}"
    );
}

/// Writes an EXR of one layer: its size, its place in the display window, its attributes, its texels.
fn write(
    path: &Path,
    (width, height): (usize, usize),
    window: Option<IntegerBounds>,
    position: (i32, i32),
    attributes: impl Fn(&mut ImageAttributes, &mut LayerAttributes),
    texel: impl Sync + Fn(usize, usize) -> (f32, f32, f32),
) {
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| texel(at.x(), at.y()));
    let mut of_layer = LayerAttributes::named("").with_position(Vec2(position.0, position.1));
    let window = window.unwrap_or(IntegerBounds::new((0, 0), (width, height)));
    let mut of_image = ImageAttributes::new(window);
    attributes(&mut of_image, &mut of_layer);
    let layer = Layer::new((width, height), of_layer, Encoding::FAST_LOSSLESS, channels);
    Image::new(of_image, layer).write().to_file(path).unwrap();
}

fn plain(_: &mut ImageAttributes, _: &mut LayerAttributes) {}

#[test]
fn the_display_window_is_the_picture() {
    let place = tempfile::tempdir().unwrap();
    let at = |name: &str| place.path().join(name);
    // Every texel knows where it is in the display window.
    let colour = |x: i32, y: i32| [1.0 + x as f32, 20.0 + y as f32, 1.0];
    for (name, window, position, size) in [
        ("crop.exr", ((0, 0), (8, 4)), (2, 1), (3, 2)),
        ("overscan.exr", ((0, 0), (8, 4)), (-2, -1), (12, 7)),
        ("shifted.exr", ((100, -50), (8, 4)), (98, -52), (9, 5)),
        ("corner.exr", ((5, 5), (8, 4)), (9, 7), (20, 20)),
        ("beside.exr", ((0, 0), (8, 4)), (30, 0), (2, 2)),
    ] {
        let window = IntegerBounds::new(window.0, window.1);
        let (left, top) = (position.0 - window.position.x(), position.1 - window.position.y());
        write(&at(name), size, Some(window), position, plain, |x, y| {
            let [r, g, b] = colour(left + x as i32, top + y as i32);
            (r.max(0.0), g.max(0.0), b)
        });
        let (texels, width, _) = both(place.path(), name, "");
        assert_eq!((texels.len(), width), (32, 8), "{name}");
        for (i, texel) in (0..).zip(texels) {
            let (x, y) = (i % 8, i / 8);
            let stored = (left..left + size.0 as i32).contains(&x) && (top..top + size.1 as i32).contains(&y);
            assert_eq!(texel, if stored { colour(x, y) } else { [0.0; 3] }, "{name} at {x} {y}");
        }
    }
}

/// The matrices are those of the standards to 1e-4 (`src/scene/picture/colour.rs` proves it); here they reach the texels, and white
/// stays white.
#[test]
fn chromaticities_are_converted_to_rec_709_with_a_note() {
    let place = tempfile::tempdir().unwrap();
    let named = |red, green, blue, white| Chromaticities {
        red,
        green,
        blue,
        white,
    };
    let ap1 = named(
        Vec2(0.713, 0.293),
        Vec2(0.165, 0.830),
        Vec2(0.128, 0.044),
        Vec2(0.32168, 0.33767),
    );
    let xyz = named(
        Vec2(1.0, 0.0),
        Vec2(0.0, 1.0),
        Vec2(0.0, 0.0),
        Vec2(1.0 / 3.0, 1.0 / 3.0),
    );
    let rec_709 = named(Vec2(0.64, 0.33), Vec2(0.3, 0.6), Vec2(0.15, 0.06), Vec2(0.3127, 0.3290));
    // 0.8, 0.4, 0.1 of Rec. 709 in XYZ, by the matrix that IEC 61966-2-1 prints.
    for (name, chromaticities, from, to) in [
        ("white.exr", ap1, (0.7, 0.7, 0.7), [0.7; 3]),
        ("red.exr", ap1, (0.5, 0.2, 0.2), [0.711_515, 0.160_922, 0.192_8]),
        ("xyz.exr", xyz, (0.491, 0.463_38, 0.158_17), [0.8, 0.4, 0.1]),
        ("same.exr", rec_709, (0.8, 0.4, 0.1), [0.8, 0.4, 0.1]),
    ] {
        let attributes = |image: &mut ImageAttributes, _: &mut LayerAttributes| {
            image.chromaticities = Some(chromaticities);
        };
        write(&place.path().join(name), (4, 2), None, (0, 0), attributes, |_, _| from);
        let (texels, _, notes) = both(place.path(), name, "");
        near(texels[0], to, 1e-3);
        assert_eq!(
            notes.iter().any(|note| note.contains("chromaticities")),
            name != "same.exr",
            "{notes:?}"
        );
    }
    let broken = |image: &mut ImageAttributes, _: &mut LayerAttributes| {
        image.chromaticities = Some(named(Vec2(0.3, 0.3), Vec2(0.3, 0.3), Vec2(0.3, 0.3), Vec2(0.3, 0.0)));
    };
    write(
        &place.path().join("broken.exr"),
        (4, 2),
        None,
        (0, 0),
        broken,
        |_, _| (1.0, 1.0, 1.0),
    );
    let error = texture(place.path(), "broken.exr", "").unwrap_err();
    assert!(
        error.contains("names chromaticities (primaries) that no colours can have"),
        "{error}"
    );
}

#[test]
fn cubes_are_refused_by_name_as_environments() {
    let place = tempfile::tempdir().unwrap();
    let cube = |_: &mut ImageAttributes, layer: &mut LayerAttributes| {
        layer.environment_map = Some(EnvironmentMap::Cube);
    };
    write(&place.path().join("cube.exr"), (2, 12), None, (0, 0), cube, |_, _| {
        (1.0, 1.0, 1.0)
    });
    let error = environment(place.path(), "cube.exr", "").unwrap_err();
    assert!(
        error.contains("is a cube map (its attribute envmap says cube)"),
        "{error}"
    );
    assert!(texture(place.path(), "cube.exr", "").is_ok());
}

/// Written by OpenEXR's library: chroma of half the width and height, the same for all pixels, luminance by pixel.
#[test]
fn luminance_and_chroma_are_colours_again() {
    // What halves lose: 11 bits of luminance and of each difference.
    for (name, tolerance) in [
        ("no", 4e-3),
        ("rle", 4e-3),
        ("zips", 4e-3),
        ("zip", 4e-3),
        ("piz", 4e-3),
        ("pxr24", 4e-3),
        // Loses more on purpose.
        ("dwaa", 2e-2),
    ] {
        let (texels, width, _) = both(Path::new("tests/pictures"), &format!("chroma-{name}.exr"), "");
        assert_eq!((texels.len(), width), (16 * 36, 16));
        let unit = 0.8 * 0.2126 + 0.4 * 0.7152 + 0.1 * 0.0722;
        for (i, texel) in texels.into_iter().enumerate() {
            let luminance = 0.2 + 0.05 * (i % 16) as f64 + 0.01 * (i / 16) as f64;
            near(texel, [0.8, 0.4, 0.1].map(|x| x * luminance / unit), tolerance);
        }
    }
    let error = texture(Path::new("tests/pictures"), "chroma-b44.exr", "").unwrap_err();
    assert!(
        error.contains("has channels of fewer samples than pixels, compressed by"),
        "{error}"
    );
}

#[test]
fn luminance_alone_is_grey() {
    let place = tempfile::tempdir().unwrap();
    let channel = AnyChannel::new("Y", FlatSamples::F32((0..8).map(|i| i as f32).collect()));
    let layer = Layer::new(
        (4, 2),
        LayerAttributes::default(),
        Encoding::UNCOMPRESSED,
        AnyChannels::sort([channel].into_iter().collect()),
    );
    Image::from_layer(layer)
        .write()
        .to_file(place.path().join("y.exr"))
        .unwrap();
    let (texels, ..) = both(place.path(), "y.exr", "");
    assert!(texels.iter().zip(0..).all(|(texel, i)| *texel == [i as f32; 3]));
}

/// Written by OpenEXR's library: `ViewLayer.Combined` and `ViewLayer.DiffCol` beside a depth; two parts of three channels each.
#[test]
fn a_layer_is_chosen_by_its_name_and_others_are_listed() {
    let folder = Path::new("tests/pictures");
    for (name, layer, value) in [
        ("layers.exr", "ViewLayer.Combined", 1.0),
        ("layers.exr", "ViewLayer.DiffCol", 3.0),
        ("parts.exr", "beauty", 1.0),
        ("parts.exr", "albedo", 2.0),
    ] {
        let (texels, ..) = both(folder, name, &format!("layer = \"{layer}\""));
        assert_eq!(texels[0], [value, value / 2.0, value / 4.0], "{layer}");
    }
    let unsaid = texture(folder, "layers.exr", "").unwrap_err();
    assert!(
        unsaid.contains("holds several layers, and none of them is the picture"),
        "{unsaid}"
    );
    assert!(
        unsaid.contains("one of \"ViewLayer.Combined\", \"ViewLayer.DiffCol\""),
        "{unsaid}"
    );
    let missing = environment(folder, "parts.exr", "layer = \"normal\"").unwrap_err();
    assert!(
        missing.contains("has no layer \"normal\"") && missing.contains("\"beauty\", \"albedo\""),
        "{missing}"
    );
    let (texels, _, notes) = both(folder, "parts.exr", "");
    assert_eq!(texels[0][0], 1.0);
    assert!(
        notes[0].contains("holds the pictures \"beauty\", \"albedo\": the first is read"),
        "{notes:?}"
    );
}

#[test]
fn noise_below_zero_is_taken_as_zero_with_a_note() {
    let place = tempfile::tempdir().unwrap();
    let write = |name: &str, low: f32| {
        write(&place.path().join(name), (4, 2), None, (0, 0), plain, |x, y| {
            if (x, y) == (2, 1) {
                (low, 1.0, 1.0)
            } else {
                (1.0, 1.0, 1.0)
            }
        });
    };
    write("noise.exr", -1e-4);
    let (texels, _, notes) = both(place.path(), "noise.exr", "");
    assert_eq!(texels[6], [0.0, 1.0, 1.0]);
    assert!(
        notes[0].ends_with("\"noise.exr\": 1 number below 0, down to -1e-4, taken as 0"),
        "{notes:?}"
    );
    write("deep.exr", -0.1);
    let error = texture(place.path(), "deep.exr", "").unwrap_err();
    assert!(error.contains("has [-0.1, 1.0, 1.0] at (2, 1)"), "{error}");
}

/// Red in four inks as Adobe's programs and Pillow store it, inverted (libvips, issue 1283).
#[test]
fn inks_become_colours() {
    let (texels, ..) = texture(Path::new("tests/pictures"), "cmyk.jpg", "").unwrap();
    near(texels[100], [1.0, 0.0, 0.0], 0.02);
}

/// Grey of sRGB 118 is a reflectance of 0.181 (IEC 61966-2-1).
#[test]
fn jpeg_and_png_are_textures_and_with_a_note_environments() {
    let place = tempfile::tempdir().unwrap();
    let grey = image::RgbImage::from_pixel(16, 8, image::Rgb([118; 3]));
    for name in ["a.png", "a.jpg", "a.JPEG"] {
        grey.save(place.path().join(name)).unwrap();
        let (texels, width, notes) = both(place.path(), name, "");
        assert_eq!((texels.len(), width), (128, 16));
        near(texels[77], [0.1812; 3], 1e-3);
        assert!(
            notes.len() == 1 && notes[0].contains("is an ordinary picture"),
            "{notes:?}"
        );
    }
    let deep = image::ImageBuffer::<image::Rgb<u16>, _>::from_pixel(4, 2, image::Rgb([30_326_u16; 3]));
    deep.save(place.path().join("deep.png")).unwrap();
    near(both(place.path(), "deep.png", "").0[3], [0.1812; 3], 1e-4);
    let clear = image::RgbaImage::from_pixel(4, 2, image::Rgba([118, 118, 118, 9]));
    clear.save(place.path().join("clear.png")).unwrap();
    let (_, _, notes) = texture(place.path(), "clear.png", "").unwrap();
    assert!(notes[0].contains("its transparency is left out"), "{notes:?}");
}

#[test]
fn layers_belong_to_exr_files() {
    let place = tempfile::tempdir().unwrap();
    image::RgbImage::new(2, 2).save(place.path().join("a.png")).unwrap();
    let error = texture(place.path(), "a.png", "layer = \"x\"").unwrap_err();
    assert!(error.contains("texture \"a.png\" has no layers"), "{error}");
}
