"""Where things are, and the scenes that several tests use."""

import os
import sys
from pathlib import Path

import pytest

import octolux as ol

REPOSITORY = Path(__file__).resolve().parents[2]
OCTOLUX = os.environ.get("OCTOLUX", str(REPOSITORY / "target/release/octolux"))
sys.path.insert(0, str(REPOSITORY / "python/examples"))

QUAD = [(0, 1, 2), (0, 2, 3)]


@pytest.fixture
def ball() -> ol.Scene:
    """A diffuse sphere of radius 1 at the origin and a light above it, seen from z = 5."""
    scene = ol.Scene(size=(32, 24))
    scene.set_camera((0, 0, 5), (0, 0, 0), fov_x=50)
    scene.add_geometry(ol.Sphere((0, 0, 0), 1, brdf_params=(0.5, 0.6, 0.7, 1)))
    scene.add_geometry(ol.Sphere((0, 4, 1), 0.5, Le=(10, 9, 8)))
    return scene
