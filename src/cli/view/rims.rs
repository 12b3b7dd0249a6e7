//! Which pixels count in a race: not those at the rims of lights. There a sample is a light's whole radiance or nothing, by every
//! estimator. One rim of a bright light in a dark pixel, which the reference missed, would be greater than all other errors together.

use glam::DVec3;

use octolux::pipeline::Prepared;
use octolux::scene::{Camera, FilmSize, Fov, Light, LightClass, Scene};

/// The radius in pixels from which a disk covers a pixel, wherever its centre is: the diagonal of a pixel. The rays of
/// [`Prepared::rims`], one a pixel, may miss a smaller one.
const COVERS: f64 = std::f64::consts::SQRT_2;

/// For each pixel, row by row, whether its error counts.
pub fn counted(scene: &Scene, prepared: &Prepared) -> Vec<bool> {
    let film = prepared.settings().film;
    let mut counts: Vec<bool> = prepared.rims().into_iter().map(|rim| !rim).collect();
    for [left, top, right, bottom] in small_lights(scene, film) {
        for row in top..bottom {
            let row = row as usize * film.width as usize;
            counts[row + left as usize..row + right as usize].fill(false);
        }
    }
    counts
}

/// The pixels of the lights that are too small for a ray a pixel, with a border of one pixel: left, top, right, bottom; the last two are
/// not included. Of a camera with a lens these are the lights in focus. A light that something hides is among them.
fn small_lights(scene: &Scene, film: FilmSize) -> Vec<[u32; 4]> {
    let view = Projection::new(scene.camera(), film);
    let origin = scene.camera().origin;
    let spheres = scene.spheres().iter().filter(|sphere| sphere.surface.emits());
    let spheres = spheres.filter_map(|sphere| view.disk(sphere.center - origin, sphere.radius));
    let meshes = scene.meshes().iter().filter(|mesh| mesh.surface.emits());
    let meshes = meshes.filter_map(|mesh| {
        let used = || {
            mesh.triangles
                .iter()
                .flatten()
                .map(|&corner| mesh.vertices[corner as usize])
        };
        let low = used().reduce(DVec3::min)?;
        let high = used().reduce(DVec3::max)?;
        view.disk(0.5 * (low + high) - origin, 0.5 * (high - low).length())
    });
    let suns = scene
        .lights()
        .iter()
        .filter(|light| light.emits() && light.class() == LightClass::Disk);
    let suns = suns.filter_map(|light| match light {
        Light::Directional {
            direction,
            angular_radius,
            ..
        } => view.disk(-direction.normalize(), angular_radius.to_radians().tan()),
        _ => None,
    });
    spheres
        .chain(meshes)
        .chain(suns)
        .filter_map(|disk| disk.small(film))
        .collect()
}

/// Maps points relative to the pinhole to pixels.
struct Projection {
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    middle: [f64; 2],
    /// Pixels of something as long as it is distant.
    scale: f64,
}

/// What a sphere covers of the picture, in pixels.
#[derive(Clone, Copy, Debug)]
struct Disk {
    center: [f64; 2],
    radius: f64,
}

impl Projection {
    fn new(camera: &Camera, film: FilmSize) -> Self {
        let forward = (camera.target - camera.origin).normalize();
        let right = forward.cross(camera.up).normalize();
        let middle = [0.5 * f64::from(film.width), 0.5 * f64::from(film.height)];
        let scale = match camera.fov {
            Fov::X(degrees) => middle[0] / (0.5 * degrees.to_radians()).tan(),
            Fov::Y(degrees) => middle[1] / (0.5 * degrees.to_radians()).tan(),
        };
        Self {
            forward,
            right,
            up: right.cross(forward),
            middle,
            scale,
        }
    }

    /// The disk of a sphere in front of the pinhole. Towards the border of the picture a sphere covers an ellipse, longer than this by the
    /// inverse cosine of the angle from the axis: the border of a pixel is for that.
    fn disk(&self, center: DVec3, radius: f64) -> Option<Disk> {
        let depth = center.dot(self.forward);
        (depth > radius).then(|| Disk {
            center: [
                self.middle[0] + self.scale * center.dot(self.right) / depth,
                self.middle[1] - self.scale * center.dot(self.up) / depth,
            ],
            radius: self.scale * radius / depth,
        })
    }
}

