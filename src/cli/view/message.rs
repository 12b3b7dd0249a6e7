//! Requests of a page.

use serde::Deserialize;

use octolux::settings::{EstimatorKind, SamplerKind};

/// Maximum message length in bytes: the longest is a race of four.
pub const LONGEST: usize = 16 << 10;

/// Maximum number of settings in a race.
pub const MOST_RACERS: usize = 4;

/// Maximum number of passes of a pixel per request.
pub const MOST_SAMPLES: u32 = 256;

/// The longest time that a page may say it drew, in milliseconds: it slows down the looks of all pages.
pub const MOST_MS: f64 = 1000.0;

/// One message.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Ask {
    /// The page has shown a picture and is ready for another one.
    Next {
        /// Milliseconds that it took to draw, up to [`MOST_MS`].
        #[serde(default)]
        ms: f64,
    },
    /// Continue rendering.
    Go,
    /// Pause until `Go`.
    Stop,
    /// Write the files named on the command line; PNGs with this exposure.
    Write {
        /// Stops, as `--exposure`.
        exposure: f64,
    },
    /// Change the camera.
    Camera(View),
    /// Reset the camera to the scene's.
    ResetCamera,
    /// Render with another estimator and sampler.
    Settings(Choice),
    /// Race these settings at equal time.
    Race {
        /// Two to [`MOST_RACERS`].
        racers: Vec<Choice>,
        /// What renders the reference; `None` takes the given picture if there is one, else [`By::Mis`].
        #[serde(default)]
        by: Option<By>,
        /// For how many seconds; `None` as the command line says.
        #[serde(default)]
        seconds: Option<f64>,
    },
    /// Return to one picture.
    EndRace,
    /// Replay samples of one pixel.
    Sample {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// The first pass.
        pass: u32,
        /// How many, at most [`MOST_SAMPLES`].
        count: u32,
        /// The racer whose estimator to use; 0 without a race.
        #[serde(default)]
        layer: usize,
    },
    /// The radiance of a pixel, in full precision.
    Pixel {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// Focus on the point that a pixel shows, or orbit around it if there is no lens.
    Aim {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
    },
    /// Scale the radiance of every light.
    Lights {
        /// One factor per light, in the order sent to the page.
        gains: Vec<f64>,
    },
}

/// A camera; the field of view stays the scene's.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct View {
    /// The pinhole.
    pub origin: [f64; 3],
    /// The point at the centre of the picture.
    pub target: [f64; 3],
    /// Up.
    pub up: [f64; 3],
    /// Distance of the focal plane, if there is a lens.
    pub focus: Option<f64>,
}

/// The settings of a picture.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Its estimator.
    pub estimator: EstimatorKind,
    /// Its sampler.
    pub sampler: SamplerKind,
    /// Adaptive sampling.
    #[serde(default)]
    pub adaptive: bool,
}

/// What renders the reference of a race.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum By {
    /// Two renders by `mis`.
    Mis,
    /// The f64 oracle.
    Oracle,
}

impl Ask {
    /// Parses a message.
    ///
    /// # Errors
    /// A sentence about the problem.
    pub fn read(text: &str) -> Result<Self, String> {
        let ask: Self = serde_json::from_str(text).map_err(|error| format!("not understood: {error}"))?;
        match &ask {
            Self::Race {
                seconds: Some(seconds), ..
            } if !(0.1..=3600.0).contains(seconds) => Err("a reference takes 0.1 to 3600 seconds".to_owned()),
            Self::Race { racers, .. } if !(2..=MOST_RACERS).contains(&racers.len()) => {
                Err(format!("a race has 2 to {MOST_RACERS} settings"))
            }
            Self::Sample { count, .. } if !(1..=MOST_SAMPLES).contains(count) => {
                Err(format!("1 to {MOST_SAMPLES} samples are drawn at once"))
            }
            Self::Next { ms } if !(0.0..=MOST_MS).contains(ms) => {
                Err(format!("a picture is drawn in 0 to {MOST_MS} ms"))
            }
            Self::Write { exposure } if !(-64.0..=64.0).contains(exposure) => {
                Err("an exposure is a number of stops from -64 to 64".to_owned())
            }
            Self::Lights { gains } if !gains.iter().all(|gain| (0.0..=1e6).contains(gain)) => {
                Err("a light is dimmed or brightened by a factor from 0 to a million".to_owned())
            }
            _ => Ok(ask),
        }
    }

    /// Whether it discards the current picture, so that its run can be stopped early.
    pub fn begins_anew(&self) -> bool {
        matches!(
            self,
            Self::Camera(_)
                | Self::ResetCamera
                | Self::Settings(_)
                | Self::Race { .. }
                | Self::EndRace
                | Self::Lights { .. }
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_message_is_a_sentence() {
        for bad in [
            "",
            "[]",
            "{}",
            r#"{"do":"rm"}"#,
            r#"{"do":"next","ms":-1}"#,
            r#"{"do":"next","ms":1e6}"#,
            r#"{"do":"sample","x":-1,"y":0,"pass":0,"count":1}"#,
            r#"{"do":"sample","x":1,"y":0,"pass":0,"count":100000}"#,
            r#"{"do":"write","exposure":1e9}"#,
            r#"{"do":"write","exposure":0,"path":"/etc/passwd"}"#,
            r#"{"do":"race","racers":[]}"#,
            r#"{"do":"race","racers":[],"by":"me"}"#,
            r#"{"do":"race","racers":[],"seconds":0}"#,
            r#"{"do":"lights","gains":[-1]}"#,
        ] {
            assert!(Ask::read(bad).is_err(), "{bad}");
        }
        assert_eq!(Ask::read(r#"{"do":"next"}"#), Ok(Ask::Next { ms: 0.0 }));
    }
}
