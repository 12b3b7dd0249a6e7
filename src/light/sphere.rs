//! Spherical lights, sampled uniformly in the cone that they subtend.
//!
//! Angles are stored as `one_minus_cos_max = 1 - cos(theta_max)` and `t = 1 - cos(theta)`: a light with a sine of 1e-7 has
//! `one_minus_cos_max = 5e-15`, which a cosine cannot represent.

use crate::lane::{Lane, Mask};
use crate::math::Vec3;
use crate::sampling::warp;

/// A spherical light, the same for all lanes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereLight {
    /// Center.
    pub center: [f32; 3],
    /// Radius.
    pub radius: f32,
    /// Radiance.
    pub le: [f32; 3],
    /// Sphere index in the scene; also the skip id, as the light does not occlude itself.
    pub sphere: u32,
    /// `|center|² - radius²`, rounded once from `f64`, if the surface passes close to the origin compared with the radius. Center
    /// and radius alone are then too imprecise for distances to the surface.
    pub origin_power: Option<f32>,
}

/// The cone of directions from a point to a light.
#[derive(Clone, Copy, Debug)]
pub struct Cone<L: Lane> {
    /// Unit direction to the center.
    pub axis: Vec3<L>,
    /// `1 - cos(theta_max)` in (0, 1], or 2 inside the light, where every direction hits it.
    pub one_minus_cos_max: L,
    /// Lanes inside or on the light.
    pub inside: L::Mask,
    /// Distance to the center.
    center_distance: L,
    radius: L,
    /// Power of the point: `D^2 - R^2`.
    power: L,
    /// Whether the power comes from [`SphereLight::origin_power`].
    near: bool,
}

/// A light as seen from points, before any division.
#[derive(Clone, Copy, Debug)]
pub struct View<L: Lane> {
    /// Vector to the center.
    pub to_center: Vec3<L>,
    /// Squared distance to the center.
    squared: L,
    /// Distance to the center.
    pub distance: L,
    /// Radius.
    pub radius: L,
    /// The power of the point, `D^2 - R^2`: negative inside.
    power: L,
    near: bool,
}

impl SphereLight {
    /// The light as seen from `p`.
    #[inline(always)]
    pub fn seen_from<L: Lane>(&self, p: Vec3<L>) -> View<L> {
        let center = Vec3::splat(self.center);
        let to_center = center - p;
        let squared = to_center.length_squared();
        let (distance, radius) = (squared.sqrt(), L::splat(self.radius));
        let power = match self.origin_power {
            // Its error grows with the distance from the origin instead of the radius.
            Some(power) => p.dot(p - (center + center)) + L::splat(power),
            None => (distance - radius) * (distance + radius),
        };
        View {
            to_center,
            squared,
            distance,
            radius,
            power,
            near: self.origin_power.is_some(),
        }
    }

    /// The cone that the light subtends at `p`.
    #[inline(always)]
    pub fn cone<L: Lane>(&self, p: Vec3<L>) -> Cone<L> {
        self.seen_from(p).cone()
    }

    /// The cone whose [`Cone::columns`] and `one_minus_cos_max` these are: loading them is cheaper than two roots and a division.
    #[inline(always)]
    pub fn cone_of_columns<L: Lane>(&self, [x, y, z, center_distance, power]: [L; 5], one_minus_cos_max: L) -> Cone<L> {
        Cone {
            axis: Vec3::new(x, y, z),
            one_minus_cos_max,
            inside: power.le(L::zero()),
            center_distance,
            radius: L::splat(self.radius),
            power,
            near: self.origin_power.is_some(),
        }
    }

    /// Lanes where the unit direction `wi` from `p` may hit the light: a slight superset of [`Cone::contains`], without a root or a
    /// division. In the cone, `wi . to_center >= sqrt(D^2 - R^2)`.
    #[inline(always)]
    pub fn may_meet<L: Lane>(&self, p: Vec3<L>, wi: Vec3<L>) -> L::Mask {
        let to_center = Vec3::splat(self.center) - p;
        let along = wi.dot(to_center);
        let tangent = match self.origin_power {
            Some(_) => self.seen_from(p).power,
            None => to_center.length_squared() - L::splat(self.radius * self.radius),
        };
        let inside = tangent.le(L::zero());
        inside | (along.gt(L::zero()) & (along * along).ge(tangent * L::splat(1.0 - 1e-5)))
    }
}

