//! The lights of a tree: spheres, triangles, and delta lights with a position.

use super::UNIT;
use crate::light::tree::Emitter;
use crate::light::{DeltaLight, SphereLight, TriangleLight};

/// Which lights the stages of an estimator draw from lists.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Draws {
    /// None: every light is sampled, or found by the directions of points.
    #[default]
    Nothing,
    /// Points and spots alone: estimators that sample no light of a shape would not find them otherwise.
    Deltas,
    /// Spheres, triangles, points and spots.
    All,
}

/// A light of a tree, by its index among the lights of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Member {
    Sphere(usize),
    Triangle(usize),
    Delta(usize),
}

/// The lights of a tree. Light indices count spheres, triangles and delta lights, in this order.
#[derive(Clone, Copy, Debug)]
pub struct Lights<'a> {
    pub spheres: &'a [SphereLight],
    pub triangles: &'a [TriangleLight],
    pub deltas: &'a [DeltaLight],
}

impl<'a> Lights<'a> {
    /// Of the delta lights, those with a position are in the tree.
    pub fn new(spheres: &'a [SphereLight], triangles: &'a [TriangleLight], deltas: &'a [DeltaLight]) -> Self {
        Self {
            spheres,
            triangles,
            deltas,
        }
    }

    /// Numbers of lights of each kind.
    pub fn counts(&self) -> [usize; 3] {
        [self.spheres.len(), self.triangles.len(), self.deltas.len()]
    }

    /// The delta lights without a position.
    pub fn others(&self) -> Vec<DeltaLight> {
        let others = self.deltas.iter().filter(|light| light.position().is_none());
        others.copied().collect()
    }

    /// The emitters of the tree. Lights whose power underflows `f32` are left out.
    pub fn emitters(&self) -> Vec<Emitter> {
        let [spheres, triangles, _] = self.counts();
        let of_spheres = (0..).zip(self.spheres).map(|(light, sphere)| of_sphere(light, sphere));
        let of_triangles = (spheres as u32..).zip(self.triangles);
        let of_triangles = of_triangles.map(|(light, triangle)| of_triangle(light, triangle));
        let of_deltas = ((spheres + triangles) as u32..).zip(self.deltas);
        let of_deltas = of_deltas.filter_map(|(light, delta)| of_delta(light, delta));
        of_spheres
            .chain(of_triangles)
            .chain(of_deltas)
            .filter(|emitter| emitter.power > 0.0 && emitter.power.is_finite())
            .collect()
    }
}

fn mean(le: [f32; 3]) -> f64 {
    le.iter().map(|&x| f64::from(x)).sum::<f64>() / 3.0
}

fn of_sphere(light: u32, sphere: &SphereLight) -> Emitter {
    let radius = f64::from(sphere.radius) * f64::from(UNIT);
    Emitter {
        light,
        mean: sphere.center.map(|x| x * UNIT),
        variance: [(radius * radius / 3.0) as f32; 3],
        normal: None,
        power: mean(sphere.le) * (std::f64::consts::PI * 3.0_f64.sqrt()) * radius * radius,
    }
}

fn of_triangle(light: u32, TriangleLight { triangle, le, .. }: &TriangleLight) -> Emitter {
    let unit = f64::from(UNIT);
    let corners = triangle.corners.map(|corner| corner.map(|x| x * UNIT));
    let [a, b, c] = corners;
    let mean_of = |k: usize| (a[k] + b[k] + c[k]) / 3.0;
    // Variance of a uniform distribution over a triangle: a twelfth of the sum of squared distances of the corners from their mean.
    let variance = |k: usize| {
        corners
            .iter()
            .map(|corner| (corner[k] - mean_of(k)).powi(2))
            .sum::<f32>()
            / 12.0
    };
    Emitter {
        light,
        mean: [mean_of(0), mean_of(1), mean_of(2)],
        variance: [variance(0), variance(1), variance(2)],
        normal: Some(triangle.normal),
        power: mean(*le) * f64::from(triangle.area) * unit * unit,
    }
}

/// A spot has the power of its axis: what a point in its cone receives. Points outside of the cone do not see it, as the looks of a
/// table find ([`Look`](crate::light::tree::Look)).
fn of_delta(light: u32, delta: &DeltaLight) -> Option<Emitter> {
    let (position, unit) = delta.position()?;
    let unit = f64::from(unit) * f64::from(UNIT);
    Some(Emitter {
        light,
        mean: position.map(|x| x * UNIT),
        variance: [0.0; 3],
        normal: None,
        power: mean(delta.le) * 3.0_f64.sqrt() * unit * unit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::delta::Place;
    use crate::light::falloff::Falloff;
    use crate::pipeline::space::Space;

    /// A sphere of radiance `le` and radius `r` is a point of intensity `pi r² le` from afar.
    #[test]
    fn a_small_sphere_and_a_point_of_its_intensity_have_the_same_power() {
        let (center, radius, le) = ([3e8, -1e7, 2e8], 1e4_f32, [0.25, 3.0, 0.5]);
        let sphere = SphereLight {
            center,
            radius,
            le,
            sphere: 0,
            origin_power: None,
        };
        // Irradiance at the unit distance.
        let ratio = radius / Space::UNIT_DISTANCE;
        let le = le.map(|x| std::f32::consts::PI * ratio * ratio * x);
        let axis = [0.0, -1.0, 0.0];
        for spot in [None, Some(Falloff::new(axis, [0.1, 0.2]))] {
            let at = |unit: f32, scale: f32| DeltaLight {
                place: Place::At {
                    position: center,
                    unit,
                    spot,
                },
                le: le.map(|x| x * scale),
            };
            // The same light, told by another distance; and a light without a place.
            let deltas = [
                at(Space::UNIT_DISTANCE, 1.0),
                DeltaLight {
                    place: Place::Toward(axis),
                    le,
                },
                at(0.5 * Space::UNIT_DISTANCE, 4.0),
            ];
            let emitters = Lights::new(&[sphere], &[], &deltas).emitters();
            assert_eq!(emitters.iter().map(|e| e.light).collect::<Vec<_>>(), [0, 1, 3]);
            for emitter in &emitters {
                assert!((emitter.power / emitters[0].power - 1.0).abs() < 1e-6, "{emitters:?}");
                assert_eq!((emitter.mean, emitter.normal), (emitters[0].mean, None));
            }
            assert_eq!(emitters[1].variance, [0.0; 3]);
        }
    }

    /// A light that emits 0 or infinitely much is in no tree.
    #[test]
    fn lights_without_a_finite_power_are_left_out() {
        let deltas = [0.0, f32::INFINITY, 1e-38].map(|x| DeltaLight {
            place: Place::At {
                position: [1.0; 3],
                unit: Space::UNIT_DISTANCE,
                spot: None,
            },
            le: [x; 3],
        });
        let emitters = Lights::new(&[], &[], &deltas).emitters();
        assert_eq!(emitters.iter().map(|e| e.light).collect::<Vec<_>>(), [2]);
    }
}
