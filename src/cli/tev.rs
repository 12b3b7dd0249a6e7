//! Sends pictures to the viewer tev by its own protocol: an image is created once, then changed tiles are sent.

use std::io;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::sync::mpsc::{self, SyncSender, TrySendError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

use super::report;
use octolux::film::Picture;

/// tev's default address.
pub const HOME: &str = "127.0.0.1:14158";

/// How long the end of a render waits for a tev that does not read.
const STALL: Duration = Duration::from_secs(30);

/// Interval between pictures.
const PAUSE: Duration = Duration::from_millis(250);

const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// The side of a tile in pixels.
const SIDE: u32 = 128;

/// Timeout of tev's answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// Connects to tev; a write that blocks for `stalls` fails.
///
/// # Errors
/// A sentence about an address that does not answer.
pub fn connect(address: &str, stalls: Option<Duration>) -> Result<TevClient, String> {
    let places = address
        .to_socket_addrs()
        .map_err(|error| format!("--tev {address}: {error}"))?;
    let mut last = format!("--tev {address}: no such address");
    for place in places {
        match TcpStream::connect_timeout(&place, PATIENCE) {
            Ok(stream) => {
                let _ = stream.set_nodelay(true);
                let _ = stream.set_write_timeout(stalls);
                return Ok(TevClient::wrap(stream));
            }
            Err(error) => last = format!("--tev {address}: {error}"),
        }
    }
    Err(last)
}

/// Sends the tiles that differ from the previous picture.
///
/// # Errors
/// Errors of the network.
pub fn send(tev: &mut TevClient, name: &str, picture: &Picture, before: Option<&Picture>) -> io::Result<()> {
    // A zero byte would terminate the name.
    let name = &name.replace('\0', " ");
    let same_size = |old: &&Picture| (old.width, old.height) == (picture.width, picture.height);
    let before = before.filter(same_size);
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

/// A live feed of a render: it never waits for tev, which gets the newest picture once it has taken the previous one.
pub struct Feed {
    pictures: SyncSender<Picture>,
    sender: JoinHandle<()>,
    due: Instant,
}

impl Feed {
    /// Connects; the first picture is due at once.
    ///
    /// # Errors
    /// A sentence about an address that does not answer.
    pub fn start(address: &str, name: &str) -> Result<Self, String> {
        let (mut tev, name) = (connect(address, Some(STALL))?, name.to_owned());
        let (pictures, taken) = mpsc::sync_channel::<Picture>(0);
        let sender = thread::spawn(move || {
            let mut before: Option<Picture> = None;
            for picture in taken {
                if let Err(error) = send(&mut tev, &name, &picture, before.as_ref()) {
                    report::warning(&format!("tev has gone: {error}"));
                    return;
                }
                before = Some(picture);
            }
        });
        let due = Instant::now();
        Ok(Self { pictures, sender, due })
    }

    /// When the next picture is due.
    pub fn due(&self) -> Instant {
        self.due
    }

    /// Sends a picture if one is due and tev has taken the previous one.
    pub fn show(&mut self, picture: impl FnOnce() -> Picture) {
        if Instant::now() < self.due {
            return;
        }
        match self.pictures.try_send(picture()) {
            Ok(()) | Err(TrySendError::Full(_)) => self.due = Instant::now() + PAUSE,
            // A day: long enough to disable it.
            Err(TrySendError::Disconnected(_)) => self.due = Instant::now() + Duration::from_secs(86_400),
        }
    }

    /// Sends the last picture, and waits until tev has received all of it.
    pub fn finish(self, picture: Picture) {
        let _ = self.pictures.send(picture);
        drop(self.pictures);
        let _ = self.sender.join();
    }
}
