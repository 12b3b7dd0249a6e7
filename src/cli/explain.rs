//! `octolux explain`: the contents and requirements of a scene, and how it would be rendered.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::explain_effects::{self as effects, Found};
use super::noise::{self, Noise};
use super::options::Options;
use super::{CliError, Exit, report};
use octolux::machine;
use octolux::pipeline::{Chosen, Prepared};
use octolux::run::DEFAULT_SPP;
use octolux::scene::{Bsdf, Effect, EstimatorKind, SamplerKind, Scene, Surface};
use octolux::settings::LightsAsked;
use octolux::study::effect_costs::{self, Costs};

/// Say what a scene contains and requires, and how it would be rendered
#[derive(clap::Args)]
pub struct Args {
    /// The scene file
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    #[command(flatten)]
    options: Options,
    /// Print one JSON object instead
    #[arg(long)]
    json: bool,
    /// Measure here and now what each effect costs: absent ones compiled in without being used, present ones taken
    /// out of the scene (a second or two, one thread)
    #[arg(long)]
    measure: bool,
    /// Say why the picture is noisy (some 10 to 60 seconds): a map of the noise, what share of it each light and each material
    /// has, and which settings would be the cheapest. The map goes to FILE, a .png in colours, or .exr or .npy with the numbers
    /// themselves
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "{name}-noise.png")]
    noise: Option<PathBuf>,
}

/// Prints the explanation on standard output.
///
/// # Errors
/// A scene that cannot be loaded, or not rendered with these settings.
pub fn run(args: &Args) -> Result<Exit, CliError> {
    let scene = args.options.reading.load(&args.scene)?;
    let settings = args.options.settings(&scene)?;
    let prepared = Prepared::new(&scene, settings).map_err(|error| CliError::setup(&args.scene, &error))?;
    let chosen = Chosen::of(&scene, args.options.estimator);
    let mut explanation = Explanation::new(&args.scene, &scene, chosen, &prepared);
    if args.measure {
        let costs = effect_costs::measure(&scene, settings).map_err(|error| CliError::setup(&args.scene, &error))?;
        explanation.costs = Some(costs);
        if let Some(load) = machine::load().filter(|&load| load > 1.0) {
            let what = format!(
                "the machine is busy (load {load:.1}), and times are not exact: close other programs and measure again"
            );
            report::warning(&what);
        }
    }
    if let Some(map) = &args.noise {
        explanation.noise = match noise::measure(&args.scene, &scene, settings, map)? {
            None => return Ok(Exit::Interrupted),
            measured => measured,
        };
    }
    if args.json {
        let json = serde_json::to_string(&explanation).map_err(|error| CliError::failed(error.to_string()))?;
        report::data(&json)?;
    } else {
        let costs = explanation.costs.iter();
        let costs = costs.flat_map(|costs| effects::cost_lines(costs, &prepared));
        let noise = explanation.noise.iter().flat_map(noise::lines);
        let lines: Vec<String> = std::iter::once(explanation.text()).chain(costs).chain(noise).collect();
        report::data(&lines.join("\n"))?;
    }
    Ok(Exit::Well)
}

/// Counts, required effects and the plan.
#[derive(Serialize)]
struct Explanation {
    scene: String,
    width: u32,
    height: u32,
    spheres: usize,
    sphere_lights: usize,
    meshes: usize,
    mesh_lights: usize,
    other_lights: usize,
    triangles: usize,
    materials: usize,
    /// Materials with a diffuse lobe, with a Phong lobe, with both, and with microfacets.
    diffuse: usize,
    phong: usize,
    blends: usize,
    rough: usize,
    needs: Vec<&'static str>,
    found: Vec<Found>,
    absent: Vec<Effect>,
    notes: Vec<String>,
    kernel: String,
    why: String,
    /// `None` if no rays go through Embree.
    robust: Option<bool>,
    /// `None` with too many shapes.
    cull: Option<bool>,
    /// Which lights a pass samples, and why.
    asked: String,
    lanes: usize,
    /// Rays per call of the intersector.
    rays_together: usize,
    threads: usize,
    spp: u32,
    estimator: EstimatorKind,
    /// Who named the estimator, or why it was chosen.
    estimator_why: &'static str,
    /// The estimator that `auto` takes, and why.
    auto: EstimatorKind,
    auto_why: &'static str,
    sampler: SamplerKind,
    seed: u32,
    #[serde(skip_serializing_if = "Option::is_none")]
    costs: Option<Costs>,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<Noise>,
}

