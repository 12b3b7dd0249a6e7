//! `octolux render SCENE --replay X,Y,PASS`: repeats one sample step by step.

use std::path::Path;

use super::options::Options;
use super::{CliError, Exit, names, report};
use octolux::pipeline::{Asked, Beside, Found, Met, Prepared, Replay, Settings};
use octolux::scene::Scene;
use octolux::settings::Lanes;

/// Parses `X,Y,PASS`.
pub fn sample(text: &str) -> Result<[u32; 3], String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    let three = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    three.ok_or_else(|| "a sample is X,Y,PASS, such as 100,20,0: pixels and passes are counted from 0".to_owned())
}

/// Prints the sample; writes no picture.
///
/// # Errors
/// A scene that cannot be rendered with these settings, a pixel outside the film.
pub fn run(path: &Path, options: &Options, sample: [u32; 3], json: bool) -> Result<Exit, CliError> {
    let scene = options.reading.load(path)?;
    // One lane gives the same bits as 8 and 16.
    let settings = Settings {
        lanes: Some(Lanes::One),
        threads: 1,
        ..options.settings(&scene)?
    };
    let [x, y, _] = sample;
    let prepared = Prepared::new(&scene, settings);
    let prepared = prepared.map_err(|error| CliError::setup(path, &error))?;
    let replay = prepared.replay(sample).map_err(|error| CliError::setup(path, &error))?;
    let replay = replay.ok_or_else(|| {
        let (width, height) = (settings.film.width, settings.film.height);
        let what = format!("--replay: there is no pixel {x},{y} in a picture of {width} x {height}");
        CliError::usage(what).with_help("pixels are counted from 0, from the top left corner")
    })?;
    report::data(&if json {
        serde_json::to_string(&replay).map_err(|error| CliError::failed(format!("the sample: {error}")))?
    } else {
        text(&replay, &scene, prepared.kernel())
    })?;
    sound(path, &replay)?;
    Ok(Exit::Well)
}

/// Rejects a sample that is NaN or infinite, or of which a part was rejected. Its steps are printed before, because they show
/// the cause.
fn sound(path: &Path, replay: &Replay) -> Result<(), CliError> {
    let thrown: u64 = replay.invalid.iter().sum();
    if thrown == 0 && replay.radiance.iter().chain(&replay.seen).all(|x| x.is_finite()) {
        return Ok(());
    }
    let [x, y, pass] = replay.sample;
    let what = format!(
        "{}: pixel {x},{y}, pass {pass}: a part of this sample is NaN, infinite or negative",
        path.display()
    );
    Err(CliError::failed(what).with_help("the steps above show where; please report the scene"))
}

/// The steps as text.
pub fn text(replay: &Replay, scene: &Scene, kernel: &str) -> String {
    let [x, y, pass] = replay.sample;
    let mut lines = vec![
        format!("sample     pixel {x},{y}, pass {pass}, by {kernel}; positions are relative to the pinhole"),
        format!("camera ray direction {:?}", replay.direction),
    ];
    match replay.hit {
        None => lines.push("hit        nothing".to_owned()),
        Some(hit) => lines.push(format!(
            "hit        {}, at distance {:?}, barycentric {:?}",
            met(scene, &hit),
            hit.distance,
            hit.barycentric
        )),
    }
    if replay.seen != [0.0; 3] {
        lines.push(format!("seen       radiance {:?}", replay.seen));
    }
    if let Some(point) = replay.point {
        lines.push(format!("point      {:?}, off the surface", point.p));
        lines.push(format!("           ng {:?}", point.ng));
        lines.push(format!("           n  {:?}", point.n));
        lines.push(format!(
            "           {}, rho {:?}, alpha {:?}",
            point.model, point.rho, point.alpha
        ));
    }
    for asked in &replay.asked {
        lines.extend(direction(scene, asked));
    }
    lines.extend(replay.beside.iter().flat_map(|ray| beside(scene, ray)));
    if replay.meshes_untold {
        lines.push(
            "           the radiance includes the light of meshes of more than four triangles: the rays above"
                .to_owned(),
        );
    }
    lines.push(format!("radiance   {:?}", replay.radiance));
    if replay.invalid != [0; 3] {
        let [nan, infinite, negative] = replay.invalid;
        lines.push(format!("rejected: {nan} NaN, {infinite} infinite, {negative} below 0"));
    }
    lines.join("\n")
}

