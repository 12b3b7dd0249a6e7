"""Octolux: direct illumination in SIMD packets, for numpy.

>>> import octolux as ol
>>> scene = ol.Scene(size=(384, 256))
>>> scene.set_camera(eye=(0, 2, 6), at=(0, 0.7, 0), up=(0, 1, 0), fov_x=40)
>>> scene.add_geometry(ol.Sphere((0, 0.8, 0), 0.8, brdf_params=(0.6, 0.6, 0.65, 30)))
>>> scene.add_geometry(ol.Sphere((-2, 4, 2), 0.5, Le=(40, 38, 34)))
>>> image = ol.render(scene, spp=64)                       # (256, 384, 3) float32, linear radiance

`load` reads scene files, `progressive` shows a picture as it converges, `Scene.intersect` and `Scene.occluded` answer
rays in arrays, and `check` holds an estimator of your own against the oracle.

Lengths are in the units of the scene, angles in degrees, radiances in W / (m^2 sr), linear RGB. Scenes that cannot be
are a `SceneError`, a `ValueError` that names the part and what would do. Other wrong arguments are a `ValueError` or
a `TypeError`.
"""

from . import _processor
from ._check import Block, Report, check
from ._lamps import DirectionalLight, PointLight, SpotLight
from ._materials import Blend, Conductor, Ggx
from ._native import SceneError
from ._picture import Image, read, save
from ._rays import Hits
from ._render import ESTIMATORS, progressive, reference, render
from ._scene import Light, Mesh, Scene, Sphere, load

__all__ = [
    "ESTIMATORS",
    "Blend",
    "Block",
    "Conductor",
    "DirectionalLight",
    "Ggx",
    "Hits",
    "Image",
    "Light",
    "Mesh",
    "PointLight",
    "Report",
    "Scene",
    "SceneError",
    "Sphere",
    "SpotLight",
    "check",
    "load",
    "progressive",
    "read",
    "reference",
    "render",
    "save",
]
__version__ = "0.1.0"
