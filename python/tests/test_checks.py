"""`check` passes the hand-out's three deliverables and finds twelve planted faults; reports depend on seeds alone."""

from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

import handout
import numpy as np
import pytest
from conftest import REPOSITORY

import octolux as ol

RIGHT = [handout.light_sampling, handout.brdf_sampling, handout.mis_sampling]
PASSES = 128


@pytest.fixture(scope="module")
def scene() -> ol.Scene:
    """Give the example's scene."""
    return handout.small_scene()


@pytest.mark.parametrize("estimator", RIGHT)
def test_the_deliverables_pass(scene: ol.Scene, estimator: Callable) -> None:
    """A right one fails once in a thousand seeds at most; this is one seed, which passes for good."""
    report = ol.check(estimator, scene, passes=PASSES, efficiency=True)
    assert report, str(report)
    assert report.sees < 0.1
    assert report.efficiency["yours"] > 0 and "unbiased as far as" in str(report)


def contribution(clamp: Callable, *, power: int = 1, along_wi: bool = False, seen: Callable | None = None) -> Callable:
    """Give the example's `contribution` with something else in one place."""

    def changed(scene, hits, wo, wi, light, pdf):
        cos = clamp(handout.dot(hits.normal, wi))
        scale = np.divide(cos, pdf, out=np.zeros(len(hits)), where=pdf > 0)
        origins = hits.point + handout.EPSILON * (wi if along_wi else hits.normal)
        unblocked = seen(scene, origins, wi) if seen else scene.intersect(origins, wi).object == light.object
        reflected = handout.brdf(hits, wo, wi) * hits.brdf_params[:, :3] ** (power - 1)
        return reflected * (scale * unblocked)[:, None] * light.Le

    return changed


def times(function: Callable, factor: float) -> Callable:
    """Give a function whose value is multiplied."""
    return lambda *given: factor * function(*given)


def narrow(hits, light):
    """Give a cone whose angle is one percent too small."""
    axis, cos = right["cone"](hits, light)
    return axis, np.cos(0.99 * np.arccos(cos))


def alpha_plus_two(hits, wo, wi):
    """Give Phong's lobe with another normalisation."""
    a = handout.alpha(hits)[:, None]
    return right["brdf"](hits, wo, wi) * np.where(a > 1, (a + 2) / (a + 1), 1)


def no_frame_at_minus_z(axis, cos, rng):
    """Give directions about z where the axis is -z."""
    return right["about"](np.where(axis[:, [2]] < -0.999, [[0.0, 0.0, 1.0]], axis), cos, rng)


