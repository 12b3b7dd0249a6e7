"""Scenes in the vocabulary of the hand-out."""

import math
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._arrays import array, numbers, real, vectors
from ._arrays import size as as_size
from ._lamps import DirectionalLight, Lamp, PointLight, SpotLight, lamp
from ._materials import Material, surface
from ._rays import Floats, Hits
from ._surfaces import Surfaces


class Sphere:
    """A sphere that reflects as `brdf_params` or a `material` say, or emits the radiance `Le`.

    `brdf_params` are (r, g, b, alpha): with alpha 1 a diffuse reflectance, with alpha above 1 a specular one and
    Phong's exponent. `material` is a `Blend`, a `Ggx` or a `Conductor`. `Le` is (r, g, b) in W / (m^2 sr), the same in
    all directions. Without any of them it is black. `one_sided`: its inside reflects nothing.
    """

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        *,
        brdf_params: ArrayLike | None = None,
        material: Material | None = None,
        Le: ArrayLike | None = None,
        one_sided: bool = False,
    ) -> None:
        """Take centre (3,) and radius in the units of the scene."""
        self.center = numbers("center", center, 3)
        self.radius = real("radius", radius)
        self.surface = surface("sphere", brdf_params, material, Le)
        self.one_sided = bool(one_sided)

    def __repr__(self) -> str:
        """Say what it is."""
        return f"Sphere({self.center}, {self.radius}, {self.surface})"

    def add_to(self, builder: _native.Builder) -> None:
        """Add it to a scene in the making."""
        builder.add_sphere(self.center, self.radius, self.surface.model, self.surface.Le, self.one_sided)


