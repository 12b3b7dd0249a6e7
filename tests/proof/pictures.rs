//! Pictures that must be the same bits.

use octolux::film::Picture;
use octolux::pipeline::{Counters, Settings};
use octolux::scene::Scene;

use super::runs::{leave, rendered};

/// Pixels that differ in any bit.
pub fn differences(a: &Picture, b: &Picture) -> usize {
    let bits = |p: &[f32; 3]| p.map(f32::to_bits);
    a.pixels
        .iter()
        .zip(&b.pixels)
        .filter(|(a, b)| bits(a) != bits(b))
        .count()
}

/// Fails with both pictures and their difference, unless they are the same bits.
pub fn assert_same(name: &str, a: &Picture, b: &Picture) {
    let count = differences(a, b);
    if count > 0 {
        let mut difference = a.clone();
        for (x, y) in difference.pixels.iter_mut().flatten().zip(b.pixels.iter().flatten()) {
            *x = (*x - y).abs();
        }
        let name = name.replace(['/', ' '], "-");
        let files = [(a, "one"), (b, "other"), (&difference, "difference")]
            .map(|(p, what)| leave(p, &format!("{name}-{what}")));
        panic!(
            "{name}: {count} of {} pixels differ: {}",
            a.pixels.len(),
            files.join(", ")
        );
    }
}

/// Renders both and asks for the same bits, from the same rays.
pub fn both(scene: &Scene, a: Settings, b: Settings, passes: u32, what: &str) -> Counters {
    let name = format!("{} {} {} {what}", scene.name(), a.estimator.name(), a.sampler.name());
    let (a, b) = (rendered(scene, a, passes), rendered(scene, b, passes));
    assert_same(&name, &a.picture(), &b.picture());
    assert_eq!(a.counters(), b.counters(), "{name}: the same picture from other rays");
    a.counters()
}
