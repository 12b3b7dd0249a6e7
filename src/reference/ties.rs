//! Ties: rays whose result single precision cannot determine, because they hit two shapes at the same distance, or the edge of
//! one.
//!
//! A renderer in `f32` knows a point only to a few roundings of its coordinates. Where a ray hits two faces closer together
//! than that, or passes the edge of a shape within that distance, the reported shape depends on the last bits: packets, single
//! rays and other intersectors may differ, and none is wrong. This module decides it in `f64`, from the scene's own
//! coordinates: every shape that the ray may hit gets an interval of distances, and a tie is a case that the intervals leave
//! undecided.

use glam::DVec3;
use rand_pcg::Pcg64;

use super::Pinhole;
use super::geometry::{Bounds, Ray, Shape};
use super::stream;
use super::world::{Sight, World};
use crate::scene::{FilmSize, Scene};

/// Error of a coordinate, relative to the largest one involved, measured from the camera: 16 roundings of 2⁻²⁴. Corners,
/// normals, edges and distances take about ten.
const BOUND: f64 = 16.0 / (1 << 24) as f64;

/// Triangles are parallel if the squared sine between their normals is at most this, as in the renderer.
const PARALLEL: f64 = 1e-6;

/// A ray of the renderer: positions are relative to the camera.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// Its start.
    pub origin: DVec3,
    /// Its direction, of any length.
    pub direction: DVec3,
    /// Its end, in lengths of `direction`.
    pub end: f64,
}

/// Two bodies between which a ray is undecided: spheres by their index in the scene, then meshes; the same twice for the edge
/// of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Tie(pub usize, pub usize);

/// A shape that a ray may hit, and the interval of distances.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    shape: u32,
    low: f64,
    high: f64,
    /// Whether it is certainly hit, and not only at its edge.
    sure: bool,
}

/// A scene prepared for finding ties.
#[derive(Debug)]
pub struct Ties<'s> {
    world: World<'s>,
    camera: DVec3,
    pinhole: Pinhole,
    film: FilmSize,
}

impl<'s> Ties<'s> {
    /// Prepares the scene.
    pub fn new(scene: &'s Scene, film: FilmSize) -> Self {
        Self {
            world: World::new(scene),
            camera: scene.camera().origin,
            pinhole: Pinhole::new(scene.camera(), film),
            film,
        }
    }

    /// Whether a sample of the renderer is a tie: its camera ray, or one of the rays from its hit point.
    pub fn of_sample(&self, camera_ray: Segment, onward: &[Segment]) -> Option<Tie> {
        self.of_camera_ray(camera_ray)
            .or_else(|| self.of_onward(camera_ray, onward))
    }

    /// Whether a camera ray is a tie.
    pub fn of_camera_ray(&self, camera_ray: Segment) -> Option<Tie> {
        self.of(camera_ray, None)
    }

    /// Whether all that a camera ray may hit are triangles in one plane, each hit certainly: of these the renderer's rule names one.
    pub fn in_one_plane(&self, camera_ray: Segment) -> bool {
        let ray = self.ray(camera_ray);
        let met = self.met(&ray, f64::INFINITY, None);
        let Some(first) = met.first() else {
            return false;
        };
        let point = ray.origin + 0.5 * (first.low + first.high) * ray.direction;
        let named = |other: &Candidate| other.sure && self.in_plane(&ray, first.shape, other.shape, point);
        met.iter().all(named)
    }

    /// Whether one of the rays from the hit point of a camera ray is a tie.
    pub fn of_onward(&self, camera_ray: Segment, onward: &[Segment]) -> Option<Tie> {
        let left = self.first(&self.ray(camera_ray));
        onward.iter().find_map(|&segment| self.of(segment, left))
    }

