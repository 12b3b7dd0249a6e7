//! `octolux view`: the live picture in the browser.
//!
//! One thread renders (`engine`), one accepts connections, each page has two (`socket`). They share a `board` with the newest
//! state of everything, so that none waits for another.

mod batches;
mod board;
mod camera;
mod desk;
mod engine;
mod frame;
mod gate;
mod http;
mod message;
mod pace;
mod race;
mod reference;
mod rims;
mod socket;
mod tev;
mod watch;
mod write;

use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;

use serde_json::json;

use self::board::Board;
use self::desk::Desk;
use self::engine::{Engine, Order, Setup};
use self::gate::{Gate, Refusal};
use super::inputs::Inputs;
use super::options::{self, Options};
use super::outputs::{self, is_sums};
use super::{CliError, Exit, report, units};
use octolux::film::{read_picture, replace};

/// Maximum number of connections: each page uses one, and a few more while it loads.
const MOST_CONNECTIONS: usize = 64;

const EXAMPLES: &str = "\
Examples:
  octolux view scenes/veach-mis.toml
      opens the picture in the browser, from the first sample on
  octolux view scene.toml --no-open --port 8000
      prints the address; over ssh: ssh -L 8000:localhost:8000 HOST
  octolux view scene.toml --reference exact.exr
      measures the errors of races against this picture
  octolux view scene.toml -o a.exr -o a.png
      what the page's Write button writes

The page turns the camera, races estimators at equal time, and opens one
sample as a drawing. Ctrl-c ends it; nothing is written then.";

/// Show a picture in the browser while it is rendered
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// The scene file. It is rendered again whenever it is saved
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// A picture that the page's Write button writes, .exr, .png or .npy by its ending; may be repeated. {name} stands for the
    /// scene's name [default: {name}.exr and {name}.png]
    #[arg(short, long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,
    /// Samples a pixel at which the render ends [default: it goes on until it is stopped]
    #[arg(long, value_name = "N", value_parser = options::spp, allow_negative_numbers = true)]
    pub spp: Option<u32>,
    #[command(flatten)]
    pub options: Options,
    /// A picture, .exr or .npy, that races are measured against: of this scene and size, best by another program or by `octolux
    /// reference` [default: one is rendered before the race]
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// How long the reference of a race is rendered where no file is given
    #[arg(long, value_name = "TIME", default_value = "10", value_parser = units::time, allow_negative_numbers = true)]
    pub reference_time: f64,
    /// The address to serve the page at. Others than this machine can reach it then, and whoever knows the whole address sees
    /// the picture and the scene's text [default: this machine alone]
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    pub bind: Option<IpAddr>,
    /// The port to serve it at [default: one that is free]
    #[arg(long, value_name = "PORT", default_value = "0", hide_default_value = true, allow_negative_numbers = true,
          value_parser = units::whole::<u16>("a port is", 0..=u16::MAX.into()))]
    pub port: u16,
    /// Print the address and open no browser
    #[arg(long)]
    pub no_open: bool,
    /// Also send the picture to the viewer tev, which listens at 127.0.0.1:14158 unless it was told otherwise
    #[arg(long, value_name = "HOST:PORT")]
    pub tev: Option<String>,
    /// Say nothing but the address and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Serves the page until ctrl-c.
