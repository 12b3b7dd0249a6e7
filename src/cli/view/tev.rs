//! `--tev HOST:PORT`: the same picture in the viewer tev.
//!
//! tev is another reader of the board: it gets the newest look once it has taken the previous one.

use std::collections::BTreeMap;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use tev_client::TevClient;

use super::board::{Board, Layer, News, REFERENCE};
use crate::cli::tev::send;

/// Sends looks until tev disconnects.
///
/// # Errors
/// Errors of the network.
pub fn feed(mut tev: TevClient, board: &Board, name: &str) -> io::Result<()> {
    let reader = board.enter();
    let mut sent = BTreeMap::<u8, Arc<Layer>>::new();
    loop {
        match board.news(reader, Duration::from_secs(60)) {
            News::Look(look) => {
                for layer in &look.layers {
                    let before = sent.get(&layer.id).map(|old| &old.picture);
                    send(&mut tev, &title(name, layer.id), &layer.picture, before)?;
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
    match layer {
        0 => name.to_owned(),
        REFERENCE => format!("{name}, reference"),
        racer => format!("{name}, {}", racer + 1),
    }
}
