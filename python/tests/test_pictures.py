"""Pictures have the bits of the command line, and the oracle agrees."""

import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from conftest import OCTOLUX, REPOSITORY

import octolux as ol

SETTINGS = {"size": (48, 32), "spp": 4, "seed": 3}


def test_estimators_are_those_of_the_command() -> None:
    """The program lists its own in the answer to a name that it does not know."""
    command = [OCTOLUX, "render", "scene.toml", "--estimator", "none"]
    said = subprocess.run(command, capture_output=True, text=True, check=False).stderr
    listed = said.split("[possible values: ")[1].split("]")[0]
    assert tuple(listed.split(", ")) == ol.ESTIMATORS


def by_command(scene: str, folder: Path) -> np.ndarray:
    """Render with the program."""
    path = folder / "picture.npy"
    command = [
        OCTOLUX,
        "render",
        str(REPOSITORY / scene),
        "-o",
        str(path),
        "--size",
        "48x32",
        "--spp",
        "4",
        "--seed",
        "3",
    ]
    subprocess.run(command, check=True, capture_output=True)
    return np.load(path)


@pytest.mark.parametrize(
    "scene", ["veach-mis", "knot", "many-spheres", "sky", "textures", "lens", "mesh-light", "blend"]
)
def test_a_loaded_scene_has_the_bits_of_the_command(scene: str, tmp_path: Path) -> None:
    """Of every kind of scene."""
    image = ol.render(ol.load(REPOSITORY / f"scenes/{scene}.toml"), **SETTINGS)
    assert image.dtype == np.float32 and image.shape == (32, 48, 3)
    assert np.array_equal(image, by_command(f"scenes/{scene}.toml", tmp_path))


def test_a_scene_built_by_hand_has_the_bits_of_the_command(tmp_path: Path) -> None:
    """Veach's, whose text has all of its numbers; it is read here by Python."""
    told = tomllib.loads((REPOSITORY / "scenes/veach-mis.toml").read_text())
    camera, film = told["camera"], told["film"]
    scene = ol.Scene(size=(film["width"], film["height"]))
    angle = {key: camera[key] for key in ("fov_x", "fov_y") if key in camera}
    scene.set_camera(camera["origin"], camera["target"], camera.get("up"), **angle)

    def surface(shape: dict) -> dict:
        if "emission" in shape:
            return {"Le": shape["emission"]}
        material = told["materials"][shape["material"]]
        if "brdf_params" in material:
            return {"brdf_params": material["brdf_params"]}
        rho = material.get("diffuse") or material["phong"]
        return {"brdf_params": (*rho, material.get("exponent", 1))}

    for mesh in told["meshes"]:
        scene.add_geometry(ol.Mesh(mesh["vertices"], mesh["faces"], **surface(mesh)))
    for sphere in told["spheres"]:
        scene.add_geometry(ol.Sphere(sphere["center"], sphere["radius"], **surface(sphere)))
    image = ol.render(scene, **SETTINGS)
    assert np.array_equal(image, by_command("scenes/veach-mis.toml", tmp_path))


def test_progressive_ends_with_the_bits_of_render(ball: ol.Scene) -> None:
    """And shows 1, 2, 4, ... passes on the way."""
    shown = list(ol.progressive(ball, spp=12))
    assert [passes for passes, _ in shown] == [1, 2, 4, 8, 12]
    assert np.array_equal(shown[-1][1], ol.render(ball, spp=12))
    assert np.array_equal(shown[1][1], ol.render(ball, spp=2))


def test_threads_and_time_change_no_bit(ball: ol.Scene) -> None:
    """A picture depends on its settings alone."""
    one = ol.render(ball, spp=8, threads=1)
    assert np.array_equal(one, ol.render(ball, spp=8, threads=3))
    assert not np.array_equal(one, ol.render(ball, spp=8, seed=1))
    assert ol.render(ball, seconds=0.05).shape == (24, 32, 3)


def test_the_oracle_agrees(ball: ol.Scene) -> None:
    """The mean of all pixels, at 5 standard errors of both; one right pair in 500 000 differs by more."""
    mean, error = ol.reference(ball, spp=256, seed=1)
    runs = np.array([ol.render(ball, spp=32, sampler="independent", seed=i).mean(dtype=np.float64) for i in range(16)])
    noise = np.hypot(runs.std(ddof=1) / 4, np.sqrt((error**2).sum()) / error.size)
    assert abs(runs.mean() - mean.mean()) < 5 * noise
    assert noise < 0.01 * mean.mean()


def test_pieces_of_the_oracle_are_one(ball: ol.Scene) -> None:
    """Moments of pieces are those of all samples: the error falls as the root of their number, within a tenth."""
    errors = [np.sqrt((ol.reference(ball, spp=spp, size=(16, 12), seed=5)[1] ** 2).mean()) for spp in (64, 4096)]
    assert errors[0] / errors[1] == pytest.approx(8, rel=0.1)


def test_a_notebook_shows_pictures(ball: ol.Scene) -> None:
    """As PNG; slices that are none are shown as arrays."""
    image = ol.render(ball, spp=1)
    assert image._repr_png_().startswith(b"\x89PNG")
    assert image[0]._repr_png_() is None
    assert isinstance(image * 2, ol.Image)


def test_files_hold_what_was_rendered(ball: ol.Scene, tmp_path: Path) -> None:
    """Both linear formats, bit for bit."""
    image = ol.render(ball, spp=1)
    for name in ("a.exr", "a.npy"):
        image.save(tmp_path / name)
        assert np.array_equal(ol.read(tmp_path / name), image)
    with pytest.raises(OSError, match=r"\.exr, \.png or \.npy"):
        image.save(tmp_path / "a.jpg")
