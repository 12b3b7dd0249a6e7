"""What is wrong gets a sentence, in whatever order it comes."""

from pathlib import Path

import numpy as np
import pytest

import octolux as ol


def said(call, kind=ValueError) -> str:
    """Give what an exception of this kind says."""
    with pytest.raises(kind) as caught:
        call()
    return str(caught.value)


def test_a_wrong_scene_names_the_part_and_what_would_do(ball: ol.Scene) -> None:
    """As the library says it."""
    ball.add_geometry(ol.Sphere((1, 2, 3), -0.5, Le=(1, 1, 1)))
    with pytest.raises(ol.SceneError, match="sphere 3 radius must be positive and finite, got -0.5") as caught:
        ol.render(ball)
    assert caught.value.subject == "sphere 3"
    assert "above 0" in caught.value.remedy


def test_numbers_that_are_none_are_refused(ball: ol.Scene) -> None:
    """NaN in a centre, a vertex, a radiance; an exponent below 1; an index that is no vertex."""
    triangle = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    wrong = [
        (ol.Sphere((np.nan, 0, 0), 1), "sphere 3"),
        (ol.Sphere((0, 0, 0), 1, Le=(np.nan, 0, 0)), "sphere 3"),
        (ol.Sphere((0, 0, 0), 1, brdf_params=(1, 1, 1, 0.5)), "alpha|exponent"),
        (ol.Mesh([(0, 0, np.inf), *triangle[1:]], [(0, 1, 2)]), "mesh 1"),
        (ol.Mesh(triangle, [(0, 1, 3)]), "mesh 1"),
        (ol.Mesh(triangle, np.zeros((0, 3), int)), "mesh 1"),
    ]
    for geometry, names in wrong:
        scene = ol.Scene()
        scene.set_camera((0, 0, 5), (0, 0, 0), fov_x=50)
        scene.add_geometry(ol.Sphere((0, 0, 0), 1))
        scene.add_geometry(ol.Sphere((3, 0, 0), 1))
        scene.add_geometry(geometry)
        with pytest.raises(ol.SceneError, match=names):
            scene.check()


def rendered(geometry: ol.Sphere) -> ol.Image:
    """Render it alone."""
    scene = ol.Scene(size=(8, 8))
    scene.set_camera((0, 0, 5), (0, 0, 0), fov_x=50)
    scene.add_geometry(geometry)
    return ol.render(scene, spp=1)


def test_wrong_arguments_have_sentences(ball: ol.Scene, tmp_path: Path) -> None:
    """Shapes, types and ranges."""
    assert "(n, 3)" in said(lambda: ball.intersect(np.zeros((4, 2)), np.zeros((4, 2))))
    assert "4 origins and 5 directions" in said(lambda: ball.intersect(np.zeros((4, 3)), np.zeros((5, 3))))
    assert "tmax has 3" in said(lambda: ball.occluded(np.zeros((4, 3)), np.zeros((4, 3)), [1, 2, 3]))
    assert "complex" in said(lambda: ball.intersect(np.zeros((4, 3), complex), np.zeros((4, 3))), TypeError)
    assert "there are auto, uniform, light" in said(lambda: ol.render(ball, estimator="best"))
    assert "spp" in said(lambda: ol.render(ball, spp=0))
    assert "width" in said(lambda: ol.render(ball, size=(0, 10)))
    assert "MiB" in said(lambda: ol.render(ball, size=(65536, 65536)), MemoryError)
    assert "camera" in said(lambda: ol.render(ol.Scene()), ol.SceneError)
    assert "do not reflect" in said(lambda: ol.Sphere((0, 0, 0), 1, Le=(1, 1, 1), brdf_params=(1, 1, 1, 1)))
    both = {"brdf_params": (1, 1, 1, 1), "material": ol.Ggx((1, 1, 1), 0, 0.5)}
    assert "brdf_params and a material" in said(lambda: ol.Sphere((0, 0, 0), 1, **both))
    assert "a material and Le" in said(lambda: ol.Sphere((0, 0, 0), 1, Le=(1, 1, 1), material=both["material"]))
    assert "is a Blend, a Ggx or a Conductor" in said(lambda: ol.Sphere((0, 0, 0), 1, material="gold"), TypeError)
    assert "3 real numbers" in said(lambda: ol.Sphere((0, 0, 0), 1, material=ol.Ggx("red", 0, 0.5)), TypeError)
    assert "roughness" in said(
        lambda: rendered(ol.Sphere((0, 0, 0), 1, material=ol.Ggx((1, 1, 1), 0, 2))), ol.SceneError
    )
    assert "add_geometry" in said(lambda: ball.add_light(ol.Sphere((0, 0, 0), 1, Le=(1, 1, 1))), TypeError)
    assert "one aim" in said(lambda: ball.add_light(ol.SpotLight((0, 0, 0), (1, 1, 1), 30)))
    assert "differ" in said(lambda: ball.add_light(ol.SpotLight((0, 0, 0), (1, 1, 1), 30, target=(0, 0, 0))))
    assert "fov_x or fov_y" in said(lambda: ball.set_camera((0, 0, 1), (0, 0, 0)))
    assert "function" in said(lambda: ol.check(3, ball), TypeError)
    missing = said(lambda: ol.load(tmp_path / "none.toml"), ol.SceneError)
    assert "none.toml" in missing
    broken = tmp_path / "broken.toml"
    broken.write_text("[camera]\norigin = 3\n")
    assert "broken.toml:2" in said(lambda: ol.load(broken), ol.SceneError)


