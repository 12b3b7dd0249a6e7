//! Pictures go to files and come back; what is no picture gets a sentence.

use std::fs;
use std::path::Path;

use octolux::film::{Attributes, Picture, Value, check_output, read_picture, write_picture};

/// Every kind of value that a picture may hold, in a size that is no multiple of anything.
fn sample() -> Picture {
    let (width, height) = (37, 19);
    let pixels = (0..width * height)
        .map(|i| {
            let x = i as f32;
            [x * 0.1, (x * 0.37).sin().abs() * 1e-30, if i == 5 { 1e30 } else { 0.5 }]
        })
        .collect();
    Picture { width, height, pixels }
}

fn settings() -> Attributes {
    Attributes::new([
        ("estimator", Value::Text("mis".into())),
        ("scene", Value::Text("scènes/水.toml".into())),
        ("spp", Value::Number(64.0)),
        ("seed", Value::Number(4_294_967_295.0)),
    ])
}

fn message(result: Result<Picture, octolux::film::PictureError>) -> String {
    result.expect_err("not a picture").to_string()
}

fn is_empty(folder: &Path) -> bool {
    fs::read_dir(folder).unwrap().next().is_none()
}

#[test]
fn exr_and_npy_come_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.exr", "a.npy", "B.EXR"] {
        let path = folder.path().join(name);
        write_picture(&path, &sample(), &settings()).unwrap();
        assert_eq!(read_picture(&path).unwrap(), sample(), "{name}");
    }
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        3,
        "no temporary file is left"
    );
}

#[test]
fn samples_are_a_layer_behind_the_colours() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let samples: Vec<u32> = (0..37 * 19).map(|i| 2 * i).collect();
    let attributes = Attributes {
        samples: Some(samples.clone()),
        ..settings()
    };
    write_picture(&path, &sample(), &attributes).unwrap();
    assert_eq!(read_picture(&path).unwrap(), sample());
    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let channels = image.layer_data.channel_data.list;
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    assert_eq!(names, ["B", "G", "R", "samples.N"]);
    let stored: Vec<u32> = channels[3].sample_data.values_as_f32().map(|n| n as u32).collect();
    assert_eq!(stored, samples);
}

/// A hash map gives two files of ten attributes the same order once in 10! times.
#[test]
fn exr_files_of_one_picture_are_the_same_file() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str| {
        let path = folder.path().join(name);
        write_picture(&path, &sample(), &settings()).unwrap();
        fs::read(path).unwrap()
    };
    let first = bytes("first.exr");
    for i in 0..4 {
        assert!(bytes(&format!("{i}.exr")) == first, "file {i} differs from the first");
    }
}

#[test]
fn exr_keeps_its_settings() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write_picture(&path, &sample(), &settings()).unwrap();
    let meta = MetaData::read_from_file(&path, true).unwrap();
    let header = &meta.headers[0];
    let get = |name: &str| header.own_attributes.other.get(&Text::from(name));
    assert_eq!(get("octolux.estimator"), Some(&AttributeValue::Text(Text::from("mis"))));
    assert_eq!(get("octolux.spp"), Some(&AttributeValue::I32(64)));
    assert_eq!(get("octolux.seed"), Some(&AttributeValue::F64(4_294_967_295.0)));
    let Some(AttributeValue::Text(scene)) = get("octolux.scene") else {
        panic!("the scene's name is text")
    };
    assert_eq!(scene.as_slice(), "scènes/水.toml".as_bytes());
    let names: Vec<String> = header
        .channels
        .list
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    assert_eq!(names, ["B", "G", "R"]);
    assert!(
        header
            .channels
            .list
            .iter()
            .all(|channel| channel.sample_type == SampleType::F32)
    );
}

