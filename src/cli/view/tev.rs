//! `--tev HOST:PORT`: the same picture in the viewer tev, over its own protocol.
//!
//! tev is one more reader of the board: it gets the newest look when it has taken the one before.

use std::collections::BTreeMap;
use std::io;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::Arc;
use std::time::Duration;

use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::board::{Board, Layer, News, REFERENCE};
use octolux::film::Picture;

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// The side of a tile in pixels.
const SIDE: u32 = 128;

/// How long tev may take to answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// Connects to tev.
///
/// # Errors
/// A sentence about an address that does not answer.
pub fn connect(address: &str) -> Result<TevClient, String> {
    let places = address
        .to_socket_addrs()
        .map_err(|error| format!("--tev {address}: {error}"))?;
    let mut last = format!("--tev {address}: no such address");
    for place in places {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => {
                let _ = stream.set_nodelay(true);
                return Ok(TevClient::wrap(stream));
            }
            Err(error) => last = format!("--tev {address}: {error}"),
        }
    }
    Err(last)
}

/// Sends looks until tev goes.
///
/// # Errors
/// What the network answers.
pub fn feed(mut tev: TevClient, board: &Board, name: &str) -> io::Result<()> {
    let reader = board.enter();
    let mut sent = BTreeMap::<u8, Arc<Layer>>::new();
    loop {
        match board.news(reader, Duration::from_secs(60)) {
            News::Look(look) => {
                for layer in &look.layers {
                    send(&mut tev, &title(name, layer.id), layer, sent.get(&layer.id))?;
                    sent.insert(layer.id, layer.clone());
                }
                board.credit(reader);
            }
            News::Text(_) | News::Quiet => {}
            News::Closed => return Ok(()),
        }
    }
}

fn title(name: &str, layer: u8) -> String {
    // A zero byte would end the name.
    let name = name.replace('\0', " ");
    match layer {
        0 => name,
        REFERENCE => format!("{name}, reference"),
        racer => format!("{name}, {}", racer + 1),
    }
}

/// Sends the tiles that differ from what tev has.
fn send(tev: &mut TevClient, name: &str, layer: &Layer, before: Option<&Arc<Layer>>) -> io::Result<()> {
    let picture = &layer.picture;
    let same_size = |old: &&Arc<Layer>| (old.picture.width, old.picture.height) == (picture.width, picture.height);
    let before = before.filter(same_size).map(|old| &old.picture);
    if before.is_none() {
        tev.send(PacketCreateImage {
            image_name: name,
            grab_focus: false,
            width: picture.width,
            height: picture.height,
            channel_names: &CHANNELS,
        })?;
    }
    for y in (0..picture.height).step_by(SIDE as usize) {
        for x in (0..picture.width).step_by(SIDE as usize) {
            let (width, height) = (SIDE.min(picture.width - x), SIDE.min(picture.height - y));
            let data = tile(picture, [x, y, width, height]);
            if before.is_some_and(|before| tile(before, [x, y, width, height]) == data) {
                continue;
            }
            tev.send(PacketUpdateImage {
                image_name: name,
                grab_focus: false,
                channel_names: &CHANNELS,
                channel_offsets: &[0, 1, 2],
                channel_strides: &[3, 3, 3],
                x,
                y,
                width,
                height,
                data: &data,
            })?;
        }
    }
    Ok(())
}

fn tile(picture: &Picture, [x, y, width, height]: [u32; 4]) -> Vec<f32> {
    let row = |y: u32| {
        let start = (y * picture.width + x) as usize;
        picture.pixels[start..start + width as usize]
            .as_flattened()
            .iter()
            .copied()
    };
    (y..y + height).flat_map(row).collect()
}
