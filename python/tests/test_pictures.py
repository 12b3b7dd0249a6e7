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
    assert listed.split(", ") == ["auto", *ol.ESTIMATORS]


def test_auto_is_what_a_silent_scene_gets(ball: ol.Scene) -> None:
    """With its name, its reason and the same bits; what a file names is its own."""
    silent = ol.render(ball, **SETTINGS)
    name, why = ball.estimator
    assert name == "product" and "least error" in why
    assert np.array_equal(silent, ol.render(ball, estimator="auto", **SETTINGS))
    assert np.array_equal(silent, ol.render(ball, estimator=name, **SETTINGS))
    assert not np.array_equal(silent, ol.render(ball, estimator="mis", **SETTINGS))
    assert ol.load(REPOSITORY / "scenes/mesh-light.toml").estimator[0] == "product"


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


def material(told: dict) -> dict:
    """Give the arguments of a surface for a table of `[materials]`."""
    if "brdf_params" in told:
        return {"brdf_params": told["brdf_params"]}
    if "eta" in told:
        return {"material": ol.Conductor(**told)}
    if "base_color" in told:
        return {"material": ol.Ggx(**told)}
    if "diffuse" in told and "phong" in told:
        return {"material": ol.Blend(**told)}
    return {"brdf_params": (*(told.get("diffuse") or told["phong"]), told.get("exponent", 1))}


def light(told: dict) -> object:
    """Give the light of a table of `[[lights]]`."""
    kinds = {"point": ol.PointLight, "spot": ol.SpotLight, "directional": ol.DirectionalLight}
    return kinds[told["kind"]](**{key: value for key, value in told.items() if key != "kind"})


@pytest.mark.parametrize("name", ["veach-mis", "blend", "ggx", "lamps", "tests/sun-phong", "tests/spot-edge"])
def test_a_scene_built_by_hand_has_the_bits_of_the_command(name: str, tmp_path: Path) -> None:
    """Of scenes whose texts have all of their numbers; they are read here by Python."""
    told = tomllib.loads((REPOSITORY / f"scenes/{name}.toml").read_text())
    camera, film = told["camera"], told["film"]
    scene = ol.Scene(size=(film["width"], film["height"]))
    angle = {key: camera[key] for key in ("fov_x", "fov_y") if key in camera}
    scene.set_camera(camera["origin"], camera["target"], camera.get("up"), **angle)
    if "environment" in told:
        scene.set_environment(told["environment"]["emission"])

    def surface(shape: dict) -> dict:
        return {"Le": shape["emission"]} if "emission" in shape else material(told["materials"][shape["material"]])

    for mesh in told.get("meshes", []):
        faces = [
            face[i : i + 3] if i == 0 else [face[0], *face[2:]] for face in mesh["faces"] for i in range(len(face) - 2)
        ]
        scene.add_geometry(ol.Mesh(mesh["vertices"], faces, **surface(mesh)))
    for sphere in told.get("spheres", []):
        scene.add_geometry(ol.Sphere(sphere["center"], sphere["radius"], **surface(sphere)))
    for lamp in told.get("lights", []):
        scene.add_light(light(lamp))
    assert len(scene.lamps) == len(told.get("lights", []))
    estimator = told.get("render", {}).get("estimator")
    image = ol.render(scene, estimator=estimator, **SETTINGS)
    assert np.array_equal(image, by_command(f"scenes/{name}.toml", tmp_path))


def test_lamps_of_a_scene_make_the_same_scene() -> None:
    """What `lamps` tells, `add_light` takes."""
    told = ol.load(REPOSITORY / "scenes/lamps.toml")
    sun, spot, point = told.lamps
    assert isinstance(sun, ol.DirectionalLight) and sun.angular_radius == 1.1
    assert isinstance(spot, ol.SpotLight) and (spot.inner_angle, spot.outer_angle) == (8, 15)
    assert isinstance(point, ol.PointLight) and tuple(point.intensity) == (4.5, 2.4, 0.8)

    def with_lamps() -> ol.Scene:
        scene = ol.Scene()
        scene.set_camera((0, 0, 9), (0, 0, 0), fov_x=40)
        scene.add_geometry(ol.Sphere((0, 0, 0), 1, brdf_params=(0.5, 0.5, 0.5, 1)))
        return scene

    once, again = with_lamps(), with_lamps()
    for lamp in told.lamps:
        once.add_light(lamp)
    for lamp in once.lamps:
        again.add_light(lamp)
    assert once.hash == again.hash != with_lamps().hash


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
