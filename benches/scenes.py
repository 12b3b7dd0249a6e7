#!/usr/bin/env python3
"""Scenes of any size for measurements: `benches/scenes.py KIND NUMBER FOLDER` writes FOLDER/KIND-NUMBER.toml.

    benches/scenes.py triangles 1000000 /tmp    a sphere with waves, smooth and diffuse, on a floor, three lights
    benches/scenes.py spheres 1000000 /tmp      a cloud of balls, half of them Phong, three lights
    benches/scenes.py lights 1024 /tmp          24 balls on a floor under so many lights of equal power together
    benches/scenes.py points 1024 /tmp          the same with point lights of the same intensities at the same places
    benches/scenes.py rooms 4096 /tmp           49 rooms with doors, seen from one of them: most lights are behind walls
    benches/scenes.py glow 100000 /tmp          the balls on the floor under one mesh of so many triangles that emits

The same numbers in every run. Python 3.8 or later, nothing else; ten million triangles take a minute.
"""

import array
import math
import pathlib
import random
import sys

HEAD = """[camera]
origin = {origin}
target = [0, 0, 0]
up = [0, 1, 0]
fov_x = {fov}

[film]
width = 768
height = 512

[materials.floor]
diffuse = [0.5, 0.5, 0.5]

[materials.clay]
diffuse = [0.7, 0.5, 0.4]

[materials.metal]
phong = [0.6, 0.6, 0.65]
exponent = 30.0

[[meshes]]
material = "floor"
vertices = [[-20, -1.4, 20], [20, -1.4, 20], [20, -1.4, -20], [-20, -1.4, -20]]
faces = [[0, 1, 2, 3]]
"""

BALL = "[[spheres]]\ncenter = [{:.6f}, {:.6f}, {:.6f}]\nradius = {:.6f}\n{}\n"


def light(center, radius, power):
    """A light whose radiance is such that `radiance x radius^2` is `power`."""
    le = power / radius**2
    return BALL.format(*center, radius, f"emission = [{le:.6f}, {le:.6f}, {le:.6f}]")


THREE_LIGHTS = light((-3.0, 4.0, 3.0), 0.5, 8) + light((3.5, 2.5, 2.0), 0.2, 5) + light((1.0, 3.5, -3.0), 0.05, 4)


def waves(triangles):
    """A sphere with waves on it as columns: coordinates of its vertices, corners of its triangles."""
    # `around` quadrilaterals in a row and half as many rows; the two rows at the poles are triangles.
    around = max(3, round(math.sqrt(triangles)))
    down = max(2, round(triangles / around / 2) + 1)
    phis = [2 * math.pi * (i % around) / around for i in range(around + 1)]
    circle = [(math.cos(phi), math.sin(phi)) for phi in phis]
    vertices = array.array("f")
    for j in range(down + 1):
        theta = math.pi * j / down
        s, y = math.sin(theta), math.cos(theta)
        ys = [a * math.sin(f * y + b) for a, f, b in ((0.12, 5, 1), (0.05, 13, 1), (0.015, 31, 1), (0.003, 83, 1))]
        for c, z in circle:
            x, z = s * c, s * z
            d = 1.0
            for (f, wave) in zip((5, 13, 31, 83), ys):
                d += wave * math.sin(f * x) * math.sin(f * z + 2)
            vertices.extend((x * d, y * d, z * d))
    corners = array.array("I")
    for j in range(down):
        for i in range(around):
            a = j * (around + 1) + i
            b = a + around + 1
            if j > 0:
                corners.extend((a, a + 1, b + 1))
            if j + 1 < down:
                corners.extend((a, b + 1, b))
    return vertices, corners


def write_ply(path, vertices, corners):
    """Binary, with a byte before the corners of each triangle."""
    faces = len(corners) // 3
    rows = bytearray(13 * faces)
    rows[0::13] = b"\3" * faces
    if sys.byteorder == "big":
        vertices.byteswap(), corners.byteswap()
    bytes_of = corners.tobytes()
    for k in range(12):
        rows[k + 1 :: 13] = bytes_of[k::12]
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices) // 3}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(vertices.tobytes())
        file.write(rows)


def triangles(number, folder):
    name = f"triangles-{number}"
    write_ply(folder / f"{name}.ply", *waves(number))
    mesh = f'[[meshes]]\nmaterial = "clay"\nnormals = "smooth"\nfile = "{name}.ply"\n'
    return HEAD.format(origin=[0, 1.2, 4.2], fov=42) + THREE_LIGHTS + mesh