    /// Whether two points with their normals, as two renders have them on a camera ray, are one up to rounding: on the shape that
    /// the ray hits, by the error of its place and by how far its normal turns over that.
    pub fn one_point(&self, camera_ray: Segment, [p, n]: [DVec3; 2], [q, m]: [DVec3; 2]) -> bool {
        let ray = self.ray(camera_ray);
        let Some((index, meeting)) = self.world.nearest(&ray) else {
            return false;
        };
        let shape = self.world.shapes()[index as usize];
        let met = ray.origin + meeting.distance * ray.direction;
        let (normal, size) = match shape {
            Shape::Sphere { center, radius } => ((met - center) / radius, radius),
            Shape::Triangle([a, b, c]) => {
                let longest = (b - a).length().max((c - b).length()).max((a - c).length());
                let normal = (b - a).cross(c - a);
                (normal.normalize(), normal.length() / longest)
            }
        };
        let reach = self.error(&ray, &shape.bounds()) / normal.dot(ray.direction).abs().max(1e-6);
        (p - q).length() <= 2.0 * reach && (n - m).length() <= 8.0 * reach / size + 1e-5
    }

    /// A tie of two coincident faces on one oracle sample of a pixel: on the camera ray, on rays from the hit point to every
    /// emitter, or along its BRDF direction. Edges are ignored, because they cover no area of the picture.
    pub fn of_pixel(&self, pixel: usize, seed: u64) -> Option<Tie> {
        let mut rng: Pcg64 = stream(seed ^ 0x71e5_0000_0000, pixel as u64);
        let width = self.film.width as usize;
        let camera_ray = self
            .pinhole
            .sampled_ray((pixel % width) as f64, (pixel / width) as f64, &mut rng);
        if let Some((tie, surely)) = self.along(&camera_ray, f64::INFINITY, None) {
            return (surely && self.matters(tie)).then_some(tie);
        }
        let Some(Sight::Reflector { shading, point }) = self.world.look(&camera_ray) else {
            return None;
        };
        let left = self.first(&camera_ray);
        let by_brdf = (shading.sample(&mut rng), f64::INFINITY);
        let lights = self.world.emitters().iter();
        let towards = lights.filter_map(|light| light.sample(point, shading.n, self.world.shapes(), &mut rng));
        let towards: Vec<(DVec3, f64)> = towards.map(|sample| (sample.wi, sample.distance)).collect();
        std::iter::once(by_brdf).chain(towards).find_map(|(direction, end)| {
            let ray = Ray {
                origin: point,
                direction,
            };
            let (tie, surely) = self.along(&ray, end, left)?;
            (surely && self.matters(tie)).then_some(tie)
        })
    }

    /// Whether the two look different: of coincident faces with the same surface, either is right.
    fn matters(&self, Tie(a, b): Tie) -> bool {
        a == b || !self.world.same_surface(a, b)
    }

    fn ray(&self, segment: Segment) -> Ray {
        Ray {
            origin: segment.origin + self.camera,
            direction: segment.direction.normalize(),
        }
    }

    fn of(&self, segment: Segment, left: Option<u32>) -> Option<Tie> {
        let tie = self.along(&self.ray(segment), segment.end * segment.direction.length(), left);
        tie.map(|(tie, _)| tie)
    }

    fn first(&self, ray: &Ray) -> Option<u32> {
        self.world.nearest(ray).map(|(shape, _)| shape)
    }

    /// The tie of a ray that starts on shape `left` and ends at `end`, if any; and whether both of its shapes are certainly
    /// hit.
    fn along(&self, ray: &Ray, end: f64, left: Option<u32>) -> Option<(Tie, bool)> {
        let met = self.met(ray, end, left);
        let body = |candidate: &Candidate| self.world.body(candidate.shape);
        let first = met.first()?;
        // An undecided case: the start of the ray, an edge, or a second shape.
        let open = !first.sure || first.low <= 0.0;
        match (met.get(1), open) {
            (Some(second), _) => {
                let (a, b) = (body(first), body(second));
                Some((Tie(a.min(b), a.max(b)), first.sure && second.sure))
            }
            (None, true) => {
                let (a, b) = (body(first), left.map_or(body(first), |shape| self.world.body(shape)));
                Some((Tie(a.min(b), a.max(b)), false))
            }
            (None, false) => None,
        }
    }

