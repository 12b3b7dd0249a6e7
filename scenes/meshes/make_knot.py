#!/usr/bin/env python3
"""Makes knot.ply: a tube along a trefoil knot, of quads, with a normal at each vertex.

The knot lies about the z axis, within 3.45 of it and 1.45 of the plane z = 0. Run it in this folder:
    python3 make_knot.py > knot.ply
"""
from math import cos, pi, sin, sqrt

ALONG, AROUND, RADIUS = 200, 14, 0.45


def scaled(v, by):
    return [x * by for x in v]


def unit(v):
    return scaled(v, 1 / sqrt(sum(x * x for x in v)))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def curve(t):
    return [(2 + cos(3 * t)) * cos(2 * t), (2 + cos(3 * t)) * sin(2 * t), sin(3 * t)]


def frame(t):
    """Normal and binormal of the curve (Frenet): its curvature is nowhere zero, so they come round to themselves."""
    h = 1e-4
    before, here, after = curve(t - h), curve(t), curve(t + h)
    tangent = unit([b - a for a, b in zip(before, after)])
    bend = [a - 2 * p + b for a, p, b in zip(before, here, after)]
    binormal = unit(cross(tangent, bend))
    return cross(binormal, tangent), binormal


vertices, faces = [], []
for i in range(ALONG):
    t = 2 * pi * i / ALONG
    normal, binormal = frame(t)
    for j in range(AROUND):
        # Counter-clockwise about the tangent: so are the corners of a face, seen from outside.
        angle = 2 * pi * j / AROUND
        n = [cos(angle) * a + sin(angle) * b for a, b in zip(normal, binormal)]
        vertices.append([p + RADIUS * x for p, x in zip(curve(t), n)] + n)
        corner = lambda along, around: (along % ALONG) * AROUND + around % AROUND
        faces.append([corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)])

print("ply\nformat ascii 1.0\ncomment a trefoil knot, made by make_knot.py")
print(f"element vertex {len(vertices)}")
for name in ("x", "y", "z", "nx", "ny", "nz"):
    print(f"property float {name}")
print(f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header")
for vertex in vertices:
    # Adding 0.0 turns -0.0 into 0.0.
    print(" ".join(f"{round(x, 5) + 0.0:g}" for x in vertex))
for face in faces:
    print(4, *face)
