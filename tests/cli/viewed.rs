//! A program that shows a scene, and a page that looks at it.

use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::net::TcpStream;
use std::process::{Child, Stdio};
use std::time::Duration;

use half::f16;
use serde_json::{Value, json};
use tungstenite::{Message, WebSocket};

use crate::place::Place;

/// Longer than anything takes here.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// A server that ends with the test.
pub struct Server {
    pub child: Child,
    /// Such as `127.0.0.1:40000`.
    pub host: String,
    pub token: String,
}

impl Server {
    pub fn start(place: &Place, arguments: &str) -> Self {
        let mut command = place.command(&format!("view --no-open --quiet {arguments}"));
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.as_mut().unwrap())
            .read_line(&mut line)
            .unwrap();
        let rest = line.trim().strip_prefix("http://").unwrap();
        let (host, token) = rest.trim_end_matches('/').split_once('/').unwrap();
        let (host, token) = (host.to_owned(), token.to_owned());
        Self { child, host, token }
    }

    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// The status that a request gets; 0 where the connection is closed without one.
    pub fn status(&self, request: &str) -> u32 {
        let mut stream = self.connect();
        let _ = stream.write_all(request.as_bytes());
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let answer = String::from_utf8_lossy(&answer);
        answer.split(' ').nth(1).map_or(0, |status| status.parse().unwrap())
    }

    pub fn get(&self, path: &str, headers: &str) -> u32 {
        self.status(&format!("GET {path} HTTP/1.1\r\n{headers}\r\n"))
    }

    pub fn upgrade(&self, headers: &str) -> u32 {
        let own = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
        let mut stream = self.connect();
        let request = format!("GET /{}/live HTTP/1.1\r\n{own}{headers}\r\n", self.token);
        stream.write_all(request.as_bytes()).unwrap();
        let mut line = String::new();
        BufReader::new(stream).read_line(&mut line).unwrap();
        line.split(' ').nth(1).map_or(0, |status| status.parse().unwrap())
    }

    pub fn page(&self) -> Page {
        use tungstenite::client::IntoClientRequest as _;
        let address = format!("ws://{}/{}/live", self.host, self.token);
        let mut request = address.into_client_request().unwrap();
        let origin = format!("http://{}", self.host).parse().unwrap();
        request.headers_mut().insert("Origin", origin);
        let (socket, _) = tungstenite::client(request, self.connect()).unwrap();
        Page {
            socket,
            halves: Vec::new(),
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page without a browser.
pub struct Page {
    pub socket: WebSocket<TcpStream>,
    /// The picture as it was sent.
    pub halves: Vec<[f16; 3]>,
}

impl Page {
    pub fn ask(&mut self, message: &Value) {
        self.socket.send(Message::text(message.to_string())).unwrap();
    }

    /// The next message of a kind that is as wanted; pictures are taken on the way.
    pub fn hear(&mut self, kind: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        loop {
            match self.socket.read().unwrap() {
                Message::Binary(bytes) => self.see(&bytes),
                Message::Text(text) => {
                    let message: Value = serde_json::from_str(&text).unwrap();
                    if message["kind"] == "look" {
                        self.ask(&json!({ "do": "next" }));
                    }
                    if message["kind"] == kind && wanted(&message) {
                        return message;
                    }
                }
                _ => {}
            }
        }
    }

    /// `src/cli/view/frame.rs` says what a message holds.
    pub fn see(&mut self, bytes: &[u8]) {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let short = |at: usize| usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
        let (layer, width, height, tiles) = (word(0), word(8), word(12), word(16));
        if layer != 0 {
            return;
        }
        self.halves.resize(width * height, [f16::ZERO; 3]);
        let mut at = 20 + 8 * tiles;
        for tile in 0..tiles {
            let [x, y, w, h] = [0, 2, 4, 6].map(|part| short(20 + 8 * tile + part));
            for y in y..y + h {
                for x in x..x + w {
                    self.halves[y * width + x] = [0, 2, 4].map(|part| f16::from_bits(short(at + part) as u16));
                    at += 6;
                }
            }
        }
        assert_eq!(at, bytes.len(), "a message holds its tiles and nothing else");
    }

    pub fn wait_for(&mut self, state: &str) -> Value {
        self.hear("status", |status| status["state"] == state)
    }

    pub fn write(&mut self) -> String {
        self.ask(&json!({ "do": "write", "exposure": 0.0 }));
        let said = self.hear("said", |_| true);
        assert_eq!(said["level"], "note", "{said}");
        said["what"].as_str().unwrap().to_owned()
    }
}
