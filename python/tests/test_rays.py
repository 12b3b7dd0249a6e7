"""Rays in arrays: what they meet is known from formulas."""

import numpy as np
import pytest
from conftest import QUAD, REPOSITORY

import octolux as ol


def random_rays(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Give rays from a box around the ball, in all directions."""
    rng = np.random.default_rng(seed)
    origins = rng.uniform(-6, 6, (n, 3))
    directions = rng.normal(size=(n, 3))
    return origins.astype(np.float32), directions.astype(np.float32)


def test_a_sphere_is_met_where_the_formula_says(ball: ol.Scene) -> None:
    """Against the quadratic in f64: t to 1e-4, and who is met, away from the silhouettes."""
    o, d = random_rays(20000, 1)
    hits = ball.intersect(o, d)
    a, nearest, who, sure = (
        (d.astype(float) ** 2).sum(1),
        np.full(len(o), np.inf),
        np.full(len(o), -1),
        np.ones(len(o), bool),
    )
    for number, (c, r) in enumerate([((0, 0, 0), 1.0), ((0, 4, 1), 0.5)]):
        oc = o.astype(float) - c
        b = (oc * d).sum(1)
        root = b * b - a * ((oc * oc).sum(1) - r * r)
        sure &= np.abs(root) > 1e-3 * a
        for sign in (-1, 1):
            t = (-b + sign * np.sqrt(np.maximum(root, 0))) / a
            better = (root > 0) & (t > 1e-3) & (t < nearest)
            nearest, who = np.where(better, t, nearest), np.where(better, number, who)
    assert np.array_equal(hits.object[sure], who[sure])
    met = sure & (who >= 0)
    assert met.sum() > 300
    np.testing.assert_allclose(hits.t[met], nearest[met], rtol=1e-4)
    assert np.all((hits.normal[met] * d[met]).sum(1) < 0)
    assert np.array_equal(ball.occluded(o, d), hits.hit)
    assert np.array_equal(hits.Le[met], np.array([[0, 0, 0], [10, 9, 8]], np.float32)[who[met]])
    np.testing.assert_array_equal(
        hits[met].brdf_params[who[met] == 0], np.float32([(0.5, 0.6, 0.7, 1)] * (who[met] == 0).sum())
    )


def test_a_triangle_has_its_coordinates() -> None:
    """The point is that of its barycentric coordinates, and the light is that of its mesh."""
    scene = ol.Scene()
    scene.set_camera((0, 0, 5), (0, 0, 0), fov_y=50)
    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], float)
    scene.add_geometry(ol.Mesh(corners, QUAD, Le=(1, 2, 3)))
    o = np.random.default_rng(2).uniform(-0.99, 0.99, (1000, 3)) + (0, 0, 3)
    hits = scene.intersect(o, (0, 0, -2))
    assert hits.hit.all()
    np.testing.assert_allclose(hits.t, o[:, 2] / 2, rtol=1e-5)
    a, b, c = (corners[np.array(QUAD)[hits.primitive][:, k]] for k in range(3))
    u, v = hits.uv[:, :1], hits.uv[:, 1:]
    np.testing.assert_allclose(a + u * (b - a) + v * (c - a), hits.point, atol=1e-5)
    (light,) = scene.lights
    assert light.object == 0 and light.faces.shape == (2, 3)


def test_rays_end(ball: ol.Scene) -> None:
    """At tmax lengths of the direction, which may be one number for all."""
    o, d = np.float32([[0, 0, 5], [0, 0, 5]]), np.float32([[0, 0, -1], [0, 0, -2]])
    assert ball.occluded(o, d, 3.9).tolist() == [False, True]
    assert ball.occluded(o, d, [4.1, 1.9]).tolist() == [True, False]
    assert ball.intersect(o, d, 3.9).object.tolist() == [-1, 0]


def test_layouts_and_types_say_the_same(ball: ol.Scene) -> None:
    """Rows, columns, slices, f64, big-endian and lists."""
    o, d = random_rays(999, 3)
    plain = ball.intersect(o, d)
    wide = np.zeros((999, 6), np.float32)
    wide[:, ::2] = d
    for directions in (np.asfortranarray(d), wide[:, ::2], d.astype(float), d.astype(">f4"), d.tolist()):
        hits = ball.intersect(o, directions, coherent=True)
        assert np.array_equal(hits.t, plain.t) and np.array_equal(hits.normal, plain.normal)
    readonly = d.copy()
    readonly.flags.writeable = False
    assert np.array_equal(ball.intersect(o, readonly).t, plain.t)


def test_no_rays_are_no_mistake(ball: ol.Scene) -> None:
    """An empty question has an empty answer."""
    hits = ball.intersect(np.zeros((0, 3)), np.zeros((0, 3)))
    assert len(hits) == 0 and hits.point.shape == (0, 3) and hits.Le.shape == (0, 3)
    assert ball.occluded([], []).shape == (0,)


def test_rays_that_are_none_meet_nothing(ball: ol.Scene) -> None:
    """Numbers that are not finite, and no direction."""
    d = np.float32([[np.nan, 0, -1], [0, 0, 0], [0, np.inf, -1], [0, 0, -1]])
    assert ball.intersect((0, 0, 5), d).hit.tolist() == [False, False, False, True]


def test_eye_rays_are_the_camera() -> None:
    """Means over jittered rays of what they meet are the picture that is rendered, where only lights are seen."""
    scene = ol.load(REPOSITORY / "scenes/tests/emitter-seen.toml")
    size, rng = (16, 12), np.random.default_rng(4)
    assert all(rays.flags.c_contiguous for rays in scene.eye_rays(size)), "they are taken as they lie"
    mean = np.mean([scene.intersect(*scene.eye_rays(size, rng)).Le for _ in range(400)], axis=0).reshape(12, 16, 3)
    image = ol.render(scene, size=size, spp=1024)
    # 400 draws of a pixel that is half covered are off by 1/40; 6 of these.
    assert np.abs(mean - image).max() < 6 / 40 * image.max()
    assert image.max() > 0


def test_shuffled_rays_of_a_camera_have_the_answers_of_those_in_order() -> None:
    """Neighbours do not change the bits of an answer, also among rays that end or are none."""
    n = 513
    x, z = np.meshgrid(np.linspace(-4, 4, n), np.linspace(-4, 4, n))
    y = 0.3 * np.sin(3 * x) * np.cos(4 * z)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = [np.stack([corner, corner + 1, corner + n], 1), np.stack([corner + 1, corner + n + 1, corner + n], 1)]
    scene = ol.Scene(size=(400, 300))
    scene.set_camera((0, 3, 6), (0, 0, 0), fov_x=60)
    scene.add_geometry(ol.Mesh(np.stack([x, y, z], -1).reshape(-1, 3), np.concatenate(faces), brdf_params=(1, 1, 1, 1)))
    scene.add_geometry(ol.Sphere((0, 9, 0), 1, Le=(1, 1, 1)))
    origins, directions = scene.eye_rays()
    rng = np.random.default_rng(4)
    directions[rng.integers(len(directions), size=50)] = np.nan
    directions[rng.integers(len(directions), size=50)] = 0
    ends = np.where(rng.random(len(directions)) < 0.5, np.inf, 7).astype(np.float32)
    for tmax in (None, ends):
        ordered = scene.intersect(origins, directions, tmax, coherent=True)
        assert 0.3 < ordered.hit.mean() < 0.9
        at = rng.permutation(len(origins))
        shuffled = scene.intersect(origins[at], directions[at], None if tmax is None else tmax[at])
        for name in ("t", "normal", "uv", "object", "primitive"):
            one, other = getattr(ordered, name)[at], getattr(shuffled, name)
            assert one.tobytes() == other.tobytes(), name


def test_answers_that_someone_holds_are_not_written_again(ball: ol.Scene) -> None:
    """A scene keeps the room of answers that nobody holds; one array of them is enough to hold it."""
    o, d = ball.eye_rays((64, 48))
    t = ball.intersect(o, d).t
    before = t.copy()
    assert not np.shares_memory(t, ball.intersect(o + 0.5, d).t)
    assert t.tobytes() == before.tobytes() and np.isfinite(t).any()
    chosen = ball.intersect(o, d)[3:9]
    assert not np.shares_memory(chosen.normal, ball.intersect(o + 0.5, d).normal)
    del t, chosen
    place = ball.intersect(o, d).t.ctypes.data
    assert place == ball.intersect(o, d).t.ctypes.data
