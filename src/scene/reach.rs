//! Which lights can reach visible surfaces, and what can occlude them: conservative tests based on the shapes alone.

use std::sync::Arc;

use glam::DVec3;

use super::sight::Frustum;
use super::{Mesh, Scene, Sphere, Surface};

/// Scenes with more spheres and meshes than this are not tested: every pair is examined for every light.
const MOST: usize = 256;

/// Relative distance below which a point counts as being on both sides of a plane.
const MARGIN: f64 = 1e-5;

/// A sphere or a mesh.
#[derive(Clone, Copy)]
enum Body<'s> {
    Sphere(&'s Sphere),
    Mesh(&'s Mesh),
}

impl Body<'_> {
    fn bounds(&self) -> [DVec3; 2] {
        match self {
            Body::Sphere(ball) => [ball.center - ball.radius, ball.center + ball.radius],
            Body::Mesh(mesh) => {
                let corners = mesh
                    .triangles
                    .iter()
                    .flatten()
                    .map(|&corner| mesh.vertices[corner as usize]);
                corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], v| {
                    [low.min(v), high.max(v)]
                })
            }
        }
    }

    /// The plane of a planar mesh, as a point and a unit normal.
    fn plane(&self) -> Option<(DVec3, DVec3)> {
        let Body::Mesh(mesh) = self else {
            return None;
        };
        let [a, b, c] = mesh.triangles[0].map(|corner| mesh.vertices[corner as usize]);
        let normal = (b - a).cross(c - a).normalize();
        let flat = |&corner: &u32| {
            let away = mesh.vertices[corner as usize] - a;
            normal.dot(away).abs() <= 1e-9 * away.length()
        };
        mesh.triangles.iter().flatten().all(flat).then_some((a, normal))
    }
}

impl Scene {
    fn bodies(&self) -> Vec<(&Surface, Body<'_>)> {
        let balls = self.spheres().iter().map(|s| (&s.surface, Body::Sphere(s)));
        balls
            .chain(self.meshes().iter().map(|m| (&m.surface, Body::Mesh(m))))
            .collect()
    }

    /// Emitting spheres.
    fn sphere_lights(&self) -> impl Iterator<Item = (usize, &Sphere)> {
        let emits = |s: &Sphere| matches!(s.surface, Surface::Emission(le) if le.max_element() > 0.0);
        self.spheres()
            .iter()
            .enumerate()
            .filter(move |(_, sphere)| emits(sphere))
    }

    /// Indices of emitting spheres that light nothing visible from the pinhole: every visible surface faces the
    /// camera with its unlit side.
    pub fn lights_below_every_horizon(&self) -> Vec<usize> {
        let frustum = Frustum::new(self.camera(), self.film());
        if self.camera().lens.is_some() || self.meshes().len() > MOST || self.spheres().len() > MOST {
            return Vec::new();
        }
        let origin = self.camera().origin;
        // A visible sphere has surface on every side, so every light may reach it.
        let ball_in_sight = self
            .spheres()
            .iter()
            .any(|ball| matches!(ball.surface, Surface::Material(_)) && frustum.may_see_ball(ball.center, ball.radius));
        let lit = |light: &Sphere, mesh: &Mesh| {
            mesh.triangles.iter().any(|corners| {
                let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize]);
                let normal = (b - a).cross(c - a).normalize();
                let [toward_camera, toward_light] = [origin, light.center].map(|point| normal.dot(point - a));
                let slack = light.radius + MARGIN * ((origin - a).length() + (light.center - a).length());
                toward_camera * toward_light >= 0.0
                    || toward_light.abs() <= slack
                    || toward_camera.abs() <= slack * MARGIN
            })
        };
        let reflects = |mesh: &&Arc<Mesh>| matches!(mesh.surface, Surface::Material(_)) && mesh.normals.is_none();
        let smooth = |mesh: &Arc<Mesh>| matches!(mesh.surface, Surface::Material(_)) && mesh.normals.is_some();
        if ball_in_sight || self.meshes().iter().any(smooth) {
            return Vec::new();
        }
        let unlit = |light: &Sphere| !self.meshes().iter().filter(reflects).any(|mesh| lit(light, mesh));
        self.sphere_lights()
            .filter(|(_, light)| unlit(light))
            .map(|(i, _)| i)
            .collect()
    }

    /// Indices of emitting spheres that nothing can occlude from any surface: for each surface, no other body intersects the
    /// bounding box of surface and light, or all of that box lies on one side of the body's plane. A surface that is neither a
    /// sphere nor planar could occlude the light itself.
    pub fn lights_with_nothing_between(&self) -> Vec<usize> {
        let bodies = self.bodies();
        if bodies.len() > MOST {
            return Vec::new();
        }
        let bounds: Vec<[DVec3; 2]> = bodies.iter().map(|(_, body)| body.bounds()).collect();
        let apart = |a: &[DVec3; 2], b: &[DVec3; 2]| a[1].cmplt(b[0]).any() || b[1].cmplt(a[0]).any();
        let one_side = |body: &Body<'_>, [low, high]: &[DVec3; 2]| {
            body.plane().is_some_and(|(point, normal)| {
                let corner = |i: usize| {
                    DVec3::from_array(std::array::from_fn(|k| if i >> k & 1 == 0 { low[k] } else { high[k] }))
                };
                let sides = (0..8).map(|i| normal.dot(corner(i) - point));
                let (least, most) = sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), x| (l.min(x), m.max(x)));
                // Bodies standing on the plane touch it without occluding anything.
                let slack = MARGIN * (*high - *low).length();
                least >= -slack || most <= slack
            })
        };
        let open = |number: usize| {
            (0..bodies.len())
                .filter(|&i| matches!(bodies[i].0, Surface::Material(_)))
                .all(|i| {
                    let convex = matches!(bodies[i].1, Body::Sphere(_)) || bodies[i].1.plane().is_some();
                    let hull = [bounds[i][0].min(bounds[number][0]), bounds[i][1].max(bounds[number][1])];
                    convex
                        && (0..bodies.len())
                            .filter(|&j| j != i && j != number)
                            .all(|j| apart(&bounds[j], &hull) || one_side(&bodies[j].1, &hull))
                })
        };
        self.sphere_lights()
            .filter(|&(number, _)| open(number))
            .map(|(i, _)| i)
            .collect()
    }
}
