//! A scene in the oracle's form: indexed shapes, their surfaces, and the hierarchy over them.

use glam::{DVec2, DVec3};

use super::brdf::Shading;
use super::bvh::Bvh;
use super::emitter::Emitter;
use super::geometry::{Bounds, Meeting, Ray, Shape};
use super::pick::Picks;
use super::shapeless::ShapelessLight;
use super::sky::Sky;
use crate::scene::{Bsdf, MaterialId, Scene, Surface, Wrap};

/// Shapes, their surfaces, and the emitters.
#[derive(Debug)]
pub struct World<'s> {
    scene: &'s Scene,
    shapes: Vec<Shape>,
    bodies: Vec<Body>,
    /// The first shape of each body, ascending.
    starts: Vec<u32>,
    emitters: Vec<Emitter>,
    sky: Option<Sky<'s>>,
    shapeless_lights: Vec<ShapelessLight>,
    picks: Option<Picks>,
    tree: Bvh,
}

/// A sphere or a mesh of the scene.
#[derive(Clone, Copy, Debug)]
struct Body {
    finish: Finish,
    /// Index into [`Scene::meshes`].
    mesh: Option<usize>,
}

#[derive(Clone, Copy, Debug)]
enum Finish {
    Reflects { material: MaterialId },
    Emits { emitter: usize },
}

/// What a ray hits.
#[derive(Debug)]
pub enum Sight<'w> {
    /// The back of a one-sided surface: no light comes from there.
    Back,
    /// A surface that reflects.
    Reflector {
        /// The surface there.
        shading: Shading,
        /// The point, offset from the surface to the viewer's side: shadow rays start here.
        point: DVec3,
    },
    /// A surface that emits.
    Emitter {
        /// Its index.
        emitter: usize,
        /// The shape of it that was hit.
        shape: &'w Shape,
        /// The distance.
        distance: f64,
    },
}

impl<'s> World<'s> {
    /// Assigns indices to the shapes and builds the hierarchy.
    pub fn new(scene: &'s Scene) -> Self {
        let spheres = scene.spheres().iter().map(|sphere| {
            let shape = Shape::Sphere {
                center: sphere.center,
                radius: sphere.radius,
            };
            (vec![shape], sphere.surface, None)
        });
        let meshes = scene.meshes().iter().enumerate().map(|(number, mesh)| {
            let triangle = |corners: &[u32; 3]| Shape::Triangle(corners.map(|index| mesh.vertices[index as usize]));
            (
                mesh.triangles.iter().map(triangle).collect(),
                mesh.surface,
                Some(number),
            )
        });
        let (mut shapes, mut bodies, mut starts, mut emitters) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (own, surface, mesh) in spheres.chain(meshes) {
            let first = shapes.len() as u32;
            let finish = match surface {
                Surface::Material(material) => Finish::Reflects { material },
                Surface::Emission(le) => {
                    emitters.push(Emitter::new(le, first, &own));
                    Finish::Emits {
                        emitter: emitters.len() - 1,
                    }
                }
            };
            starts.push(first);
            bodies.push(Body { finish, mesh });
            shapes.extend(own);
        }
        let tree = Bvh::new(&shapes);
        Self {
            picks: None,
            scene,
            shapes,
            bodies,
            starts,
            emitters,
            sky: scene.environment().map(Sky::new),
            shapeless_lights: scene.lights().iter().map(ShapelessLight::new).collect(),
            tree,
        }
    }

