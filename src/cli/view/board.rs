//! The board between the renderer and the pages: the newest state of everything, without queues.
//!
//! The renderer posts a look and continues; each page takes the newest one when it is ready. A page that does not read misses
//! looks, and costs no samples.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use half::f16;
use half::slice::HalfFloatSliceExt as _;

use octolux::film::Picture;
use octolux::pipeline::Progress;

/// Maximum looks in flight to a page: one is drawn while another is sent.
const CREDIT: u32 = 2;

/// Maximum queued answers of a page; a page that sends more requests without reading is closed.
const MOST_ANSWERS: usize = 64;

/// One picture of a look.
#[derive(Debug)]
pub struct Layer {
    /// 0 is the picture, or the first racer; [`REFERENCE`] is the reference of a race.
    pub id: u8,
    /// Linear radiances.
    pub picture: Picture,
    halves: OnceLock<Vec<f16>>,
}

/// The layer of the reference.
pub const REFERENCE: u8 = 255;

impl Layer {
    /// A layer of one picture.
    pub fn new(id: u8, picture: Picture) -> Self {
        Self {
            id,
            picture,
            halves: OnceLock::new(),
        }
    }

    /// The radiances in half precision, shared by all pages and converted on first use.
    pub fn halves(&self) -> &[f16] {
        self.halves.get_or_init(|| {
            let values = self.picture.pixels.as_flattened();
            let mut halves = vec![f16::ZERO; values.len()];
            halves.convert_from_f32_slice(values);
            halves
        })
    }
}

/// The pictures at one moment.
#[derive(Debug, Default)]
pub struct Look {
    /// Counter of cameras, settings and races: pictures with the same epoch show the same thing.
    pub epoch: u32,
    /// The pictures.
    pub layers: Vec<Arc<Layer>>,
}

/// Kinds of texts of which only the newest matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// The available choices.
    Hello,
    /// The progress of the render.
    Status,
    /// The scene's text and its error.
    Scene,
}

const TOPICS: usize = 3;

#[derive(Debug, Default)]
struct Pinned {
    look: (u64, Arc<Look>),
    texts: [(u64, Arc<str>); TOPICS],
    pages: BTreeMap<u64, Page>,
    next_page: u64,
    watched: Vec<Arc<Progress>>,
}

#[derive(Debug, Default)]
struct Page {
    credit: u32,
    seen_look: u64,
    seen_texts: [u64; TOPICS],
    answers: VecDeque<String>,
    closed: bool,
}

/// The board.
#[derive(Debug, Default)]
pub struct Board {
    pinned: Mutex<Pinned>,
    changed: Condvar,
    /// Nanoseconds of threads that looks have taken.
    cost: AtomicU64,
}

/// The next message for a page.
#[derive(Debug)]
pub enum News {
    /// A text.
    Text(String),
    /// A look.
    Look(Arc<Look>),
    /// Nothing new for a while.
    Quiet,
    /// The page is gone.
    Closed,
}

impl Board {
    fn lock(&self) -> MutexGuard<'_, Pinned> {
        self.pinned.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Posts a look.
    pub fn show(&self, look: Look) {
        let mut pinned = self.lock();
        pinned.look = (pinned.look.0 + 1, Arc::new(look));
        self.changed.notify_all();
    }

    /// The current look.
    pub fn look(&self) -> Arc<Look> {
        self.lock().look.1.clone()
    }

    /// Posts a text.
    pub fn tell(&self, topic: Topic, text: String) {
        let mut pinned = self.lock();
        let slot = &mut pinned.texts[topic as usize];
        *slot = (slot.0 + 1, text.into());
        self.changed.notify_all();
    }

    /// Whether a page is ready for a picture that it does not have.
    pub fn is_awaited(&self) -> bool {
        let pinned = self.lock();
        let newest = pinned.look.0;
        pinned
            .pages
            .values()
            .any(|page| page.credit > 0 && page.seen_look == newest)
    }

    /// Counts what a look took of the time of threads: see [`Pace`](super::pace::Pace).
    pub fn charge(&self, cost: Duration) {
        self.cost.fetch_add(cost.as_nanos() as u64, Ordering::Relaxed);
    }

    /// What all looks have taken.
    pub fn cost(&self) -> Duration {
        Duration::from_nanos(self.cost.load(Ordering::Relaxed))
    }

