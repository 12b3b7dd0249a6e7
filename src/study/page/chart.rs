//! Log-log charts of error against time, as SVG by plotters.
//!
//! Drawn at [`FINE`] times the final size, because plotters places everything on whole pixels.

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::theme::{self, Role};
use super::words;
use crate::study::cost::price::Price;

/// Steps per pixel.
const FINE: i32 = 8;

/// The layout of a chart, in pixels.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Width of the whole drawing.
    pub width: i32,
    /// Height of the whole drawing.
    pub height: i32,
    /// Width on the right for the labels of the lines.
    pub right: i32,
    /// Font size.
    pub font: i32,
    /// Whether labels have room for figures.
    pub figures: bool,
}

/// The subject of a chart, which determines the figures in its labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// Settings with different noise: each curve with its slope and confidence band.
    Noise,
    /// Settings with the same noise at different speeds: the pass time relative to the defaults. One band serves all.
    Time,
}

/// For desktop screens and a README.
pub const DESK: Layout = Layout {
    width: 960,
    height: 520,
    right: 232,
    font: 15,
    figures: true,
};

/// For a phone.
pub const PHONE: Layout = Layout {
    width: 360,
    height: 400,
    right: 100,
    font: 13,
    figures: false,
};

type Failure = Box<dyn std::error::Error>;
type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
/// Logarithms of seconds and of errors.
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// Draws the curves of some settings, the defaults first.
///
/// # Errors
/// None expected: it draws into memory.
pub fn draw(prices: &[&Price], layout: Layout, about: About) -> Result<String, Failure> {
    let mut svg = String::new();
    let size = ((layout.width * FINE) as u32, (layout.height * FINE) as u32);
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        let (x, y) = ranges(prices);
        // Room for `0.0005` beside the title of the axis.
        let left = 6 * layout.font;
        let mut chart = ChartBuilder::on(&root)
            .margin_top(layout.font * FINE)
            .margin_right(layout.right * FINE)
            .margin_left(left * FINE)
            .margin_bottom(4 * layout.font * FINE)
            .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
        grid(&root, &mut chart, layout, x, y)?;
        let plain = monte_carlo(prices, x, y);
        if let Some(ends) = plain {
            let style = Role::Soft.color().stroke_width((3 * FINE / 2) as u32);
            chart.draw_series(DashedLineSeries::new(ends, 7 * FINE, 5 * FINE, style))?;
        }
        for (i, price) in prices.iter().enumerate() {
            curve(&mut chart, price, i, i == 0 || about == About::Noise)?;
        }
        names(&root, &chart, prices, plain.map(|ends| ends[1]), layout, about)?;
        root.present()?;
    }
    let opened = svg.find('>').map_or(0, |end| end + 1);
    let head = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"{}\">",
        size.0,
        size.1,
        about.aloud()
    );
    Ok(format!("{head}{}", theme::paint(&svg[opened..])))
}

impl About {
    /// The text for screen readers.
    fn aloud(self) -> &'static str {
        match self {
            Self::Noise => "relative MSE against time, a line for each way of sampling",
            Self::Time => "relative MSE against time, a line for each way of computing the same picture",
        }
    }
}

/// The SVG as a standalone file with its own background.
pub fn alone(svg: &str) -> String {
    let opened = svg.find('>').map_or(0, |end| end + 1);
    format!(
        "{}<style>{}</style><rect width=\"100%\" height=\"100%\" fill=\"var(--paper)\"/>{}",
        &svg[..opened],
        theme::CSS,
        &svg[opened..]
    )
}

/// The logarithm to base 10, clamped to what can be drawn.
fn log(value: f64) -> f64 {
    value.max(1e-300).log10()
}

/// The logarithmic ranges of both axes, with a margin around all points.
fn ranges(prices: &[&Price]) -> ((f64, f64), (f64, f64)) {
    let points = || {
        prices
            .iter()
            .flat_map(|price| &price.points)
            .filter(|point| point.relative_mse.value > 0.0)
    };
    let around = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        if low > high {
            (-1.0, 1.0)
        } else {
            (low - 0.15, high + 0.15)
        }
    };
    let x = around(&mut points().map(|point| log(point.seconds.value)));
    let y = around(&mut points().map(|point| log(point.relative_mse.value)));
    (x, y)
}

fn text_style(layout: Layout, role: Role, pos: Pos) -> TextStyle<'static> {
    // plotters divides font sizes by 1.24.
    let size = f64::from(layout.font * FINE) * 1.24;
    let plain = TextStyle::from(("system-ui, sans-serif", size).into_font()).pos(pos);
    TextStyle {
        color: role.color().to_backend_color(),
        ..plain
    }
}

