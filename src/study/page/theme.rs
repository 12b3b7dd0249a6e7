//! Colours by role, in charts and in the page.
//!
//! A chart is drawn with one placeholder colour per role, which is then replaced by a CSS variable. One drawing thus serves
//! light and dark mode, and all colours are defined in `theme.css`. The lines' colours are those of Okabe and Ito, "Color
//! Universal Design" (2008), which stay distinct with every common colour blindness; markers distinguish the lines without
//! colour.

use plotters::style::RGBColor;

/// The variables, for a page or a standalone picture.
pub const CSS: &str = include_str!("theme.css");

/// Number of line colours.
pub const SERIES: usize = 8;

/// The role of a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Text.
    Ink,
    /// Secondary text.
    Soft,
    /// Grid lines.
    Grid,
    /// One of the lines of the chart.
    Series(usize),
}

impl Role {
    /// Its placeholder colour while drawing.
    pub fn color(self) -> RGBColor {
        RGBColor(1, 2, self.number())
    }

    fn number(self) -> u8 {
        match self {
            Self::Ink => 0,
            Self::Soft => 1,
            Self::Grid => 2,
            Self::Series(i) => 3 + (i % SERIES) as u8,
        }
    }

    fn variable(self) -> String {
        match self {
            Self::Ink => "--ink".to_owned(),
            Self::Soft => "--soft".to_owned(),
            Self::Grid => "--grid".to_owned(),
            Self::Series(i) => format!("--s{}", i % SERIES),
        }
    }

    fn all() -> impl Iterator<Item = Self> {
        [Self::Ink, Self::Soft, Self::Grid]
            .into_iter()
            .chain((0..SERIES).map(Self::Series))
    }
}

/// Replaces placeholder colours by variables.
pub fn paint(svg: &str) -> String {
    Role::all().fold(svg.to_owned(), |svg, role| {
        svg.replace(
            &format!("\"#0102{:02X}\"", role.number()),
            &format!("\"var({})\"", role.variable()),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_role_has_its_variable_in_light_and_dark() {
        for role in Role::all() {
            let RGBColor(r, g, b) = role.color();
            let painted = paint(&format!("<line stroke=\"#{r:02X}{g:02X}{b:02X}\"/>"));
            assert_eq!(painted, format!("<line stroke=\"var({})\"/>", role.variable()));
            assert_eq!(CSS.matches(&format!("{}:", role.variable())).count(), 2, "{role:?}");
        }
    }
}
