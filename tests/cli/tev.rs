//! `--tev` against a recording server that speaks the viewer's protocol.

use std::io::{self, Read as _};
use std::net::{TcpListener, TcpStream};

use octolux::film::read_picture;

use crate::place::{Place, stderr};
use crate::viewed::{PATIENCE, Server};

const SIZE: [usize; 2] = [150, 140];

/// A picture that is assembled from the packets of one connection.
struct Recorder {
    stream: TcpStream,
    picture: Vec<[f32; 3]>,
    tiles: usize,
}

impl Recorder {
    fn accept(listener: &TcpListener) -> Self {
        let (stream, _) = listener.accept().unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let (picture, tiles) = (Vec::new(), 0);
        Self { stream, picture, tiles }
    }

    /// Takes one packet in.
    fn take(&mut self) -> io::Result<()> {
        let mut length = [0; 4];
        self.stream.read_exact(&mut length)?;
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        self.stream.read_exact(&mut packet)?;
        let name = 2 + packet[2..].iter().position(|&byte| byte == 0).unwrap();
        assert_eq!(&packet[2..name], b"small");
        let word = |at: usize| u32::from_le_bytes(packet[at..at + 4].try_into().unwrap()) as usize;
        let [width, height] = SIZE;
        match packet[0] {
            // Create: width, height, channels and their names.
            4 => {
                assert_eq!([word(name + 1), word(name + 5), word(name + 9)], [width, height, 3]);
                assert_eq!(&packet[name + 13..], b"R\0G\0B\0");
                self.picture = vec![[0.0; 3]; width * height];
            }
            // Update: channels and their names, a rectangle, offsets and strides, values.
            6 => {
                assert_eq!(&packet[name + 5..name + 11], b"R\0G\0B\0");
                let [x, y, w, h] = [11, 15, 19, 23].map(|at| word(name + at));
                let values = packet[name + 27 + 48..].chunks_exact(4);
                let values: Vec<f32> = values
                    .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
                    .collect();
                assert_eq!(values.len(), 3 * w * h);
                for (at, pixel) in values.chunks_exact(3).enumerate() {
                    self.picture[(y + at / w) * width + x + at % w] = pixel.try_into().unwrap();
                }
                self.tiles += 1;
            }
            other => panic!("packet {other}"),
        }
        Ok(())
    }
}

fn listener() -> (TcpListener, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = listener.local_addr().unwrap().to_string();
    (listener, at)
}

#[test]
fn tev_gets_the_picture_of_the_file_in_tiles_from_a_view() {
    let place = Place::new();
    let (listener, at) = listener();
    let _server = Server::start(&place, &format!("in/small.toml --size 150x140 --spp 4 --tev {at}"));
    place.succeeds("render in/small.toml --size 150x140 --spp 4 -o b.npy");
    let file = read_picture(&place.path().join("b.npy")).unwrap();
    let mut recorder = Recorder::accept(&listener);
    // 150 x 140 pixels are four tiles of 128. A tile that is black equals the file before it has been sent, so the
    // picture alone does not tell that all four have come.
    while recorder.tiles < 4 || recorder.picture != file.pixels {
        recorder.take().unwrap();
    }
}

#[test]
fn tev_has_the_picture_of_the_file_when_a_render_ends() {
    let place = Place::new();
    let (listener, at) = listener();
    let arguments = format!("render in/small.toml --size 150x140 --spp 64 --tev={at} -o a.npy");
    let recorder = std::thread::spawn(move || {
        let mut recorder = Recorder::accept(&listener);
        // The render closes the connection behind its last tile.
        while recorder.take().is_ok() {}
        recorder
    });
    place.succeeds(&arguments);
    let recorder = recorder.join().unwrap();
    assert!(recorder.tiles >= 4);
    assert_eq!(
        recorder.picture,
        read_picture(&place.path().join("a.npy")).unwrap().pixels
    );
    place.succeeds("render in/small.toml --size 150x140 --spp 64 -o b.npy");
    let bytes = |name: &str| std::fs::read(place.path().join(name)).unwrap();
    assert!(bytes("a.npy") == bytes("b.npy"), "who looks on changes no bit");
}

#[test]
fn without_tev_a_render_warns_and_goes_on() {
    let place = Place::new();
    let output = place.succeeds("render in/small.toml --tev=127.0.0.1:1 -o a.npy");
    let said = stderr(&output);
    assert!(
        said.contains("warning: --tev 127.0.0.1:1: ") && said.contains("without tev"),
        "{said}"
    );
    assert_eq!(place.files(), ["a.npy"]);
}
