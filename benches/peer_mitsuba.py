"""Mitsuba 3 on a scene of ours, with the estimator `mis` of ours; a process of its own for compare_peers.py.

The scene is built from our TOML file (spheres, and meshes written into the file itself). The integrator is traced by
Dr.Jit and compiled by LLVM like Mitsuba's own ones. Both reflection models are one lobe `cos^a` about an axis, so the
materials are a table that is read by the shape's number: no virtual calls, which is to Mitsuba's advantage.

Protocol: one JSON object a line. First the start-up's figures; then, for every line `SEED FILE.npy` on standard input, a
render and its figures. Ends with standard input.
"""

import argparse
import ctypes.util
import json
import os
import resource
import sys
import time
import tomllib

STARTED = time.perf_counter()
PI = 3.141592653589793


def find_llvm():
    """Dr.Jit loads LLVM at run time and looks for the name that developers' packages have. Others have a number."""
    if os.environ.get("DRJIT_LIBLLVM_PATH") or ctypes.util.find_library("LLVM"):
        return
    for version in (19, 20, 18, 17, 15, 21, 14):  # 16 was seen to fail; the first ones are known to work
        name = ctypes.util.find_library(f"LLVM-{version}") or ctypes.util.find_library(f"LLVM.so.{version}")
        if name:
            os.environ["DRJIT_LIBLLVM_PATH"] = name
            return


def fail(sentence):
    """One sentence for the caller, who shows it."""
    print(json.dumps({"error": sentence}), flush=True)
    sys.exit(2)


find_llvm()
try:
    import drjit as dr
    import mitsuba as mi
    import numpy as np
except ImportError as error:
    fail(f"this Python cannot import {error.name}: install it with `python3 -m pip install mitsuba==3.9.1 numpy`")
try:
    mi.set_variant("llvm_ad_rgb")
    dr.eval(dr.arange(mi.Float, 2) + 1)
except Exception as error:  # whatever Dr.Jit raises, the cause is the same
    fail(
        "Mitsuba finds no LLVM that it can use: install the shared library (Debian: `apt-get install libllvm19`) or "
        f"set DRJIT_LIBLLVM_PATH to it ({str(error).splitlines()[0]})"
    )


def look(scene, entry):
    """Reflectance, exponent (1: diffuse) and radiance of a shape."""
    if "emission" in entry:
        return [0, 0, 0], 1.0, entry["emission"]
    material = scene["materials"][entry["material"]]
    if "phong" in material:
        return material["phong"], material["exponent"], [0, 0, 0]
    return material["diffuse"], 1.0, [0, 0, 0]


def shapes_of(scene):
    """Mitsuba's shapes, the looks of each, in one order."""
    shapes, looks = [], []
    for ball in scene.get("spheres", []):
        shapes.append(mi.load_dict({"type": "sphere", "center": ball["center"], "radius": ball["radius"]}))
        looks.append(look(scene, ball))
    for number, entry in enumerate(scene.get("meshes", [])):
        if "vertices" not in entry or "transform" in entry:
            fail("only meshes with `vertices` and without `transform` can be handed to Mitsuba by this script")
        corners = [[f[0], f[i], f[i + 1]] for f in entry["faces"] for i in range(1, len(f) - 1)]
        mesh = mi.Mesh(f"mesh{number}", len(entry["vertices"]), len(corners))
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = np.ravel(np.array(entry["vertices"], np.float32))
        parameters["faces"] = np.ravel(np.array(corners, np.uint32))
        parameters.update()
        shapes.append(mesh)
        looks.append(look(scene, entry))
    return shapes, looks


class Materials:
    """The looks as columns, indexed by the number that Dr.Jit gives a shape; row 0 stands for no shape."""

    def __init__(self, shapes, looks):
        rows = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]) for shape in shapes]
        table = np.zeros((7, max(rows) + 1), np.float32)
        table[3] = 1
        for row, (rho, alpha, le) in zip(rows, looks):
            table[:, row] = [*rho, alpha, *le]
        self.columns = [mi.Float(np.ascontiguousarray(column)) for column in table]
        dr.eval(self.columns)

    def at(self, shape, active):
        row = dr.select(active, dr.reinterpret_array(mi.UInt32, shape), 0)
        v = [dr.gather(mi.Float, column, row) for column in self.columns]
        return mi.Color3f(*v[:3]), v[3], mi.Color3f(*v[4:])


def chord(a, b):
    """1 - cos between unit vectors, true to its last digits where they are close."""
    return 0.5 * dr.squared_norm(a - b)