class _Twice:
    """Random numbers of which each is given twice."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.kept = rng, None

    def random(self, n: int) -> np.ndarray:
        """Give new numbers, or those of the call before."""
        if self.kept is None:
            self.kept = self.rng.random(n)
            return self.kept
        kept, self.kept = self.kept, None
        return kept


def sum_of_densities(scene, hits, wo, rng):
    """Mix without halves."""
    with mock.patch.multiple(handout, light_pdf=times(right["light_pdf"], 2), brdf_pdf=times(right["brdf_pdf"], 2)):
        return handout.mis_sampling(scene, hits, wo, rng)


class _Fewer:
    """A scene whose last light is not listed."""

    def __init__(self, scene: ol.Scene) -> None:
        self.lights, self.intersect = scene.lights[:-1], scene.intersect


right = {name: getattr(handout, name) for name in ("cone", "brdf", "about", "light_pdf", "brdf_pdf", "contribution")}


def positive(x):
    """Clamp as it should be."""
    return np.maximum(x, 0)


# The fault that is planted, what of the example it replaces, in which estimator, and the names that may be the first
# hint. What has two names has one picture.
PLANTED: list[tuple[str, dict, Callable, set[str]]] = [
    (
        "missing cosine",
        {"contribution": contribution(lambda x: (x > 0) * 1.0)},
        handout.light_sampling,
        {"missing cosine"},
    ),
    ("doubled density", {"light_pdf": times(right["light_pdf"], 2)}, handout.light_sampling, {"doubled density"}),
    (
        "own shadow",
        {"contribution": contribution(positive, seen=lambda scene, o, wi: ~scene.occluded(o, wi))},
        handout.light_sampling,
        {"own shadow"},
    ),
    ("cone's angle off", {"cone": narrow}, handout.light_sampling, {"cone too narrow"}),
    ("alpha + 2", {"brdf": alpha_plus_two}, handout.mis_sampling, {"alpha + 2"}),
    ("heads without the half", {}, sum_of_densities, {"half missing", "doubled density"}),
    ("forgotten light", {}, lambda s, *given: handout.mis_sampling(_Fewer(s), *given), {"forgotten light"}),
    (
        "horizon ignored",
        {"contribution": contribution(lambda x: x, along_wi=True)},
        handout.light_sampling,
        {"horizon ignored"},
    ),
    ("wrong frame", {"about": no_frame_at_minus_z}, handout.brdf_sampling, {"wrong frame"}),
    ("shared numbers", {}, lambda *given: handout.light_sampling(*given[:3], _Twice(given[3])), {"shared numbers"}),
    ("rho squared", {"contribution": contribution(positive, power=2)}, handout.mis_sampling, {"rho squared"}),
    (
        "back faces lit",
        {"contribution": contribution(np.abs, along_wi=True)},
        handout.light_sampling,
        {"back faces lit"},
    ),
]


@pytest.mark.parametrize(("name", "changed", "estimator", "names"), PLANTED, ids=[planted[0] for planted in PLANTED])
def test_a_planted_fault_is_found_and_named(
    scene: ol.Scene, name: str, changed: dict, estimator: Callable, names: set[str]
) -> None:
    """By the first hint."""
    with mock.patch.multiple(handout, EPSILON=handout.EPSILON, **changed):
        report = ol.check(estimator, scene, passes=PASSES, seed=1)
    assert not report, f"{name} is not found"
    assert report.hint in names, f"{name}: {report}"


def test_estimates_that_are_none_are_reported(scene: ol.Scene) -> None:
    """Not a number, and a wrong shape."""
    nan = ol.check(lambda scene, hits, wo, rng: np.full((len(hits), 3), np.nan), scene, passes=32)
    assert not nan and "not finite" in str(nan)
    flat = ol.check(lambda scene, hits, wo, rng: np.zeros(len(hits)), scene, passes=32)
    assert not flat and ", 3)" in str(flat)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("knot", "interpolated normals"),
        ("one-sided", "one-sided surfaces"),
        ("terminator", "smooth terminators"),
        ("ggx", "rough surfaces (Ggx), metals (Conductor)"),
        ("lamps", "suns"),
    ],
)
def test_what_hits_do_not_tell_of_is_refused(name: str, words: str) -> None:
    """With its name, before the estimator is called."""
    scene = ol.load(REPOSITORY / f"scenes/{name}.toml")
    with pytest.raises(ValueError, match="which hits do not tell of: check in a scene without") as refused:
        ol.check(lambda *_: 1 / 0, scene, passes=32)
    assert words in str(refused.value)


def without_textures(scene: ol.Scene, hits: ol.Hits, wo: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sample lights as if surfaces had one colour."""
    hits._made["brdf_params"] = scene.surfaces.brdf[hits.object]
    return handout.light_sampling(scene, hits, wo, rng)


