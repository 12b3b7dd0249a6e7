"""Mitsuba 3 on one of the scenes `lights N` of benches/scenes.py, by its own integrator `direct`, which chooses lights uniformly; a
process of its own for many_lights.py, with the protocol of peer_cycles.py.
"""

import argparse
import json
import sys
import time

import many_lights

STARTED = time.perf_counter()


def load(mi, np, scene, size):
    parts = {}
    for name, colour, centers, radius in scene["balls"]:
        look = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(colour)}}
        for i, center in enumerate(centers):
            parts[f"{name}{i}"] = {"type": "sphere", "center": list(center), "radius": radius, "bsdf": look}
    for i, (vertices, faces, colour) in enumerate(scene["meshes"]):
        look = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": list(colour)}})
        properties = mi.Properties()
        properties["mesh_bsdf"] = look
        corners = [[f[0], f[j], f[j + 1]] for f in faces for j in range(1, len(f) - 1)]
        mesh = mi.Mesh(f"mesh{i}", len(vertices), len(corners), props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = np.ravel(np.array(vertices, np.float32))
        parameters["faces"] = np.ravel(np.array(corners, np.uint32))
        parameters.update()
        parts[f"mesh{i}"] = mesh
    glow = {"type": "area", "radiance": {"type": "rgb", "value": [scene["lamp_le"]] * 3}}
    for i, center in enumerate(scene["lamps"]):
        parts[f"lamp{i}"] = {"type": "sphere", "center": list(center), "radius": scene["lamp_radius"], "emitter": glow}
    film = {"type": "hdrfilm", "width": size[0], "height": size[1], "pixel_format": "rgb", "component_format": "float32"}
    sensor = {
        "type": "perspective",
        "fov": scene["fov_x"],
        "fov_axis": "x",
        "to_world": mi.ScalarTransform4f().look_at(scene["origin"], scene["target"], scene["up"]),
        "film": {**film, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent"},
    }
    return mi.load_dict({"type": "scene", "sensor": sensor, **parts})


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("number", type=int)
    parser.add_argument("--size", default="192x128")
    parser.add_argument("--variant", default="llvm_ad_rgb")
    args = parser.parse_args()
    try:
        import peer_mitsuba  # finds LLVM
        import drjit as dr
        import mitsuba as mi
        import numpy as np

        mi.set_variant(args.variant)
    except (ImportError, SystemExit) as error:
        print(json.dumps({"error": f"Mitsuba does not start: {error}"}))
        sys.exit(2)
    dr.set_thread_count(1)
    scene = load(mi, np, many_lights.scene(args.number), tuple(map(int, args.size.split("x"))))
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0})
    print(json.dumps({"version": mi.__version__, "startup_s": time.perf_counter() - STARTED}), flush=True)
    for line in sys.stdin:
        seed, spp, target = line.strip().split(" ", 2)
        begin = time.process_time()
        picture = np.array(mi.render(scene, integrator=integrator, spp=int(spp), seed=int(seed)))
        seconds = time.process_time() - begin
        np.save(target, picture)
        print(json.dumps({"render_s": seconds}), flush=True)


if __name__ == "__main__":
    main()
