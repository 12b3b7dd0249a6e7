//! Sums come back to the bit, and damage is found.

use super::*;

/// 20 x 17 pixels: tiles of four different sizes; the first one has two nodes and an open leaf.
fn film() -> Film {
    let mut film = Film::new(FilmSize { width: 20, height: 17 });
    for (at, tile) in film.tiles_mut().iter_mut().enumerate() {
        let mut chunk = tile.empty_sum(1);
        chunk.add(0, &[0.1, 1.0 / 3.0, at as f32, 0.0]);
        let leaf = crate::film::leaf_passes(FilmSize { width: 20, height: 17 });
        for passes in [leaf, leaf, leaf, 5] {
            tile.add(&chunk, passes);
        }
    }
    film
}

fn place() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.acc");
    (folder, path)
}

#[test]
fn sums_come_back_to_the_bit() {
    let (_folder, path) = place();
    write(&path, &"about", &film()).unwrap();
    let (about, back): (String, Film) = read(&path).unwrap();
    assert_eq!(about, "about");
    for (tile, same) in film().tiles().iter().zip(back.tiles()) {
        assert_eq!((tile.sums(), tile.passes()), (same.sums(), same.passes()));
    }
    // Saved while noise is measured: pilot passes of an adaptive render.
    let mut film = Film::new(FilmSize { width: 5, height: 1 });
    film.measure_noise();
    let chunk = film.tiles()[0].empty_sum(4);
    film.tiles_mut()[0].add(&chunk, 4);
    write(&path, &"about", &film).unwrap();
    let (_, back): (String, Film) = read(&path).unwrap();
    assert!(back.measures_noise());
    film.set_goals(&[4, 6, 8, 10, 12]);
    write(&path, &"about", &film).unwrap();
    let (_, back): (String, Film) = read(&path).unwrap();
    assert_eq!((back.most_samples(), back.samples()), (Some(12), film.samples()));
}

#[test]
fn every_flipped_byte_and_every_cut_is_found() {
    let (_folder, path) = place();
    write(&path, &"about", &film()).unwrap();
    let whole = std::fs::read(&path).unwrap();
    let refused = |bytes: &[u8], what: &str| {
        std::fs::write(&path, bytes).unwrap();
        assert!(read::<String>(&path).is_err(), "{what}");
        assert!(read_about::<String>(&path).is_err(), "{what}");
    };
    // All of the header and of the end, and every byte position within sums at some place.
    for at in (0..200)
        .chain((200..whole.len()).step_by(203))
        .chain(whole.len() - 8..whole.len())
    {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        refused(&bytes, &format!("byte {at}"));
        refused(&whole[..at], &format!("cut at {at}"));
    }
    refused(&[&whole[..], &[0]].concat(), "a byte too many");
    assert!(read::<String>(Path::new("nowhere.acc")).is_err());
}
