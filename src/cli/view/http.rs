//! The part of HTTP that a page needs: static files from memory, and the WebSocket upgrade.

use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use tungstenite::handshake::derive_accept_key;

use super::gate::{Gate, Refusal};

/// Maximum size of a request head.
const LONGEST_HEAD: usize = 8 << 10;

/// Maximum number of headers.
const MOST_HEADERS: usize = 64;

/// Timeout of a request head.
const PATIENCE: Duration = Duration::from_secs(5);

/// How long to keep reading from a refused client.
const LINGER: Duration = Duration::from_millis(500);

/// The files of the page: name, content type, text.
const FILES: [(&str, &str, &str); 9] = [
    ("", "text/html; charset=utf-8", include_str!("page/index.html")),
    ("view.css", "text/css; charset=utf-8", include_str!("page/view.css")),
    ("view.js", JAVASCRIPT, include_str!("page/view.js")),
    ("picture.js", JAVASCRIPT, include_str!("page/picture.js")),
    ("camera.js", JAVASCRIPT, include_str!("page/camera.js")),
    ("lights.js", JAVASCRIPT, include_str!("page/lights.js")),
    ("race.js", JAVASCRIPT, include_str!("page/race.js")),
    ("sample.js", JAVASCRIPT, include_str!("page/sample.js")),
    ("icon.svg", "image/svg+xml", include_str!("page/icon.svg")),
];

const JAVASCRIPT: &str = "text/javascript; charset=utf-8";

/// Answers one request; returns the stream after an upgrade to a WebSocket.
///
/// # Errors
/// Errors of the network.
pub fn serve(mut stream: TcpStream, gate: &Gate) -> io::Result<Option<TcpStream>> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let Some(head) = head(&mut stream)? else {
        refuse(
            &mut stream,
            Refusal("431 Request Header Fields Too Large", "the head is too long"),
        )?;
        return Ok(None);
    };
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    let parsed = request.parse(&head);
    if !matches!(parsed, Ok(httparse::Status::Complete(_))) {
        refuse(&mut stream, Refusal("400 Bad Request", "this is no request"))?;
        return Ok(None);
    }
    match answer(&request, gate) {
        Ok(Answer::File(kind, text)) => {
            let host = header(&request, "host").unwrap_or_default();
            reply(&mut stream, "200 OK", kind, text, host)?;
            Ok(None)
        }
        Ok(Answer::Upgrade(key)) => {
            let head = format!(
                "HTTP/1.1 101 Switching Protocols\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
                 Sec-WebSocket-Accept: {key}\r\n\r\n"
            );
            stream.write_all(head.as_bytes())?;
            Ok(Some(stream))
        }
        Err(refusal) => {
            refuse(&mut stream, refusal)?;
            Ok(None)
        }
    }
}

/// The answer to a request.
enum Answer {
    /// A file: its content type and its text.
    File(&'static str, &'static str),
    /// An upgrade to a WebSocket, with its accept key.
    Upgrade(String),
}

fn answer(request: &httparse::Request<'_, '_>, gate: &Gate) -> Result<Answer, Refusal> {
    let get = |name| header(request, name);
    gate.host(get("host"))?;
    let inside = gate.inside(request.path.unwrap_or_default())?;
    if request.method != Some("GET") {
        return Err(Refusal("405 Method Not Allowed", "this server only shows"));
    }
    let socket = inside == "live";
    gate.origin(get("origin"), get("host"), socket)?;
    if socket {
        let says = |name, word: &str| get(name).is_some_and(|value| value.to_ascii_lowercase().contains(word));
        let whole = says("upgrade", "websocket") && says("connection", "upgrade");
        return match get("sec-websocket-key") {
            Some(key) if whole && get("sec-websocket-version") == Some("13") => {
                Ok(Answer::Upgrade(derive_accept_key(key.as_bytes())))
            }
            _ => Err(Refusal(
                "400 Bad Request",
                "this address is for a WebSocket of version 13",
            )),
        };
    }
    let known = FILES.iter().find(|(name, ..)| *name == inside);
    let &(_, kind, text) = known.ok_or(Refusal("404 Not Found", "there is no such file"))?;
    Ok(Answer::File(kind, text))
}

/// A header that occurs once, as UTF-8. Duplicates count as missing, because which one applies would be a guess.
fn header<'a>(request: &httparse::Request<'_, 'a>, name: &str) -> Option<&'a str> {
    let mut found = request
        .headers
        .iter()
        .filter(|header| header.name.eq_ignore_ascii_case(name));
    let one = found.next()?;
    found.next().is_none().then(|| std::str::from_utf8(one.value).ok())?
}

/// Reads up to the empty line; `None` if it does not come within [`LONGEST_HEAD`].
fn head(stream: &mut TcpStream) -> io::Result<Option<Vec<u8>>> {
    let (mut head, deadline) = (Vec::new(), Instant::now() + PATIENCE);
    let mut part = [0; 1024];
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        if head.len() > LONGEST_HEAD {
            return Ok(None);
        }
        // A client that sends one byte a second must not hold a connection for hours.
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut part)? {
            0 => return Err(io::ErrorKind::UnexpectedEof.into()),
            read => head.extend_from_slice(&part[..read]),
        }
    }
    Ok(Some(head))
}

/// Sends a refusal.
///
/// # Errors
/// Errors of the network.
pub fn refuse(stream: &mut TcpStream, Refusal(status, why): Refusal) -> io::Result<()> {
    reply(stream, status, "text/plain; charset=utf-8", &format!("{why}\n"), "")
}

fn reply(stream: &mut TcpStream, status: &str, kind: &str, text: &str, host: &str) -> io::Result<()> {
    // `host` was checked by the gate: a number or `localhost`.
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
         Cross-Origin-Resource-Policy: same-origin\r\n\
         Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; \
         connect-src 'self' ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\r\n",
        text.len()
    );
    stream.write_all(head.as_bytes())?;
    stream.write_all(text.as_bytes())?;
    stream.shutdown(Shutdown::Write)?;
    // Read the rest of the request: unread data would make the system reset the connection, and the answer would be lost.
    let (deadline, mut rest) = (Instant::now() + LINGER, [0; 4096]);
    stream.set_read_timeout(Some(LINGER))?;
    while Instant::now() < deadline && stream.read(&mut rest)? > 0 {}
    Ok(())
}
