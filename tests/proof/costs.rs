//! The study of costs on a scene whose truth is known to have no harmful setting.

use octolux::scene::{EstimatorKind, FilmSize, SamplerKind};
use octolux::study::cost::measure::{self, Effort};
use octolux::study::cost::price::{Price, Verdict};
use octolux::study::cost::settings::{Choice, Variant};
use octolux::study::cost::{analyse, truth};

use super::runs;

/// Prices of the default settings, of `independent` and of one lane, from 12 seeds of up to 64 samples. The mean of such a picture
/// is known to 0.03 % with `independent`: a bias of 1 % is far beyond that.
pub fn prices() -> Vec<Price> {
    let scene = runs::load("tests/two-lights.toml");
    let film = FilmSize { width: 24, height: 16 };
    let settings = runs::settings(film.width, film.height, EstimatorKind::Light);
    let turned = |setting: &'static str, value: &str, choice: Choice| Variant {
        setting,
        value: value.to_owned(),
        what: "",
        choice,
    };
    let default = Variant::defaults(settings);
    let with = |change: &dyn Fn(&mut Choice)| {
        let mut choice = default.choice;
        change(&mut choice);
        choice
    };
    let variants = [
        default.clone(),
        turned(
            "sampler",
            "independent",
            with(&|c| c.settings.sampler = SamplerKind::Independent),
        ),
        turned(
            "lanes",
            "1",
            with(&|c| c.settings.lanes = Some(octolux::settings::Lanes::One)),
        ),
    ];
    let effort = Effort {
        film,
        looks: vec![4, 16, 64],
        rounds: 12,
        seed: 1,
    };
    let all = measure::rounds(&scene, &variants, &effort, &(), |_| false).expect("these settings are possible");
    let truth = truth::find(&scene, film, 512, None);
    analyse(&scene, &variants, &all, &effort, truth, 1e-6)
        .expect("twelve rounds suffice")
        .prices
}

/// No setting is harmful: false alarms 1e-6.
pub fn nothing_is_harmful() {
    for price in prices() {
        assert_ne!(price.verdict, Verdict::Harmful, "{}: {:?}", price.label, price.bias);
    }
}

/// The error that four replicates show is that of their mean, as 40 further means tell it. Two estimates of a variance over 384
/// pixels: a ratio of 1.5 is out of reach of chance, the factor of 2 of a forgotten division is not.
pub fn target_errors_are_those_of_the_mean() {
    use octolux::run::replicates as target;
    let scene = runs::load("tests/two-lights.toml");
    let picture = |seed: u32, replicate: usize| {
        let mut settings = runs::settings(24, 16, EstimatorKind::Light);
        settings.seed = target::seed(seed, replicate);
        runs::picture(&scene, settings, 8)
    };
    let means: Vec<_> = (0..40)
        .map(|seed| (0..target::LEAST).map(|r| picture(seed, r)).collect::<Vec<_>>())
        .map(|replicates| (target::error(&replicates).error, target::mean(&replicates)))
        .collect();
    let said = (means.iter().map(|(error, _)| error * error).sum::<f64>() / 40.0).sqrt();
    // `error` is of the mean of its pictures: of one of these, the root of 40 times as much.
    let pictures: Vec<_> = means.into_iter().map(|(_, mean)| mean).collect();
    let plain = {
        let count = pictures.len() as f64;
        let mean = target::mean(&pictures);
        let square = |p: usize, c: usize| {
            let of = |picture: &octolux::film::Picture| f64::from(picture.pixels[p][c]);
            pictures.iter().map(|x| (of(x) - of(&mean)).powi(2)).sum::<f64>() / (count - 1.0)
        };
        let values = 3.0 * mean.pixels.len() as f64;
        let variance: f64 = (0..mean.pixels.len())
            .flat_map(|p| (0..3).map(move |c| (p, c)))
            .map(|(p, c)| square(p, c))
            .sum();
        let total: f64 = mean.pixels.iter().flatten().map(|&x| f64::from(x)).sum();
        (variance / values).sqrt() / (total / values)
    };
    assert!((said / plain - 1.0).abs() < 0.5, "said {said}, is {plain}");
}
