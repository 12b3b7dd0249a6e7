//! The render thread. It handles orders between steps, and posts looks that pages are waiting for.

mod told;
mod turning;
mod writing;

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use super::board::{Board, Layer, Look};
use super::camera::Changes;
use super::desk::{Desk, Shown};
use super::message::{Ask, By, Choice};
use super::pace::{self, Meter, Pace};
use super::race::Race;
use super::said;
use crate::cli::options::Options;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Settings, SetupError};
use octolux::run::{MOST_SPP, Run};
use octolux::scene::{Effects, FilmSize, Scene};

/// A first picture with more pixels than this is preceded by a smaller one.
const LARGE: u32 = 1 << 16;

/// Interval of figures between two looks.
const TELL: Duration = Duration::from_millis(500);

/// Maximum seconds of a first pass after a camera change without a smaller preview.
const SWIFT: f64 = 0.02;

/// Assumed seconds of the first pass before any was measured.
const UNKNOWN: f64 = 0.3;

/// Orders to the engine.
#[derive(Debug)]
pub enum Order {
    /// A request of a page.
    Ask(u64, Ask),
    /// The file has changed.
    Scene(Arc<Scene>),
}

/// The constant setup.
pub struct Setup {
    /// The scene file as given.
    pub path: PathBuf,
    /// The settings of the command line.
    pub options: Options,
    /// Samples per pixel at the end; `None` renders without end.
    pub spp: Option<u32>,
    /// Files to write on the page's request.
    pub outputs: Vec<PathBuf>,
    /// The reference of races, for the scene as in the file.
    pub reference: Option<Picture>,
    /// Time for rendering a reference if none is given.
    pub reference_time: Duration,
}

/// The current render.
enum Show {
    Nothing,
    Picture(Box<Run>),
    Race(Race),
}

/// The render thread.
pub struct Engine {
    setup: Setup,
    board: Arc<Board>,
    desk: Arc<Desk>,
    orders: Receiver<Order>,
    waiting: VecDeque<Order>,
    /// The scene as in the file.
    file: Arc<Scene>,
    changes: Changes,
    choice: Choice,
    show: Show,
    epoch: u32,
    playing: bool,
    /// The run is finished, or was ended for a pending order.
    halted: bool,
    /// When looks at this picture are taken.
    pace: Pace,
    meter: Meter,
    /// How long it was rendered, turns of a race and of its reference together.
    age: Duration,
    /// The age when its figures were last sent.
    told: Duration,
    /// The threads of a render.
    threads: u32,
    /// Seconds of the last picture's first pass.
    first_pass: f64,
}

impl Engine {
    /// An engine for a scene.
    pub fn new(setup: Setup, scene: Arc<Scene>, board: Arc<Board>, desk: Arc<Desk>, orders: Receiver<Order>) -> Self {
        let settings = setup.options.render_options().settings(&scene);
        let choice = Choice {
            estimator: settings.estimator,
            sampler: settings.sampler,
            adaptive: false,
        };
        Self {
            setup,
            board,
            desk,
            orders,
            waiting: VecDeque::new(),
            file: scene,
            changes: Changes::default(),
            choice,
            show: Show::Nothing,
            epoch: 0,
            playing: true,
            halted: true,
            pace: Pace::new(false, Duration::ZERO),
            meter: Meter::default(),
            age: Duration::ZERO,
            told: Duration::ZERO,
            threads: u32::try_from(settings.threads).unwrap_or(u32::MAX).max(1),
            first_pass: UNKNOWN,
        }
    }

    /// Sets up the first picture.
    ///
    /// # Errors
    /// A scene that cannot be rendered with these settings.
    pub fn set_up(&mut self) -> Result<Prepared, SetupError> {
        self.hello();
        self.prepare(&self.file, self.film())
    }

    /// Renders and handles orders until all senders are gone; begins with the prepared picture.
    pub fn run(mut self, prepared: Prepared) {
        let scene = self.file.clone();
        if self.film().width * self.film().height > LARGE {
            self.show_small(&scene);
        }
        self.show_picture(scene, prepared);
        loop {
            let busy = self.playing && !self.halted;
            match self.next_order(busy) {
                Ok(Some(order)) => self.take(order),
                Ok(None) => self.step(),
                Err(()) => return,
            }
        }
    }

