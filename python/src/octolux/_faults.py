"""Known faults of estimators, planted one at a time: what `check` compares a wrong picture with.

An estimator of spheres' light, in numpy: `Planted(strategy, fault)` is called as `check` calls an estimator of a
user. Without a fault it is right. Strategies are the hand-out's `light`, `brdf` and `mis`, the last per light as
Octolux has it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._rays import Hits
from ._scene import Light, Scene

F = NDArray[np.float64]

SENTENCES = {
    "missing cosine": "the cosine max(0, n . wi) is missing",
    "doubled density": "everything is divided by twice the density",
    "half missing": "the mixture's density lacks the half before one or both of its parts",
    "own shadow": "a light shadows itself: its own surface counts as an occluder, so that no reflected light arrives",
    "cone too wide": "the cone of a light is too wide: its angle is off by about 1 %, or its density by 2 %",
    "cone too narrow": "the cone of a light is too narrow: its angle is off by about 1 %, or its density by 2 %",
    "alpha + 2": "Phong's lobe is normalised with alpha + 2 where the hand-out has alpha + 1",
    "forgotten light": "one light is forgotten",
    "horizon ignored": "directions below the horizon count, with their negative cosines",
    "back faces lit": "light from below the horizon counts as if it came from above: abs(n . wi), not max(0, n . wi)",
    "wrong frame": "the coordinate frame is wrong about an axis near -z",
    "shared numbers": "one random number is used for two purposes",
    "rho squared": "the reflectance is multiplied in twice",
}


@dataclass(frozen=True)
class Fault:
    """A fault by its name; of a forgotten light the object's number. Variants have one name and several pictures."""

    name: str
    light: int = -1
    variant: int = 0

    @property
    def sentence(self) -> str:
        """What it is."""
        of = f" (object {self.light})" if self.light >= 0 else ""
        return SENTENCES[self.name] + of


def known(scene: Scene) -> Iterator[tuple[str, Fault]]:
    """Give the faults whose pictures differ in this scene, with the strategies whose pictures differ."""
    for name in ("missing cosine", "doubled density", "own shadow", "rho squared", "horizon ignored", "back faces lit"):
        yield "mis", Fault(name)
    if len(scene.lights) > 1:
        for light in scene.lights[:12]:
            yield "mis", Fault("forgotten light", light.object)
    for strategy in ("light", "mis"):
        yield strategy, Fault("cone too wide")
        yield strategy, Fault("cone too narrow")
    for strategy in ("any", "brdf", "mis"):
        yield strategy, Fault("alpha + 2")
    for strategy in ("light", "brdf", "mis"):
        # Where a direction turns to depends on the frame: those of two textbooks.
        yield strategy, Fault("shared numbers")
        yield strategy, Fault("shared numbers", variant=2)
        yield strategy, Fault("wrong frame")
    yield "mis", Fault("shared numbers", variant=1)
    for variant in (0, 1, 2):
        yield "mis", Fault("half missing", variant=variant)


