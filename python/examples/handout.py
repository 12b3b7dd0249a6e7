"""The three deliverables of the hand-out in numpy, as a student would write them, and their checks.

ECSE 446/546, assignment 3: light importance sampling of spheres, BRDF importance sampling, and multiple importance
sampling by the average of both densities. Each estimator is a function of points that are seen; `octolux` finds what
rays meet.

    python handout.py [SCENE.toml]
"""

import sys

import numpy as np

import octolux as ol

EPSILON = 1e-4
"""Shadow rays start so far above their surface."""

QUAD = [(0, 1, 2), (0, 2, 3)]
"""A quadrilateral's triangles."""


def light_sampling(scene, hits, wo, rng):
    """Deliverable 1: a direction within the cone of each light, for every light."""
    total = np.zeros((len(hits), 3))
    for light in scene.lights:
        axis, cos_max = cone(hits, light)
        wi = about(axis, 1 - rng.random(len(hits)) * (1 - cos_max), rng)
        total += contribution(scene, hits, wo, wi, light, light_pdf(axis, cos_max, wi))
    return total


def brdf_sampling(scene, hits, wo, rng):
    """Deliverable 2: a direction of the BRDF's own lobe, for every light."""
    total = np.zeros((len(hits), 3))
    for light in scene.lights:
        wi = about(lobe_axis(hits, wo), rng.random(len(hits)) ** (1 / (alpha(hits) + 1)), rng)
        total += contribution(scene, hits, wo, wi, light, brdf_pdf(hits, wo, wi))
    return total


def mis_sampling(scene, hits, wo, rng):
    """Deliverable 3: heads one, tails the other, divided by the average of both densities."""
    total = np.zeros((len(hits), 3))
    for light in scene.lights:
        axis, cos_max = cone(hits, light)
        xi = rng.random(len(hits))
        by_light = about(axis, 1 - xi * (1 - cos_max), rng)
        by_brdf = about(lobe_axis(hits, wo), xi ** (1 / (alpha(hits) + 1)), rng)
        heads = rng.random(len(hits)) < 0.5
        wi = np.where(heads[:, None], by_light, by_brdf)
        pdf = light_pdf(axis, cos_max, wi) / 2 + brdf_pdf(hits, wo, wi) / 2
        total += contribution(scene, hits, wo, wi, light, pdf)
    return total


def contribution(scene, hits, wo, wi, light, pdf):
    """Le V f max(0, n . wi) / pdf, (n, 3), where the direction meets this light first."""
    cos = np.maximum(dot(hits.normal, wi), 0)
    scale = np.divide(cos, pdf, out=np.zeros(len(hits)), where=pdf > 0)
    seen = scene.intersect(hits.point + EPSILON * hits.normal, wi).object == light.object
    return brdf(hits, wo, wi) * (scale * seen)[:, None] * light.Le


def alpha(hits):
    """Phong's exponent, 1 on diffuse surfaces."""
    return hits.brdf_params[:, 3].astype(np.float64)


def brdf(hits, wo, wi):
    """f_r, (n, 3): both models are rho times a lobe, and the diffuse one is constant."""
    a = alpha(hits)
    phong = (a + 1) / (2 * np.pi) * np.maximum(dot(mirror(hits, wo), wi), 0) ** a
    return hits.brdf_params[:, :3] * np.where(a > 1, phong, 1 / np.pi)[:, None]


def mirror(hits, wo):
    """w_r = 2 (n . wo) n - wo."""
    return 2 * dot(hits.normal, wo)[:, None] * hits.normal - wo


def lobe_axis(hits, wo):
    """The axis of the BRDF's lobe: the normal, or with Phong the mirror direction."""
    return np.where((alpha(hits) > 1)[:, None], mirror(hits, wo), hits.normal)


def brdf_pdf(hits, wo, wi):
    """The density of directions that `brdf_sampling` draws, (n,)."""
    return (alpha(hits) + 1) / (2 * np.pi) * np.maximum(dot(lobe_axis(hits, wo), wi), 0) ** alpha(hits)


def cone(hits, light):
    """The axis (n, 3) of the cone that a light subtends, and the cosine (n,) of its half-angle."""
    to = light.center - hits.point
    distance = np.linalg.norm(to, axis=1)
    sin2 = np.minimum(light.radius / distance, 1) ** 2
    return to / distance[:, None], np.sqrt(1 - sin2)


def light_pdf(axis, cos_max, wi):
    """The density of directions that `light_sampling` draws, (n,)."""
    return (dot(axis, wi) >= cos_max - 1e-9) / (2 * np.pi * (1 - cos_max))


def about(axis, cos, rng):
    """Directions (n, 3) of this cosine with an axis, turned about it at random."""
    helper = np.where(np.abs(axis[:, [0]]) > 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    first = np.cross(helper, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(axis, first)
    sin, phi = np.sqrt(np.maximum(1 - cos**2, 0)), 2 * np.pi * rng.random(len(cos))
    return (sin * np.cos(phi))[:, None] * first + (sin * np.sin(phi))[:, None] * second + cos[:, None] * axis


def dot(a, b):
    """Products of rows."""
    return np.einsum("ij,ij->i", a, b, dtype=np.float64)


def small_scene():
    """Two sphere lights, a floor, a plate that shines, a wall whose normal is -z, a screen with a light behind it."""
    scene = ol.Scene(size=(96, 64))
    scene.set_camera(eye=(0, 2.2, -6), at=(0, 0.7, 0), up=(0, 1, 0), fov_x=42)
    floor = [(-6, 0, -4), (6, 0, -4), (6, 0, 3), (-6, 0, 3)]
    wall = [(-6, 0, 3), (6, 0, 3), (6, 6, 3), (-6, 6, 3)]
    plate = [(-1.6, 0.05, -1.4), (1.6, 0.05, -1.4), (1.6, 0.8, -0.1), (-1.6, 0.8, -0.1)]
    screen = [(1.2, 0, -0.8), (2.6, 0, -0.8), (2.6, 1.3, -0.8), (1.2, 1.3, -0.8)]
    matt = {"floor": (floor, 0.5), "wall": (wall, 0.4), "screen": (screen, 0.7)}
    for corners, rho in matt.values():
        scene.add_geometry(ol.Mesh(corners, QUAD, brdf_params=(rho, rho, 0.45, 1)))
    scene.add_geometry(ol.Mesh(plate, QUAD, brdf_params=(0.6, 0.6, 0.62, 12)))
    scene.add_geometry(ol.Sphere((-2.2, 0.8, -0.4), 0.8, brdf_params=(0.7, 0.35, 0.2, 1)))
    scene.add_geometry(ol.Sphere((-1.5, 3.2, -1), 0.5, Le=(14, 13, 11)))
    scene.add_geometry(ol.Sphere((1.8, 2.2, 1), 0.8, Le=(3, 4, 6)))
    return scene


def main():
    """Check all three."""
    scene = ol.load(sys.argv[1]) if len(sys.argv) > 1 else small_scene()
    wrong = 0
    for estimator in (light_sampling, brdf_sampling, mis_sampling):
        report = ol.check(estimator, scene, efficiency=True)
        print(f"{estimator.__name__}: {report}\n")
        wrong += not report
    return wrong


if __name__ == "__main__":
    sys.exit(main())