    /// The next order. Of several consecutive cameras only the last counts.
    fn next_order(&mut self, busy: bool) -> Result<Option<Order>, ()> {
        if !busy && self.waiting.is_empty() {
            self.waiting.push_back(self.orders.recv().map_err(drop)?);
        }
        loop {
            match self.orders.try_recv() {
                Ok(order) => self.waiting.push_back(order),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return Err(()),
            }
        }
        let camera = |order: &Order| matches!(order, Order::Ask(_, Ask::Camera(_)));
        while self.waiting.len() > 1 && camera(&self.waiting[0]) && camera(&self.waiting[1]) {
            self.waiting.pop_front();
        }
        Ok(self.waiting.pop_front())
    }

    fn take(&mut self, order: Order) {
        match order {
            Order::Scene(scene) => {
                self.file = scene;
                self.changes.gains.clear();
                self.hello();
                self.begin(false);
            }
            Order::Ask(_, Ask::Go) => {
                self.playing = true;
                self.tell();
            }
            Order::Ask(_, Ask::Stop) => {
                self.playing = false;
                self.look();
            }
            Order::Ask(page, Ask::Write { exposure }) => self.write(page, exposure),
            Order::Ask(_, Ask::Camera(view)) => self.turn(Some(view)),
            Order::Ask(_, Ask::ResetCamera) => self.turn(None),
            Order::Ask(_, Ask::Settings(choice)) => {
                self.choice = choice;
                self.playing = true;
                self.begin(false);
            }
            Order::Ask(_, Ask::Lights { gains }) => {
                self.changes.gains = gains;
                self.playing = true;
                self.begin(true);
            }
            Order::Ask(page, Ask::Race { racers, by, seconds }) => {
                self.playing = true;
                let limit = seconds.map_or(self.setup.reference_time, Duration::from_secs_f64);
                if let Err(error) = self.race(&racers, by, limit) {
                    self.board.answer(page, said("error", &error));
                    self.begin(false);
                }
            }
            Order::Ask(_, Ask::EndRace) => {
                self.playing = true;
                self.begin(false);
            }
            Order::Ask(_, Ask::Aim { x, y }) => self.aim(x, y),
            // Other threads answer these.
            Order::Ask(_, Ask::Next { .. } | Ask::Sample { .. } | Ask::Pixel { .. }) => {}
        }
    }

    fn settings(&self, scene: &Scene, film: FilmSize) -> Settings {
        Settings {
            film,
            estimator: self.choice.estimator,
            sampler: self.choice.sampler,
            ..self.setup.options.render_options().settings(scene)
        }
    }

    fn film(&self) -> FilmSize {
        self.setup.options.size.unwrap_or(self.file.film())
    }

    fn prepare(&self, scene: &Scene, film: FilmSize) -> Result<Prepared, SetupError> {
        Prepared::holding(scene, self.settings(scene, film), Effects::of(&self.setup.options.hold))
    }

    /// Restarts the picture; `swiftly` shows a smaller one first if the full one is slow.
    fn begin(&mut self, swiftly: bool) {
        let scene = match self.changes.of(&self.file) {
            Ok(scene) => scene,
            Err(error) => {
                self.board.say(&said("error", &format!("{error}: {}", error.remedy())));
                self.changes = Changes::default();
                self.file.clone()
            }
        };
        if swiftly && self.first_pass > SWIFT {
            self.show_small(&scene);
            // A newer camera makes the full picture of this one unnecessary.
            while let Ok(order) = self.orders.try_recv() {
                self.waiting.push_back(order);
            }
            if matches!(
                self.waiting.front(),
                Some(Order::Ask(_, Ask::Camera(_) | Ask::Lights { .. }))
            ) {
                return;
            }
        }
        match self.prepare(&scene, self.film()) {
            Ok(prepared) => self.show_picture(scene, prepared),
            Err(error) => {
                self.show = Show::Nothing;
                self.halted = true;
                self.board.say(&said("error", &error.to_string()));
                self.tell();
            }
        }
    }

