//! Colours by role, in charts as in the page.
//!
//! A chart is drawn with one stand-in colour for each role, which then becomes a variable of CSS: so one drawing serves light
//! and dark, and its colours stand in one place, `theme.css`. The lines' colours are those of Okabe and Ito, "Color Universal
//! Design" (2008), which survive every common colour blindness; markers tell the lines apart without any colour.

use plotters::style::RGBColor;

/// The variables, for a page or a picture that stands alone.
pub const CSS: &str = include_str!("theme.css");

/// Colours of lines.
pub const SERIES: usize = 8;

/// What a colour is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Words.
    Ink,
    /// Less important words.
    Soft,
    /// Lines of the grid.
    Grid,
    /// One of the lines of the chart.
    Series(usize),
}

impl Role {
    /// The colour that stands for it while it is drawn.
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

/// A drawing with variables in the places of its stand-in colours.
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
