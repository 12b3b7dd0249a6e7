//! The options that choose how a scene is rendered, shared by `render` and `explain`.

use clap::builder::{PossibleValuesParser, TypedValueParser};

use super::CliError;
use super::reading::LoadOptions;
use super::units::{self, MOST_SEED};
use octolux::lane::{AVX512, has_avx512};
use octolux::pipeline::Settings;
use octolux::run::{MOST_SPP, RenderOptions};
use octolux::scene::{Effect, FilmSize, SamplerKind, Scene, available_memory};
use octolux::settings::{AccelKind, EstimatorAsked, Lanes, LightsAsked};

/// Maximum side of a picture in pixels, as in scene files.
const LONGEST_SIDE: u32 = 65_536;

/// Minimum memory of a pixel during rendering, as for scene files.
const BYTES_PER_PIXEL: u64 = 40;

/// The spelling of on/off options.
const SWITCH: [&str; 2] = ["on", "off"];

/// The spelling of an on/off value.
pub const fn switch(on: bool) -> &'static str {
    SWITCH[if on { 0 } else { 1 }]
}

/// Each overrides the scene's own `[render]` and `[film]`.
#[derive(clap::Args, Clone, Debug)]
pub struct Options {
    /// How directions of light are drawn [default: the scene's, else auto]
    #[arg(long, value_enum, value_name = "NAME")]
    pub estimator: Option<EstimatorAsked>,
    /// Where random numbers come from [default: the scene's, else sobol]
    #[arg(long, value_enum, value_name = "NAME")]
    pub sampler: Option<SamplerKind>,
    /// Seed of every random number, 0 to 4294967295 [default: the scene's, else 0]
    #[arg(long, value_name = "N", value_parser = units::whole::<u32>("a seed is", 0..=MOST_SEED), allow_negative_numbers = true)]
    pub seed: Option<u32>,
    /// Size of the picture in pixels, such as 768x512 [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = size, allow_hyphen_values = true)]
    pub size: Option<FilmSize>,
    /// Rays a packet: 16 (AVX-512), 8, or 1 for the scalar kernel; the picture is the same [default: the most that the
    /// processor and the intersector support; OCTOLUX_AVX512=off does without AVX-512]
    #[arg(long, value_name = "1|8|16", value_parser = lanes, allow_negative_numbers = true)]
    pub lanes: Option<Lanes>,
    /// How rays find what they hit: Embree's tree, or a plain list of the shapes [default: linear up to 128 shapes, else embree]
    #[arg(long, value_enum, value_name = "NAME")]
    pub accel: Option<AccelKind>,
    /// Whether Embree closes the edges between triangles, so that rays aimed at them hardly ever slip through a mesh. `off`
    /// is a little faster; it changes nothing with --accel linear [default: on]
    #[arg(long, value_name = "on|off", value_parser = PossibleValuesParser::new(SWITCH).map(|value| value == SWITCH[0]))]
    pub robust: Option<bool>,
    /// Whether shapes that cannot be hit are left out for all rays of a tile at once, in scenes of few shapes. `off` tests every
    /// ray, for benchmarks of rays: the picture is the same but for the last rounding [default: on]
    #[arg(long, value_name = "on|off", value_parser = PossibleValuesParser::new(SWITCH).map(|value| value == SWITCH[0]))]
    pub cull: Option<bool>,
    /// Which lights a pass samples: all, or a list of so many (1 to 64) for each group of pixels in a tile of 16 x 16, drawn by what
    /// they may bring;
    /// the mean is the same [default: auto, all up to 64 lights, else lists of 8]
    #[arg(long, value_name = "auto|all|N", value_parser = lights, allow_negative_numbers = true)]
    pub lights: Option<LightsAsked>,
    /// Threads, 1 to 1024 [default: as many as the machine offers]
    #[arg(long, value_name = "N", value_parser = units::threads(), allow_negative_numbers = true)]
    pub threads: Option<usize>,
    /// Effects to compile into the kernel even if the scene does not require them; the picture is the same. For measurements
    #[arg(long, value_enum, value_name = "EFFECT", hide = true)]
    pub hold: Vec<Effect>,
    #[command(flatten)]
    pub reading: LoadOptions,
}

impl Options {
    /// Resolves every option: the command line, then the scene, then the default.
    ///
    /// # Errors
    /// A `--size` that does not fit into memory.
    pub fn settings(&self, scene: &Scene) -> Result<Settings, CliError> {
        check_size(self.size)?;
        Ok(self.render_options().settings(scene))
    }

