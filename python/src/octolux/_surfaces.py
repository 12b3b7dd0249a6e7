"""What the objects of a scene reflect and emit, and the light from beyond them."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from . import _native

if TYPE_CHECKING:
    from ._rays import Floats, Hits


class Surfaces:
    """Of each object `brdf_params`, `blend_params` and `Le`; the last row, which is -1, is of nothing."""

    def __init__(self, built: _native.Scene) -> None:
        """Read those of a checked scene; the texels of a texture are read when they are first asked for."""
        self._built = built
        brdf, blend, emitted = built.surfaces()
        dull = np.array([[0, 0, 0, 1]], np.float32)
        self.brdf: Floats = np.concatenate([brdf, dull])
        self.blend: Floats = np.concatenate([blend, dull])
        self.Le: Floats = np.concatenate([emitted, np.zeros((1, 3), np.float32)])
        self._textures: dict[int, _Texture] = {}
        self._sky: tuple[Floats, list[list[float]]] | None = None

    def reflectance(self, hits: "Hits") -> "Floats":
        """Give `brdf_params` where rays meet something, `(n, 4)`, times the textures that are there."""
        brdf: Floats = self.brdf[hits.object]
        for i in self._built.textured:
            if i not in self._textures:
                self._textures[i] = _Texture.of(self._built, i)
            there = np.flatnonzero(hits.object == i)
            if len(there):
                brdf[there, :3] *= self._textures[i].at(hits, there)
        return brdf

    def environment(self, directions: "Floats") -> NDArray[np.float64]:
        """Give the radiance from beyond all objects `(n, 3)`, for unit directions; 0 without an environment."""
        self._sky = self._sky or self._built.environment()
        if self._sky is None:
            return np.zeros((len(directions), 3))
        texels, to_scene = self._sky
        height, width, _ = texels.shape
        x, y, z = (directions.astype(np.float64) @ np.array(to_scene)).T
        across, down = np.arctan2(x, -z) / (2 * np.pi) + 0.5, np.arccos(np.clip(y, -1, 1)) / np.pi
        return _between(texels, across * width, down * height, (False, True))


@dataclass(frozen=True, eq=False)
class _Texture:
    """The texture of one object."""

    texels: "Floats"
    clamps: tuple[bool, bool]
    """Whether the outermost column and row go on outside; otherwise the picture repeats."""
    corners: NDArray[np.float64]
    """Texture coordinates of a mesh's triangles, `(m, 3, 2)`; of a sphere none."""
    center: NDArray[np.float64]
    """Of a sphere."""

    @classmethod
    def of(cls, built: _native.Scene, i: int) -> "_Texture":
        texels, clamps = built.texture(i)
        meshes, _ = built.counts
        if i < meshes:
            _, faces, _ = built.mesh(i)
            uvs = built.uvs(i)
            assert uvs is not None, "without them it shows no texture"
            return cls(texels, (clamps, clamps), uvs[faces], np.zeros(3))
        return cls(texels, (False, True), np.empty((0, 3, 2)), np.array(built.sphere(i - meshes)[0]))

    def at(self, hits: "Hits", there: NDArray[np.intp]) -> NDArray[np.float64]:
        """Give its value `(k, 3)` at some of the hits: bilinear between the middles of texels."""
        height, width, _ = self.texels.shape
        if len(self.corners):
            v, w = hits.uv[there].astype(np.float64).T
            uv = np.einsum("kc,kcx->kx", np.stack([1 - v - w, v, w], axis=1), self.corners[hits.primitive[there]])
        else:
            outward = hits.point[there] - self.center
            x, y, z = (outward / np.linalg.norm(outward, axis=1, keepdims=True)).T
            uv = np.stack([0.5 + np.arctan2(x, z) / (2 * np.pi), 1 - np.arccos(np.clip(y, -1, 1)) / np.pi], axis=1)
        return _between(self.texels, uv[:, 0] * width, (1 - uv[:, 1]) * height, self.clamps)


def _between(
    texels: "Floats", x: NDArray[np.float64], y: NDArray[np.float64], clamps: tuple[bool, bool]
) -> NDArray[np.float64]:
    """Interpolate in a picture, in texels from its top left corner."""
    columns, rows = _two(x, texels.shape[1], clamps[0]), _two(y, texels.shape[0], clamps[1])
    total = np.zeros((len(x), 3))
    for column, across in columns:
        for row, down in rows:
            total += (across * down)[:, None] * texels[row, column]
    return total


def _two(at: NDArray[np.float64], size: int, clamps: bool) -> list[tuple[NDArray[np.int64], NDArray[np.float64]]]:
    """Give the two texels whose middles are beside a place, each with its share."""
    low = np.floor(at - 0.5).astype(np.int64)
    share = at - 0.5 - low
    both = ((low, 1 - share), (low + 1, share))
    return [(np.clip(i, 0, size - 1) if clamps else i % size, part) for i, part in both]