    /// The shapes that a ray may hit first, certain hits before others.
    fn met(&self, ray: &Ray, end: f64, left: Option<u32>) -> Vec<Candidate> {
        let mut found: Vec<Candidate> = Vec::new();
        let mut nearest = f64::INFINITY;
        self.world
            .near(ray, end, &|bounds| self.error(ray, bounds), &mut |shape| {
                if left.is_none_or(|left| left != shape && !self.in_plane(ray, left, shape, ray.origin))
                    && let Some(candidate) = self.candidate(ray, shape)
                {
                    if candidate.sure && candidate.low > 0.0 {
                        nearest = nearest.min(candidate.high);
                    }
                    found.push(candidate);
                }
                nearest
            });
        let limit = nearest.min(end);
        found.retain(|candidate| candidate.low <= limit);
        found.sort_by_key(|candidate| !candidate.sure);
        found
    }

    /// Whether two shapes are triangles in one plane, as far as single precision tells at `point`. The offset of a ray that leaves
    /// one takes it from the other too.
    fn in_plane(&self, ray: &Ray, first: u32, second: u32, point: DVec3) -> bool {
        let shapes = self.world.shapes();
        let [Shape::Triangle([a, b, c]), Shape::Triangle([d, e, f])] =
            [first, second].map(|index| shapes[index as usize])
        else {
            return false;
        };
        let (normal, other) = ((b - a).cross(c - a), (e - d).cross(f - d));
        let parallel =
            normal.cross(other).length_squared() <= PARALLEL * normal.length_squared() * other.length_squared();
        let error = self.error(ray, &shapes[second as usize].bounds());
        parallel && other.dot(point - d).abs() <= error * other.length()
    }

    /// The error of points in the box.
    fn error(&self, ray: &Ray, bounds: &Bounds) -> f64 {
        let most = |v: DVec3| (v - self.camera).abs().max_element();
        BOUND * most(bounds.min).max(most(bounds.max)).max(most(ray.origin))
    }

    fn candidate(&self, ray: &Ray, index: u32) -> Option<Candidate> {
        let shape = self.world.shapes()[index as usize];
        let error = self.error(ray, &shape.bounds());
        let (low, high, sure) = match shape {
            Shape::Sphere { center, radius } => sphere(ray, center, radius, error)?,
            Shape::Triangle(corners) => triangle(ray, corners, error)?,
        };
        (high >= 0.0).then_some(Candidate {
            shape: index,
            low,
            high,
            sure,
        })
    }
}

/// The interval of distances at which a ray may hit a sphere, and whether it certainly does.
fn sphere(ray: &Ray, center: DVec3, radius: f64, error: f64) -> Option<(f64, f64, bool)> {
    let to_center = center - ray.origin;
    let along = to_center.dot(ray.direction);
    let beside = (to_center - along * ray.direction).length();
    if beside > radius + error {
        return None;
    }
    let chord = |radius: f64| ((radius - beside).max(0.0) * (radius + beside)).sqrt();
    let (outer, inner) = (chord(radius + error), chord(radius - error));
    if beside >= radius - error {
        return Some((along - outer, along + outer, false));
    }
    let near = (along - outer - error, along - inner + error);
    let far = (along + inner - error, along + outer + error);
    let (low, high) = if near.1 > 0.0 { near } else { far };
    Some((low, high, true))
}