def value(rng: np.random.Generator) -> object:
    """Draw something that may or may not fit."""
    shapes = [(), (0,), (3,), (4,), (0, 3), (1, 3), (5, 3), (5, 2), (2, 2, 3), (5, 3, 1)]
    shape = shapes[rng.integers(len(shapes))]
    kind = rng.choice(["f4", "f8", "i4", "i8", "u1", "c16", "?", "U3", "O", "M8[s]", ">f4"])
    array = (rng.normal(size=shape) * 10.0 ** rng.integers(-30, 30)).astype("f8")
    if rng.random() < 0.3:
        array = np.where(rng.random(shape) < 0.5, rng.choice([np.nan, np.inf, -np.inf, 0]), array)
    with np.errstate(all="ignore"):
        made = np.asarray(np.asarray(np.nan_to_num(array).astype("i8") if kind == "M8[s]" else array).astype(kind))
    if rng.random() < 0.2 and made.ndim == 2:
        made = np.asfortranarray(made)
    if rng.random() < 0.1:
        return made.tolist()
    return odd(rng) if rng.random() < 0.4 else made


def odd(rng: np.random.Generator) -> object:
    """Draw something that is no array; numbers are small, as a render of 2**30 samples would be answered, too."""
    others = [None, "x", b"x", -1, 0, 1, 3.5, 2**70, np.nan, object(), [1, [2, 3]], {}, (1, 2, 3), True]
    return others[rng.integers(len(others))]


@pytest.mark.filterwarnings("ignore")
def test_random_calls_answer_or_say_why(ball: ol.Scene, tmp_path: Path) -> None:
    """10 000 calls: each answers or raises one of Python's own exceptions with a sentence; none ends the process."""
    rng = np.random.default_rng(7)

    def shape_and_ask(geometry: object) -> object:
        scene = ol.Scene(size=(4, 4))
        scene.set_camera((0, 0, 5), (0, 0, 0), fov_x=50)
        scene.add_geometry(geometry)
        return scene.intersect((0, 0, 5), (0, 0, -1))

    calls = [
        lambda: ball.intersect(value(rng), value(rng)),
        lambda: ball.intersect(value(rng), value(rng), value(rng)).point,
        lambda: ball.occluded(value(rng), value(rng), value(rng)),
        lambda: ball.occluded(np.zeros((5, 3)), value(rng), value(rng), coherent=value(rng)),
        lambda: shape_and_ask(ol.Sphere(value(rng), value(rng), brdf_params=value(rng))),
        lambda: shape_and_ask(ol.Sphere((0, 0, 0), 1, Le=value(rng))),
        lambda: shape_and_ask(ol.Mesh(value(rng), value(rng), Le=value(rng))),
        lambda: shape_and_ask(ol.Mesh(np.eye(3), value(rng), normals=value(rng))),
        lambda: shape_and_ask(value(rng)),
        lambda: ol.Scene(size=value(rng)),
        lambda: ol.Scene().set_camera(value(rng), value(rng), value(rng), value(rng), lens=value(rng)),
        lambda: ol.render(ball, spp=odd(rng), size=(4, 4), seed=value(rng)),
        lambda: ol.render(ball, spp=1, size=(value(rng), value(rng)), estimator=value(rng)),
        lambda: ol.reference(ball, spp=odd(rng), size=value(rng), seed=1) if rng.random() < 0.1 else None,
        lambda: ol.save(tmp_path / "a.npy", value(rng), value(rng)),
        lambda: ol.load(value(rng)),
        lambda: ol.check(value(rng), ball, passes=value(rng), size=(4, 4)),
        lambda: ball.eye_rays(value(rng)),
        lambda: ball.intersect((0, 0, 5), np.float32([[0, 0, -1]] * 3))[value(rng)],
    ]
    failed = answered = 0
    for _ in range(10_000):
        call = calls[rng.integers(len(calls))]
        try:
            call()
            answered += 1
        except (ValueError, TypeError, OSError, MemoryError, IndexError) as error:
            failed += 1
            assert len(str(error)) > 10, repr(error)
    assert failed > 1000 and answered > 300