def spheres(number, folder):
    """Balls in a cube, as large as lets a ray through about one in two of their layers. In the shortest spelling: a
    million of them just fit into the 64 MiB that a scene file may have."""
    draw = random.Random(number)
    radius = 0.35 * number ** (-1 / 3)
    at = lambda: ",".join(f"{draw.uniform(-1, 1):.4f}" for _ in "xyz")
    balls = [f'{{center=[{at()}],radius={radius:.5f},material="{"clay" if i % 2 else "metal"}"}}' for i in range(number)]
    shine = [
        f"{{center=[{x},{y},{z}],radius={radius},emission=[{le},{le},{le}]}}"
        for x, y, z, radius, le in ((-3, 4, 3, 0.5, 32), (3.5, 2.5, 2, 0.2, 125), (1, 3.5, -3, 0.05, 1600))
    ]
    return f"spheres = [{','.join(shine + balls)}]\n\n" + HEAD.format(origin=[0, 1.2, 4.2], fov=42)


BALLS = "".join(
    BALL.format(i % 6 - 2.5, -1.1, i // 6 - 1.5, 0.3, f'material = "{"clay" if i % 2 else "metal"}"') for i in range(24)
)


def cloud(folder, name, lamps):
    """Lights as a scene says it: a table each, or of many a file of binary numbers. `lamps` are centres, radii and powers."""
    if len(lamps) <= 2048:
        return "".join(light(*lamp) for lamp in lamps)
    numbers = array.array("f")
    for (x, y, z), radius, power in lamps:
        numbers.extend((x, y, z, radius, *[power / radius**2] * 3))
    if sys.byteorder == "big":
        numbers.byteswap()
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "radius", "red", "green", "blue"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(lamps)}\n{properties}end_header\n"
    (folder / f"{name}.ply").write_bytes(head.encode() + numbers.tobytes())
    return f'[[light_clouds]]\nfile = "{name}.ply"\n'


def lights(number, folder):
    draw = random.Random(number)
    radius = 0.4 * number**-0.5
    at = lambda: (draw.uniform(-4, 4), draw.uniform(1, 4), draw.uniform(-4, 4))
    lamps = [(at(), radius, 20 / number) for _ in range(number)]
    return HEAD.format(origin=[0, 3.5, 7], fov=42) + BALLS + cloud(folder, f"lights-{number}", lamps)


def points(number, folder):
    draw = random.Random(number)
    at = lambda: (draw.uniform(-4, 4), draw.uniform(1, 4), draw.uniform(-4, 4))
    intensity = math.pi * 20 / number
    lamp = '[[lights]]\nkind = "point"\nposition = [{:.6f}, {:.6f}, {:.6f}]\n' + f"intensity = {[round(intensity, 8)] * 3}\n"
    return HEAD.format(origin=[0, 3.5, 7], fov=42) + BALLS + "".join(lamp.format(*at()) for _ in range(number))


def rooms(number, folder):
    """7 x 7 rooms of 4 x 4 units, 3 high, walls with doors; lights of log-normal power anywhere."""
    draw = random.Random(number)
    radius = 0.4 * number**-0.5
    at = lambda: (draw.uniform(-14, 14), draw.uniform(-1.3, 1.5), draw.uniform(-14, 14))
    lamps = [(at(), radius, 200 / number * draw.lognormvariate(0, 1.5)) for _ in range(number)]
    walls = []
    for i in range(1, 7):
        p = 4 * i - 14
        for j in range(7):
            # A door of one unit in the middle of each room's side.
            for a, b in ((4 * j - 14, 4 * j - 12.5), (4 * j - 11.5, 4 * j - 10)):
                walls.append([[p, -1.4, a], [p, -1.4, b], [p, 1.6, b], [p, 1.6, a]])
                walls.append([[a, -1.4, p], [b, -1.4, p], [b, 1.6, p], [a, 1.6, p]])
    walls.append([[-14, 1.6, -14], [14, 1.6, -14], [14, 1.6, 14], [-14, 1.6, 14]])
    vertices = [vertex for wall in walls for vertex in wall]
    faces = [[4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3] for i in range(len(walls))]
    mesh = f'[[meshes]]\nmaterial = "floor"\nvertices = {vertices}\nfaces = {faces}\n'
    return HEAD.format(origin=[1.9, 0.4, 1.9], fov=70) + BALLS + mesh + cloud(folder, f"rooms-{number}", lamps)


def glow(number, folder):
    vertices, corners = waves(number)
    for i in range(0, len(vertices), 3):
        vertices[i + 1] += 2.5
    write_ply(folder / f"glow-{number}.ply", vertices, corners)
    mesh = f'[[meshes]]\nemission = [2, 1.8, 1.5]\nfile = "glow-{number}.ply"\n'
    return HEAD.format(origin=[0, 3.5, 7], fov=42) + BALLS + mesh


KINDS = {"triangles": triangles, "spheres": spheres, "lights": lights, "points": points, "rooms": rooms, "glow": glow}


def write(kind, number, folder):
    """Writes a scene with the files that it names and returns its path."""
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{kind}-{number}.toml"
    path.write_text(KINDS[kind](number, folder))
    return path


if __name__ == "__main__":
    if len(sys.argv) != 4 or sys.argv[1] not in KINDS or not sys.argv[2].isdigit():
        sys.exit(__doc__)
    print(write(sys.argv[1], int(sys.argv[2]), sys.argv[3]))
