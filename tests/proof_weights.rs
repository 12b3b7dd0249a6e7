//! Weights: every sample of every strategy is worth `f_cos / pdf`, and none that counts is left out.

mod proof;

use std::f64::consts::PI;

use octolux::estimator::per_light;
use octolux::lane::Word;
use octolux::math::Frame;
use octolux::math::elementary::sin_cos_turn;
use octolux::sampling::{PassBlock, warp};
use octolux::scene::SamplerKind;
use proof::places::{light, point};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

#[test]
fn a_sample_of_a_light_weighs_f_cos_over_pdf() {
    proof::weights::samples_of_lights();
}

#[test]
fn a_sample_of_the_point_weighs_f_cos_over_pdf() {
    proof::weights::samples_of_points();
}

/// Before a direction is drawn, lanes are dropped whose light is below the horizon or beyond the lobe. 400 000 places
/// with lights at the horizon, at the lobe's edge and around the point: wherever a direction of the cone counts, the
/// sample is there, and it is the direction of the cone.
#[test]
fn nothing_that_counts_is_dropped_before_it_is_drawn() {
    let mut rng = Pcg64::seed_from_u64(12);
    let numbers = PassBlock::new(SamplerKind::Independent, 4, 0, 1, 1);
    let (mut counted, mut dropped) = (0, 0);
    for pixel in 0..400_000 {
        let alpha = [1.0, 1.5, 30.0, 1e3, 1e5, 1e6][rng.random_range(0..6)];
        let point = point::<f32>(alpha, 1.5 * rng.random::<f64>());
        let sine = 10.0_f64.powf(-4.0 * rng.random::<f64>()) * 1.05;
        // Where the horizon or the lobe's last digit is, give or take two light radii.
        let edge = if alpha == 1.0 {
            PI / 2.0
        } else {
            (180.0 / alpha).sqrt().min(1.6)
        };
        let light = light(&point, sine, 4.0 * rng.random::<f64>() - 2.0, edge);
        let toss = numbers.toss(Word(pixel), Word(0), 0, pixel);
        let cone = light.cone(point.p);
        let ((u, v), frame) = (toss.pair.unit::<f32>(), Frame::about(cone.axis));
        let (sin_phi, cos_phi) = sin_cos_turn(v);
        let wi = frame.direction(warp::cone(u, cone.omc), sin_phi, cos_phi);
        let (cos_theta, above) = point.above(wi);
        let counts = above && point.bsdf.eval(wi, cos_theta).shape > 0.0;
        let found = per_light::sample::<f32, per_light::ConeOnly>(&point, &light, || toss, true);
        match found {
            Some(found) => assert_eq!(found.wi.lane(0), wi.lane(0)),
            None => assert!(
                !counts,
                "alpha {alpha}, sin {sine}: a direction that counts was dropped"
            ),
        }
        counted += u32::from(counts);
        dropped += u32::from(!counts);
    }
    assert!(
        counted > 50_000 && dropped > 50_000,
        "{counted} count, {dropped} do not: the edge is not in sight"
    );
}
