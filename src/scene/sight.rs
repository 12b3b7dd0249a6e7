//! View frustum tests. They are conservative: a visible shape is never called invisible.

use glam::DVec3;

use super::{Camera, FilmSize, Fov};

/// The view frustum: four planes through the camera and the edges of the picture, with the visible side inwards.
#[derive(Clone, Debug)]
pub(super) struct Frustum {
    origin: DVec3,
    /// Unit normals that point inwards; empty with a lens, which sees beyond the edges.
    planes: Vec<DVec3>,
}

/// Relative distance from a plane that counts as inside: camera rays are rounded to `f32`.
const MARGIN: f64 = 1e-5;

impl Frustum {
    pub fn new(camera: &Camera, film: FilmSize) -> Self {
        let forward = (camera.target - camera.origin).normalize();
        let right = forward.cross(camera.up).normalize();
        let up = right.cross(forward);
        let aspect = f64::from(film.width) / f64::from(film.height);
        let half = |degrees: f64| (degrees.to_radians() / 2.0).tan();
        let (x, y) = match camera.fov {
            Fov::X(degrees) => (half(degrees), half(degrees) / aspect),
            Fov::Y(degrees) => (half(degrees) * aspect, half(degrees)),
        };
        let plane = |side: DVec3, tangent: f64| (tangent * forward + side).normalize();
        let planes = match camera.lens {
            Some(_) => Vec::new(),
            None => vec![plane(right, x), plane(-right, x), plane(up, y), plane(-up, y)],
        };
        Self {
            origin: camera.origin,
            planes,
        }
    }

    /// Whether a camera ray may hit a sphere.
    pub fn may_see_ball(&self, center: DVec3, radius: f64) -> bool {
        let away = center - self.origin;
        let reach = radius + MARGIN * (away.length() + radius);
        self.planes.iter().all(|plane| plane.dot(away) >= -reach)
    }

    /// Whether a camera ray may hit the convex hull of points.
    pub fn may_see_points(&self, points: &[DVec3]) -> bool {
        self.planes.iter().all(|plane| {
            points.iter().any(|&point| {
                let away = point - self.origin;
                plane.dot(away) >= -MARGIN * away.length()
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_in_the_picture_may_be_seen() {
        let camera = Camera {
            origin: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(1.0, 2.0, 0.0),
            up: DVec3::Y,
            fov: Fov::X(90.0),
            lens: None,
        };
        let frustum = Frustum::new(&camera, FilmSize { width: 4, height: 2 });
        let ball = |x, y, z, r| frustum.may_see_ball(camera.origin + DVec3::new(x, y, z), r);
        assert!(ball(0.0, 0.0, -5.0, 0.1));
        assert!(!ball(0.0, 0.0, 5.0, 0.1), "behind");
        // At distance 5 the right edge is 5 away and its plane is at 45 degrees: a sphere beyond it needs a radius of 1 / sqrt
        // 2.
        assert!(!ball(6.0, 0.0, -5.0, 0.70) && ball(6.0, 0.0, -5.0, 0.72));
        // The upper edge is half as far away.
        assert!(ball(0.0, 2.4, -5.0, 0.01) && !ball(0.0, 2.6, -5.0, 0.01));
        assert!(ball(0.0, 0.0, 5.0, 6.0), "around the camera");
        let at = |z: f64| [[-9.0, 0.0], [9.0, 0.0], [0.0, 9.0]].map(|[x, y]| camera.origin + DVec3::new(x, y, z));
        assert!(
            frustum.may_see_points(&at(-1.0)),
            "no corner is inside, and yet it fills the picture"
        );
        assert!(!frustum.may_see_points(&at(1.0)));
    }
}
