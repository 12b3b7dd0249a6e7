"""An estimator of one's own against the oracle."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arrays import number, whole
from ._arrays import size as as_size
from ._faults import Fault, Planted, known
from ._picture import Image
from ._rays import Hits
from ._render import reference, render
from ._scene import Scene

F = NDArray[np.float64]
Estimator = Callable[[Scene, Hits, Any, np.random.Generator], Any]

GRID = (4, 6)
"""Rows and columns of blocks that a picture is divided into."""

LEAST_PASSES = 32
"""Fewer passes say nothing of their own variance."""

LEAST_EVENTS = 100.0
"""A block is judged by itself where its samples weigh as much as so many equal ones; the whole picture always is."""

FAR = 50.0
"""Pictures whose blocks differ by more, in variances, are not alike."""

BEYOND = {
    "smooth normals": "interpolated normals",
    "one-sided": "one-sided surfaces",
    "smooth terminator": "smooth terminators",
    "ggx": "rough surfaces (Ggx)",
    "conductor": "metals (Conductor)",
    "suns": "suns, which are seen in the sky",
}
"""What `Hits` does not tell an estimator of."""


@dataclass(frozen=True)
class Block:
    """A part of the picture where an estimator is off: rows and columns of pixels, and what was found there."""

    rows: tuple[int, int]
    columns: tuple[int, int]
    channel: str
    found: float
    expected: float
    z: float

    def __str__(self) -> str:
        """Say where and how much."""
        by = f"{(self.found / self.expected - 1) * 100:+.2f} %" if self.expected else f"{self.found:g} where nothing is"
        where = f"rows {self.rows[0]} to {self.rows[1] - 1}, columns {self.columns[0]} to {self.columns[1] - 1}"
        return f"{where}, {self.channel}: {by} ({self.z:+.1f} standard errors)"


@dataclass(frozen=True)
class Report:
    """What `check` found; `print` it. It is true where nothing is wrong."""

    passed: bool
    passes: int
    samples: int
    rate: float
    sees: float
    """The relative bias of the whole picture that would have been seen."""
    bias: float
    """The relative difference of the whole picture that was found."""
    blocks: list[Block] = field(default_factory=list)
    """Where it is off, the worst first."""
    hints: list[Fault] = field(default_factory=list)
    """Known faults that look so, the likeliest first; several where no picture tells them apart."""
    problems: list[str] = field(default_factory=list)
    """What was wrong with the estimates themselves."""
    efficiency: dict[str, float] = field(default_factory=dict)
    """1 / (variance of a sample, over the square of the picture's mean): of yours, and of Octolux's estimators."""
    picture: Image | None = None
    expected: Image | None = None

    def __bool__(self) -> bool:
        """Whether nothing is wrong."""
        return self.passed

    @property
    def hint(self) -> str:
        """The likeliest fault's name, or nothing."""
        return self.hints[0].name if self.hints else ""

    def __str__(self) -> str:
        """Say it in sentences."""
        lines = []
        if self.passed:
            lines.append(f"unbiased as far as {self.samples} samples see (sees {self.sees:.2%} of the whole picture)")
        else:
            lines += [f"wrong: {problem}" for problem in self.problems]
            if self.blocks:
                lines.append(f"biased: {self.bias:+.2%} of the whole picture; {len(self.blocks)} of its parts are off")
                lines += [f"  {block}" for block in self.blocks[:4]]
            if self.hints:
                lines.append("it looks as if " + ", or ".join(fault.sentence for fault in self.hints))
            elif self.blocks:
                lines.append("it looks like none of the known faults")
        lines.append(
            f"{self.passes} passes; a right estimator is called wrong once in {1 / self.rate:.0f} checks at most"
        )
        if self.efficiency:
            lines.append("efficiency: " + ", ".join(f"{name} {value:.3g}" for name, value in self.efficiency.items()))
        return "\n".join(lines)


class _Sums:
    """Moments of the blocks, and of the whole picture, over passes; the last row is the whole."""

    def __init__(self, size: tuple[int, int]) -> None:
        width, height = size
        self.size, self.count = size, 0
        rows, columns = min(GRID[0], height), min(GRID[1], width)
        y, x = np.divmod(np.arange(width * height), width)
        self.block = (y * rows // height) * columns + x * columns // width
        self.grid = (rows, columns)
        self.n = rows * columns
        self.pixels = np.append(np.bincount(self.block, minlength=self.n), width * height).astype(float)[:, None]
        self.first, self.second = np.zeros((self.n + 1, 3)), np.zeros((self.n + 1, 3))
        # Of single samples, for their number and for the picture.
        self.sample, self.square = np.zeros((self.n + 1, 3)), np.zeros((self.n + 1, 3))
        self.picture = np.zeros((width * height, 3))
        self.pixel_square = np.zeros((width * height, 3))

    def blocks(self, values: F) -> F:
        """Sum over the pixels of each block, and over all."""
        sums = np.stack([np.bincount(self.block, values[:, k], self.n) for k in range(3)], axis=1)
        return np.vstack([sums, sums.sum(axis=0)])

    def add(self, values: F) -> None:
        """Take a pass."""
        sums, squares = self.blocks(values), self.blocks(values**2)
        mean = sums / self.pixels
        self.count += 1
        before = mean - self.first
        self.first += before / self.count
        self.second += before * (mean - self.first)
        self.sample += sums
        self.square += squares
        self.picture += values
        self.pixel_square += values**2

    @property
    def error(self) -> F:
        """Standard error of the blocks' means."""
        return np.sqrt(self.second / (self.count * max(self.count - 1, 1)))

    @property
    def events(self) -> F:
        """To how many equal samples those of each block amount."""
        return np.divide(self.sample**2, self.square, out=np.zeros_like(self.square), where=self.square > 0)

    @property
    def variance(self) -> float:
        """Mean variance of a sample, over the pixels."""
        mean = self.picture / self.count
        return float(
            np.maximum(self.pixel_square / self.count - mean**2, 0).mean() * self.count / max(self.count - 1, 1)
        )


class _Wrong(Exception):
    """Estimates that no picture can be made of."""


def check(
    estimator: Estimator,
    scene: Scene,
    *,
    seconds: float = 20.0,
    passes: int | None = None,
    size: tuple[int, int] | None = None,
    rate: float = 1e-3,
    seed: int = 0,
    hints: bool = True,
    efficiency: bool = False,
) -> Report:
    """Hold an estimator against the oracle: is it biased, where, by how much, and which known fault does it resemble?

    `estimator(scene, hits, wo, rng)` returns `(n, 3)` estimates of the radiance that surfaces reflect: `hits` are
    `Hits` on `n` reflecting points (lights that are seen are none of its business), `wo` `(n, 3)` float32 are unit
    directions from there to the eye, `rng` is a `numpy.random.Generator`. It is called once a pass, for one jittered
    ray of each pixel, for half of `seconds`, or for `passes` (32 at least; the report then depends on `seed` alone).
    The oracle takes the other half. The lights are `scene.lights` and, without shape, `scene.lamps`.

    `size` is that of the picture, 48 pixels wide where nothing is said. It is divided into blocks whose means are
    compared channel by channel, as is the whole. `rate` is how often a right estimator may be called wrong, for all
    comparisons together. Blocks that too few samples lit are judged within the whole alone. `hints` runs estimators
    with known faults where something is off; they know lights that are spheres, and no `Blend`. `efficiency` measures
    the variance of Octolux's estimators too.

    The estimator owes all of the light: that of `scene.environment` too, and on a `Blend` both of its lobes. An error
    of its own is passed on. Scenes with what `hits` do not tell of (smooth normals, ...) are refused.
    """
    if not callable(estimator):
        raise TypeError(f"an estimator is a function f(scene, hits, wo, rng), and this is {type(estimator).__name__}")
    if not isinstance(scene, Scene):
        raise TypeError(f"an estimator is checked in a scene, and this is {type(scene).__name__}")
    seconds, rate = number("seconds", seconds, 0.01, 1e6), number("rate", rate, 1e-12, 0.5)
    passes = None if passes is None else whole("passes", passes, LEAST_PASSES, 1 << 24)
    seed = whole("seed", seed, 0, 2**63)
    beyond = [words for name, words in BEYOND.items() if name in scene.built.effects]
    if beyond:
        raise ValueError(f"the scene has {', '.join(beyond)}, which hits do not tell of: check in a scene without")
    shape = _small(scene.size) if size is None else as_size(size)
    begun = time.monotonic()
    rng = np.random.default_rng(seed)
    try:
        sums = _passes(estimator, scene, shape, rng, passes, seconds / 2)
    except _Wrong as wrong:
        return Report(passed=False, passes=0, samples=0, rate=rate, sees=math.inf, bias=math.nan, problems=[str(wrong)])
    spp = _oracle_passes(scene, shape, passes, begun + seconds - time.monotonic())
    mean, error = reference(scene, spp=spp, size=shape, seed=seed)
    flat = mean.reshape(-1, 3)
    truth, doubt = sums.blocks(flat) / sums.pixels, np.sqrt(sums.blocks(error.reshape(-1, 3) ** 2)) / sums.pixels
    report = _judge(sums, truth, doubt, spp, rate)
    if not report.passed and hints and _known_to(scene):
        _explain(report, scene, sums, seed)
    if efficiency:
        _efficiency(report, scene, sums, flat, seed)
    object.__setattr__(report, "picture", Image((sums.picture / sums.count).reshape(mean.shape)))
    object.__setattr__(report, "expected", Image(mean))
    return report


def _known_to(scene: Scene) -> bool:
    """Whether the estimators with known faults know all of the scene."""
    more = {"blend", "environment"}.intersection(scene.built.effects)
    return not more and not scene.lamps and all(light.radius is not None for light in scene.lights)


def _small(size: tuple[int, int]) -> tuple[int, int]:
    return (
        (48, max(8, round(48 * size[1] / size[0])))
        if size[0] >= size[1]
        else (max(8, round(48 * size[0] / size[1])), 48)
    )


def _oracle_passes(scene: Scene, shape: tuple[int, int], passes: int | None, left: float) -> int:
    if passes is not None:
        return max(4 * passes, 256)
    begun = time.monotonic()
    reference(scene, spp=16, size=shape)
    return max(64, int(16 * left / max(time.monotonic() - begun, 1e-4)))


def _passes(
    estimator: Estimator,
    scene: Scene,
    shape: tuple[int, int],
    rng: np.random.Generator,
    passes: int | None,
    seconds: float,
) -> _Sums:
    sums, begun = _Sums(shape), time.monotonic()
    while sums.count < passes if passes else sums.count < LEAST_PASSES or time.monotonic() - begun < seconds:
        origins, directions = scene.eye_rays(shape, rng)
        hits = scene.intersect(origins, directions, coherent=True)
        values = np.where(hits.hit[:, None], hits.Le, scene.environment(directions))
        lit = np.flatnonzero(hits.hit & ~hits.Le.any(axis=1))
        if len(lit):
            values[lit] = _estimates(estimator, scene, hits[lit], -directions[lit], rng)
        sums.add(values)
    return sums


def _estimates(estimator: Estimator, scene: Scene, hits: Hits, wo: Any, rng: np.random.Generator) -> F:
    found = np.asarray(estimator(scene, hits, wo, rng))
    if found.shape != (len(hits), 3) or found.dtype.kind not in "fiu":
        raise _Wrong(
            f"the estimator must return real numbers of the shape ({len(hits)}, 3), "
            f"and returned {found.dtype} {found.shape}"
        )
    bad = ~np.isfinite(found).all(axis=1)
    if bad.any():
        i = int(np.flatnonzero(bad)[0])
        raise _Wrong(
            f"{int(bad.sum())} of {len(hits)} estimates of a pass are not finite, such as {found[i]} at {hits.point[i]}"
        )
    return found.astype(np.float64)


def _quantile(p: float, dof: float) -> float:
    """Give Student's upper quantile (Cornish and Fisher's expansion; Abramowitz and Stegun 26.7.5)."""
    z = -NormalDist().inv_cdf(p)
    terms = (z**3 + z) / 4, (5 * z**5 + 16 * z**3 + 3 * z) / 96, (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + sum(term / dof ** (k + 1) for k, term in enumerate(terms))


def _judge(sums: _Sums, truth: F, doubt: F, spp: int, rate: float) -> Report:
    # Where an estimator seldom meets a light and has been unlucky, its variance is as low as its mean: it grows with
    # the truth.
    low = np.divide(truth, sums.first, out=np.ones_like(truth), where=sums.first > 0)
    # What is seldom seen, as a light's rim is, may not have been: the oracle, which draws more samples, knows its
    # variance.
    own = np.maximum(sums.error**2 * np.clip(low, 1, 4), doubt**2 * spp / sums.count)
    error = np.sqrt(own + doubt**2)
    # Sums of exact numbers are off by their rounding, and points of float32 by theirs.
    error = np.maximum(error, 2e-5 * np.abs(truth))
    off = sums.first - truth
    z = np.divide(off, error, out=np.where(off == 0, 0.0, np.inf * np.sign(off)), where=error > 0)
    judged = sums.events >= LEAST_EVENTS
    judged[-1] = True
    limit = _quantile(rate / 2 / judged.sum(), sums.count - 1)
    worst = [tuple(at) for at in np.argwhere(judged & (np.abs(z) > limit))]
    worst.sort(key=lambda at: -abs(z[at]))
    mean, whole_error = max(float(truth[-1].mean()), 1e-300), float(error[-1].mean())
    blocks = [_block(sums, int(i), int(k), truth, float(z[i, k])) for i, k in worst]
    return Report(
        passed=not blocks,
        passes=sums.count,
        samples=sums.count * len(sums.picture),
        rate=rate,
        sees=limit * whole_error / mean,
        bias=float(off[-1].mean()) / mean,
        blocks=blocks,
    )


def _block(sums: _Sums, i: int, k: int, truth: F, z: float) -> Block:
    width, height = sums.size
    if i == sums.n:
        (top, bottom), (left, right) = (0, height), (0, width)
    else:
        y, x = np.divmod(np.flatnonzero(sums.block == i), width)
        (top, bottom), (left, right) = (int(y[0]), int(y[-1]) + 1), (int(x.min()), int(x.max()) + 1)
    return Block(
        (top, bottom), (left, right), ("red", "green", "blue")[k], float(sums.first[i, k]), float(truth[i, k]), z
    )


def _explain(report: Report, scene: Scene, sums: _Sums, seed: int) -> None:
    """Find the known faults whose pictures are nearest, and keep those that are as near as noise allows."""
    candidates = list(known(scene))
    # All of them at a glance, then the nearest with less noise.
    for count, kept in ((LEAST_PASSES, 8), (4 * LEAST_PASSES, 8)):
        found = []
        for strategy, fault in candidates:
            key = (sums.size, seed, count, strategy, fault)
            if key not in scene.faults:
                rng = np.random.default_rng([seed, count])
                scene.faults[key] = _passes(Planted(strategy, fault), scene, sums.size, rng, count, 0.0)
            found.append((_distance(sums, scene.faults[key]), strategy, fault))
        found.sort(key=lambda found: found[0])
        candidates = [(strategy, fault) for _, strategy, fault in found[:kept]]
    nearest = found[0][0]
    names: list[str] = []
    for distance, _, fault in found:
        if nearest < FAR and distance < 1.3 * nearest + 0.3 and fault.name not in names:
            names.append(fault.name)
            report.hints.append(fault)


def _distance(mine: _Sums, planted: _Sums) -> float:
    """Give the mean squared difference of two pictures' blocks, in variances; about 1 where only noise differs."""
    variance = mine.error**2 + planted.error**2 + (0.002 * mine.first) ** 2
    use = (variance > 0) & (np.maximum(mine.events, planted.events) >= LEAST_EVENTS)
    use[-1] = variance[-1] > 0
    return float(np.mean((mine.first - planted.first)[use] ** 2 / variance[use])) if use.any() else 0.0


def _efficiency(report: Report, scene: Scene, sums: _Sums, truth: F, seed: int) -> None:
    scale = float(truth.mean()) ** 2
    report.efficiency["yours"] = scale / max(sums.variance, 1e-300)
    for name in ("light", "brdf", "mis"):
        pictures = [
            render(scene, estimator=name, spp=1, sampler="independent", size=sums.size, seed=seed + i)
            for i in range(16)
        ]
        variance = float(np.var(np.array(pictures, np.float64), axis=0, ddof=1).mean())
        report.efficiency[name] = scale / max(variance, 1e-300)
