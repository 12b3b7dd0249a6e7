//! `[camera]`, `[film]` and `[render]`.

use super::check::{LONGEST_SIDE, MOST_SPP};
use super::error::Fault;
use super::table::Table;
use super::{Camera, FilmSize, Fov, Lens, RenderTable};
use crate::settings::{EstimatorAsked, SamplerKind};

pub(super) const CAMERA_KEYS: &[&str] = &[
    "origin",
    "target",
    "up",
    "fov_x",
    "fov_y",
    "lens_radius",
    "focus_distance",
];
pub(super) const FILM_KEYS: &[&str] = &["width", "height"];
pub(super) const RENDER_KEYS: &[&str] = &["spp", "estimator", "sampler", "seed"];

pub(super) fn camera(table: &Table<'_>) -> Result<Camera, Fault> {
    let origin = table.need("origin", "origin = [0.0, 1.0, 5.0]")?.triple()?;
    let target = table.need("target", "target = [0.0, 0.0, 0.0]")?.triple()?;
    let up = table.need("up", "up = [0.0, 1.0, 0.0]")?.triple()?;
    let angle = table.one_of(
        "fov_x",
        "fov_y",
        "write fov_x = 45 (across the width) or fov_y = 30 (across the height)",
    )?;
    let degrees = angle.number()?;
    let fov = if angle.key == "fov_x" {
        Fov::X(degrees)
    } else {
        Fov::Y(degrees)
    };

    Ok(Camera {
        origin,
        target,
        up,
        fov,
        lens: lens(table, (target - origin).length())?,
    })
}

/// A lens, focused on the target unless the file gives a distance.
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
        radius: radius.number()?,
        focus: focus.map_or(Ok(to_target), |focus| focus.number())?,
    }))
}

/// `[film]`, which is required, and `[render]`; only their form is checked.
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
    Ok(FilmSize { width, height })
}

fn render(table: &Table<'_>) -> Result<RenderTable, Fault> {
    Ok(RenderTable {
        spp: table.get("spp").map(|value| value.whole(1, MOST_SPP)).transpose()?,
        estimator: table
            .get("estimator")
            .map(|v| v.choice(&EstimatorAsked::ALL, EstimatorAsked::name))
            .transpose()?
            .and_then(EstimatorAsked::named),
        sampler: table
            .get("sampler")
            .map(|v| v.choice(&SamplerKind::ALL, SamplerKind::name))
            .transpose()?,
        seed: table.get("seed").map(|value| value.whole(0, u32::MAX)).transpose()?,
    })
}
