//! Radiance pictures (.hdr) of every kind, read as textures and environments.

use crate::pictures::{both, near};

/// A Radiance file of 12 x 2 pixels in 32 bits each, rows from the top: red grows to the right, green down.
fn radiance(header: &str, order: &str, pixels: impl Iterator<Item = [u8; 4]>) -> Vec<u8> {
    let mut bytes = format!("{header}\n\n{order}\n").into_bytes();
    bytes.extend(pixels.flatten());
    bytes
}

fn pixel(x: usize, y: usize) -> [u8; 4] {
    [10 + x as u8, 100 + 50 * y as u8, 50, 129]
}

#[test]
fn radiance_pictures_are_the_same_in_all_orders() {
    let place = tempfile::tempdir().unwrap();
    let (w, h) = (12, 2);
    let rows = |y: bool, x: bool| {
        let flip = |at: usize, of: usize, turned: bool| if turned { of - 1 - at } else { at };
        (0..h).flat_map(move |j| (0..w).map(move |i| pixel(flip(i, w, x), flip(j, h, y))))
    };
    let columns = |y: bool, x: bool| {
        let flip = |at: usize, of: usize, turned: bool| if turned { of - 1 - at } else { at };
        (0..w).flat_map(move |i| (0..h).map(move |j| pixel(flip(i, w, x), flip(j, h, y))))
    };
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe";
    for (name, bytes) in [
        ("a.hdr", radiance(header, "-Y 2 +X 12", rows(false, false))),
        ("b.hdr", radiance(header, "+Y 2 +X 12", rows(true, false))),
        ("c.hdr", radiance(header, "-Y 2 -X 12", rows(false, true))),
        ("d.hdr", radiance(header, "+Y 2 -X 12", rows(true, true))),
        ("e.hdr", radiance(header, "+X 12 -Y 2", columns(false, false))),
        ("f.hdr", radiance(header, "+X 12 +Y 2", columns(true, false))),
        ("g.hdr", radiance(header, "-X 12 -Y 2", columns(false, true))),
        ("h.hdr", radiance("#?RGBE", "-X 12 +Y 2", columns(true, true))),
    ] {
        std::fs::write(place.path().join(name), bytes).unwrap();
        let (texels, width, _) = both(place.path(), name, "");
        assert_eq!((texels.len(), width), (24, 12));
        for (i, texel) in texels.into_iter().enumerate() {
            let [r, g, b, _] = pixel(i % 12, i / 12).map(|c| f32::from(c) / 128.0);
            assert_eq!(texel, [r, g, b], "{name}");
        }
    }
}

#[test]
fn exposures_are_divided_out_and_xyz_becomes_rgb() {
    let place = tempfile::tempdir().unwrap();
    let grey = || std::iter::repeat_n([128, 128, 128, 129], 24);
    let write = |name: &str, header: &str| {
        std::fs::write(place.path().join(name), radiance(header, "-Y 2 +X 12", grey())).unwrap();
        both(place.path(), name, "").0[5]
    };
    assert_eq!(
        write("a.hdr", "#?RADIANCE\nEXPOSURE=2\nEXPOSURE=4.0\nFORMAT=32-bit_rle_rgbe"),
        [0.125; 3]
    );
    assert_eq!(
        write("b.hdr", "#?RADIANCE\nCOLORCORR=1 2 4\nEXPOSURE=0.5\nCOLORCORR= 2 1 1"),
        [1.0, 1.0, 0.5]
    );
    // The columns of the inverse of IEC 61966-2-1's matrix, summed.
    near(
        write("c.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_xyze"),
        [1.2048, 0.9483, 0.9087],
        2e-3,
    );
    // As `ra_xyze` of Radiance writes it.
    near(
        write("e.hdr", "#?RADIANCE\nEXPOSURE=5.586592e-03\nFORMAT=32-bit_rle_xyze"),
        [1.2048, 0.9483, 0.9087],
        2e-3,
    );
    let primaries = "PRIMARIES= .640 .330 .290 .600 .150 .060 .3333 .3333";
    near(write("d.hdr", &format!("#?RADIANCE\n{primaries}")), [1.0; 3], 1e-3);
}

#[test]
fn old_runs_and_new_ones_are_read() {
    let place = tempfile::tempdir().unwrap();
    // A run in the first version's spelling: a pixel, then 1 1 1 with how often it comes again.
    let old = radiance(
        "#?RADIANCE",
        "-Y 1 +X 12",
        [[64, 32, 16, 129], [1, 1, 1, 11]].into_iter(),
    );
    // The second: 2 2, the width, then each component in runs (128 + length, value).
    let mut new = radiance("#?RADIANCE", "-Y 1 +X 12", [[2, 2, 0, 12]].into_iter());
    for component in [64, 32, 16, 129] {
        new.extend([128 + 12, component]);
    }
    for (name, bytes) in [("old.hdr", old), ("new.hdr", new)] {
        std::fs::write(place.path().join(name), bytes).unwrap();
        let (texels, ..) = both(place.path(), name, "");
        assert!(texels == [[0.5, 0.25, 0.125]; 12], "{name}");
    }
}

/// A flat file whose first pixel looks like the mark of runs, narrower than runs may be and wider: loaders.gl, pull request 3327.
#[test]
fn a_flat_file_may_begin_like_runs() {
    let place = tempfile::tempdir().unwrap();
    for (name, width) in [("narrow.hdr", 4), ("wide.hdr", 12)] {
        let pixels = (0..2 * width).map(|i| if i == 0 { [2, 2, 1, 130] } else { [64, 32, 16, 129] });
        let bytes = radiance("#?RADIANCE", &format!("-Y 2 +X {width}"), pixels);
        std::fs::write(place.path().join(name), bytes).unwrap();
        let (texels, ..) = both(place.path(), name, "");
        assert_eq!(texels[0], [2.0 / 64.0, 2.0 / 64.0, 1.0 / 64.0]);
        assert!(texels[1..].iter().all(|texel| *texel == [0.5, 0.25, 0.125]));
    }
}