/// Ticks with labels at every power of ten, and at 2 and 5 times it where there are few.
fn ticks((low, high): (f64, f64)) -> Vec<f64> {
    let mut all: Vec<f64> = (low.ceil() as i32..=high.floor() as i32).map(f64::from).collect();
    if all.len() < 3 {
        for decade in low.floor() as i32..=high.floor() as i32 {
            for part in [2.0_f64, 5.0] {
                let at = f64::from(decade) + part.log10();
                if (low..=high).contains(&at) {
                    all.push(at);
                }
            }
        }
    }
    all
}

fn grid(
    root: &Area<'_>,
    chart: &mut Chart<'_, '_>,
    layout: Layout,
    x: (f64, f64),
    y: (f64, f64),
) -> Result<(), Failure> {
    let line = Role::Grid.color().stroke_width(FINE as u32);
    let under = text_style(layout, Role::Soft, Pos::new(HPos::Center, VPos::Top));
    let beside = text_style(layout, Role::Soft, Pos::new(HPos::Right, VPos::Center));
    // Decades come first; labels that would overlap an earlier one are dropped.
    let mut taken: Vec<i32> = Vec::new();
    for at in ticks(x) {
        chart.draw_series([PathElement::new(vec![(at, y.0), (at, y.1)], line)])?;
        let (px, py) = chart.backend_coord(&(at, y.0));
        if taken
            .iter()
            .any(|other| other.abs_diff(px) < (4 * layout.font * FINE) as u32)
        {
            continue;
        }
        taken.push(px);
        let label = words::seconds(10.0_f64.powf(at)).replace(".0 ", " ");
        root.draw(&Text::new(label, (px, py + layout.font * FINE / 2), under.clone()))?;
    }
    for at in ticks(y) {
        chart.draw_series([PathElement::new(vec![(x.0, at), (x.1, at)], line)])?;
        let (px, py) = chart.backend_coord(&(x.0, at));
        let label = if at.fract() == 0.0 && at < -3.5 {
            format!("10{}", words::superscript(&format!("{at:.0}")))
        } else {
            // Shortest form of a number with one significant digit.
            let digit = format!("{:.0e}", 10.0_f64.powf(at));
            digit.parse::<f64>().unwrap_or_default().to_string()
        };
        root.draw(&Text::new(label, (px - layout.font * FINE / 2, py), beside.clone()))?;
    }
    let title = text_style(layout, Role::Soft, Pos::new(HPos::Center, VPos::Bottom));
    let (left, bottom) = chart.backend_coord(&(x.0, y.0));
    let (right, top) = chart.backend_coord(&(x.1, y.1));
    let below = (layout.height - layout.font / 2) * FINE;
    let words = if layout.figures {
        "time of rendering (wall clock)"
    } else {
        "time of rendering"
    };
    root.draw(&Text::new(words, ((left + right) / 2, below), title.clone()))?;
    let turned = title
        .pos(Pos::new(HPos::Center, VPos::Top))
        .transform(FontTransform::Rotate270);
    root.draw(&Text::new(
        "relative MSE",
        (layout.font * FINE / 4, (bottom + top) / 2),
        turned,
    ))?;
    Ok(())
}

/// The line of plain Monte Carlo from the first point of the defaults (squared error inversely proportional to time): both
/// ends, in logarithms.
fn monte_carlo(prices: &[&Price], x: (f64, f64), y: (f64, f64)) -> Option<[(f64, f64); 2]> {
    let first = prices
        .first()?
        .points
        .iter()
        .find(|point| point.relative_mse.value > 0.0)?;
    let sum = log(first.seconds.value) + log(first.relative_mse.value);
    Some([x.0.max(sum - y.1), x.1.min(sum - y.0)].map(|x| (x, sum - x)))
}

/// The 95 % band, the line, and a marker at each point.
fn curve(chart: &mut Chart<'_, '_>, price: &Price, i: usize, with_band: bool) -> Result<(), Failure> {
    let color = Role::Series(i).color();
    let points: Vec<_> = price
        .points
        .iter()
        .filter(|point| point.relative_mse.value > 0.0)
        .collect();
    let at = |error: f64, time: f64| (log(time), log(error));
    let upper = points.iter().map(|p| at(p.relative_mse.high, p.seconds.value));
    let lower = points.iter().rev().map(|p| at(p.relative_mse.low, p.seconds.value));
    let band: Vec<_> = upper.chain(lower).collect();
    if with_band {
        chart.draw_series([Polygon::new(band, color.mix(0.15))])?;
    }
    let line: Vec<_> = points
        .iter()
        .map(|p| at(p.relative_mse.value, p.seconds.value))
        .collect();
    let width = if i == 0 { 3 * FINE } else { 2 * FINE };
    chart.draw_series([PathElement::new(line.clone(), color.stroke_width(width as u32))])?;
    marker(chart, &line, i)
}