/// The interval of distances at which a ray may hit a triangle, and whether it certainly does.
fn triangle(ray: &Ray, [a, b, c]: [DVec3; 3], error: f64) -> Option<(f64, f64, bool)> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    let (slope, above) = (normal.dot(ray.direction), normal.dot(a - ray.origin));
    // A ray parallel to the plane may hit it anywhere or nowhere: its distance from the plane decides.
    let reach = error / slope.abs().max(1e-9);
    let distance = above / slope;
    if !distance.is_finite() {
        return (above.abs() <= error).then_some((0.0, f64::INFINITY, false));
    }
    let met = ray.origin + distance * ray.direction;
    let inside = [(a, b), (b, c), (c, a)].map(|(from, to)| normal.cross((to - from).normalize()).dot(met - from));
    let least = inside.into_iter().fold(f64::INFINITY, f64::min);
    let margin = reach + error;
    (least >= -margin).then_some((distance - reach, distance + reach, least > margin))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// A camera above a floor of two meshes that share the line x = 0, below a second floor that coincides with the right one.
    fn scene() -> Scene {
        let floor = |vertices: &str, material: &str| {
            format!("[[meshes]]\nmaterial = \"{material}\"\nvertices = {vertices}\nfaces = [[0, 1, 2, 3]]\n")
        };
        let text = "[camera]\norigin = [0, 5, 0]\ntarget = [0, 0, 0]\nup = [0, 0, 1]\nfov_x = 40\n[film]\nwidth = 4\nheight = 4\n\
                    [materials.a]\ndiffuse = [0.5, 0.5, 0.5]\n[materials.b]\ndiffuse = [0.1, 0.1, 0.1]\n\
                    [[spheres]]\ncenter = [0, 9, 0]\nradius = 1\nemission = [1, 1, 1]\n"
            .to_owned()
            + &floor("[[-9, 0, -9], [-9, 0, 9], [0, 0, 9], [0, 0, -9]]", "a")
            + &floor("[[0, 0, -9], [0, 0, 9], [9, 0, 9], [9, 0, -9]]", "a")
            + &floor("[[3, 0, -9], [3, 0, 9], [9, 0, 9], [9, 0, -9]]", "b");
        Scene::parse(&text, Path::new("ties.toml")).unwrap()
    }

    fn at(target: [f64; 3]) -> Segment {
        Segment {
            origin: DVec3::ZERO,
            direction: DVec3::from(target) - DVec3::Y * 5.0,
            end: f64::INFINITY,
        }
    }

    #[test]
    fn faces_that_touch_or_lie_in_one_another_are_ties_and_nothing_else_is() {
        let scene = scene();
        let ties = Ties::new(&scene, scene.film());
        // Body 0 is the light.
        assert_eq!(ties.of_sample(at([0.0, 0.0, 0.3]), &[]), Some(Tie(1, 2)));
        assert_eq!(ties.of_sample(at([1e-7, 0.0, 0.3]), &[]), Some(Tie(1, 2)));
        assert_eq!(ties.of_sample(at([1e-4, 0.0, 0.3]), &[]), None);
        assert_eq!(ties.of_sample(at([5.0, 0.0, 0.3]), &[]), Some(Tie(2, 3)));
        assert_eq!(ties.of_sample(at([-5.0, 0.0, 0.3]), &[]), None);
        // Where the floors coincide the rule names one; where they touch, an edge decides.
        assert!(ties.in_one_plane(at([5.0, 0.0, 0.3])));
        assert!(!ties.in_one_plane(at([0.0, 0.0, 0.3])) && !ties.in_one_plane(at([0.0, 5.0, 0.3])));
    }

    #[test]
    fn shadow_rays_tie_at_rims_and_not_where_they_leave_their_surface() {
        let scene = scene();
        let ties = Ties::new(&scene, scene.film());
        // From a point just above the floor to the light of radius 1 at height 9: at its centre, and along its silhouette.
        let from = |aside: f64| Segment {
            origin: DVec3::new(-1.0, -5.0 + 1e-6, 0.3),
            direction: DVec3::new(1.0 + aside, 9.0, -0.3),
            end: f64::INFINITY,
        };
        let camera_ray = at([-1.0, 0.0, 0.3]);
        assert_eq!(ties.of_sample(camera_ray, &[from(0.0)]), None);
        let (mut low, mut high) = (0.0, 5.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let ray = ties.ray(from(middle));
            if ties.first(&ray).is_some() {
                low = middle
            } else {
                high = middle
            }
        }
        assert_eq!(ties.of_sample(camera_ray, &[from(low)]), Some(Tie(0, 1)));
        assert_eq!(ties.of_sample(camera_ray, &[from(low + 1e-3)]), None);
    }

    #[test]
    fn pixels_of_coincident_floors_are_found_by_probing() {
        let scene = scene();
        let ties = Ties::new(&scene, scene.film());
        let open = (0..16).filter(|&pixel| ties.of_pixel(pixel, 1).is_some()).count();
        assert_eq!(open, 0, "the camera looks at less than 2 to each side");
        let mut wide = scene.to_builder();
        wide.camera.fov = crate::scene::Fov::X(120.0);
        let wide = wide.build().unwrap();
        let ties = Ties::new(&wide, wide.film());
        let open: Vec<usize> = (0..16).filter(|&pixel| ties.of_pixel(pixel, 1).is_some()).collect();
        assert!(!open.is_empty() && open.len() <= 8, "{open:?}");
    }
}
