//! `[camera]`, `[film]` and `[render]`.

use glam::DVec3;

use super::error::Fault;
use super::memory;
use super::rule::{FINITE, POSITIVE, VIEW_ANGLE};
use super::table::Table;
use super::{Camera, FilmSize, Fov, Lens, RenderTable};
use crate::settings::{EstimatorKind, SamplerKind};

pub(super) const CAMERA_KEYS: &[&str] = &[
    "origin",
    "target",
    "up",
    "fov_x",
    "fov_y",
    "lens_radius",
    "focus_distance",
];
const FILM_KEYS: &[&str] = &["width", "height"];
const RENDER_KEYS: &[&str] = &["spp", "estimator", "sampler", "seed"];

/// The longest side of a picture, in pixels.
const LONGEST_SIDE: u32 = 65536;

/// The least that a pixel takes while it is rendered: sums of three colours in `f64`, and the picture while it is written.
const BYTES_PER_PIXEL: u64 = 40;

/// Below this sine `up` and the view are parallel: no side of the picture could be told from them.
const LEAST_SINE: f64 = 1e-9;

pub(super) fn camera(table: &Table<'_>) -> Result<Camera, Fault> {
    let origin = table.need("origin", "origin = [0.0, 1.0, 5.0]")?.triple(&FINITE)?;
    let target_value = table.need("target", "target = [0.0, 0.0, 0.0]")?;
    let target = target_value.triple(&FINITE)?;
    let up_value = table.need("up", "up = [0.0, 1.0, 0.0]")?;
    let up = up_value.triple(&FINITE)?;
    let angle = table.one_of(
        "fov_x",
        "fov_y",
        "write fov_x = 45 (across the width) or fov_y = 30 (across the height)",
    )?;
    let degrees = angle.number(&VIEW_ANGLE)?;
    let fov = if angle.key == "fov_x" {
        Fov::X(degrees)
    } else {
        Fov::Y(degrees)
    };

    if origin == target {
        return Err(target_value.fault(
            "must differ from the origin",
            "point the camera at something: move the target",
        ));
    }
    if up == DVec3::ZERO {
        return Err(up_value.fault(
            "must not be zero",
            "write a direction that points up, such as [0, 1, 0]",
        ));
    }
    // Brought to about 1 first: squares of what single precision can hold fit into f64, their products may not.
    let direction = |v: DVec3| (v / v.abs().max_element()).normalize();
    if direction(target - origin).cross(direction(up)).length() < LEAST_SINE {
        let help = "the view goes along this direction: choose another one, such as [0, 0, 1]";
        let help = if up.y == 0.0 {
            "the view goes along this direction: choose another one, such as [0, 1, 0]"
        } else {
            help
        };
        return Err(up_value.fault("must not be parallel to the view", help));
    }
    Ok(Camera {
        origin,
        target,
        up,
        fov,
        lens: lens(table, (target - origin).length())?,
    })
}

/// A lens, in focus at the target unless the file says where.
fn lens(table: &Table<'_>, to_target: f64) -> Result<Option<Lens>, Fault> {
    let focus = table.get("focus_distance");
    let Some(radius) = table.get("lens_radius") else {
        return match focus {
            Some(focus) => Err(focus.fault(
                "belongs to a lens",
                "add `lens_radius = 0.05`, or leave the distance out: a pinhole sees everything sharply",
            )),
            None => Ok(None),
        };
    };
    Ok(Some(Lens {
        radius: radius.number(&POSITIVE)?,
        focus: focus.map_or(Ok(to_target), |focus| focus.number(&POSITIVE))?,
    }))
}

/// `[film]`, which a scene must have, and `[render]`.
pub(super) fn film_and_render(root: &Table<'_>) -> Result<(FilmSize, RenderTable), Fault> {
    let help = "add [film] with width and height in pixels";
    let no_film = || Fault::new("the scene has no [film]", help).at(0..0, "in this file");
    let value = root.get("film").ok_or_else(no_film)?;
    let film = film(&value.table("[film]".to_owned(), "film", FILM_KEYS)?)?;
    let render = match root.get("render") {
        Some(value) => render(&value.table("[render]".to_owned(), "render", RENDER_KEYS)?)?,
        None => RenderTable::default(),
    };
    Ok((film, render))
}

fn film(table: &Table<'_>) -> Result<FilmSize, Fault> {
    let width = table.need("width", "width = 768")?.whole(1, LONGEST_SIDE)?;
    let height = table.need("height", "height = 512")?.whole(1, LONGEST_SIDE)?;
    let bytes = u64::from(width) * u64::from(height) * BYTES_PER_PIXEL;
    if !memory::fits(bytes) {
        let gib = bytes as f64 / f64::from(1 << 30);
        let what = format!("film of {width} x {height} pixels needs {gib:.1} GiB of memory, more than is free");
        return Err(table.fault(what, "make width and height smaller, or close other programs"));
    }
    Ok(FilmSize { width, height })
}

fn render(table: &Table<'_>) -> Result<RenderTable, Fault> {
    Ok(RenderTable {
        spp: table.get("spp").map(|value| value.whole(1, u32::MAX)).transpose()?,
        estimator: table
            .get("estimator")
            .map(|v| v.choice(&EstimatorKind::ALL, EstimatorKind::name))
            .transpose()?,
        sampler: table
            .get("sampler")
            .map(|v| v.choice(&SamplerKind::ALL, SamplerKind::name))
            .transpose()?,
        seed: table.get("seed").map(|value| value.whole(0, u32::MAX)).transpose()?,
    })
}
