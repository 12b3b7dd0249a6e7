#!/usr/bin/env python3
"""The files of scenes/city.toml, a street at night: `scenes/city.py FOLDER` writes FOLDER/city-lamps.ply and FOLDER/city-houses.ply.

About 20 000 lights: street lamps, strings of bulbs over the street, bulbs along the eaves and around the shop windows, cars, and a
town on the hill behind. The same numbers in every run. Python 3.8 or later, nothing else.
"""

import math
import pathlib
import random
import struct
import sys

WARM = (1.0, 0.62, 0.28)
WHITE = (1.0, 0.9, 0.75)
COLOURS = [(1.0, 0.25, 0.12), (1.0, 0.7, 0.2), (0.3, 1.0, 0.35), (0.25, 0.5, 1.0), (1.0, 0.35, 0.8)]

draw = random.Random(7)
lamps = []
vertices, faces = [], []


def lamp(x, y, z, radius, colour, watts):
    """A bulb whose radiance times radius squared is `watts`."""
    le = watts / radius**2
    lamps.append((x, y, z, radius, *(le * c for c in colour)))


def box(low, high):
    """A house, a kerb or a car, turned outward."""
    first = len(vertices)
    vertices.extend((x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2]))
    for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
        faces.append((first + a, first + b, first + c, first + d))


def along(a, b, number, sag=0.0):
    """Points between two, hanging down by `sag` in the middle."""
    for i in range(number):
        t = (i + 0.5) / number
        x, y, z = (p + t * (q - p) for p, q in zip(a, b))
        yield x, y - sag * 4 * t * (1 - t), z


def houses():
    for side in (-1, 1):
        z = 6.0
        while z > -160.0:
            depth, height = draw.uniform(7, 12), draw.uniform(7, 15)
            front = side * draw.uniform(7.0, 7.6)
            back = front + side * 9
            box((min(front, back), 0, z - depth), (max(front, back), height, z - 0.4))
            edge = front - side * 0.06
            colour = draw.choice(COLOURS + [WARM, WARM, WHITE])
            # Bulbs along the eaves, and around the windows of the shop.
            for x, y, w in along((edge, height, z - 0.6), (edge, height, z - depth + 0.2), int(depth * 9)):
                lamp(x, y, w, 0.02, colour, 0.0025)
            colour = draw.choice(COLOURS + [WHITE])
            left, right = z - 1.2, z - depth + 0.8
            corners = [(edge, 0.6, left), (edge, 3.0, left), (edge, 3.0, right), (edge, 0.6, right), (edge, 0.6, left)]
            for a, b in zip(corners, corners[1:]):
                for x, y, w in along(a, b, int(8 * math.dist(a, b))):
                    lamp(x, y, w, 0.02, colour, 0.003)
            # Lit rooms: a few bulbs behind where a window would be.
            for floor in range(1, int(height // 3)):
                for column in range(int(depth // 2)):
                    if draw.random() < 0.55:
                        warm = tuple(c * draw.uniform(0.7, 1) for c in (WARM if draw.random() < 0.7 else WHITE))
                        y, w = 3 * floor + 1.4, z - 1.3 - 2 * column
                        for k in range(6):
                            lamp(edge, y + 0.5 * (k % 3), w - 0.5 * (k // 3), 0.05, warm, 0.004)
            z -= depth


def street():
    for i in range(14):
        z = 2 - 11.5 * i
        for side in (-1, 1):
            x = side * 4.9
            box((x - 0.05, 0, z - 0.05), (x + 0.05, 4.9, z + 0.05))
            lamp(x - side * 0.4, 4.9, z, 0.16, WARM, 2.2)
        # Strings over the street, every second one of many colours.
        for k in range(3):
            a, b = (-7.0, 6.6, z - 2.4 * k), (7.0, 6.6, z - 2.4 * k - draw.uniform(-1, 1))
            for j, (x, y, w) in enumerate(along(a, b, 80, sag=0.9)):
                lamp(x, y, w, 0.03, COLOURS[j % 5] if k == 1 else WARM, 0.012)
    for side in (-1, 1):
        box((min(side * 4.6, side * 7.7), 0, -160), (max(side * 4.6, side * 7.7), 0.15, 8))
    for i in range(16):
        lane, z = (-1, 1)[i % 2], -7 - 9.2 * i + draw.uniform(-2, 2)
        box((lane * 2.2 - 0.9, 0.25, z - 2.1), (lane * 2.2 + 0.9, 1.4, z + 2.1))
        for x in (-0.65, 0.65):
            lamp(lane * 2.2 + x, 0.7, z + 2.16, 0.07, (1, 0.05, 0.02) if lane > 0 else WHITE, 0.05 if lane > 0 else 0.25)


def town():
    """Lights of houses on a hill, far away."""
    for _ in range(6500):
        x, up = draw.uniform(-220, 220), draw.random() ** 1.6
        y, z = 4 + 70 * up + draw.uniform(-1, 1), -190 - 130 * up
        lamp(x, y, z, 0.12, draw.choice([WARM, WARM, WHITE, WHITE, *COLOURS]), 0.05 * math.exp(draw.gauss(0, 1)))


def main(folder):
    houses()
    street()
    town()
    folder.mkdir(parents=True, exist_ok=True)
    names = ("x", "y", "z", "radius", "red", "green", "blue")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(lamps)}\n" + "".join(f"property float {n}\n" for n in names)
    body = b"".join(struct.pack("<7f", *one) for one in lamps)
    (folder / "city-lamps.ply").write_bytes(head.encode() + b"end_header\n" + body)
    head = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    body = b"".join(struct.pack("<3f", *one) for one in vertices) + b"".join(struct.pack("<B4I", 4, *one) for one in faces)
    (folder / "city-houses.ply").write_bytes(head.encode() + body)
    print(f"{len(lamps)} lights, {len(faces)} faces in {folder}")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent / "fetched"))
