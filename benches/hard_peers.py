"""The hard cases in which Mitsuba 3 was seen to fail, by Mitsuba and by Octolux, beside the truth.

    python3 -m pip install mitsuba==3.9.1 numpy
    python3 benches/hard_peers.py [PROGRAM]

PROGRAM is ours, by default target/release/octolux. Rows: a sphere light of sin(theta) from 1e-1 to 1e-7 over a diffuse plate; the
same scene moved away from the origin; a closed box with the light outside of it, moved likewise; one seed twice. Mitsuba renders in `scalar_rgb` and `llvm_ad_rgb` (where it finds LLVM)
with its integrator `direct`, one sample of emitters and none of BRDFs, as `light` does. Prints a table in Markdown.
"""

import os
import subprocess
import sys
import tempfile

import mitsuba as mi
import numpy as np

RHO, DISTANCE, COSINE, SPP, SIZE = 0.5, 4.0, 0.5, 256, 32
CENTER = np.array([DISTANCE * 0.75**0.5, DISTANCE * COSINE, 0.0])


def plate(offset, s):
    """Camera, plate and light in the terms of both: the eye sees one spot of a plate in the plane y = offset."""
    return {
        "eye": offset + np.array([-3.0, 3.0, 0.0]),
        "target": offset + np.zeros(3),
        "fov": 0.3,
        "faces": [offset + np.array(v, float) for v in ([-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1])],
        "quads": [[0, 1, 2, 3]],
        "light": (offset + CENTER, DISTANCE * s, 1 / (s * s)),
    }


def box(offset, _):
    """A closed box of side 2 around the eye, and a light outside."""
    corners = [offset + np.array([[-1, 1][i & 1], [-1, 1][i >> 1 & 1], [-1, 1][i >> 2 & 1]], float) for i in range(8)]
    quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    return {
        "eye": offset + np.array([-0.9, 0.3, -0.8]),
        "target": offset + np.array([0.5, -0.4, 0.3]),
        "fov": 120.0,
        "faces": corners,
        "quads": quads,
        "light": (offset + np.array([3.2, 2.0, 1.6]), 0.9, 1.0),
    }


def mitsuba(case, seed=1):
    """The picture by the variant that is set."""
    center, radius, radiance = case["light"]
    triangles = [t for a, b, c, d in case["quads"] for t in ((a, b, c), (a, c, d))]
    mesh = mi.Mesh("m", len(case["faces"]), len(triangles), props=properties())
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(case["faces"]).astype(np.float32)
    parameters["faces"] = np.ravel(triangles).astype(np.uint32)
    parameters.update()
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
            "sensor": {
                "type": "perspective",
                "fov": case["fov"],
                "to_world": mi.ScalarTransform4f().look_at(
                    origin=list(case["eye"]), target=list(case["target"]), up=[0, 1, 0]
                ),
                "film": {
                    "type": "hdrfilm",
                    "width": SIZE,
                    "height": SIZE,
                    "rfilter": {"type": "box"},
                    "component_format": "float32",
                },
                "sampler": {"type": "independent"},
            },
            "plate": mesh,
            "light": {
                "type": "sphere",
                "center": list(center),
                "radius": float(radius),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": float(radiance)}},
            },
        }
    )
    return np.array(mi.render(scene, spp=SPP, seed=seed))[..., 1]


def properties():
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(
        {"type": "twosided", "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": RHO}}}
    )
    return properties


def octolux(program, case, seed=1):
    """The picture by `light`."""
    center, radius, radiance = case["light"]
    numbers = lambda v: "[" + ", ".join(repr(float(x)) for x in v) + "]"
    scene = f"""[camera]
origin = {numbers(case["eye"])}
target = {numbers(case["target"])}
up = [0, 1, 0]
fov_x = {case["fov"]!r}
[film]
width = {SIZE}
height = {SIZE}
[materials.m]
diffuse = [{RHO}, {RHO}, {RHO}]
[[meshes]]
material = "m"
vertices = [{", ".join(numbers(v) for v in case["faces"])}]
faces = {case["quads"]}
[[spheres]]
center = {numbers(center)}
radius = {float(radius)!r}
emission = {numbers([radiance] * 3)}
"""
    with tempfile.TemporaryDirectory() as folder:
        path, picture = os.path.join(folder, "scene.toml"), os.path.join(folder, "a.npy")
        with open(path, "w") as file:
            file.write(scene)
        command = [program, "render", path, "--estimator", "light", "--sampler", "independent", "--spp", str(SPP)]
        subprocess.run([*command, "--seed", str(seed), "-q", "-o", picture], check=True)
        return np.load(picture)[..., 1]


def rows(render):
    """Name, figure and truth of each row."""
    here = np.zeros(3)
    for s in (1e-1, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7):
        yield f"light of sin = {s:.0e}: mean", f"{render(plate(here, s)).mean():.6f}", f"{RHO * COSINE:.6f}"
    for far in (0.0, 2e5, 1e6):
        image = render(plate(np.full(3, far), 0.1))
        yield f"moved by {far:.0e}: mean", f"{image.mean():.6f}", f"{RHO * COSINE:.6f}"
        black = int((image == 0).sum())
        yield f"moved by {far:.0e}: black pixels", str(black), "0"
        lit = int((render(box(np.full(3, far), 0)) > 0).sum())
        yield f"closed box moved by {far:.0e}: lit pixels", str(lit), "0"
    one, two = render(plate(here, 0.1)), render(plate(here, 0.1))
    yield "one seed twice: pixels that differ", str(int((one != two).sum())), "0"


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else "target/release/octolux"
    if not os.access(program, os.X_OK):
        sys.exit(f"error: there is no program {program}: `cargo build --release`, or name it")
    columns = {"Octolux": list(rows(lambda case: octolux(program, case)))}
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        try:
            mi.set_variant(variant)
            columns[f"Mitsuba {mi.__version__} {variant}"] = list(rows(mitsuba))
        except Exception as error:  # no LLVM: the other variant stands
            print(f"{variant}: {str(error).splitlines()[0]}", file=sys.stderr)
    print("| row | truth |", " | ".join(columns), "|")
    print("| --- |" + " --- |" * (1 + len(columns)))
    for i, (name, _, truth) in enumerate(columns["Octolux"]):
        print(f"| {name} | {truth} |", " | ".join(column[i][1] for column in columns.values()), "|")


if __name__ == "__main__":
    main()