    /// The options as library options.
    pub fn render_options(&self) -> RenderOptions {
        RenderOptions {
            size: self.size,
            estimator: self.estimator,
            sampler: self.sampler,
            seed: self.seed,
            lanes: self.lanes,
            threads: self.threads,
            accel: self.accel,
            robust: self.robust.unwrap_or(true),
            cull: self.cull.unwrap_or(true),
            lights: self.lights.unwrap_or_default(),
            ..RenderOptions::default()
        }
    }
}

impl Options {
    /// The given options as typed, each with a leading space; leaves out the option `turned`.
    pub fn given(&self, turned: &str) -> String {
        let text = |value: Option<&'static str>| value.map(str::to_owned);
        let size = self.size.map(|FilmSize { width, height }| format!("{width}x{height}"));
        let all = [
            ("estimator", text(self.estimator.map(EstimatorAsked::name))),
            ("sampler", text(self.sampler.map(SamplerKind::name))),
            ("seed", self.seed.map(|seed| seed.to_string())),
            ("size", size),
            ("lanes", self.lanes.map(|lanes| lanes.to_string())),
            ("accel", text(self.accel.map(AccelKind::name))),
            ("robust", text(self.robust.map(switch))),
            ("cull", text(self.cull.map(switch))),
            ("lights", self.lights.map(|lights| lights.to_string())),
            ("threads", self.threads.map(|threads| threads.to_string())),
        ];
        let kept = all.into_iter().filter(|(name, _)| *name != turned);
        let kept = kept.filter_map(|(name, value)| Some(format!(" --{name} {}", value?)));
        std::iter::once(self.reading.given()).chain(kept).collect()
    }
}

/// Checks that a picture of the size on the command line fits into memory.
///
/// # Errors
/// If it does not.
pub fn check_size(size: Option<FilmSize>) -> Result<(), CliError> {
    let Some(FilmSize { width, height }) = size else {
        return Ok(());
    };
    let bytes = u64::from(width) * u64::from(height) * BYTES_PER_PIXEL;
    if available_memory().is_some_and(|free| bytes > free) {
        let gib = bytes as f64 / f64::from(1 << 30);
        let what = format!("--size {width}x{height} needs {gib:.1} GiB of memory, more than is free");
        return Err(CliError::usage(what).with_help("make the picture smaller, or close other programs"));
    }
    Ok(())
}

/// Parses a number of passes.
pub fn spp(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(number @ 1..=MOST_SPP) => Ok(number),
        _ => Err(format!("samples a pixel are a whole number from 1 to {MOST_SPP}")),
    }
}

/// Parses an exposure in stops.
pub fn stops(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.abs() <= 64.0 => Ok(number),
        _ => Err("an exposure is a number of stops from -64 to 64, such as 1 or -0.5".to_owned()),
    }
}

fn lights(text: &str) -> Result<LightsAsked, String> {
    match (text, text.parse()) {
        ("auto", _) => Ok(LightsAsked::Auto),
        ("all", _) => Ok(LightsAsked::All),
        (_, Ok(length @ 1..=LightsAsked::LONGEST)) => Ok(LightsAsked::List(length)),
        _ => Err(format!(
            "lights are auto, all or a whole number from 1 to {}",
            LightsAsked::LONGEST
        )),
    }
}

fn lanes(text: &str) -> Result<Lanes, String> {
    let known = Lanes::ALL.into_iter().find(|lanes| lanes.to_string() == text);
    match known.ok_or("a packet has 1, 8 or 16 rays")? {
        Lanes::Sixteen if !has_avx512() => Err(format!(
            "packets of 16 rays need AVX-512, which this processor lacks, this build left out or {AVX512}=off leaves unused"
        )),
        lanes => Ok(lanes),
    }
}

/// Parses a picture size, `WIDTHxHEIGHT`.
pub fn size(text: &str) -> Result<FilmSize, String> {
    let side = |text: &str| {
        text.parse::<u32>()
            .ok()
            .filter(|side| (1..=LONGEST_SIDE).contains(side))
    };
    let sides = text
        .split_once(['x', 'X'])
        .and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides
        .map(|(width, height)| FilmSize { width, height })
        .ok_or_else(|| format!("a size is WIDTHxHEIGHT, such as 768x512, each from 1 to {LONGEST_SIDE}"))
}