/// Notes about parts of the scene without effect, and about an estimator that is another one here.
fn notes(scene: &Scene, prepared: &Prepared) -> Vec<String> {
    let mut said = effects::notes(scene, prepared.features());
    let (asked, taken) = (prepared.settings().estimator, prepared.estimator());
    if asked != taken {
        said.push(format!(
            "lights are in lists: {} samples them as {} does",
            asked.name(),
            taken.name()
        ));
    }
    said
}

impl Explanation {
    fn new(path: &Path, scene: &Scene, chosen: Chosen, prepared: &Prepared) -> Self {
        let (settings, auto) = (prepared.settings(), Chosen::AUTO);
        let emits = |surface: &Surface| matches!(surface, Surface::Emission(_));
        let of_kind =
            |kind: fn(&Bsdf) -> bool| scene.materials().iter().filter(|material| kind(&material.bsdf)).count();
        Self {
            scene: path.to_string_lossy().into_owned(),
            width: settings.film.width,
            height: settings.film.height,
            spheres: scene.spheres().len(),
            sphere_lights: scene.spheres().iter().filter(|sphere| emits(&sphere.surface)).count(),
            meshes: scene.meshes().len(),
            mesh_lights: scene.meshes().iter().filter(|mesh| emits(&mesh.surface)).count(),
            other_lights: scene.lights().iter().filter(|light| light.emits()).count(),
            triangles: scene.meshes().iter().map(|mesh| mesh.triangles.len()).sum(),
            materials: scene.materials().len(),
            diffuse: of_kind(|bsdf| matches!(bsdf, Bsdf::Diffuse { .. } | Bsdf::Blend { .. })),
            phong: of_kind(|bsdf| matches!(bsdf, Bsdf::Phong { .. } | Bsdf::Blend { .. })),
            blends: of_kind(|bsdf| matches!(bsdf, Bsdf::Blend { .. })),
            rough: of_kind(|bsdf| matches!(bsdf, Bsdf::Ggx { .. } | Bsdf::Conductor { .. })),
            needs: prepared.needs(),
            found: effects::found(scene, prepared.features()),
            absent: effects::absent(prepared.features()),
            notes: notes(scene, prepared),
            kernel: prepared.kernel().to_owned(),
            why: prepared.why().to_owned(),
            robust: prepared.robust(),
            cull: prepared.cull(),
            asked: asked(prepared),
            lanes: prepared.lanes().count(),
            rays_together: prepared.rays_together(),
            threads: settings.threads,
            spp: scene.render().spp.unwrap_or(DEFAULT_SPP),
            estimator: chosen.estimator,
            estimator_why: chosen.why,
            auto: auto.estimator,
            auto_why: auto.why,
            sampler: settings.sampler,
            seed: settings.seed,
            costs: None,
            noise: None,
        }
    }

    /// Counts each material once: a blend does not also count as its parts.
    fn materials(&self) -> String {
        let [diffuse, phong] = [self.diffuse, self.phong].map(|all| all - self.blends);
        let blends = match self.blends {
            0 => String::new(),
            some => format!(", {some} blends"),
        };
        let rough = match self.rough {
            0 => String::new(),
            some => format!(", {some} with microfacets"),
        };
        format!(
            "  materials  {}: {diffuse} diffuse, {phong} phong{blends}{rough}",
            self.materials
        )
    }

    /// Which estimator is taken, and by whose choice.
    fn estimators(&self) -> String {
        let (estimator, auto) = (self.estimator.name(), self.auto.name());
        let reason = match self.estimator_why == self.auto_why {
            true => self.auto_why.to_owned(),
            false => format!("{}; auto would take {auto}: {}", self.estimator_why, self.auto_why),
        };
        format!("  estimator  {estimator}: {reason}")
    }

