//! The tables of the page.

use super::html::{definitions, escape, table};
use super::{Circumstances, words};
use crate::scene::{Effect, Features, Scene};
use crate::study::cost::Study;
use crate::study::cost::price::{Price, Verdict};

/// Errors in the table of cheapest settings, as `--target-error` means them.
const ASKED: [f64; 5] = [0.3, 0.1, 0.03, 0.01, 0.003];

/// The cheapest command line for several errors.
pub fn cheapest(study: &Study, circumstances: &Circumstances) -> String {
    let whole = words::whole_film(study);
    let row = |&error: &f64| {
        let best = study.cheapest(error);
        let line = format!("octolux render {}{}", circumstances.scene, study.recommendation(error));
        vec![
            words::exact_percent(error),
            words::seconds(whole * best.seconds_for_error(error)),
            words::seconds(whole * study.prices[0].seconds_for_error(error)),
            format!("<code>{}</code>", escape(&line)),
        ]
    };
    let rows: Vec<_> = ASKED.iter().map(row).collect();
    table(
        "cards",
        &[
            "error asked",
            "cheapest",
            "default settings",
            "command line of the cheapest",
        ],
        &rows,
    )
}

/// Costs of one setting at a time.
pub fn prices(study: &Study) -> String {
    let row = |price: &Price| {
        let verdict = format!("<span class=\"verdict {0}\">{0}</span>", price.verdict);
        let plain = price.verdict == Verdict::Default && price.variant.setting.is_empty();
        let relative = |text: String| if plain { "1".to_owned() } else { text };
        let setting = if price.arguments.is_empty() {
            format!("<b>{}</b>", price.label)
        } else {
            format!(
                "<b>{}</b><br><code>{}</code>",
                escape(&price.label),
                escape(price.arguments.trim())
            )
        };
        vec![
            setting,
            relative(two_lines(words::ratio(price.time_ratio))),
            words::number(price.rays_per_second.value * 1e-6),
            relative(if price.same_bits {
                "same picture".to_owned()
            } else {
                two_lines(words::ratio(price.noise_ratio))
            }),
            relative(speed_up(price)),
            if price.same_bits {
                "none: same bits".to_owned()
            } else {
                format!("<span class=\"whole\">{}</span>", words::bias(price.bias))
            },
            match price.bias_equals_noise_at {
                Some(spp) => format!(
                    "{verdict}<br>bias equals noise at {} samples a pixel",
                    words::number(spp)
                ),
                None => verdict,
            },
        ]
    };
    let rows: Vec<_> = study.prices.iter().map(row).collect();
    table(
        "cards prices",
        &[
            "setting",
            "time of a pass",
            "million rays / s",
            "relative MSE at equal samples",
            "speed-up at equal error",
            "bias of brightness",
            "verdict",
        ],
        &rows,
    )
}

fn speed_up(price: &Price) -> String {
    let (value, mut interval) = words::speed_up(price.speed_up);
    if price.extrapolated {
        interval += ", along its slope";
    }
    two_lines((value, interval))
}

/// A value with its interval below it.
fn two_lines((value, interval): (String, String)) -> String {
    format!("<span class=\"whole\">{value}</span><br><span class=\"soft\">{interval}</span>")
}

/// All effects: how many shapes require each, and what follows for the kernel.
pub fn effects(study: &Study, scene: &Scene) -> String {
    let found = Features::of(scene, scene.film());
    let triangles: usize = scene.meshes().iter().map(|mesh| mesh.triangles.len()).sum();
    let row = |effect: Effect| {
        let count = found.count(effect);
        let held = study.phases.held.contains(&effect.name());
        vec![
            effect.name().to_owned(),
            if count > 0 {
                count.to_string()
            } else {
                "none".to_owned()
            },
            match (count > 0, held) {
                (true, _) => "compiled into the kernel".to_owned(),
                (false, true) => "compiled into the kernel: there is no smaller one".to_owned(),
                (false, false) => "<span class=\"soft\">no code for it runs</span>".to_owned(),
            },
        ]
    };
    let mut rows: Vec<_> = Effect::ALL.into_iter().map(row).collect();
    rows.push(vec![
        "shapes in all".to_owned(),
        format!("{}, {triangles} of them triangles", found.shapes),
        format!(
            "<code>{}</code>: {}",
            escape(&study.phases.kernel),
            escape(&study.phases.why)
        ),
    ]);
    let impossible = study
        .impossible
        .iter()
        .map(|(label, why)| vec![escape(label), "not possible here".to_owned(), escape(why)]);
    rows.extend(impossible);
    table("cards", &["effect", "shapes that require it", "what follows"], &rows)
}

/// Time by phase of one render.
pub fn phases(study: &Study) -> String {
    let p = &study.phases;
    let rays = |count: f64| {
        format!(
            "{} million a pass, {} million / s",
            words::number(count * 1e-6),
            words::number(count * 1e-6 / p.pass_s)
        )
    };
    let [width, height] = study.scene_film;
    let pairs = [
        ("load the scene", words::seconds(p.load_s)),
        ("set up threads and tables", words::seconds(p.setup_s)),
        ("build the accelerator", words::seconds(p.build_s)),
        ("first pass", words::seconds(p.first_pass_s)),
        (
            "each further pass",
            format!(
                "{} <span class=\"soft\">mean of {}</span>",
                words::seconds(p.pass_s),
                p.passes
            ),
        ),
        ("write EXR and PNG", words::seconds(p.write_s)),
        ("camera rays", rays(p.eye_rays)),
        ("shadow rays", rays(p.shadow_rays)),
    ];
    let pairs: Vec<_> = pairs.map(|(name, what)| (name.to_owned(), what)).into();
    format!(
        "<p>One render of {width} × {height} pixels with the default settings.</p>\n{}",
        definitions(&pairs)
    )
}

/// The circumstances in which the figures were measured.
pub fn circumstances(study: &Study, c: &Circumstances) -> String {
    let load = c.load.map_or_else(|| "unknown".to_owned(), |load| format!("{load:.2}"));
    let reference = format!(
        "independent f64 oracle, {} samples a pixel{}, own relative MSE {}",
        study.reference.spp,
        if study.reference.cached { " (cached)" } else { "" },
        words::number(study.reference.relative_mse)
    );
    let pairs = [
        ("command", format!("<code>{}</code>", escape(&c.command))),
        (
            "Octolux",
            format!("{}, commit {}", escape(&c.version), escape(&c.commit)),
        ),
        ("processor", escape(&c.cpu)),
        (
            "compiled for",
            format!("{}; kernels of {} lanes", escape(&c.target_features), c.lanes),
        ),
        ("Embree", escape(&study.phases.embree_version)),
        ("threads", c.threads.to_string()),
        ("load before", load),
        (
            "default settings",
            format!(
                "{}, {}, {} lanes, {} threads",
                escape(&c.estimator),
                escape(&c.sampler),
                c.lanes,
                c.threads
            ),
        ),
        (
            "comparisons",
            format!(
                "{} × {} pixels, {} seeds from {} on",
                study.film[0], study.film[1], study.seeds, study.seed
            ),
        ),
        ("reference", reference),
        ("took", format!("{:.0} s of {:.0} s", study.seconds, c.budget)),
    ];
    definitions(&pairs.map(|(name, what)| (name.to_owned(), what)))
}
