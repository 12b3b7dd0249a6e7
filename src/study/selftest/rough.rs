//! Case 45: microfacet surfaces, from roughness below the spacing of directions up, also at grazing angles.

use super::bench::SIGMAS;
use super::row::{Check, Checks, Effort};
use crate::bsdf::{Brdf, Conductor, Ggx, Microfacets, Tint};
use crate::lane::{Bits, F32x8, Lane, U32x8};
use crate::math::Vec3;
use crate::sampling::Pair;
use crate::sampling::hash::pcg4d;
use crate::study::estimate::Estimate;

/// Measurements of a model.
#[derive(Default)]
struct Found {
    /// Directions that are not unit vectors, values and densities that are NaN, infinite or negative.
    unsound: usize,
    /// The largest weight.
    largest: f64,
    /// The largest mean weight in a white furnace, minus 5.5 standard errors.
    albedo: f64,
}

impl Found {
    /// Samples directions and evaluates their weights; also evaluates directions independent of the lobe.
    fn look<B: Brdf<F32x8>>(&mut self, model: B, packets: u32) {
        let white = Vec3::splat([1.0; 3]);
        let (mut sum, mut squares) = (0.0_f64, 0.0_f64);
        for packet in 0..packets {
            let lane = U32x8::from_fn(|i| packet * 8 + i as u32);
            let [a, b, c, d] = pcg4d([lane, U32x8::splat(3), U32x8::splat(5), U32x8::splat(0x9e37_79b9)]);
            let (u, v) = Pair(a, b).unit::<F32x8>();
            let wi = model.draw(u, v);
            let cosine = model.normal().dot(wi);
            let weight = model.weight(wi, cosine).colour(model.rho(), white);
            let aside = Ggx::<F32x8> {
                facets: Microfacets::new(model.normal(), model.normal(), F32x8::one()),
                rho: white,
                metallic: F32x8::zero(),
            };
            let (u, v) = Pair(c, d).unit::<F32x8>();
            let other = aside.draw(u, v);
            let height = model.normal().dot(other);
            let lobe = model.eval(other, height);
            let value = lobe.shape.colour(model.rho(), white);
            for lane in 0..8 {
                let length: f32 = wi.lane(lane).map(|x| x * x).iter().sum();
                self.unsound += usize::from((length - 1.0).abs().partial_cmp(&1e-5) != Some(std::cmp::Ordering::Less));
                if height.lane(lane) > 0.0 {
                    let said = [value.y.lane(lane), lobe.pdf.lane(lane)];
                    self.unsound += said.iter().filter(|x| !(x.is_finite() && **x >= 0.0)).count();
                }
                let up = cosine.lane(lane) > 0.0;
                let x = if up { f64::from(weight.y.lane(lane)) } else { 0.0 };
                self.unsound += usize::from(!(x.is_finite() && x >= 0.0));
                self.largest = self.largest.max(x);
                (sum, squares) = (sum + x, squares + x * x);
            }
        }
        let n = f64::from(packets) * 8.0;
        let mean = Estimate {
            mean: sum / n,
            variance: (squares / n - (sum / n).powi(2)).max(0.0) / n,
            dof: n - 1.0,
        };
        self.albedo = self.albedo.max(mean.mean - SIGMAS * mean.error());
    }
}

/// Case 45.
pub fn grazing(effort: Effort) -> Checks {
    let n = Vec3::splat([0.0, 0.0, 1.0]);
    let (mut mirrors, mut bodies) = (Found::default(), Found::default());
    let packets = effort.of(1 << 9);
    for alpha in [1e-8, 1e-6, 1e-4, 1e-2, 0.3, 1.0] {
        for sine in [-0.3, 0.0, 1e-30, 1e-7, 1e-5, 1e-3, 0.1, 1.0_f32] {
            let wo = Vec3::splat([(1.0 - sine * sine).sqrt(), 0.0, sine]);
            let facets = Microfacets::new(n, wo, F32x8::splat(alpha));
            let rho = Vec3::splat([1.0; 3]);
            for metallic in [0.0, 0.5, 1.0] {
                let metallic = F32x8::splat(metallic);
                let found = if metallic.lane(0) < 1.0 {
                    &mut bodies
                } else {
                    &mut mirrors
                };
                found.look(Ggx { facets, rho, metallic }, packets);
            }
            let (eta, k) = (Vec3::splat([0.2, 0.9, 1.4]), Vec3::splat([4.0, 2.4, 1.6]));
            mirrors.look(Conductor { facets, rho, eta, k }, packets);
        }
    }
    Ok(vec![
        Check::new(
            "roughness 1e-4 to 1, n.wo from below 0 to 1: largest f cos / pdf of metals",
            mirrors.largest,
            1.0 + 1e-5,
        ),
        Check::new(
            "white furnace there, metals and coated bodies: mean minus 5.5 standard errors",
            mirrors.albedo.max(bodies.albedo),
            1.0 + 1e-5,
        ),
        Check::none(
            "directions that are not unit vectors; values and densities that are NaN, infinite or negative",
            mirrors.unsound + bodies.unsound,
        ),
    ])
}