    fn text(&self) -> String {
        let needs = if self.needs.is_empty() {
            "nothing".to_owned()
        } else {
            self.needs.join(", ")
        };
        let rays = match (self.lanes, self.rays_together) {
            (1, _) => "one ray at a time".to_owned(),
            (lanes, 1) => format!("{lanes} rays a packet, which Embree takes one by one"),
            (lanes, _) => format!("{lanes} rays a packet"),
        };
        let robust = match self.robust {
            Some(true) => "on: Embree closes the edges between triangles",
            Some(false) => "off: rays aimed at edges and vertices may slip through meshes",
            None => "without effect: no ray goes through Embree",
        };
        let cull = match self.cull {
            Some(true) => "on: shapes that cannot be hit are left out for all rays of a tile at once",
            Some(false) => "off: every ray is tested",
            None => "without effect: too many shapes",
        };
        let lights = self.sphere_lights + self.mesh_lights + self.other_lights;
        let mut lines = vec![
            format!("{}: {} x {} pixels", self.scene, self.width, self.height),
            format!("  spheres    {}, {} of them lights", self.spheres, self.sphere_lights),
            format!(
                "  meshes     {} with {} triangles, {} of them lights",
                self.meshes, self.triangles, self.mesh_lights
            ),
            format!("  lights     {lights}"),
            self.materials(),
            format!("  needs      {needs}"),
        ];
        lines.extend(self.found.iter().map(Found::line));
        lines.push(format!("  absent     {}", effects::names(&self.absent)));
        lines.extend(self.notes.iter().map(|said| format!("  note       {said}")));
        lines.extend([
            format!("  kernel     {}, {rays}, {} threads", self.kernel, self.threads),
            format!("  because    {}", self.why),
            format!("  robust     {robust}"),
            format!("  cull       {cull}"),
            format!("  sampled    {}", self.asked),
            self.estimators(),
            format!(
                "  render     {} spp, {}, {}, seed {}",
                self.spp,
                self.estimator.name(),
                self.sampler.name(),
                self.seed
            ),
        ]);
        lines.join("\n")
    }
}

/// Which lights a pass samples, and by which rule.
fn asked(prepared: &Prepared) -> String {
    let (settings, features) = (prepared.settings(), prepared.features());
    if settings.estimator.per_light() {
        let kinds = match (features.emitters > features.placed, features.placed > 0) {
            (true, true) => KINDS[2],
            (false, true) => KINDS[1],
            (_, false) => KINDS[0],
        };
        return all_or_lists(prepared, ["light", "lights"], features.emitters, kinds);
    }
    let met = format!(
        "whatever a direction meets: {} draws none for a light",
        settings.estimator.name()
    );
    match features.placed {
        0 => met,
        placed => format!("{met}; {}", all_or_lists(prepared, KINDS[1], placed, KINDS[1])),
    }
}

/// Lights that count for the rule: of one, and of several.
const KINDS: [[&str; 2]; 3] = [
    ["sphere or triangle", "spheres and triangles"],
    ["point or spot", "points and spots"],
    [
        "sphere, triangle, point or spot",
        "spheres, triangles, points and spots",
    ],
];

/// A number of things, of which one has another name than several.
fn counted(count: u32, [one, several]: [&str; 2]) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

/// How a pass samples lights: `called` are those that it samples, `count` those of these kinds.
fn all_or_lists(prepared: &Prepared, called: [&str; 2], count: usize, [one, several]: [&str; 2]) -> String {
    let few = LightsAsked::FEW;
    let rule = match prepared.settings().lights {
        LightsAsked::Auto if count == 1 => format!("1 {one} that emits is not more than {few}"),
        LightsAsked::Auto if count <= few => format!("{count} {several} that emit are not more than {few}"),
        LightsAsked::Auto => format!("{count} {several} emit, more than the {few} that are all sampled"),
        forced => format!("--lights {forced} was asked for"),
    };
    let Some(lists) = prepared.lists() else {
        return format!("every {} in each pass: {rule}", called[0]);
    };
    let polished = [Effect::Phong, Effect::Conductor].map(|model| prepared.features().effects().has(model));
    let walks = if polished.contains(&true) {
        format!(
            ", or {} of each polished point down the tree, where the tile's table expects less noise of them",
            counted(lists.walks, ["walk", "walks"])
        )
    } else {
        String::new()
    };
    format!(
        "a list of {} for each group of pixels in a tile and each pass{walks}: {rule}; tree of {:.1} MB, {:.0} bytes a light, {:.0} ms to build",
        counted(lists.length, called),
        lists.bytes as f64 / 1e6,
        lists.bytes as f64 / lists.lights as f64,
        lists.build_time.as_secs_f64() * 1e3
    )
}