    /// One pass of a picture small enough to be finished at once.
    fn show_small(&mut self, scene: &Arc<Scene>) {
        let factor = (self.first_pass / SWIFT).sqrt().ceil().clamp(2.0, 8.0) as u32;
        let FilmSize { width, height } = self.film();
        let film = FilmSize {
            width: (width / factor).max(1),
            height: (height / factor).max(1),
        };
        if let Ok(prepared) = self.prepare(scene, film) {
            self.epoch += 1;
            let picture = prepared.passes(1).finish().picture();
            self.pin(vec![Arc::new(Layer::new(0, picture))]);
        }
    }

    fn show_picture(&mut self, scene: Arc<Scene>, prepared: Prepared) {
        let run = prepared.passes(self.setup.spp.unwrap_or(MOST_SPP));
        self.board.watch(vec![run.progress().clone()]);
        self.desk.put(Shown {
            scene,
            prepared: vec![prepared],
        });
        self.show = Show::Picture(Box::new(run));
        self.fresh();
    }

    fn race(&mut self, choices: &[Choice], by: Option<By>, limit: Duration) -> Result<(), String> {
        let shown = self.desk.shown().ok_or("nothing is rendered yet")?;
        let prepared = shown.prepared.first().ok_or("nothing is rendered yet")?;
        let FilmSize { width, height } = self.film();
        // A picture of the scene as in the file is no reference for changed cameras or lights.
        let given = by.is_none() && self.changes == Changes::default();
        let reference = self.setup.reference.clone().filter(|_| given);
        let reference = reference.filter(|picture| (picture.width, picture.height) == (width, height));
        let reference = reference.ok_or((by.unwrap_or(By::Mis), limit));
        let race = Race::new(&shown.scene, prepared, choices, reference)?;
        self.board.watch(race.progress());
        self.desk.put(Shown {
            scene: shown.scene,
            prepared: race.prepared(),
        });
        self.show = Show::Race(race);
        self.fresh();
        Ok(())
    }

    fn fresh(&mut self) {
        self.epoch += 1;
        self.halted = false;
        self.pace = Pace::new(matches!(self.show, Show::Race(_)), self.board.cost());
        (self.age, self.told) = (Duration::ZERO, Duration::ZERO);
        // What it took to prepare the scene is no look.
        self.meter.lap(Duration::ZERO);
        self.tell();
    }

    fn step(&mut self) {
        let begun = Instant::now();
        let more = match &mut self.show {
            Show::Nothing => false,
            Show::Picture(run) => {
                let more = run.step_until(Some(begun + pace::SHORTEST)).is_more();
                self.first_pass = run.first_block_time().as_secs_f64();
                more
            }
            Show::Race(race) => race.step(),
        };
        self.age += begun.elapsed();
        self.halted = !more;
        if self.is_given_up() {
            return;
        }
        let due = self.pace.is_due(self.age, self.threads, self.board.cost());
        // The first and last look are also posted for pages that connect later.
        if !more || self.pace.is_first() || (due && self.board.is_awaited()) {
            self.look();
        } else if self.age >= self.told + TELL {
            self.tell();
            self.told = self.age;
        }
    }

    /// Whether the current runs were ended because something else is wanted.
    fn is_given_up(&self) -> bool {
        match &self.show {
            Show::Nothing => false,
            Show::Picture(run) => run.progress().stop_requested(),
            Show::Race(race) => race.progress().iter().any(|progress| progress.stop_requested()),
        }
    }

    /// Posts a look. All threads of the render wait for it.
    fn look(&mut self) {
        let begun = Instant::now();
        let layers = match &mut self.show {
            Show::Nothing => return self.tell(),
            Show::Picture(run) => {
                let (picture, (least, _, most)) = (run.picture(), run.spread());
                if least == most {
                    self.desk.batches().take(&picture, least);
                }
                vec![Arc::new(Layer::new(0, picture))]
            }
            Show::Race(race) => race.look(),
        };
        self.pin(layers);
        self.pace.look(self.age);
        self.told = self.age;
        self.tell();
        // Between looks this thread does little but wait for those that render.
        self.board.charge(self.meter.lap(begun.elapsed()) * self.threads);
    }

    fn pin(&self, layers: Vec<Arc<Layer>>) {
        self.board.show(Look {
            epoch: self.epoch,
            layers,
        });
    }
}