class Mesh:
    """Triangles: `vertices` (n, 3) in the units of the scene and `faces` (m, 3), indices into them.

    The surface is that of `Sphere`, on both sides unless it is `one_sided` (the front is where the corners go round
    counter-clockwise). With `smooth`, or with `normals` (n, 3) at the vertices, shading normals are interpolated.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        brdf_params: ArrayLike | None = None,
        material: Material | None = None,
        Le: ArrayLike | None = None,
        normals: ArrayLike | None = None,
        smooth: bool = False,
        one_sided: bool = False,
    ) -> None:
        """Take the arrays; float64 and uint32 are not copied until the mesh is added to a scene."""
        self.vertices: NDArray[np.float64] = array("vertices", vertices, 3, np.float64)
        self.faces: NDArray[np.uint32] = array("faces", faces, 3, np.uint32)
        self.normals = None if normals is None else array("normals", normals, 3, np.float64)
        self.smooth = bool(smooth)
        self.surface = surface("mesh", brdf_params, material, Le)
        self.one_sided = bool(one_sided)

    def __repr__(self) -> str:
        """Say what it is."""
        return f"Mesh({len(self.vertices)} vertices, {len(self.faces)} faces, {self.surface})"

    def add_to(self, builder: _native.Builder) -> None:
        """Add it to a scene in the making."""
        smooth = self.smooth or self.normals is not None
        model, emitted = self.surface.model, self.surface.Le
        builder.add_mesh(self.vertices, self.faces, self.normals, smooth, model, emitted, self.one_sided)


@dataclass(frozen=True, eq=False)
class Light:
    """An object that emits: a sphere has `center` and `radius`, a mesh `vertices` and `faces`."""

    object: int
    """Its number, as `Hits.object` has it."""
    Le: Floats
    """Its radiance, (3,)."""
    center: NDArray[np.float64] | None = None
    radius: float | None = None
    vertices: NDArray[np.float64] | None = None
    faces: NDArray[np.uint32] | None = None


# What a parent's process left in a child after a fork. To free it would wait for threads that are not there.
_ORPHANS: list[object] = []

_KEPT = 3

_FEW = 1024
"""Answers to fewer rays are arrays of their own."""

_MOST_KEPT = 1 << 24
"""Numbers that a scene keeps room for between queries: 64 MB, two million rays."""


class Scene:
    """Geometry, a camera and a picture's size. What was added is checked when the scene is first rendered or asked."""

    def __init__(self, size: tuple[int, int] = (768, 512)) -> None:
        """Begin a scene without geometry whose pictures have (width, height) pixels."""
        self._builder = _native.Builder(*as_size(size))
        self._camera = False
        self._forget()

    @classmethod
    def _of(cls, built: _native.Scene) -> "Scene":
        scene = cls.__new__(cls)
        scene._builder, scene._camera = built.builder(), True
        scene._forget()
        scene._built = built
        return scene

    def _forget(self) -> None:
        self._built: _native.Scene | None = None
        self._prepared: dict[object, _native.Prepared] = {}
        self._surfaces: Surfaces | None = None
        self._lights: list[Light] | None = None
        self._rooms: list[Floats] = []
        self.faults: dict[object, Any] = {}
        """What `check` found of known faults in this scene: the same for every estimator that is checked."""
        self._pid = os.getpid()

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of its pictures in pixels."""
        return self._builder.size

    def set_size(self, size: tuple[int, int]) -> None:
        """Give its pictures another width and height."""
        self._builder.set_size(*as_size(size))
        self._forget()

    def set_camera(
        self,
        eye: ArrayLike,
        at: ArrayLike,
        up: ArrayLike | None = None,
        fov_x: float | None = None,
        *,
        fov_y: float | None = None,
        lens: tuple[float, float] | None = None,
    ) -> None:
        """Put a camera at `eye` that looks at the point `at`; `up` is a direction.

        The full angle of view in degrees is `fov_x` across the width or `fov_y` across the height. `lens` is (radius,
        distance of the plane in focus).
        """
        if (fov_x is None) == (fov_y is None):
            raise ValueError("a camera has one angle of view: give fov_x or fov_y, such as fov_x=40")
        fov = real("fov_x", fov_x) if fov_y is None else real("fov_y", fov_y)
        upwards = None if up is None else numbers("up", up, 3)
        disk = None if lens is None else numbers("lens", lens, 2)
        self._builder.set_camera(numbers("eye", eye, 3), numbers("at", at, 3), upwards, fov, fov_y is None, disk)
        self._camera = True
        self._forget()

    def set_environment(self, Le: ArrayLike) -> None:
        """Let rays that leave the scene see the radiance `Le` (3,)."""
        self._builder.set_environment(numbers("Le", Le, 3))
        self._forget()

    def add_geometry(self, geometry: Sphere | Mesh) -> None:
        """Add a `Sphere` or a `Mesh`; one with `Le` is a light."""
        if not isinstance(geometry, (Sphere, Mesh)):
            raise TypeError(f"geometry is a Sphere or a Mesh, and this is {type(geometry).__name__}")
        geometry.add_to(self._builder)
        self._forget()

    def add_light(self, light: Lamp) -> None:
        """Add a light without shape: a `PointLight`, a `SpotLight` or a `DirectionalLight`."""
        if not isinstance(light, (PointLight, SpotLight, DirectionalLight)):
            kinds = "a PointLight, a SpotLight or a DirectionalLight"
            remedy = "; geometry with Le goes to add_geometry" if isinstance(light, (Sphere, Mesh)) else ""
            raise TypeError(f"a light without shape is {kinds}, and this is {type(light).__name__}{remedy}")
        self._builder.add_light(*light.told())
        self._forget()

    @property
    def built(self) -> "_native.Scene":
        """The checked scene: what is asked of it may raise a `SceneError`."""
        if self._built is None:
            if not self._camera:
                raise _lacking_camera()
            self._built = self._builder.build()
        return self._built

    def check(self) -> list[str]:
        """Check everything now; return what should be said of the scene, or raise a `SceneError` of what cannot be."""
        return self.built.notes

    @property
    def notes(self) -> list[str]:
        """What should be said of the scene, a sentence each."""
        return self.built.notes

    @property
    def hash(self) -> str:
        """SHA-256 of all that decides a picture but its size and the settings of a render."""
        return self.built.hash

    @property
    def estimator(self) -> tuple[str, str]:
        """The estimator of its pictures where `render` is given none, and the reason.

        It is the one that the scene's file names, else the one that "auto" takes: "product".
        """
        return self.built.estimator

    @property
    def lights(self) -> list[Light]:
        """All objects that emit, in the order of their numbers; lights without shape are `lamps`."""
        if self._lights is None:
            meshes, _ = self.built.counts
            self._lights = [self._light(int(i), meshes) for i in np.flatnonzero(self.surfaces.Le.any(axis=1))]
        return self._lights

    @property
    def lamps(self) -> list[Lamp]:
        """All lights without shape; a spot's aim is its `direction`."""
        return [lamp(told) for told in self.built.lamps]

    def _light(self, i: int, meshes: int) -> Light:
        Le = self.surfaces.Le[i]
        if i < meshes:
            vertices, faces, _ = self.built.mesh(i)
            return Light(i, Le, vertices=vertices, faces=faces)
        center, radius = self.built.sphere(i - meshes)
        return Light(i, Le, center=np.array(center), radius=radius)

    @property
    def surfaces(self) -> Surfaces:
        """What its objects reflect and emit."""
        if self._surfaces is None:
            self._surfaces = Surfaces(self.built)
        return self._surfaces

    def environment(self, directions: ArrayLike) -> NDArray[np.float64]:
        """Give the radiance from beyond all objects, (n, 3), for unit directions (n, 3) that leave the scene.

        It is that of the environment, 0 where there is none; the disk of a sun is left out.
        """
        return self.surfaces.environment(vectors("directions", directions))

    def prepared(
        self,
        size: tuple[int, int] | None = None,
        estimator: str | None = None,
        sampler: str | None = None,
        seed: int | None = None,
        threads: int | None = None,
        accel: str | None = None,
    ) -> "_native.Prepared":
        """Give the scene with its accelerator; the last few are kept, and a process that was forked makes its own."""
        if self._pid != os.getpid():
            _ORPHANS.append(self._prepared)
            self._prepared, self._pid = {}, os.getpid()
        key = (size or self.size, estimator, sampler, seed, threads, accel)
        found = self._prepared.get(key)
        if found is None:
            found = _native.Prepared(self.built, *key)
            while len(self._prepared) >= _KEPT:
                self._prepared.pop(next(iter(self._prepared)))
            self._prepared[key] = found
        return found

    def intersect(
        self, origins: ArrayLike, directions: ArrayLike, tmax: ArrayLike | None = None, *, coherent: bool = False
    ) -> Hits:
        """Say what rays meet first.

        `origins` and `directions` are `(n, 3)`, or one of them a vector `(3,)` for all rays; directions need not be
        unit. `tmax` `(n,)`, or a number, ends rays after so many lengths of their directions. C-contiguous float32 is
        read as it lies. With `coherent`, for neighbours that go the same way as those of a camera, it is faster;
        answers are the same.

        A ray whose numbers are not finite, or whose direction is 0, meets nothing. Rays start at their origins, so
        those that leave a surface must start a little beside it.
        """
        rays = self._rays(origins, directions, tmax)
        n = len(rays[0])
        found = self._room(n)
        self.prepared().intersect(rays, bool(coherent), *found)
        return Hits(rays[:2], self.surfaces, tuple(found))

    def _room(self, n: int) -> list[NDArray[Any]]:
        """Give arrays for the answers to `n` rays: room of earlier ones if nobody holds them any more, else new.

        The system clears new pages, which took a fifth of the time of coherent rays.
        """
        if n < _FEW:
            new = ((n,), np.float32), ((n, 3), np.float32), ((n, 2), np.float32), ((n,), np.uint32), ((n,), np.uint32)
            return [np.empty(shape, dtype) for shape, dtype in new]
        kept: Floats | None = self._rooms.pop() if self._rooms else None
        # 2: nothing but `kept` and the argument of `getrefcount`, so no view of it is left.
        if kept is None or len(kept) < 8 * n or sys.getrefcount(kept) > 2:
            kept = np.empty(8 * n, np.float32)
        if len(kept) <= _MOST_KEPT:
            self._rooms = [kept]
        t, normal, uv, object_, primitive = np.split(kept[: 8 * n], np.multiply((1, 4, 6, 7), n))
        return [t, normal.reshape(n, 3), uv.reshape(n, 2), object_.view(np.uint32), primitive.view(np.uint32)]

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, tmax: ArrayLike | None = None, *, coherent: bool = False
    ) -> NDArray[np.bool_]:
        """Say whether rays meet anything before their ends, `(n,)` bool; the arguments are those of `intersect`."""
        rays = self._rays(origins, directions, tmax)
        blocked = np.empty(len(rays[0]), np.bool_)
        self.prepared().occluded(rays, bool(coherent), blocked)
        return blocked

    def _rays(self, origins: ArrayLike, directions: ArrayLike, tmax: Any) -> tuple[Floats, Floats, Floats | None]:
        many = [len(x) for x in (origins, directions) if np.ndim(x) > 1 and isinstance(x, (np.ndarray, Sequence))]
        count = many[0] if many else 1
        o, d = vectors("origins", origins, count), vectors("directions", directions, count)
        if len(o) != len(d):
            raise ValueError(f"there are {len(o)} origins and {len(d)} directions")
        if tmax is None:
            return o, d, None
        end = np.full(len(o), real("tmax", tmax), np.float32) if np.ndim(tmax) == 0 else array("tmax", tmax, None)
        if len(end) != len(o):
            raise ValueError(f"there are {len(o)} origins, and tmax has {len(end)}")
        return o, d, end

    def eye_rays(
        self, size: tuple[int, int] | None = None, rng: np.random.Generator | None = None
    ) -> tuple[Floats, Floats]:
        """Give one ray of each pixel, row by row from the top: origins and unit directions, both `(h w, 3)` float32.

        They go through the middles of pixels and of the lens, or with `rng` through points drawn uniformly on both.
        """
        width, height = self.size if size is None else as_size(size)
        eye, at, up, fov, across, lens = self.built.camera
        forward = _unit(np.subtract(at, eye))
        right = _unit(np.cross(forward, up))
        half = math.tan(math.radians(fov) / 2)
        wide, high = (half, half * height / width) if across else (half * width / height, half)
        upwards = np.cross(right, forward)
        y, x = np.divmod(np.arange(width * height), width)
        u, v = (0.5, 0.5) if rng is None else rng.random((2, width * height))
        a, b = wide * (2 * (x + u) / width - 1), high * (1 - 2 * (y + v) / height)
        directions = forward + a[:, None] * right + b[:, None] * upwards
        origins = np.broadcast_to(np.array(eye), directions.shape)
        if lens is not None and rng is not None:
            r, phi = lens[0] * np.sqrt(rng.random(len(a))), 2 * np.pi * rng.random(len(a))
            sharp = origins + lens[1] * directions
            origins = origins + (r * np.cos(phi))[:, None] * right + (r * np.sin(phi))[:, None] * upwards
            directions = sharp - origins
        directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        # In C order, which `intersect` takes as it lies; that of a broadcast eye would be kept.
        return origins.astype(np.float32, order="C"), directions.astype(np.float32, order="C")

    def __repr__(self) -> str:
        """Say how large its pictures are."""
        return f"<octolux.Scene: {self.size[0]} x {self.size[1]} pixels>"

    def __reduce__(self) -> str:
        """Refuse to be pickled: accelerators stay in their process."""
        raise TypeError("a Scene cannot be pickled; load or build it where it is needed")


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return vector / np.linalg.norm(vector)


def _lacking_camera() -> _native.SceneError:
    remedy = "call set_camera(eye, at, up, fov_x)"
    error = _native.SceneError(f"the scene has no camera; {remedy}")
    error.subject, error.remedy = "camera", remedy
    return error


def load(path: str | os.PathLike[str]) -> Scene:
    """Load a scene file as the command does. A `SceneError` names file, line, key and value, and what would do."""
    if not isinstance(path, (str, os.PathLike)):
        raise TypeError(f"a scene file's path is a str or a Path, and this is {type(path).__name__}")
    return Scene._of(_native.load(os.fspath(path)))