/// A marker shape for each line, so that lines differ by more than colour.
fn marker(chart: &mut Chart<'_, '_>, points: &[(f64, f64)], i: usize) -> Result<(), Failure> {
    let color = Role::Series(i).color();
    let (filled, line) = (color.filled(), color.stroke_width((2 * FINE) as u32));
    let points = points.iter().copied();
    match i % 4 {
        0 => chart
            .draw_series(points.map(|at| Circle::new(at, 4 * FINE, filled)))
            .map(drop)?,
        1 => chart
            .draw_series(points.map(|at| {
                let side = 4 * FINE;
                EmptyElement::at(at) + Rectangle::new([(-side, -side), (side, side)], filled)
            }))
            .map(drop)?,
        2 => chart
            .draw_series(points.map(|at| TriangleMarker::new(at, 6 * FINE, filled)))
            .map(drop)?,
        _ => chart
            .draw_series(points.map(|at| Cross::new(at, 4 * FINE, line)))
            .map(drop)?,
    }
    Ok(())
}

/// Every line's label at its right end, moved apart where they would overlap; also that of plain Monte Carlo, which ends at
/// `plain`.
fn names(
    root: &Area<'_>,
    chart: &Chart<'_, '_>,
    prices: &[&Price],
    plain: Option<(f64, f64)>,
    layout: Layout,
    about: About,
) -> Result<(), Failure> {
    let mut ends: Vec<(Role, String, (i32, i32))> = Vec::new();
    for (i, price) in prices.iter().enumerate() {
        if let Some(point) = price.points.iter().rev().find(|point| point.relative_mse.value > 0.0) {
            let at = chart.backend_coord(&(log(point.seconds.value), log(point.relative_mse.value)));
            ends.push((Role::Series(i), name(price, layout, about), at));
        }
    }
    if let Some(end) = plain {
        let words = if layout.figures {
            "plain Monte Carlo  −1"
        } else {
            "Monte Carlo"
        };
        ends.push((Role::Soft, words.to_owned(), chart.backend_coord(&end)));
    }
    // At equal height the leftmost goes on top, so that no leader lines cross.
    ends.sort_by_key(|(_, _, (x, y))| (*y / layout.font / FINE, *x));
    let apart = layout.font * FINE * 13 / 10;
    let bottom = (layout.height - 4 * layout.font) * FINE;
    let mut rows: Vec<i32> = ends.iter().map(|(_, _, (_, y))| *y).collect();
    for k in 1..rows.len() {
        rows[k] = rows[k].max(rows[k - 1] + apart);
    }
    // Labels below the bottom edge push the others up again.
    for k in (0..rows.len()).rev() {
        let most = rows.get(k + 1).map_or(bottom, |next| next - apart);
        rows[k] = rows[k].min(most);
    }
    let left = (layout.width - layout.right + layout.font) * FINE;
    for ((role, words, (x, y)), row) in ends.into_iter().zip(rows) {
        let leader = vec![(x + 7 * FINE, y), (left - 9 * FINE, row), (left - 3 * FINE, row)];
        root.draw(&PathElement::new(leader, role.color().stroke_width(FINE as u32)))?;
        let ink = if role == Role::Soft { Role::Soft } else { Role::Ink };
        let style = text_style(layout, ink, Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(words, (left, row), style))?;
    }
    Ok(())
}

/// A setting with its figure, if there is room.
fn name(price: &Price, layout: Layout, about: About) -> String {
    let figure = match (about, price.slope) {
        _ if !layout.figures => None,
        (About::Noise, Some(slope)) => {
            let value = format!("{:.2}", slope.value).replace('-', "−");
            Some(format!("{value} ± {:.2}", slope.reach()))
        }
        (About::Time, _) if !price.variant.setting.is_empty() => {
            Some(format!("time × {}", words::number(price.time_ratio.value)))
        }
        _ => None,
    };
    match figure {
        Some(figure) => format!("{}  {figure}", price.label),
        None => price.label.clone(),
    }
}