class Planted:
    """An estimator with a fault, or without."""

    def __init__(self, strategy: str = "mis", fault: Fault | None = None) -> None:
        """Choose `light`, `brdf`, `mis`, or `any` where the fault is in the integrand."""
        self.strategy = "mis" if strategy == "any" else strategy
        self.in_integrand = strategy == "any"
        self.fault = fault
        self.name = "" if fault is None else fault.name
        self.variant = 0 if fault is None else fault.variant

    def __call__(self, scene: Scene, hits: Hits, wo: Any, rng: np.random.Generator) -> F:
        """Estimate the reflected radiance, `(n, 3)`."""
        total = np.zeros((len(hits), 3))
        for light in scene.lights:
            if self.fault is not None and light.object == self.fault.light:
                continue
            total += self._one(scene, hits, np.asarray(wo, np.float64), light, rng)
        return total

    def _one(self, scene: Scene, hits: Hits, wo: F, light: Light, rng: np.random.Generator) -> F:
        count, n, p = len(hits), hits.normal.astype(np.float64), hits.point.astype(np.float64)
        rho, alpha = hits.brdf_params[:, :3].astype(np.float64), hits.brdf_params[:, 3].astype(np.float64)
        mirror = 2 * _dot(n, wo)[:, None] * n - wo
        lobe = np.where((alpha > 1)[:, None], mirror, n)
        if light.center is None or light.radius is None:
            raise ValueError("the known faults are those of lights that are spheres")
        to = light.center - p
        distance = np.linalg.norm(to, axis=1)
        axis = to / distance[:, None]
        ratio = np.minimum(light.radius / distance, 1.0)
        span = 1 - np.sqrt(1 - ratio**2)
        angle = {"cone too wide": 1.01, "cone too narrow": 0.99}.get(self.name)
        counted = span if angle is None else 1 - np.cos(np.minimum(angle * np.arcsin(ratio), np.pi / 2))
        one, two, heads = rng.random((3, count))
        if self.name == "shared numbers":
            two, heads = (two, one) if self.variant == 1 else (one, heads)
        by_light = self._about(axis, 1 - one * span, two)
        by_brdf = self._about(lobe, one ** (1 / (alpha + 1)), two)
        choice = {"light": np.ones(count, bool), "brdf": np.zeros(count, bool)}.get(self.strategy, heads < 0.5)
        wi = np.where(choice[:, None], by_light, by_brdf)
        cos, towards = _dot(n, wi), np.maximum(_dot(lobe, wi), 0)
        f = np.where(alpha > 1, (alpha + self._more("f")) / (2 * np.pi) * towards**alpha, 1 / np.pi)
        # sin^2 tells apart angles whose cosines are both rounded to 1.
        inside = (_dot(axis, wi) > 0) & (np.sum(np.cross(axis, wi) ** 2, axis=1) <= ratio**2 * (1 + 1e-9))
        p_light = inside / (2 * np.pi * counted)
        p_brdf = (alpha + self._more("p")) / (2 * np.pi) * towards**alpha
        density = {"light": p_light, "brdf": p_brdf}.get(self.strategy)
        if density is None:
            halves = ((1, 1), (1, 0.5), (0.5, 1))[self.variant] if self.name == "half missing" else (0.5, 0.5)
            density = halves[0] * p_light + halves[1] * p_brdf
        density = density * (2 if self.name == "doubled density" else 1)
        weight = self._cosine(cos) * f
        value = np.divide(weight, density, out=np.zeros(count), where=density > 0)
        ask = np.flatnonzero((value != 0) & inside)
        if self.name == "own shadow" or len(ask) == 0:
            return np.zeros((count, 3))
        beside = 3e-5 * np.maximum(hits.t[ask], 1e-3)[:, None]
        below = self.name in ("horizon ignored", "back faces lit")
        origins = p[ask] + beside * (wi[ask] if below else n[ask])
        seen = scene.intersect(origins.astype(np.float32), wi[ask].astype(np.float32)).object == light.object
        scale = np.zeros(count)
        scale[ask] = value[ask] * seen
        return scale[:, None] * (rho**2 if self.name == "rho squared" else rho) * light.Le

    def _cosine(self, cos: F) -> F:
        if self.name == "missing cosine":
            return (cos > 0).astype(np.float64)
        if self.name == "horizon ignored":
            return cos
        return np.abs(cos) if self.name == "back faces lit" else np.maximum(cos, 0)

    def _more(self, where: str) -> int:
        """Give what is added to alpha in the BRDF or in its density."""
        return 2 if self.name == "alpha + 2" and self.in_integrand == (where == "f") else 1

    def _about(self, axis: F, cos: F, turn: F) -> F:
        """Turn directions about z, of this cosine, to an axis (Duff et al., JCGT 6 (1), 2017)."""
        sign = np.where(axis[:, 2] < 0, -1.0, 1.0)
        a = -1 / (sign + axis[:, 2])
        b = axis[:, 0] * axis[:, 1] * a
        first = np.stack([1 + sign * axis[:, 0] ** 2 * a, sign * b, -sign * axis[:, 0]], axis=1)
        second = np.stack([b, sign + axis[:, 1] ** 2 * a, -axis[:, 1]], axis=1)
        if self.name == "shared numbers" and self.variant == 2:
            helper = np.where(np.abs(axis[:, [0]]) > 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
            first = np.cross(helper, axis)
            first = first / np.linalg.norm(first, axis=1, keepdims=True)
            second = np.cross(axis, first)
        sin = np.sqrt(np.maximum(1 - cos**2, 0))[:, None]
        phi = 2 * np.pi * turn
        x, y = np.cos(phi)[:, None] * sin, np.sin(phi)[:, None] * sin
        wi: F = x * first + y * second + cos[:, None] * axis
        if self.name == "wrong frame":
            # The case that a formula leaves out, filled in with the axes of space.
            near = axis[:, 2] < -0.999
            wi[near] = np.concatenate([x, y, cos[:, None]], axis=1)[near]
        return wi


def _dot(a: F, b: F) -> F:
    product: F = np.einsum("ij,ij->i", a, b)
    return product
