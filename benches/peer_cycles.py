"""Blender's Cycles on one of the scenes `lights N` of benches/scenes.py; a process of its own for many_lights.py.

Needs `bpy` (5.0.1 was used). Spheres are points of a point cloud, which Cycles traces as true spheres; lights are point lights with a
radius, in its light tree. Direct light alone, a box filter, no clamping, no threshold, no denoising. Cycles' lights cast no shadow and
are hidden from the camera here.

Protocol: one JSON object a line. First the start-up's figures; then, for every line `SEED SPP FILE.npy` on standard input, a render and
its figures. `render_s` is processor time of the whole call: the caller takes the difference between two numbers of samples.
"""

import argparse
import contextlib
import json
import math
import os
import resource
import sys
import tempfile
import time

import many_lights

STARTED = time.perf_counter()
try:
    import bpy
    import mathutils
    import numpy as np
except ImportError as error:
    print(json.dumps({"error": f"this Python cannot import {error.name}: install it with `python3 -m pip install bpy numpy`"}))
    sys.exit(2)


@contextlib.contextmanager
def silent():
    """Blender writes about its progress to the standard output, which is for our figures."""
    sys.stdout.flush()
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept), os.close(nothing)


def diffuse(name, colour):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    bsdf, out = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    bsdf.inputs["Color"].default_value = (*colour, 1)
    material.node_tree.links.new(bsdf.outputs[0], out.inputs[0])
    return material


def add(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def balls(name, centers, radius, material):
    """True spheres: the vertices of a mesh become a point cloud."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(centers, [], [])
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    begin, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    points, look = tree.nodes.new("GeometryNodeMeshToPoints"), tree.nodes.new("GeometryNodeSetMaterial")
    points.inputs["Radius"].default_value = radius
    look.inputs["Material"].default_value = material
    tree.links.new(begin.outputs[0], points.inputs["Mesh"])
    tree.links.new(points.outputs[0], look.inputs["Geometry"])
    tree.links.new(look.outputs[0], end.inputs[0])
    add(name, mesh).modifiers.new(name, "NODES").node_group = tree


def lights(scene):
    """One light at every vertex of a mesh: all have one radius and one power."""
    lamp = bpy.data.lights.new("lamp", "POINT")
    radius, le = scene["lamp_radius"], scene["lamp_le"]
    lamp.shadow_soft_size = radius
    lamp.use_soft_falloff = False
    # Else every ray of a BRDF, and every ray of the camera, is tested against all lights in a loop, which takes most of the time.
    lamp.cycles.use_multiple_importance_sampling = False
    # A sphere of this radiance emits so much in total.
    lamp.energy = 4 * math.pi**2 * radius**2 * le
    child = add("lamp", lamp)
    child.visible_camera = False
    mesh = bpy.data.meshes.new("places")
    mesh.from_pydata(scene["lamps"], [], [])
    parent = add("places", mesh)
    parent.instance_type = "VERTS"
    parent.show_instancer_for_render = False
    child.parent = parent


def camera(scene):
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit = "HORIZONTAL"
    lens.angle = math.radians(scene["fov_x"])
    eye, target = mathutils.Vector(scene["origin"]), mathutils.Vector(scene["target"])
    back = (eye - target).normalized()
    right = mathutils.Vector(scene["up"]).cross(back).normalized()
    frame = mathutils.Matrix((right, back.cross(right), back)).transposed().to_4x4()
    frame.translation = eye
    thing = add("camera", lens)
    thing.matrix_world = frame
    bpy.context.scene.camera = thing


def build(scene, size, threads, tree):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    there = bpy.context.scene
    there.render.engine = "CYCLES"
    cycles, render = there.cycles, there.render
    cycles.device = "CPU"
    cycles.use_light_tree = tree
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
    cycles.light_sampling_threshold = 0
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.use_denoising = cycles.use_adaptive_sampling = cycles.use_guiding = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 1
    render.resolution_x, render.resolution_y = size
    render.resolution_percentage = 100
    render.threads_mode, render.threads = "FIXED", threads
    render.use_persistent_data = True
    render.use_compositing = render.use_sequencer = False
    render.image_settings.file_format = "OPEN_EXR"
    render.image_settings.color_depth = "32"
    render.image_settings.exr_codec = "NONE"
    for name, colour, centers, radius in scene["balls"]:
        balls(name, centers, radius, diffuse(name, colour))
    for i, (vertices, faces, colour) in enumerate(scene["meshes"]):
        mesh = bpy.data.meshes.new(f"mesh{i}")
        mesh.from_pydata(vertices, [], faces)
        mesh.materials.append(diffuse(f"mesh{i}", colour))
        add(f"mesh{i}", mesh)
    lights(scene)
    camera(scene)


def picture(path):
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    numbers = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(numbers)
    bpy.data.images.remove(image)
    return numbers.reshape(height, width, 4)[::-1, :, :3]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("number", type=int)
    parser.add_argument("--size", default="192x128")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--no-tree", action="store_true", help="choose lights by power")
    args = parser.parse_args()
    with silent():
        build(many_lights.scene(args.number), tuple(map(int, args.size.split("x"))), args.threads, not args.no_tree)

    def say(**figures):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        print(json.dumps({**figures, "peak_rss_bytes": peak}), flush=True)

    say(version=bpy.app.version_string, startup_s=time.perf_counter() - STARTED)
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            seed, spp, target = line.strip().split(" ", 2)
            there = bpy.context.scene
            there.cycles.seed, there.cycles.samples = int(seed), int(spp)
            there.render.filepath = f"{folder}/picture.exr"
            begin = time.process_time()
            with silent():
                bpy.ops.render.render(write_still=True)
            seconds = time.process_time() - begin
            np.save(target, picture(there.render.filepath))
            say(render_s=seconds)


if __name__ == "__main__":
    main()
