"""What rays meet."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._surfaces import Surfaces

Floats = NDArray[np.float32]


class Hits:
    """What `n` rays meet first, as arrays of `n` rows; `hits[mask]` and `hits[indices]` choose among them.

    - `t (n,)` float32: distance in lengths of the direction, `inf` where nothing is met;
    - `normal (n, 3)` float32: unit geometric normal on the side of the ray's origin, 0 where nothing is met;
    - `uv (n, 2)` float32: barycentric coordinates of a triangle's second and third corner, 0 on spheres;
    - `object (n,)` int32: meshes count from 0 in the scene's order, spheres from the number of meshes on; -1 where
      nothing is met;
    - `primitive (n,)` int32: the triangle of a mesh, 0 on spheres, -1 where nothing is met.

    Further arrays are made when they are first asked for: `hit`, `point`, `brdf_params`,
    `blend_params`, `Le`.
    """

    __slots__ = ("_made", "_rays", "_surfaces", "normal", "object", "primitive", "t", "uv")

    def __init__(self, rays: tuple[Floats, Floats], surfaces: Surfaces, found: tuple[NDArray[Any], ...]) -> None:
        """Hold the answers to `rays`; `surfaces` are those of all objects."""
        self._rays, self._surfaces = rays, surfaces
        self.t: Floats = found[0]
        self.normal: Floats = found[1]
        self.uv: Floats = found[2]
        self.object: NDArray[np.int32] = found[3].view(np.int32)
        self.primitive: NDArray[np.int32] = found[4].view(np.int32)
        self._made: dict[str, NDArray[Any]] = {}

    def __len__(self) -> int:
        """How many rays there are."""
        return len(self.t)

    def __getitem__(self, which: Any) -> "Hits":
        """Choose among the rays by a mask, a slice or an array of indices."""
        if isinstance(which, (int, np.integer)):
            raise TypeError("hits are chosen by a mask, a slice or an array of indices; one ray is hits[i:i+1]")
        origins, directions = self._rays
        found = (self.t, self.normal, self.uv, self.object, self.primitive)
        return Hits((origins[which], directions[which]), self._surfaces, tuple(array[which] for array in found))

    def __repr__(self) -> str:
        """Say how many rays meet something."""
        return f"<octolux.Hits: {len(self)} rays, {int(self.hit.sum())} meet something>"

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Which rays meet something, `(n,)`."""
        hit: NDArray[np.bool_] = self._keep("hit", lambda: self.object >= 0)
        return hit

    @property
    def point(self) -> Floats:
        """Where they do, `(n, 3)` float32 in the units of the scene; not finite where nothing is met."""
        point: Floats = self._keep("point", self._points)
        return point

    @property
    def brdf_params(self) -> Floats:
        """What the hand-out calls so, `(n, 4)` float32: reflectance and exponent, which is 1 on diffuse surfaces.

        Textures are multiplied in. Of a `Blend` it is the diffuse part; a `Ggx` and a `Conductor` are NaN. 0, 0, 0, 1
        on lights and where nothing is met.
        """
        brdf: Floats = self._keep("brdf_params", lambda: self._surfaces.reflectance(self))
        return brdf

    @property
    def blend_params(self) -> Floats:
        """What a `Blend` adds to `brdf_params`, `(n, 4)` float32: the reflectance and exponent of its Phong lobe.

        0, 0, 0, 1 on all other surfaces and where nothing is met.
        """
        blend: Floats = self._keep("blend_params", lambda: self._surfaces.blend[self.object])
        return blend

    @property
    def Le(self) -> Floats:
        """Radiance that the surface emits, `(n, 3)` float32; 0 where nothing is met."""
        emitted: Floats = self._keep("Le", lambda: self._surfaces.Le[self.object])
        return emitted

    def _points(self) -> Floats:
        origins, directions = self._rays
        with np.errstate(invalid="ignore", over="ignore"):
            return (origins + self.t[:, None].astype(np.float64) * directions).astype(np.float32)

    def _keep(self, name: str, make: Any) -> Any:
        if name not in self._made:
            self._made[name] = make()
        return self._made[name]