///
/// # Errors
/// A scene that cannot be rendered, a file that could not be written, an address in use.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    if let Some(path) = args.outputs.iter().find(|path| is_sums(path)) {
        let what = format!("{}: view writes pictures, and .acc holds sums", path.display());
        return Err(CliError::usage(what).with_help("a picture ends in .exr, .png or .npy"));
    }
    let scenes = std::slice::from_ref(&args.scene);
    let targets = outputs::plan(scenes, &args.outputs, None, None, false)?;
    let outputs: Vec<PathBuf> = targets.into_iter().flat_map(|targets| targets.pictures).collect();
    // Before the scene is read: a save in the meantime is noticed.
    let before = watch::Stamp::of(std::slice::from_ref(&args.scene));
    let scene = args.options.reading.load(&args.scene)?;
    Inputs::of_scene(&scene).are_kept_by(outputs.iter().map(PathBuf::as_path))?;
    if let Some(path) = &args.reference {
        Inputs::of("--reference", [path.clone()]).are_kept_by(outputs.iter().map(PathBuf::as_path))?;
    }
    let film = args.options.settings(&scene)?.film;
    if film.width.max(film.height) > frame::LONGEST_SIDE {
        let what = format!("a page shows pictures up to {} pixels on a side", frame::LONGEST_SIDE);
        return Err(CliError::usage(what).with_help("ask for a smaller one with --size"));
    }
    let reference = match &args.reference {
        Some(path) => Some(reference(path, (film.width, film.height))?),
        None => None,
    };
    let tev = args
        .tev
        .as_deref()
        .map(|at| crate::cli::tev::connect(at, None))
        .transpose()
        .map_err(|error| {
            CliError::usage(error)
                .with_help("start tev first; it listens at 127.0.0.1:14158 unless it was told otherwise")
        })?;
    let (listener, at) = listen(args)?;
    listen_for_the_end()?;

    let board = Arc::<Board>::default();
    let desk = Arc::new(Desk::new(board.clone()));
    let (orders, taken) = mpsc::channel();
    let setup = Setup {
        path: args.scene.clone(),
        options: args.options.clone(),
        spp: args.spp,
        outputs,
        reference,
        reference_time: Duration::from_secs_f64(args.reference_time),
    };
    let (files, scene) = (scene.files().to_vec(), Arc::new(scene));
    let mut engine = Engine::new(setup, scene.clone(), board.clone(), desk.clone(), taken);
    let prepared = engine.set_up().map_err(|error| CliError::setup(&args.scene, &error))?;
    if !args.quiet {
        scene.notes().iter().for_each(|note| report::note(note));
    }
    let watch = watch::Watch {
        path: args.scene.clone(),
        reading: args.options.reading,
        board: board.clone(),
        orders: orders.clone(),
    };
    spawn("watch", move || watch.run(files, &before))?;
    spawn("render", move || engine.run(prepared))?;
    if let Some(tev) = tev {
        let (board, name) = (board.clone(), scene.name().to_owned());
        spawn("tev", move || {
            if let Err(error) = tev::feed(tev, &board, &name) {
                report::warning(&format!("tev has gone: {error}"));
            }
        })?;
    }
    let gate = Arc::new(Gate::new().map_err(|error| CliError::failed(format!("no random numbers: {error}")))?);
    report::data(&gate.address(at))?;
    if !args.no_open {
        open(&gate.address(at), args.quiet);
    }
    serve(&listener, &gate, &board, &desk, &orders)
}

fn reference(path: &Path, (width, height): (u32, u32)) -> Result<octolux::film::Picture, CliError> {
    let picture = read_picture(path).map_err(|error| CliError::bad_path(&error))?;
    if (picture.width, picture.height) != (width, height) {
        let what = format!(
            "{}: a reference of {} x {} for a picture of {width} x {height}",
            path.display(),
            picture.width,
            picture.height
        );
        return Err(CliError::usage(what).with_help("give one of the same size, or ask for that size with --size"));
    }
    Ok(picture)
}

/// Parses an address of this machine.
fn address(text: &str) -> Result<IpAddr, String> {
    let help = "an address is one of this machine in numbers, such as 127.0.0.1, ::1, or 0.0.0.0 for all of them; a port goes to --port";
    text.parse().map_err(|_| help.to_owned())
}