impl Disk {
    /// The pixels of a small disk and one more on each side, as far as they are in the picture.
    fn small(self, FilmSize { width, height }: FilmSize) -> Option<[u32; 4]> {
        let side = |at: f64, length: u32| {
            let length = f64::from(length);
            let first = (at - self.radius).floor() - 1.0;
            let last = (at + self.radius).floor() + 2.0;
            [first.clamp(0.0, length) as u32, last.clamp(0.0, length) as u32]
        };
        let ([left, right], [top, bottom]) = (side(self.center[0], width), side(self.center[1], height));
        (self.radius < COVERS && left < right && top < bottom).then_some([left, top, right, bottom])
    }
}

#[cfg(test)]
mod tests {
    use octolux::pipeline::Settings;

    use super::*;

    /// A camera at (1, 2, 9) that sees 32 x 24 pixels, 8 a unit at the distance 8, and lights there: at (1, 2), in the middle; one and a half
    /// units to the right and one up.
    fn counts(lights: &str) -> Vec<bool> {
        let camera = "[camera]\norigin = [1, 2, 9]\ntarget = [1, 2, 0]\nup = [0, 1, 0]\nfov_x = 28.072486935852957\n";
        let text = format!("{camera}[film]\nwidth = 32\nheight = 24\n{lights}");
        let scene = Scene::parse(&text, "a.toml".as_ref()).unwrap();
        let settings = Settings {
            film: scene.film(),
            ..Settings::default()
        };
        counted(&scene, &Prepared::new(&scene, settings).unwrap())
    }

    /// The corners of the box of pixels that do not count, as left, top, right and bottom, all included.
    fn out(counts: &[bool]) -> [usize; 4] {
        let all = || (0..counts.len()).filter(|&at| !counts[at]).map(|at| [at % 32, at / 32]);
        let (columns, rows) = (|| all().map(|at| at[0]), || all().map(|at| at[1]));
        [columns().min(), rows().min(), columns().max(), rows().max()].map(Option::unwrap)
    }

    fn sphere(x: f64, y: f64, radius: f64) -> String {
        format!("[[spheres]]\ncenter = [{x}, {y}, 1]\nradius = {radius}\nemission = [9, 9, 9]\n")
    }

    #[test]
    fn a_light_smaller_than_a_pixel_does_not_count_wherever_it_is_in_its_pixel() {
        for step in 0..8 {
            let x = 2.5 + (f64::from(step) + 0.5) / 64.0;
            // 12 pixels and some eighths right of the middle, 7.5 above it.
            let counts = counts(&sphere(x, 3.0 - 1.0 / 16.0, 1e-4));
            assert_eq!(out(&counts), [27, 3, 29, 5], "at {x}");
            assert_eq!(counts.iter().filter(|counts| !**counts).count(), 9);
        }
    }

    #[test]
    fn of_a_large_light_the_rim_does_not_count_and_the_rest_does() {
        // A radius of 8 pixels about the middle: (16, 12).
        let counts = counts(&sphere(1.0, 2.0, 1.0));
        let at = |x: usize, y: usize| counts[32 * y + x];
        assert!(at(16, 12) && at(0, 0) && at(16, 8) && at(31, 12));
        for (x, y) in [(7, 12), (24, 12), (16, 3), (16, 20)] {
            assert!(!at(x, y), "{x}, {y}");
        }
    }

    #[test]
    fn small_meshes_and_suns_are_lights_too() {
        let triangle = "vertices = [[1, 2, 1], [1.01, 2, 1], [1, 2.01, 1], [50, 0, 0]]\nfaces = [[0, 1, 2]]";
        let mesh = format!("[[meshes]]\nemission = [9, 9, 9]\n{triangle}\n");
        assert_eq!(out(&counts(&mesh)), [14, 10, 17, 13]);
        let sun = |radius: f64| {
            format!(
                "[[lights]]\nkind = \"directional\"\ndirection = [0, 0, 1]\nirradiance = [1, 1, 1]\nangular_radius = {radius}\n"
            )
        };
        assert_eq!(out(&counts(&sun(0.1))), [14, 10, 17, 13]);
    }

    #[test]
    fn what_is_behind_the_camera_or_beside_the_picture_takes_no_pixel() {
        let behind = "[[spheres]]\ncenter = [1, 2, 17]\nradius = 0.001\nemission = [9, 9, 9]\n";
        for light in [behind, &sphere(40.0, 2.0, 0.001)] {
            assert!(counts(light).iter().all(|&counts| counts));
        }
    }
}
