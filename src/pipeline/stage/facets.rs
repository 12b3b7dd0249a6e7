//! Points on microfacet surfaces: which lanes have them, and their parameters.

use super::surface::{SurfacePoint, Surfaces};
use crate::bsdf::{Conductor, Ggx, Microfacets};
use crate::embree::TraceLane;
use crate::lane::Mask;
use crate::math::Vec3;
use crate::pipeline::model::{self, Model, Streams};
use crate::pipeline::stream::Address;
use crate::pipeline::world::{Facets, World};

/// Pushes such points into their streams; returns their lanes.
#[inline(always)]
pub fn push<L: TraceLane>(
    world: &World,
    hits: &mut Streams,
    surfaces: &Surfaces<L>,
    point: &SurfacePoint<L>,
    reflects: L::Mask,
    address: &Address<L>,
) -> L::Mask {
    // A plain loop without closures: closures would become calls, compiled without the lanes' instruction set.
    let (mut coated, mut metals) = (0, 0);
    let (mut alpha, mut metallic, mut index) = ([1.0; 16], [0.0; 16], [[1.0; 16]; 6]);
    for lane in reflects.lanes() {
        match &surfaces.record(world, lane).facets {
            None => {}
            Some(Facets::Ggx { alpha: a, metallic: m }) => {
                (alpha[lane], metallic[lane]) = (*a, *m);
                coated |= 1 << lane;
            }
            Some(Facets::Conductor { alpha: a, eta, k }) => {
                alpha[lane] = *a;
                for channel in 0..3 {
                    index[channel][lane] = eta[channel];
                    index[3 + channel][lane] = k[channel];
                }
                metals |= 1 << lane;
            }
        }
    }
    if coated | metals == 0 {
        return L::Mask::splat(false);
    }
    let (coated, metals) = (L::Mask::from_bitmask(coated), L::Mask::from_bitmask(metals));
    let facets = Microfacets::new(point.n, point.wo, L::load(&alpha));
    let rho = point.rho;
    if coated.any() {
        let metallic = L::load(&metallic);
        let coat = Ggx { facets, rho, metallic };
        model::Ggx::filled(hits).push::<L>(coated, &point.with(coat), address);
    }
    if metals.any() {
        let [a, b, c, d, e, f] = &index;
        let eta = Vec3::new(L::load(a), L::load(b), L::load(c));
        let k = Vec3::new(L::load(d), L::load(e), L::load(f));
        let metal = Conductor { facets, rho, eta, k };
        model::Conductor::filled(hits).push::<L>(metals, &point.with(metal), address);
    }
    coated | metals
}