def both_lobes(scene: ol.Scene, hits: ol.Hits, wo: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Sample lights for the diffuse part of blends and for the other."""
    gloss = hits[:]
    gloss._made["brdf_params"] = hits.blend_params
    return handout.light_sampling(scene, hits, wo, rng) + handout.light_sampling(scene, gloss, wo, rng)


def under_the_sky(turned: np.ndarray) -> Callable:
    """Sample the BRDF, and look up where directions end."""

    def estimate(scene: ol.Scene, hits: ol.Hits, wo: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        cos = rng.random(len(hits)) ** (1 / (handout.alpha(hits) + 1))
        wi = handout.about(handout.lobe_axis(hits, wo), cos, rng)
        scale = np.maximum(handout.dot(hits.normal, wi), 0) / handout.brdf_pdf(hits, wo, wi)
        free = ~scene.occluded(hits.point + handout.EPSILON * hits.normal, wi)
        return handout.brdf(hits, wo, wi) * (scale * free)[:, None] * scene.environment(wi * turned)

    return estimate


@pytest.mark.parametrize(
    ("name", "estimator", "right"),
    [
        ("textures", handout.light_sampling, True),
        ("textures", without_textures, False),
        ("blend", both_lobes, True),
        ("blend", handout.light_sampling, False),
    ],
)
def test_textures_and_blends_are_told_of(name: str, estimator: Callable, right: bool) -> None:
    """An estimator that heeds them passes; one that does not is biased."""
    scene = ol.load(REPOSITORY / f"scenes/{name}.toml")
    report = ol.check(estimator, scene, passes=PASSES)
    assert bool(report) == right, str(report)


@pytest.mark.parametrize("turned", [(1, 1, 1), (-1, 1, 1), (1, -1, 1), (1, 1, -1)])
def test_environments_are_told_of(tmp_path: Path, turned: tuple[int, int, int]) -> None:
    """The sky is that of the oracle, turned as it is; a mirrored one is biased. It has no sun, which few samples find."""
    texels = np.random.default_rng(5).random((4, 8, 3)) ** 2
    ol.Image(texels.astype(np.float32)).save(tmp_path / "sky.exr")
    (tmp_path / "scene.toml").write_text(
        """
        camera = { origin = [1, 2, 6], target = [0, 0, 0], up = [0, 1, 0], fov_x = 50 }
        film = { width = 48, height = 32 }
        environment = { file = "sky.exr", rotate_y = 20 }
        materials.clay = { diffuse = [0.8, 0.7, 0.6] }
        materials.gloss = { phong = [0.8, 0.8, 0.8], exponent = 20 }
        spheres = [
            { center = [-1.2, 0, 0], radius = 1, material = "clay" },
            { center = [1.2, 0, 0], radius = 1, material = "gloss" },
        ]
        """
    )
    report = ol.check(under_the_sky(np.array(turned)), ol.load(tmp_path / "scene.toml"), passes=PASSES)
    assert bool(report) == (turned == (1, 1, 1)), str(report)
    assert not report.hints


def test_textures_on_spheres_are_those_of_the_oracle(tmp_path: Path) -> None:
    """A globe of four colours under a light at the eye: one quarter each, and the seam where longitude begins anew."""
    ol.Image(np.array([[[0.9, 0.1, 0.2], [0.2, 0.8, 0.1]], [[0.1, 0.3, 0.9], [0.7, 0.7, 0.1]]], np.float32)).save(
        tmp_path / "four.exr"
    )
    (tmp_path / "globe.toml").write_text(
        """
        camera = { origin = [1, 2, 6], target = [0, 0, 0], up = [0, 1, 0], fov_x = 30 }
        film = { width = 48, height = 48 }
        materials.globe = { diffuse = [1, 1, 1], texture = "four.exr" }
        [[spheres]]
        center = [0, 0, 0]
        radius = 1
        material = "globe"
        [[spheres]]
        center = [1, 4, 9]
        radius = 1
        emission = [30, 30, 30]
        """
    )
    scene = ol.load(tmp_path / "globe.toml")
    report = ol.check(handout.light_sampling, scene, passes=PASSES)
    assert report and report.sees < 0.01, str(report)
    assert not ol.check(without_textures, scene, passes=PASSES)


@pytest.mark.parametrize("factor", [1.0, 1.02])
def test_lights_without_shape_are_checked(ball: ol.Scene, factor: float) -> None:
    """A point light is summed, not sampled: a right sum passes, 2 % more of its light does not."""
    ball.add_light(ol.PointLight((3, 2, 4), (40, 30, 20)))

    def estimate(scene: ol.Scene, hits: ol.Hits, wo: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        total = handout.light_sampling(scene, hits, wo, rng)
        for lamp in scene.lamps:
            to = np.asarray(lamp.position) - hits.point
            distance = np.linalg.norm(to, axis=1, keepdims=True)
            cos = np.maximum((hits.normal * to).sum(axis=1, keepdims=True) / distance, 0)
            free = ~scene.occluded(hits.point + 1e-3 * hits.normal, to, 0.999)
            total += factor * hits.brdf_params[:, :3] / np.pi * cos * lamp.intensity / distance**2 * free[:, None]
        return total

    report = ol.check(estimate, ball, passes=PASSES)
    assert bool(report) == (factor == 1), str(report)
    assert not report.hints


def test_an_estimators_own_error_is_passed_on(scene: ol.Scene) -> None:
    """As it is."""
    with pytest.raises(ZeroDivisionError):
        ol.check(lambda *_: 1 / 0, scene, passes=32)


@pytest.fixture(autouse=True)
def quiet() -> Iterator[None]:
    """Let planted faults divide by nothing."""
    with np.errstate(all="ignore"):
        yield