#[test]
fn exr_of_half_floats_with_other_channels_is_read() {
    use exr::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("half.exr");
    let channels = SpecificChannels::rgba(|at: Vec2<usize>| {
        (
            f16::from_f32(at.x() as f32),
            f16::from_f32(0.5),
            f16::from_f32(at.y() as f32),
            f16::ONE,
        )
    });
    Image::from_channels((3, 2), channels).write().to_file(&path).unwrap();
    let picture = read_picture(&path).unwrap();
    assert_eq!((picture.width, picture.height), (3, 2));
    assert_eq!(picture.pixels[5], [2.0, 0.5, 1.0]);
}

#[test]
fn png_is_shown_behind_the_srgb_curve_with_its_exposure() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    let picture = Picture {
        width: 2,
        height: 1,
        pixels: vec![[0.25, 0.0, 9.0], [0.09, f32::NAN, -1.0]],
    };
    write_picture(
        &path,
        &picture,
        &Attributes {
            exposure: 1.0,
            ..settings()
        },
    )
    .unwrap();
    let shown = image::open(&path).unwrap().into_rgb8();
    assert_eq!(shown.dimensions(), (2, 1));
    assert_eq!(shown.as_raw(), &[188, 0, 255, 118, 0, 0]);
    assert!(message(read_picture(&path)).contains("cannot be read back"));
}

#[test]
fn npy_has_the_header_that_numpy_writes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.npy");
    write_picture(&path, &sample(), &settings()).unwrap();
    let bytes = fs::read(&path).unwrap();
    let header = String::from_utf8_lossy(&bytes[..128]);
    assert!(
        header.contains("'descr': '<f4'") && header.contains("'fortran_order': False"),
        "{header}"
    );
    assert!(header.contains("(19, 37, 3"), "{header}");
    assert_eq!(
        bytes.len() % 64,
        (19 * 37 * 3 * 4) % 64,
        "the data starts at a multiple of 64"
    );
}

#[test]
fn npy_of_doubles_is_read() {
    use npyz::WriterBuilder;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f8.npy");
    let file = fs::File::create(&path).unwrap();
    let mut writer = npyz::WriteOptions::<f64>::new()
        .default_dtype()
        .shape(&[1, 2, 3])
        .writer(file)
        .begin_nd()
        .unwrap();
    writer.extend([1.0, 2.0, 3.0, 4.0, 5.0, 1e-3]).unwrap();
    writer.finish().unwrap();
    assert_eq!(read_picture(&path).unwrap().pixels, [[1.0, 2.0, 3.0], [4.0, 5.0, 1e-3]]);
}

#[test]
fn what_is_no_picture_gets_a_sentence() {
    use npyz::WriterBuilder;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for ending in ["exr", "npy"] {
        let missing = at(&format!("missing.{ending}"));
        assert!(
            message(read_picture(&missing)).contains("cannot be read: No such file"),
            "{ending}"
        );
        let empty = at(&format!("empty.{ending}"));
        fs::write(&empty, "").unwrap();
        assert!(message(read_picture(&empty)).ends_with("is empty"), "{ending}");
        let text = at(&format!("text.{ending}"));
        fs::write(&text, "no picture at all, only words and more words").unwrap();
        assert!(message(read_picture(&text)).contains("is not a"), "{ending}");
        let sub = at(&format!("folder.{ending}"));
        fs::create_dir(&sub).unwrap();
        assert!(message(read_picture(&sub)).contains("is a folder"), "{ending}");
        // Cut anywhere, a file is refused, and nothing panics.
        let whole = at(&format!("whole.{ending}"));
        write_picture(&whole, &sample(), &settings()).unwrap();
        let bytes = fs::read(&whole).unwrap();
        for length in (1..bytes.len()).step_by(97) {
            fs::write(at("cut").with_extension(ending), &bytes[..length]).unwrap();
            let said = message(read_picture(&at("cut").with_extension(ending)));
            assert!(!said.contains('\n'), "{said}");
        }
    }
    assert!(message(read_picture(&at("a.jpg"))).contains(".exr or .npy"));
    let flat = at("flat.npy");
    let file = fs::File::create(&flat).unwrap();
    let mut writer = npyz::WriteOptions::<f32>::new()
        .default_dtype()
        .shape(&[2, 2])
        .writer(file)
        .begin_nd()
        .unwrap();
    writer.extend([0.0; 4]).unwrap();
    writer.finish().unwrap();
    assert!(message(read_picture(&flat)).contains("height x width x 3"));
    let whole = at("whole.npy");
    let file = fs::File::create(&whole).unwrap();
    let mut writer = npyz::WriteOptions::<i32>::new()
        .default_dtype()
        .shape(&[1, 1, 3])
        .writer(file)
        .begin_nd()
        .unwrap();
    writer.extend([1, 2, 3]).unwrap();
    writer.finish().unwrap();
    assert!(message(read_picture(&whole)).contains("f4 or f8"));
}

