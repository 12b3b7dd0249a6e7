"""Lights without shape: points, spots and suns."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import numbers, real
from ._materials import Told


@dataclass(frozen=True)
class PointLight:
    """A point at `position` of the radiant intensity `intensity` (3,) in W / sr."""

    position: ArrayLike
    intensity: ArrayLike

    def told(self) -> Told:
        """Give its numbers."""
        return "point", (*numbers("position", self.position, 3), *numbers("intensity", self.intensity, 3))


@dataclass(frozen=True)
class SpotLight:
    """A point at `position` that shines at the point `target`, or along `direction`; give one of the two.

    `intensity` (3,) is that on the axis in W / sr. It is full up to `inner_angle` degrees from the axis, none from
    `outer_angle` on, and between them multiplied by x^2 (3 - 2 x), where x goes from 0 to 1 with the cosine.
    """

    position: ArrayLike
    intensity: ArrayLike
    outer_angle: float
    inner_angle: float = 0.0
    target: ArrayLike | None = None
    direction: ArrayLike | None = None

    def told(self) -> Told:
        """Give its numbers."""
        position, intensity = numbers("position", self.position, 3), numbers("intensity", self.intensity, 3)
        if (self.target is None) == (self.direction is None):
            raise ValueError("a spot has one aim: give target, a point, or direction")
        if self.target is not None:
            axis = tuple(float(x) for x in np.subtract(numbers("target", self.target, 3), position))
            if not any(axis):
                raise ValueError("a spot's target must differ from its position")
        else:
            axis = numbers("direction", self.direction, 3)
        angles = real("inner_angle", self.inner_angle), real("outer_angle", self.outer_angle)
        return "spot", (*position, *axis, *intensity, *angles)


@dataclass(frozen=True)
class DirectionalLight:
    """Light that goes along `direction` from far away; `irradiance` (3,) in W / m^2 is that of a surface that faces it.

    With an `angular_radius`, in degrees up to 90, it is a disk in the sky that the camera sees: a sun. That of the
    earth has 0.2665.
    """

    direction: ArrayLike
    irradiance: ArrayLike
    angular_radius: float = 0.0

    def told(self) -> Told:
        """Give its numbers."""
        direction, irradiance = numbers("direction", self.direction, 3), numbers("irradiance", self.irradiance, 3)
        return "directional", (*direction, *irradiance, real("angular_radius", self.angular_radius))


Lamp: TypeAlias = PointLight | SpotLight | DirectionalLight


def lamp(told: tuple[str, list[float]]) -> Lamp:
    """Give the light that a built scene tells of."""
    kind, n = told
    if kind == "point":
        return PointLight(np.array(n[:3]), np.array(n[3:]))
    if kind == "spot":
        position, axis, intensity = (np.array(n[i : i + 3]) for i in (0, 3, 6))
        return SpotLight(position, intensity, outer_angle=n[10], inner_angle=n[9], direction=axis)
    return DirectionalLight(np.array(n[:3]), np.array(n[3:6]), n[6])