/// The name of what a ray hit.
fn met(scene: &Scene, met: &Met) -> String {
    let (geometry, primitive) = (met.geometry as usize, met.primitive as usize);
    if geometry < scene.meshes().len() {
        format!("triangle {primitive} of {}", names::mesh(scene, geometry))
    } else {
        names::sphere(scene, primitive)
    }
}

fn beside(scene: &Scene, ray: &Beside) -> [String; 2] {
    let to = match ray.distance {
        Some(distance) => format!("to a mesh that emits, distance {distance:?}"),
        None => "to the environment".to_owned(),
    };
    let verdict = match &ray.blocked_by {
        Some(hit) => format!("occluded by {} at distance {:?}", met(scene, hit), hit.distance),
        None => "visible".to_owned(),
    };
    [
        format!("ray        {to}: wi {:?}", ray.wi),
        format!("           {verdict}"),
    ]
}

fn direction(scene: &Scene, asked: &Asked) -> Vec<String> {
    let mut lines = Vec::new();
    if let (Some(light), Some(sphere), Some(one_minus_cos_max), Some(pdf)) =
        (asked.light, asked.sphere, asked.one_minus_cos_max, asked.cone_pdf)
    {
        lines.push(format!(
            "light {light:<4} {}, cone 1 - cos = {one_minus_cos_max:?}, pdf {pdf:?} per sr",
            names::sphere(scene, sphere as usize)
        ));
    }
    if let (Some(light), Some(kind), None) = (asked.light, asked.kind, asked.sphere) {
        lines.push(format!("light {light:<4} {kind}"));
    }
    let Some(found) = &asked.found else {
        let what = match asked.lobe {
            None => "no chance to bring light".to_owned(),
            Some([0.0, 0.0, 0.0]) => "drawn below the horizon".to_owned(),
            Some(wi) => format!(
                "wi {wi:?} does not meet {}",
                if asked.light.is_some() { "it" } else { "a light" }
            ),
        };
        lines.push(format!("           by {}: {what}", asked.technique));
        return lines;
    };
    let Found {
        wi,
        cos_theta,
        shape,
        brdf_pdf,
        pdf,
        distance,
        ld,
        occluded,
    } = found;
    lines.push(format!(
        "           by {}: wi {wi:?}, cos {cos_theta:?}",
        asked.technique
    ));
    let divided_by = pdf.map_or_else(String::new, |pdf| format!(", divided by {pdf:?} per sr"));
    lines.push(format!(
        "           f_cos / rho {shape:?}, BRDF pdf {brdf_pdf:?} per sr{divided_by}"
    ));
    let (name, verdict) = match (asked.light, occluded) {
        (Some(_), true) => ("ld", "occluded"),
        (Some(_), false) => ("ld", "visible"),
        (None, true) => ("f_cos / pdf", "meets no light"),
        (None, false) => ("f_cos / pdf", "meets a light"),
    };
    lines.push(format!("           {name} {ld:?}, distance {distance:?}, {verdict}"));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_is_no_number_is_an_error() {
        let path = Path::new("x.toml");
        let mut replay = Replay {
            sample: [3, 2, 1],
            radiance: [0.5; 3],
            ..Replay::default()
        };
        assert!(sound(path, &replay).is_ok());
        replay.invalid[0] = 1;
        assert!(sound(path, &replay).is_err());
        replay.invalid[0] = 0;
        replay.radiance[1] = f64::NAN;
        let error = sound(path, &replay).unwrap_err();
        assert_eq!(error.exit(), Exit::Failed);
        let expected = "x.toml: pixel 3,2, pass 1: a part of this sample is NaN, infinite or negative";
        assert_eq!(error.to_string(), expected);
    }
}