fn listen(args: &Args) -> Result<(TcpListener, SocketAddr), CliError> {
    let address = args.bind.unwrap_or(IpAddr::from([127, 0, 0, 1]));
    let place = SocketAddr::new(address, args.port);
    let cannot = |error: std::io::Error| {
        let help = match error.kind() {
            ErrorKind::AddrNotAvailable => {
                "--bind takes an address of this machine: 127.0.0.1, or 0.0.0.0 for all of them"
            }
            ErrorKind::PermissionDenied => "choose a --port from 1024 on, or leave it out for one that is free",
            _ => "choose another --port, or leave it out for one that is free",
        };
        CliError::usage(format!("cannot serve at {place}: {error}")).with_help(help)
    };
    let listener = TcpListener::bind(place).map_err(cannot)?;
    let at = listener.local_addr().map_err(cannot)?;
    if !address.is_loopback() {
        report::warning(&format!(
            "--bind {address}: other machines can reach this page; whoever has the whole address sees the scene and may write \
             the files that -o names. Nothing is encrypted: ssh -L is safer"
        ));
    }
    Ok((listener, at))
}

/// Ctrl-c exits at once; a file that is being written keeps its old content.
fn listen_for_the_end() -> Result<(), CliError> {
    ctrlc::set_handler(|| {
        replace::abandon_all();
        process::exit(Exit::Interrupted.code().into());
    })
    .map_err(|error| CliError::failed(format!("cannot listen for ctrl-c: {error}")))
}

fn spawn(name: &str, work: impl FnOnce() + Send + 'static) -> Result<(), CliError> {
    let started = thread::Builder::new().name(name.to_owned()).spawn(work);
    started
        .map(drop)
        .map_err(|error| CliError::failed(format!("cannot start a thread: {error}")))
}

/// Accepts connections forever.
fn serve(
    listener: &TcpListener,
    gate: &Arc<Gate>,
    board: &Arc<Board>,
    desk: &Arc<Desk>,
    orders: &mpsc::Sender<Order>,
) -> Result<Exit, CliError> {
    let open = Arc::<AtomicUsize>::default();
    for stream in listener.incoming() {
        let Ok(mut stream) = stream else {
            // Out of descriptors, or the peer is gone: wait, because the former lasts.
            thread::sleep(Duration::from_millis(20));
            continue;
        };
        let guest = Guest::enter(&open);
        if open.load(Ordering::Relaxed) > MOST_CONNECTIONS {
            let _ = stream.set_write_timeout(Some(Duration::from_millis(100)));
            let _ = http::refuse(
                &mut stream,
                Refusal("503 Service Unavailable", "too many pages are open"),
            );
            continue;
        }
        let (gate, board, desk, orders) = (gate.clone(), board.clone(), desk.clone(), orders.clone());
        let _ = spawn("guest", move || {
            let _guest = guest;
            let _ = attend(stream, &gate, &board, &desk, &orders);
        });
    }
    Ok(Exit::Well)
}

fn attend(
    stream: TcpStream,
    gate: &Gate,
    board: &Arc<Board>,
    desk: &Arc<Desk>,
    orders: &mpsc::Sender<Order>,
) -> std::io::Result<()> {
    match http::serve(stream, gate)? {
        Some(stream) => socket::serve(stream, board, desk, orders),
        None => Ok(()),
    }
}

/// Counts a connection while it exists.
struct Guest(Arc<AtomicUsize>);

impl Guest {
    fn enter(count: &Arc<AtomicUsize>) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count.clone())
    }
}

impl Drop for Guest {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Opens the browser if there is a display.
fn open(address: &str, quiet: bool) {
    let has = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let screen = cfg!(target_os = "macos") || has("DISPLAY") || has("WAYLAND_DISPLAY");
    if !screen || has("SSH_CONNECTION") {
        if !quiet {
            report::note("open this address in a browser");
        }
        return;
    }
    let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    let mut command = process::Command::new(opener);
    let silent = process::Stdio::null;
    let child = command
        .arg(address)
        .stdin(silent())
        .stdout(silent())
        .stderr(silent())
        .spawn();
    match child {
        // Wait in a separate thread, so that no zombie process is left.
        Ok(mut child) => drop(spawn("browser", move || drop(child.wait()))),
        Err(_) if !quiet => report::note("no browser could be opened: open this address yourself"),
        Err(_) => {}
    }
}

/// A message as JSON.
fn said(level: &str, what: &str) -> String {
    json!({ "kind": "said", "level": level, "what": what }).to_string()
}
