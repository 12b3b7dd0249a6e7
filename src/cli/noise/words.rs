//! The results as text.

use super::Noise;
use super::map::ENDS;
use super::parts::Part;
use super::prices::{ASKED, Of, Price};

/// The lines of the report.
pub fn lines(noise: &Noise) -> Vec<String> {
    let percent = |x: f64| 100.0 * x;
    let [width, height] = noise.film;
    let mut lines = vec![
        "  noise".to_owned(),
        format!("    map        {}", noise.map.display()),
        format!(
            "               the standard deviation of each pixel after {} samples, over the picture's mean: dark violet is {} % \
             and less, yellow {} % and more",
            noise.spread.map_spp,
            percent(ENDS[0]),
            percent(ENDS[1]),
        ),
        format!(
            "    where      half of the variance is in {:.2} % of the pixels",
            percent(noise.spread.half_in).max(0.01)
        ),
        format!(
            "    measured   on {width} x {height} pixels, {} renders of {} samples: noise {:.2} +- {:.2} % of the mean each",
            noise.seeds,
            noise.spp,
            percent(noise.error),
            percent(noise.error_uncertainty)
        ),
    ];
    if noise.lights.is_empty() && noise.materials.is_empty() {
        lines.push("    shares     not measured: passes sample lists of the many lights, and no light alone shows the noise of choosing it".to_owned());
    } else {
        lines.extend(shares("lights", &noise.lights));
        lines.extend(shares("materials", &noise.materials));
    }
    let to = format!("s to {} % noise", percent(ASKED));
    lines.push(format!("    settings   {to:>17}   {:>21}", "relMSE x s"));
    lines.extend(noise.prices.iter().map(price));
    lines.extend(advice(noise));
    lines
}

fn shares(kind: &str, parts: &[Part]) -> Vec<String> {
    let mut lines = vec![format!("    {kind:<9} {:>17}  {:>17}", "of the variance", "of relMSE")];
    lines.extend(parts.iter().map(|part| {
        let figures = [
            part.share,
            part.uncertainty,
            part.share_of_relmse,
            part.uncertainty_of_relmse,
        ];
        let [share, error, relative, relative_error] = figures.map(|x| 100.0 * x);
        format!(
            "      {share:6.1} +- {error:4.1} %  {relative:6.1} +- {relative_error:4.1} %  {}",
            part.name
        )
    }));
    lines
}

fn price(price: &Price) -> String {
    let of = |what: Of| {
        let (cost, error) = price.of(what);
        format!("{:>9} +- {:<9}", digits(cost), digits(error))
    };
    format!("      {}  {}  {}", of(Of::Error), of(Of::RelMse), price.name)
}

/// Three digits.
fn digits(x: f64) -> String {
    match x {
        x if x >= 100.0 => format!("{x:.0}"),
        x if x >= 10.0 => format!("{x:.1}"),
        x if x >= 1.0 => format!("{x:.2}"),
        x if x >= 1e-2 => format!("{x:.4}"),
        x => format!("{x:.1e}"),
    }
}

/// Recommendations.
fn advice(noise: &Noise) -> Vec<String> {
    let mut said: Vec<String> = Vec::new();
    for (what, name) in [(Of::Error, "the variance"), (Of::RelMse, "relMSE")] {
        if let (Some(light), Some(material)) = (most(&noise.lights, what), most(&noise.materials, what)) {
            said.push(format!("the largest shares of {name}: {light}; {material}"));
        }
        let cheapest = noise.prices.iter().min_by(|a, b| a.of(what).0.total_cmp(&b.of(what).0));
        let now = noise.prices.iter().find(|price| price.arguments.is_empty());
        if let (Some(now), Some(cheapest)) = (now, cheapest) {
            said.push(format!("by {name}, {}", verdict(now, cheapest, &noise.prices, what)));
        }
    }
    said.push("octolux study SCENE --recommend 0.01 measures longer, at the picture's own size".to_owned());
    let lead = std::iter::once("so").chain(std::iter::repeat(""));
    let lines = lead.zip(said);
    lines.map(|(lead, what)| format!("    {lead:<10} {what}")).collect()
}

/// The part with the largest share, if any.
fn most(parts: &[Part], what: Of) -> Option<String> {
    let of = |part: &Part| match what {
        Of::Error => part.share,
        Of::RelMse => part.share_of_relmse,
    };
    let first = parts.iter().max_by(|a, b| of(a).total_cmp(&of(b)))?;
    (of(first) > 0.0).then(|| format!("{:.0} % {}", 100.0 * of(first), first.name))
}

fn verdict(now: &Price, cheapest: &Price, all: &[Price], what: Of) -> String {
    let tied = all
        .iter()
        .filter(|price| price.name != cheapest.name && price.ties(cheapest, what));
    let tied: Vec<&str> = tied.map(|price| price.name.as_str()).collect();
    let with = match &tied[..] {
        [] => String::new(),
        some => format!("; not told apart from it: {}", some.join("; ")),
    };
    if now.arguments == cheapest.arguments {
        return format!("the current settings are the cheapest{with}");
    }
    if now.ties(cheapest, what) {
        let name = &cheapest.name;
        return format!("no setting is measurably cheaper than the current ones ({name} came first{with})");
    }
    let times = now.of(what).0 / cheapest.of(what).0;
    format!(
        "{} is the cheapest, {times:.1} times as fast as now to the same noise{with}",
        cheapest.arguments
    )
}