impl<L: Lane> View<L> {
    /// A light of its own for each lane, without [`SphereLight::origin_power`].
    #[inline(always)]
    pub fn of(to_center: Vec3<L>, radius: L) -> Self {
        let squared = to_center.length_squared();
        let distance = squared.sqrt();
        Self {
            to_center,
            squared,
            distance,
            radius,
            power: (distance - radius) * (distance + radius),
            near: false,
        }
    }

    /// Lanes inside or on the light.
    #[inline(always)]
    pub fn inside(&self) -> L::Mask {
        self.power.le(L::zero())
    }

    /// The cone that the light subtends.
    #[inline(always)]
    pub fn cone(&self) -> Cone<L> {
        let (d, radius, inside) = (self.distance, self.radius, self.inside());
        // cos = sqrt((D - R)(D + R)) / D and 1 - cos = sin^2 / (1 + cos): no cancellation.
        let tangent = self.power.safe_sqrt();
        // 1 / D and 1 / (D + tangent) from one division.
        let sum = d + tangent;
        let both = L::one() / (d * sum);
        let inverse = both * sum;
        let one_minus_cos_max = L::select(inside, L::splat(2.0), radius * (radius * both));
        let axis = self.to_center * inverse;
        // At the exact center any axis works.
        let apart = self.squared.gt(L::zero());
        let axis = Vec3::new(
            axis.x.or_zero(apart),
            axis.y.or_zero(apart),
            L::select(apart, axis.z, L::one()),
        );
        Cone {
            axis,
            one_minus_cos_max,
            center_distance: d,
            radius,
            power: self.power,
            near: self.near,
            inside,
        }
    }
}

impl<L: Lane> Cone<L> {
    /// Density of uniform sampling in the cone, per steradian.
    #[inline(always)]
    pub fn pdf(&self) -> L {
        warp::cone_pdf(self.one_minus_cos_max)
    }

    /// What differs between lanes besides `one_minus_cos_max`.
    #[inline(always)]
    pub fn columns(&self) -> [L; 5] {
        [self.axis.x, self.axis.y, self.axis.z, self.center_distance, self.power]
    }

    /// `1 - cos` between the axis and `wi`, from the chord: accurate close to the axis.
    #[inline(always)]
    pub fn t(&self, wi: Vec3<L>) -> L {
        (self.axis - wi).length_squared() * L::splat(0.5)
    }

    /// Whether directions at `t` from the axis hit the light.
    #[inline(always)]
    pub fn contains(&self, t: L) -> L::Mask {
        t.le(self.one_minus_cos_max)
    }

    /// Distance to the light along a direction at `t <= one_minus_cos_max` from the axis.
    ///
    /// From `D cos - sqrt(R^2 - D^2 sin^2) = (D^2 - R^2) / (D cos + sqrt(…))` and
    /// `R^2 - D^2 sin^2 = D^2 (one_minus_cos_max - t)(2 - one_minus_cos_max - t)`: only sums of positive terms.
    #[inline(always)]
    pub fn distance(&self, t: L) -> L {
        let (d, r) = (self.center_distance, self.radius);
        let two = L::splat(2.0);
        let chord = ((self.one_minus_cos_max - t) * (two - self.one_minus_cos_max - t)).safe_sqrt();
        let outside = self.power / (d * (L::one() - t + chord));
        if self.inside.none() {
            return outside;
        }
        if self.near {
            // One of the two roots is a sum without cancellation; the product of both is the power.
            let along = d * (L::one() - t);
            let root = (along * along - self.power).safe_sqrt();
            let far = L::select(along.ge(L::zero()), along + root, self.power / (along - root));
            return L::select(self.inside, far, outside);
        }
        let half_chord = (r * r - d * d * t * (two - t)).safe_sqrt();
        L::select(self.inside, d.mul_add(L::one() - t, half_chord), outside)
    }
}
