//! The one thread that renders. It takes orders between steps, and pins up looks that somebody waits for.

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
use super::message::{Ask, Choice};
use super::race::Race;
use super::said;
use crate::cli::options::Options;
use octolux::film::Picture;
use octolux::pipeline::{Prepared, Settings, SetupError};
use octolux::run::{MOST_SPP, Run};
use octolux::scene::{Effects, FilmSize, Scene};

/// Time between two looks at a young picture.
const LOOK: Duration = Duration::from_millis(100);

/// Time between two looks at an old one. A look costs some milliseconds of a thread, and the eye sees less and less change.
const LATE_LOOK: Duration = Duration::from_millis(500);

/// The age of a picture over the time between two looks at it.
const LOOKS_OF_AN_AGE: u32 = 20;

/// A first picture of more pixels than these is preceded by a smaller one.
const LARGE: u32 = 1 << 16;

/// Time between two looks at a race, which shows several pictures and measures their errors.
const RACE_LOOK: Duration = Duration::from_millis(250);

/// What a picture may take that follows a turned camera. One that takes longer is preceded by a smaller one.
const SWIFT: f64 = 0.02;

/// What a first pass is taken for before there was one.
const UNKNOWN: f64 = 0.3;

/// What the engine is told.
#[derive(Debug)]
pub enum Order {
    /// A page asks.
    Ask(u64, Ask),
    /// The file has changed.
    Scene(Arc<Scene>),
}

/// What does not change.
pub struct Setup {
    /// The scene file as it was named.
    pub path: PathBuf,
    /// What the command line says of settings.
    pub options: Options,
    /// Samples a pixel at the end; no end where it is `None`.
    pub spp: Option<u32>,
    /// Files to write when the page asks for it.
    pub outputs: Vec<PathBuf>,
    /// What races are measured against, as the scene is in the file.
    pub reference: Option<Picture>,
    /// How long a reference is rendered where there is none.
    pub reference_time: Duration,
}

/// What is rendered.
enum Show {
    Nothing,
    Picture(Box<Run>),
    Race(Race),
}

/// The renderer's thread.
pub struct Engine {
    setup: Setup,
    board: Arc<Board>,
    desk: Arc<Desk>,
    orders: Receiver<Order>,
    waiting: VecDeque<Order>,
    /// As it is in the file.
    file: Arc<Scene>,
    changes: Changes,
    choice: Choice,
    show: Show,
    epoch: u32,
    playing: bool,
    /// Nothing is left to do, or the run was ended for an order that comes.
    halted: bool,
    looked: Option<Instant>,
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
            looked: None,
            first_pass: UNKNOWN,
        }
    }

    /// Sets up the first picture.
    ///
    /// # Errors
    /// A scene that cannot be rendered so.
    pub fn set_up(&mut self) -> Result<Prepared, SetupError> {
        self.hello();
        self.prepare(&self.file, self.film())
    }

    /// Renders and takes orders until nobody can give any; begins with what was set up.
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

    /// The next order. Of several cameras in a row the last counts.
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
            Order::Ask(page, Ask::Race { racers }) => {
                self.playing = true;
                if let Err(error) = self.race(&racers) {
                    self.board.answer(page, said("error", &error));
                    self.begin(false);
                }
            }
            Order::Ask(_, Ask::EndRace) => {
                self.playing = true;
                self.begin(false);
            }
            Order::Ask(_, Ask::Aim { x, y }) => self.aim(x, y),
            // Others answer these.
            Order::Ask(_, Ask::Next | Ask::Sample { .. } | Ask::Pixel { .. }) => {}
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

    /// Begins the picture anew; `swiftly` shows a smaller one first where the whole one takes long.
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
            // Another camera makes the whole picture of this one needless.
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

    /// One pass of a smaller picture, so small that it is there at once.
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

    fn race(&mut self, choices: &[Choice]) -> Result<(), String> {
        let shown = self.desk.shown().ok_or("nothing is rendered yet")?;
        let prepared = shown.prepared.first().ok_or("nothing is rendered yet")?;
        let FilmSize { width, height } = self.film();
        // A picture of the file is no reference for what is looked at in another way.
        let own = self.changes == Changes::default();
        let reference = self.setup.reference.clone().filter(|_| own);
        let reference = reference.filter(|picture| (picture.width, picture.height) == (width, height));
        let race = Race::new(prepared, choices, reference, self.setup.reference_time);
        let race = race.map_err(|error| error.to_string())?;
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
        self.looked = None;
        self.tell();
    }

    fn step(&mut self) {
        let (more, every) = match &mut self.show {
            Show::Nothing => (false, LOOK),
            Show::Picture(run) => {
                let more = run.step_until(Some(Instant::now() + LOOK)).is_more();
                self.first_pass = run.first_block_time().as_secs_f64();
                (more, (run.render_time() / LOOKS_OF_AN_AGE).clamp(LOOK, LATE_LOOK))
            }
            Show::Race(race) => (race.step(), RACE_LOOK),
        };
        self.halted = !more;
        if self.is_given_up() {
            return;
        }
        let due = self.looked.is_none_or(|looked| looked.elapsed() >= every);
        // The first look and the last are for pages that come later, too.
        if !more || self.looked.is_none() || (due && self.board.is_awaited()) {
            self.look();
        }
    }

    /// Whether the runs at hand were ended for something else that is wanted.
    fn is_given_up(&self) -> bool {
        match &self.show {
            Show::Nothing => false,
            Show::Picture(run) => run.progress().stop_requested(),
            Show::Race(race) => race.progress().iter().any(|progress| progress.stop_requested()),
        }
    }

    fn look(&mut self) {
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
        self.looked = Some(Instant::now());
        self.tell();
    }

    fn pin(&self, layers: Vec<Arc<Layer>>) {
        self.board.show(Look {
            epoch: self.epoch,
            layers,
        });
    }
}
