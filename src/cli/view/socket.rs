//! Serves a page: one thread reads its requests, one sends updates.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Message, WebSocket};

use super::board::{Board, Layer, News};
use super::engine::Order;
use super::message::{self, Ask};
use super::pace::Meter;
use super::{desk, frame};

/// Interval of pings to a silent page.
const PULSE: Duration = Duration::from_secs(20);

/// How long a page may leave sent data unread.
const WRITE_PATIENCE: Duration = Duration::from_secs(30);

/// How long a page may be silent, pongs included.
const READ_PATIENCE: Duration = Duration::from_secs(90);

/// One end of a stream that two WebSockets share: one reads, the other writes, and both send whole frames.
struct End {
    stream: TcpStream,
    /// Locked while frames are written.
    whole: Arc<Mutex<()>>,
    buffer: Vec<u8>,
}

impl Read for End {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.stream.read(into)
    }
}

impl Write for End {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.buffer.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _whole = self.whole.lock().unwrap_or_else(PoisonError::into_inner);
        let written = self.stream.write_all(&self.buffer);
        self.buffer.clear();
        written
    }
}

/// Serves a page until it disconnects.
///
/// # Errors
/// What the network answers.
pub fn serve(stream: TcpStream, board: &Arc<Board>, desk: &Arc<desk::Desk>, engine: &Sender<Order>) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(READ_PATIENCE))?;
    stream.set_write_timeout(Some(WRITE_PATIENCE))?;
    let whole = Arc::<Mutex<()>>::default();
    let end = |stream: &TcpStream| -> io::Result<WebSocket<End>> {
        let end = End {
            stream: stream.try_clone()?,
            whole: whole.clone(),
            buffer: Vec::new(),
        };
        let config = WebSocketConfig::default()
            .read_buffer_size(4 << 10)
            .max_message_size(Some(message::LONGEST))
            .max_frame_size(Some(message::LONGEST));
        Ok(WebSocket::from_raw_socket(end, Role::Server, Some(config)))
    };
    // A page on this machine draws with the processors that render.
    let here = stream.peer_addr()?.ip().to_canonical().is_loopback();
    let (mut reader, mut writer) = (end(&stream)?, end(&stream)?);
    let page = board.enter();
    let news = board.clone();
    let writing = std::thread::Builder::new().name("page".to_owned()).spawn(move || {
        let _ = write(&mut writer, &news, page);
        let _ = writer.get_ref().stream.shutdown(Shutdown::Both);
        news.forget(page);
    })?;
    read(&mut reader, page, here, board, desk, engine);
    board.leave(page);
    let _ = stream.shutdown(Shutdown::Both);
    let _ = writing.join();
    Ok(())
}

/// Forwards requests until the page disconnects or sends an invalid message.
fn read(socket: &mut WebSocket<End>, page: u64, here: bool, board: &Board, desk: &desk::Desk, engine: &Sender<Order>) {
    loop {
        let text = match socket.read() {
            Ok(Message::Text(text)) => text,
            Ok(Message::Ping(_) | Message::Pong(_)) => continue,
            // tungstenite has queued the answer to a close; a message that is too long gets none.
            Ok(_) | Err(_) => {
                let _ = socket.close(None);
                let _ = socket.flush();
                return;
            }
        };
        match Ask::read(&text) {
            Ok(Ask::Next { ms }) => {
                if here {
                    board.charge(Duration::from_secs_f64(1e-3 * ms));
                }
                board.credit(page);
            }
            Ok(ask) => {
                if let Some(answer) = desk.answer(&ask) {
                    board.answer(page, answer);
                    continue;
                }
                if ask.begins_anew() {
                    board.interrupt();
                }
                if engine.send(Order::Ask(page, ask)).is_err() {
                    return;
                }
            }
            Err(what) => board.answer(page, super::said("error", &what)),
        }
    }
}

/// Sends updates until the page disconnects.
fn write(socket: &mut WebSocket<End>, board: &Board, page: u64) -> Result<(), tungstenite::Error> {
    let mut meter = Meter::default();
    meter.lap(Duration::ZERO);
    let mut sent = (0, BTreeMap::<u8, Arc<Layer>>::new());
    loop {
        match board.news(page, PULSE) {
            News::Text(text) => socket.send(Message::text(text))?,
            News::Look(look) => {
                let begun = Instant::now();
                if sent.0 != look.epoch {
                    sent = (look.epoch, BTreeMap::new());
                }
                for layer in &look.layers {
                    let message = frame::encode(look.epoch, layer, sent.1.get(&layer.id));
                    socket.send(Message::binary(message))?;
                    sent.1.insert(layer.id, layer.clone());
                }
                // Asks the page to report when it is ready for another look.
                socket.send(Message::text(format!(r#"{{"kind":"look","epoch":{}}}"#, look.epoch)))?;
                board.charge(meter.lap(begun.elapsed()));
            }
            News::Quiet => socket.send(Message::Ping(Default::default()))?,
            News::Closed => return socket.close(None).and_then(|()| socket.flush()),
        }
    }
}