    /// Sends every page a message.
    pub fn say(&self, text: &str) {
        let mut pinned = self.lock();
        pinned.pages.values_mut().for_each(|page| page.take(text.to_owned()));
        self.changed.notify_all();
    }

    /// Sends one page a message.
    pub fn answer(&self, page: u64, text: String) {
        if let Some(page) = self.lock().pages.get_mut(&page) {
            page.take(text);
        }
        self.changed.notify_all();
    }

    /// Registers a new page.
    pub fn enter(&self) -> u64 {
        let mut pinned = self.lock();
        pinned.next_page += 1;
        let number = pinned.next_page;
        let page = Page {
            credit: CREDIT,
            ..Page::default()
        };
        pinned.pages.insert(number, page);
        number
    }

    /// Removes a page.
    pub fn leave(&self, page: u64) {
        if let Some(page) = self.lock().pages.get_mut(&page) {
            page.closed = true;
        }
        self.changed.notify_all();
    }

    /// Stops sending to a page.
    pub fn forget(&self, page: u64) {
        self.lock().pages.remove(&page);
    }

    /// A page is ready for another look.
    pub fn credit(&self, page: u64) {
        if let Some(page) = self.lock().pages.get_mut(&page) {
            page.credit = (page.credit + 1).min(CREDIT);
        }
        self.changed.notify_all();
    }

    /// The next message for a page: answers, then texts, then the newest look.
    pub fn news(&self, number: u64, patience: Duration) -> News {
        let ready = |pinned: &mut Pinned| pinned.news(number);
        let mut found = News::Quiet;
        let waits = |pinned: &mut Pinned| {
            found = ready(pinned);
            matches!(found, News::Quiet)
        };
        drop(self.changed.wait_timeout_while(self.lock(), patience, waits));
        found
    }

    /// Sets the runs that [`interrupt`](Self::interrupt) ends.
    pub fn watch(&self, runs: Vec<Arc<Progress>>) {
        self.lock().watched = runs;
    }

    /// Ends the current runs at their next tiles because something else is wanted.
    pub fn interrupt(&self) {
        self.lock().watched.iter().for_each(|progress| progress.request_stop());
    }
}

impl Page {
    fn take(&mut self, text: String) {
        self.answers.push_back(text);
        self.closed |= self.answers.len() > MOST_ANSWERS;
    }
}

impl Pinned {
    fn news(&mut self, number: u64) -> News {
        let Some(page) = self.pages.get_mut(&number).filter(|page| !page.closed) else {
            return News::Closed;
        };
        if let Some(answer) = page.answers.pop_front() {
            return News::Text(answer);
        }
        for (seen, (version, text)) in page.seen_texts.iter_mut().zip(&self.texts) {
            if *seen < *version {
                *seen = *version;
                return News::Text(text.as_ref().to_owned());
            }
        }
        let (version, look) = &self.look;
        if page.credit > 0 && page.seen_look < *version {
            page.credit -= 1;
            page.seen_look = *version;
            return News::Look(look.clone());
        }
        News::Quiet
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Duration = Duration::ZERO;

    #[test]
    fn a_page_that_does_not_read_misses_looks_and_gets_the_newest() {
        let board = Board::default();
        let page = board.enter();
        let show = |epoch| {
            board.show(Look {
                epoch,
                layers: Vec::new(),
            });
        };
        for epoch in 1..=CREDIT {
            show(epoch);
            assert!(matches!(board.news(page, NOW), News::Look(look) if look.epoch == epoch));
        }
        show(10);
        show(11);
        assert!(matches!(board.news(page, NOW), News::Quiet), "without credit");
        assert!(!board.is_awaited());
        board.credit(page);
        assert!(matches!(board.news(page, NOW), News::Look(look) if look.epoch == 11));
        board.credit(page);
        assert!(board.is_awaited());
    }

    #[test]
    fn a_page_that_asks_without_reading_is_closed() {
        let board = Board::default();
        let page = board.enter();
        (0..=MOST_ANSWERS).for_each(|_| board.answer(page, "text".to_owned()));
        assert!(matches!(board.news(page, NOW), News::Closed));
        board.forget(page);
        assert!(matches!(board.news(page, NOW), News::Closed));
    }
}