class OneSampleMis(mi.SamplingIntegrator):
    """For each light one direction, from the average of the light's cone and the lobe (one-sample balance heuristic)."""

    lights = ()
    materials = None

    def sample(self, scene, sampler, ray, medium=None, active=True):
        si = scene.ray_intersect(ray, active)
        found = si.is_valid()
        rho, alpha, lo = self.materials.at(si.shape, found)
        wo = -ray.d
        n = dr.mulsign(si.n, dr.dot(si.n, wo))
        glossy = alpha > 1
        axis = dr.select(glossy, 2 * dr.dot(n, wo) * n - wo, n)
        lobe_scale = (alpha + 1) / (2 * PI)
        shade = found & (dr.max(rho) > 0)
        for center, radius, le in self.lights:
            by_lobe = sampler.next_1d() < 0.5
            u = sampler.next_2d()
            to_light = mi.Point3f(center) - si.p
            d2 = dr.squared_norm(to_light)
            d = dr.sqrt(d2)
            to_light /= d
            sine2 = radius * radius / d2
            omc = sine2 / (1 + dr.safe_sqrt(1 - sine2))
            # cos^a about an axis: cos = (1 - u)^(1 / (a + 1)), for a = 1 too.
            t = dr.select(by_lobe, 1 - dr.exp(dr.log(1 - u.x) / (alpha + 1)), u.x * omc)
            sine = dr.safe_sqrt(t * (2 - t))
            s, c = dr.sincos(2 * PI * u.y)
            frame = mi.Frame3f(dr.select(by_lobe, axis, to_light))
            wi = frame.to_world(mi.Vector3f(sine * c, sine * s, 1 - t))

            cosine = dr.dot(n, wi)
            t_light = dr.select(by_lobe, chord(to_light, wi), t)
            useful = shade & (cosine > 0) & (~by_lobe | (t_light <= omc))
            lobe_cosine = dr.maximum(1 - chord(axis, wi), 1e-30)
            lobe = lobe_scale * dr.exp(alpha * dr.log(lobe_cosine))
            shape = lobe * dr.select(glossy, cosine, 1)
            useful &= shape > 0
            value = rho * mi.Color3f(le) * (shape / (0.5 * (lobe + 1 / (2 * PI * omc))))
            distance = d * (1 - t_light) - dr.safe_sqrt(radius * radius - d2 * t_light * (2 - t_light))
            # Mitsuba's own offsets keep the ray off both surfaces.
            blocked = scene.ray_test(si.spawn_ray_to(si.p + wi * distance), useful)
            lo += dr.select(useful & ~blocked, value, 0)
        return lo, found, []


mi.register_integrator("one_sample_mis", lambda properties: OneSampleMis(properties))


def build(path, sampler, spp):
    """The scene as Mitsuba has it, and its integrator."""
    with open(path, "rb") as file:
        scene = tomllib.load(file)
    shapes, looks = shapes_of(scene)
    camera, film = scene["camera"], scene["film"]
    side = "x" if "fov_x" in camera else "y"
    matrix = mi.ScalarTransform4f().look_at(camera["origin"], camera["target"], camera["up"])
    sensor = {
        "type": "perspective",
        "fov": camera[f"fov_{side}"],
        "fov_axis": side,
        "to_world": matrix,
        "film": {
            "type": "hdrfilm",
            "width": film["width"],
            "height": film["height"],
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": sampler, "sample_count": spp},
    }
    parts = {f"shape{i}": shape for i, shape in enumerate(shapes)}
    loaded = mi.load_dict({"type": "scene", "sensor": sensor, **parts})
    integrator = mi.load_dict({"type": "one_sample_mis"})
    integrator.materials = Materials(loaded.shapes(), [looks[shapes.index(shape)] for shape in loaded.shapes()])
    integrator.lights = [
        (ball["center"], ball["radius"], ball["emission"])
        for ball in scene.get("spheres", [])
        if any(ball.get("emission", []))
    ]
    return loaded, integrator


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("--sampler", default="independent")
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    dr.set_thread_count(args.threads)
    scene, integrator = build(args.scene, args.sampler, args.spp)

    def say(**figures):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(json.dumps({**figures, "peak_rss_bytes": peak}), flush=True)

    say(version=mi.__version__, startup_s=time.perf_counter() - STARTED)
    for line in sys.stdin:
        seed, target = line.strip().split(" ", 1)
        begin = time.perf_counter()
        picture = np.array(mi.render(scene, integrator=integrator, spp=args.spp, seed=int(seed)))
        seconds = time.perf_counter() - begin
        np.save(target, picture)
        say(render_s=seconds, samples=picture.shape[0] * picture.shape[1] * args.spp)


if __name__ == "__main__":
    main()
