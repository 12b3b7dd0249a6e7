"""Pictures of a scene."""

import os
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import number, whole
from ._arrays import size as as_size
from ._picture import Image, image
from ._scene import Scene

ESTIMATORS = ("uniform", "light", "brdf", "mis", "mis2-balance", "mis2-power", "projected", "product")
"""Names of estimators: the four of the hand-out, then those beyond it. "auto" stands for one of them."""

MOST_SPP = 1 << 30
"""No picture has more samples a pixel."""

# Ctrl-c is heard so often.
_PAUSE = 0.05


def render(
    scene: Scene,
    *,
    estimator: str | None = None,
    spp: int | None = None,
    seconds: float | None = None,
    size: tuple[int, int] | None = None,
    seed: int | None = None,
    sampler: str | None = None,
    threads: int | None = None,
    accel: str | None = None,
    adaptive: bool = False,
    target_error: float | None = None,
) -> Image:
    """Render a scene: `(h, w, 3)` float32 linear radiance, row 0 on top, with the bits of the command `octolux render`.

    What is not said is as the scene says, else as follows.

    - `estimator`: one of `ESTIMATORS`, or "auto", which is "product"; `Scene.estimator` says which is taken;
    - `spp`: samples a pixel, 64; with `seconds` as many as that time allows;
    - `seconds`: of rendering at most, one sample a pixel at least;
    - `size`: (width, height) in pixels;
    - `seed`: 0; the picture depends on nothing else, and not on `threads` or `accel` ("embree" or "linear");
    - `sampler`: "sobol" or "independent";
    - `adaptive`: more samples where the error is larger;
    - `target_error`: render until the noise is such a share of the picture, 1e-6 to 100.

    Ctrl-c stops it. Other threads run meanwhile.
    """
    run = _start(scene, estimator, spp, seconds, size, seed, sampler, threads, accel, adaptive, target_error)
    while run.step(_PAUSE):
        pass
    return image(run.picture())


def progressive(
    scene: Scene,
    *,
    estimator: str | None = None,
    spp: int | None = None,
    seconds: float | None = None,
    size: tuple[int, int] | None = None,
    seed: int | None = None,
    sampler: str | None = None,
    threads: int | None = None,
    accel: str | None = None,
) -> Iterator[tuple[int, Image]]:
    """Yield `(passes, image)` at 1, 2, 4, 8, ... passes and at the end; each is unbiased. Leave the loop at any time.

    The keywords are those of `render`. The last image has the bits of `render`.
    """
    run = _start(scene, estimator, spp, seconds, size, seed, sampler, threads, accel, adaptive=False, error=None)
    return _look(run)


def _look(run: _native.Run) -> Iterator[tuple[int, Image]]:
    shown, more = 0, True
    while more:
        more = run.step(_PAUSE)
        passes = run.passes
        if passes > shown and (not more or passes & (passes - 1) == 0):
            shown = passes
            yield passes, image(run.picture())


def _start(
    scene: Scene,
    estimator: str | None,
    spp: int | None,
    seconds: float | None,
    size: tuple[int, int] | None,
    seed: int | None,
    sampler: str | None,
    threads: int | None,
    accel: str | None,
    adaptive: bool,
    error: float | None,
) -> _native.Run:
    if not isinstance(scene, Scene):
        raise TypeError(f"a scene is rendered, such as octolux.load returns, and this is {type(scene).__name__}")
    for name, value in (("estimator", estimator), ("sampler", sampler), ("accel", accel)):
        if value is not None and not isinstance(value, str):
            raise TypeError(f"{name} is a name, and this is {type(value).__name__}")
    limit = None if seconds is None else number("seconds", seconds, 1e-3, 1e9)
    wanted = None if error is None else number("target_error", error, 1e-6, 100.0)
    asked = None if spp is None else whole("spp", spp, 1, MOST_SPP)
    shape = scene.size if size is None else as_size(size)
    room(shape)
    seed = None if seed is None else whole("seed", seed, 0, 0xFFFFFFFF)
    threads = None if threads is None else whole("threads", threads, 1, 1024)
    prepared = scene.prepared(shape, estimator, sampler, seed, threads, accel)
    if asked is None:
        asked = MOST_SPP if limit is not None else (scene.built.render[0] or 64)
    return prepared.start(asked, limit, bool(adaptive), wanted)


def room(shape: tuple[int, int]) -> None:
    """Refuse a film that the memory cannot hold; sums and pictures take about 64 bytes a pixel."""
    need = 64 * shape[0] * shape[1]
    have = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if need > have // 2:
        raise MemoryError(
            f"a picture of {shape[0]} x {shape[1]} pixels takes {need >> 20} MiB, and this machine has {have >> 20}"
        )


def reference(
    scene: Scene, *, spp: int = 64, size: tuple[int, int] | None = None, seed: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ask the oracle: mean and standard error of each pixel, both `(h, w, 3)` float64.

    It is another program, in f64 and one ray at a time, that shares nothing with the renderer but the scene. It is
    slow.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"the oracle takes a scene, and this is {type(scene).__name__}")
    shape = scene.size if size is None else as_size(size)
    room(shape)
    spp, seed = whole("spp", spp, 1, MOST_SPP), whole("seed", seed, 0, 2**63)
    # Piece by piece, so that ctrl-c is heard; pieces are of one size but for the last, and moments are put together
    # as of groups.
    piece = max(2, min(spp, 200_000 // (shape[0] * shape[1]) or 1))
    count, mean, squares = 0, np.zeros((shape[1], shape[0], 3)), np.zeros((shape[1], shape[0], 3))
    part = 0
    while count < spp:
        n = min(piece, spp - count)
        found, error = _native.reference(scene.built, shape, n, seed * 0x10001 + part)
        inner = np.zeros_like(error) if n == 1 else error**2 * (n * (n - 1))
        squares += inner + (found - mean) ** 2 * (count * n / (count + n))
        mean += (found - mean) * (n / (count + n))
        count, part = count + n, part + 1
    with np.errstate(divide="ignore", invalid="ignore"):
        return mean, np.sqrt(squares / (count * (count - 1))) if count > 1 else np.full_like(mean, np.inf)
