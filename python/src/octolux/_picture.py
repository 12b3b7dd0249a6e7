"""Pictures as arrays that notebooks show."""

import os
import tempfile
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import real

Path_ = str | os.PathLike[str]


class Image(np.ndarray[Any, np.dtype[np.float32]]):
    """Linear RGB radiance `(h, w, 3)` float32, row 0 on top: a numpy array that a notebook shows as a picture."""

    def __new__(cls, pixels: ArrayLike) -> Self:
        """View an array `(h, w, 3)` as a picture; no copy where it is float32."""
        return np.asarray(pixels, dtype=np.float32).view(cls)

    def save(self, path: Path_, exposure: float = 0.0) -> None:
        """Write `.exr` or `.npy` (linear), or `.png`, brightened by `exposure` stops."""
        save(path, self, exposure)

    def _repr_png_(self) -> bytes | None:
        if self.ndim != 3 or self.shape[2] != 3 or self.size == 0:
            return None
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "picture.png"
            save(path, self)
            return path.read_bytes()


def save(path: Path_, pixels: ArrayLike, exposure: float = 0.0) -> None:
    """Write a picture `(h, w, 3)` whole or not at all, as `.exr`, `.npy` (linear) or `.png` (sRGB): the ending decides.

    A PNG is brightened by `exposure` stops. An `OSError` says what cannot be written.
    """
    try:
        found = np.asarray(pixels)
    except ValueError as error:
        raise ValueError("a picture has the shape (h, w, 3), and these rows differ in length") from error
    if found.ndim != 3 or found.shape[2] != 3 or found.size == 0:
        raise ValueError(f"a picture has the shape (h, w, 3), and this has {found.shape}")
    if found.dtype.kind not in "fiu":
        raise TypeError(f"a picture holds real numbers, and the type of this is {found.dtype}")
    _native.write(os.fspath(path), np.require(np.asarray(found), np.float32, ["C", "A"]), real("exposure", exposure))


def read(path: Path_) -> Image:
    """Read a picture `(h, w, 3)` from `.exr` or `.npy`; an `OSError` says what is wrong with the file."""
    return Image(_native.read(os.fspath(path)))


def image(pixels: NDArray[np.float32]) -> Image:
    """View an array as a picture."""
    return pixels.view(Image)