#[test]
fn an_output_is_checked_before_it_is_needed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let says = |path: &Path| check_output(path).expect_err("a bad output").to_string();
    check_output(&at("new.exr")).unwrap();
    check_output(Path::new("in-the-working-directory.png")).unwrap();
    assert!(is_empty(folder.path()), "a check leaves nothing behind");
    assert!(says(&at("x.jpg")).ends_with("a picture ends in .exr, .png or .npy"));
    assert!(says(&at("x")).contains("ends in"));
    assert!(says(&at("missing/x.exr")).contains("there is no folder"));
    fs::create_dir(at("sub.exr")).unwrap();
    assert!(says(&at("sub.exr")).ends_with("is a folder, not a file"));
    fs::write(at("file"), "").unwrap();
    assert!(says(&at("file/x.exr")).contains("is not a folder"));
    assert!(says(&at(&format!("{}.exr", "x".repeat(300)))).contains("cannot be written"));
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.txt");
    fs::write(&path, "old").unwrap();
    let failed = octolux::film::replace::replace(&path, |file| {
        std::io::Write::write_all(file, b"half of it")?;
        Err(std::io::Error::other("the disk is full"))
    });
    assert!(
        failed
            .unwrap_err()
            .to_string()
            .ends_with("cannot be written: the disk is full")
    );
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn a_picture_is_as_readable_as_any_new_file_and_links_are_followed() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mode = |name: &str| fs::metadata(at(name)).unwrap().permissions().mode();
    fs::write(at("plain"), "").unwrap();
    std::os::unix::fs::symlink("real.npy", at("link.npy")).unwrap();
    fs::write(at("real.npy"), "").unwrap();
    write_picture(&at("link.npy"), &sample(), &settings()).unwrap();
    assert_eq!(mode("real.npy"), mode("plain"));
    assert!(fs::symlink_metadata(at("link.npy")).unwrap().is_symlink());
    assert_eq!(read_picture(&at("real.npy")).unwrap(), sample());
}

/// A flipped bit may go unseen or be told; it never ends in a panic or in a picture of another size than announced.
#[test]
fn damaged_files_do_not_panic() {
    let folder = tempfile::tempdir().unwrap();
    for ending in ["exr", "npy"] {
        let path = folder.path().join("a").with_extension(ending);
        write_picture(&path, &sample(), &settings()).unwrap();
        let whole = fs::read(&path).unwrap();
        let damaged = folder.path().join("b").with_extension(ending);
        // The header bit by bit (a fixed stride that meets every bit position), the rest here and there.
        for bit in (0..800 * 8).step_by(11).chain((800 * 8..whole.len() * 8).step_by(997)) {
            let mut bytes = whole.clone();
            if let Some(byte) = bytes.get_mut(bit / 8) {
                *byte ^= 1 << (bit % 8);
            }
            fs::write(&damaged, &bytes).unwrap();
            if let Ok(picture) = read_picture(&damaged) {
                assert_eq!(
                    picture.pixels.len() as u64,
                    u64::from(picture.width) * u64::from(picture.height)
                );
            }
        }
    }
}