    /// Every emitter.
    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    /// The environment, if it emits.
    pub fn sky(&self) -> Option<&Sky<'s>> {
        self.sky.as_ref()
    }

    /// Lights without shape.
    pub fn shapeless_lights(&self) -> &[ShapelessLight] {
        &self.shapeless_lights
    }

    /// The same scene with samples of some lights instead of all, if there are many. A light that is dim and near is picked seldom then, and
    /// standard errors of few samples may miss it.
    pub fn picking(mut self) -> Self {
        self.picks = Picks::new(&self.emitters, &self.shapeless_lights);
        self
    }

    /// The choice of lights, if each sample has some of many.
    pub fn picks(&self) -> Option<&Picks> {
        self.picks.as_ref()
    }

    /// The number of the first light without shape, counted behind emitters and the environment.
    pub fn first_shapeless(&self) -> usize {
        self.emitters.len() + usize::from(self.sky.is_some())
    }

    /// The radiance from beyond the shapes.
    pub fn beyond(&self, direction: DVec3) -> DVec3 {
        let of_sky = self.sky.as_ref().map_or(DVec3::ZERO, |sky| sky.radiance(direction));
        let of_shapeless = self.shapeless_lights.iter().map(|light| match light {
            ShapelessLight::Disk(disk) => disk.radiance(direction),
            ShapelessLight::Delta(_) => DVec3::ZERO,
        });
        of_sky + of_shapeless.sum::<DVec3>()
    }

    /// All shapes, by index.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The first hit along the ray.
    pub fn look(&self, ray: &Ray) -> Option<Sight<'_>> {
        let (index, meeting) = self.tree.nearest(&self.shapes, ray, f64::INFINITY, None)?;
        let shape = &self.shapes[index as usize];
        let body = self.body(index);
        Some(match self.bodies[body].finish {
            Finish::Emits { emitter } => Sight::Emitter {
                emitter,
                shape,
                distance: meeting.distance,
            },
            Finish::Reflects { material } => {
                let wo = -ray.direction;
                let surface_point = shape.point(ray, &meeting);
                let outward = shape.normal(surface_point);
                if self.scene.material(material).one_sided && outward.dot(wo) < 0.0 {
                    return Some(Sight::Back);
                }
                let ng = facing(outward, wo);
                let n = facing(self.smooth_normal(body, index, &meeting).unwrap_or(ng), ng);
                let tint = self.tint(material, body, index, &meeting, outward);
                let bsdf = match self.scene.material(material).bsdf {
                    Bsdf::Diffuse { rho } => Bsdf::Diffuse { rho: rho * tint },
                    Bsdf::Phong { rho, alpha } => Bsdf::Phong { rho: rho * tint, alpha },
                    Bsdf::Blend { rho, specular, alpha } => Bsdf::Blend {
                        rho: rho * tint,
                        specular,
                        alpha,
                    },
                    Bsdf::Ggx {
                        base,
                        metallic,
                        roughness,
                    } => Bsdf::Ggx {
                        base: base * tint,
                        metallic,
                        roughness,
                    },
                    metal @ Bsdf::Conductor { .. } => metal,
                };
                let lift = self.lift(body, index, &meeting, surface_point, n);
                Sight::Reflector {
                    shading: Shading {
                        bsdf,
                        wo,
                        n,
                        ng: if lift.is_some() { n } else { ng },
                        tint,
                    },
                    point: surface_point + shape.offset() * ng + lift.unwrap_or_default(),
                }
            }
        })
    }

    /// The shape that a ray hits first.
    pub fn nearest(&self, ray: &Ray) -> Option<(u32, Meeting)> {
        self.tree.nearest(&self.shapes, ray, f64::INFINITY, None)
    }

    /// Calls `visit` with every shape whose box, grown by `margin`, the ray enters before `far` and before the last distance
    /// that `visit` returned.
    pub fn near(&self, ray: &Ray, far: f64, margin: &dyn Fn(&Bounds) -> f64, visit: &mut dyn FnMut(u32) -> f64) {
        self.tree.near(ray, far, margin, visit);
    }

    /// Whether two bodies have the same surface at every point.
    pub fn same_surface(&self, a: usize, b: usize) -> bool {
        let plain = |body: &Body| {
            let mesh = body.mesh.map(|mesh| &self.scene.meshes()[mesh]);
            mesh.is_some_and(|mesh| mesh.normals.is_none())
        };
        match (self.bodies[a].finish, self.bodies[b].finish) {
            (Finish::Reflects { material }, Finish::Reflects { material: other }) => {
                let both = [a, b].iter().all(|&body| plain(&self.bodies[body]));
                let kind = self.scene.material(material);
                both && material == other && kind.texture.is_none() && !kind.one_sided
            }
            _ => false,
        }
    }

    /// Whether any shape is hit nearer than `far`.
    pub fn nearer(&self, ray: &Ray, far: f64) -> bool {
        self.tree.nearest(&self.shapes, ray, far, None).is_some()
    }

    /// Whether any shape except `except` is hit nearer than `far`.
    pub fn blocked(&self, ray: &Ray, far: f64, except: u32) -> bool {
        self.tree.nearest(&self.shapes, ray, far, Some(except)).is_some()
    }

    /// The index of the sphere or mesh that a shape belongs to: spheres first, then meshes.
    pub fn body(&self, index: u32) -> usize {
        self.starts.partition_point(|&start| start <= index) - 1
    }

    /// The texture value of a mesh or sphere: the mean of the texels around the point, weighted by their overlap with a unit
    /// square around it. 1 without a texture.
    fn tint(&self, material: MaterialId, body: usize, index: u32, meeting: &Meeting, outward: DVec3) -> DVec3 {
        let Some(texture) = &self.scene.material(material).texture else {
            return DVec3::ONE;
        };
        let (uv, wraps) = match self.bodies[body].mesh.map(|mesh| &self.scene.meshes()[mesh]) {
            Some(mesh) => {
                let Some(uvs) = &mesh.uvs else {
                    return DVec3::ONE;
                };
                let [a, b, c] = mesh.triangles[(index - self.starts[body]) as usize].map(|corner| uvs[corner as usize]);
                let [v, w] = meeting.weights;
                ((1.0 - v - w) * a + v * b + w * c, [texture.wrap; 2])
            }
            // Longitude from -z through -x, +z and +x; latitude from -y to +y, the top of the picture.
            None => {
                let east = outward.x.atan2(outward.z) / std::f64::consts::TAU;
                let north = outward.y.clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
                (DVec2::new(0.5 + east, 1.0 - north), [Wrap::Repeat, Wrap::Clamp])
            }
        };
        let (width, height) = (i64::from(texture.width), i64::from(texture.height));
        let (x, y) = (uv.x * width as f64, (1.0 - uv.y) * height as f64);
        let mut sum = DVec3::ZERO;
        for row in [(y - 0.5).floor(), (y - 0.5).floor() + 1.0] {
            for column in [(x - 0.5).floor(), (x - 0.5).floor() + 1.0] {
                let share = (1.0 - (x - column - 0.5).abs()) * (1.0 - (y - row - 0.5).abs());
                let inside = |at: f64, size: i64, wrap: Wrap| match wrap {
                    Wrap::Repeat => (at as i64).rem_euclid(size),
                    Wrap::Clamp => (at as i64).clamp(0, size - 1),
                };
                let at = inside(row, height, wraps[1]) * width + inside(column, width, wraps[0]);
                sum += share * DVec3::from_array(texture.texels.at(at as usize).map(f64::from));
            }
        }
        sum
    }

    /// The interpolated vertex normal of a smooth mesh; `None` for flat meshes, and where the normals cancel.
    fn smooth_normal(&self, body: usize, index: u32, meeting: &Meeting) -> Option<DVec3> {
        let mesh = &self.scene.meshes()[self.bodies[body].mesh?];
        let corners = mesh.triangles[(index - self.starts[body]) as usize];
        let normals = mesh.normals.as_ref()?;
        let [a, b, c] = corners.map(|corner| normals[corner as usize]);
        let [v, w] = meeting.weights;
        ((1.0 - v - w) * a + v * b + w * c).try_normalize()
    }

    /// The offset of the lit point from its triangle on a mesh with a smooth terminator: towards the planes through its corners
    /// perpendicular to their normals, by its depth below each, weighted like the normals.
    fn lift(&self, body: usize, index: u32, meeting: &Meeting, point: DVec3, n: DVec3) -> Option<DVec3> {
        let mesh = &self.scene.meshes()[self.bodies[body].mesh?];
        let smooth = self
            .smooth_normal(body, index, meeting)
            .filter(|_| mesh.smooth_terminator)?;
        let side = n.dot(smooth).signum();
        let corners = mesh.triangles[(index - self.starts[body]) as usize];
        let [v, w] = meeting.weights;
        let mut lift = DVec3::ZERO;
        for (corner, weight) in corners.into_iter().zip([1.0 - v - w, v, w]) {
            let normal = side * mesh.normals.as_ref()?[corner as usize];
            let height = (mesh.vertices[corner as usize] - point).dot(normal);
            if height > 0.0 {
                lift += weight * height * normal;
            }
        }
        Some(lift)
    }
}

/// `normal`, flipped to the side of `direction`.
fn facing(normal: DVec3, direction: DVec3) -> DVec3 {
    if normal.dot(direction) < 0.0 { -normal } else { normal }
}
