"""How surfaces reflect and what they emit."""

from dataclasses import dataclass
from typing import TypeAlias

from numpy.typing import ArrayLike

from ._arrays import numbers, real

Numbers: TypeAlias = tuple[float, ...]

Told: TypeAlias = tuple[str, Numbers]
"""A model by the library's name, and its numbers in the order of the constructor."""


@dataclass(frozen=True)
class Blend:
    """The sum of a diffuse reflectance `diffuse` and a Phong lobe: `phong` and `exponent`, which is above 1."""

    diffuse: ArrayLike
    phong: ArrayLike
    exponent: float

    def told(self) -> Told:
        """Give its numbers."""
        diffuse, phong = numbers("diffuse", self.diffuse, 3), numbers("phong", self.phong, 3)
        return "blend", (*diffuse, *phong, real("exponent", self.exponent))


@dataclass(frozen=True)
class Ggx:
    """The metallic-roughness model of glTF: metal of the colour `base_color`, or a diffuse body of it below a coat.

    `metallic` is the share of metal, 0 to 1; `roughness` goes from 0.0001 to 1.
    """

    base_color: ArrayLike
    metallic: float
    roughness: float

    def told(self) -> Told:
        """Give its numbers."""
        base = numbers("base_color", self.base_color, 3)
        return "ggx", (*base, real("metallic", self.metallic), real("roughness", self.roughness))


@dataclass(frozen=True)
class Conductor:
    """Metal by its index of refraction `eta` and its extinction `k`, each (3,); `roughness` as for `Ggx`."""

    eta: ArrayLike
    k: ArrayLike
    roughness: float

    def told(self) -> Told:
        """Give its numbers."""
        eta, k = numbers("eta", self.eta, 3), numbers("k", self.k, 3)
        return "conductor", (*eta, *k, real("roughness", self.roughness))


Material: TypeAlias = Blend | Ggx | Conductor

BLACK: Told = ("brdf_params", (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Surface:
    """One that reflects as `model` says, or one that emits `Le`."""

    model: Told
    Le: Numbers | None

    def __str__(self) -> str:
        """Say which, in one argument."""
        return f"Le={self.Le}" if self.Le else f"{self.model[0]}={self.model[1]}"


def surface(what: str, brdf_params: ArrayLike | None, material: Material | None, Le: ArrayLike | None) -> Surface:
    """Give the reflecting or the emitting side of a surface; not both."""
    model = None if brdf_params is None else ("brdf_params", numbers("brdf_params", brdf_params, 4))
    if material is not None:
        if not isinstance(material, (Blend, Ggx, Conductor)):
            raise TypeError(f"material is a Blend, a Ggx or a Conductor, and this is {type(material).__name__}")
        if model is not None:
            raise ValueError(f"this {what} has brdf_params and a material; leave one of them out")
        model = material.told()
    emitted = None if Le is None else numbers("Le", Le, 3)
    if emitted is None or not any(emitted):
        # What emits nothing is black by its emission, as in scene files, unless it reflects.
        return Surface(model or BLACK, emitted if model is None else None)
    if model is not None and (material is not None or any(model[1][:3])):
        named = "a material" if material is not None else "brdf_params"
        raise ValueError(f"this {what} has {named} and Le; lights do not reflect: leave one of them out")
    return Surface(BLACK, emitted)
