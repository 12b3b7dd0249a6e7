#!/usr/bin/env python3
"""Makes docs/pictures/product-rings.png and product-techniques.png, the pictures of docs/product.md.

    cargo build --release && python3 docs/product-pictures.py [--octolux PROGRAM] [--time SECONDS] [--only rings|techniques]

Octolux renders both. The first are three domes, the directions within 50 degrees of the mirror direction, with what is drawn on them as
a texture; the second are four estimators side by side after the same time of the processor, so that a busy machine favours none. This script makes textures and scenes and lays PNG files side by side.
For the documentation alone: nothing of Octolux needs Python at run time. Needs NumPy and Pillow (`pip install numpy pillow`).
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import tempfile

import numpy as np
from PIL import Image, ImageDraw, ImageFont

HERE = pathlib.Path(__file__).resolve().parent
parser = argparse.ArgumentParser()
parser.add_argument("--octolux", default=HERE.parent / "target/release/octolux")
parser.add_argument("--time", type=float, default=0.25, help="seconds of the processor [default: 0.25]")
parser.add_argument("--only", choices=["rings", "techniques"])
args = parser.parse_args()

# A lobe of exponent 40 and a light of 12 degrees, 20 degrees from the mirror direction.
EXPONENT, TAU, DELTA = 40.0, math.radians(12), math.radians(20)
REACH = math.radians(50)
WIDTH, HEIGHT, LABEL = 300, 300, 24


def octolux(*words):
    return subprocess.run([args.octolux, *map(str, words)], check=True, capture_output=True, text=True).stdout


def half_arc(theta):
    """Half the arc of a ring inside the cap."""
    cosine = (math.cos(TAU) - np.cos(theta) * math.cos(DELTA)) / np.maximum(np.sin(theta) * math.sin(DELTA), 1e-12)
    return np.arccos(np.clip(cosine, -1, 1))


def draws(n):
    """n x n directions as `product` draws them: polar angle and azimuth about the mirror direction."""
    u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
    near, far = math.cos(DELTA - TAU) ** (EXPONENT + 1), math.cos(DELTA + TAU) ** (EXPONENT + 1)
    theta = np.arccos((near - u * (near - far)) ** (1 / (EXPONENT + 1)))
    return theta.ravel(), ((2 * v - 1) * half_arc(theta)).ravel()


def texture(step):
    """What the dome shows: columns are azimuths, rows polar angles from the mirror direction to the rim."""
    columns, rows = 2048, 1024
    azimuth = (np.arange(columns) + 0.5) / columns * 2 * math.pi - math.pi
    theta = (np.arange(rows) + 0.5) / rows * REACH
    azimuth, theta = np.meshgrid(azimuth, theta)
    lobe = np.cos(theta) ** EXPONENT
    picture = np.stack([0.16 + 0.84 * lobe, 0.16 + 0.62 * lobe, 0.16 + 0.1 * lobe], -1)
    inside = np.cos(theta) * math.cos(DELTA) + np.sin(theta) * math.sin(DELTA) * np.cos(azimuth) > math.cos(TAU)
    picture[inside] = 0.35 * picture[inside] + 0.65 * np.array([0.35, 0.65, 1.0])

    def paint(where, colour):
        picture[where] = colour

    line = math.radians(0.35)
    if step >= 1:
        for ring in (DELTA - TAU, DELTA + TAU):
            paint(abs(theta - ring) < line, [1, 1, 1])
        chosen = math.radians(17)
        paint(abs(theta - chosen) < line, [0.75, 0.2, 0.15])
        paint((abs(theta - chosen) < 2.5 * line) & (abs(azimuth) < half_arc(np.array(chosen))), [0.9, 0.02, 0.02])
    if step >= 2:
        for t, phi in zip(*draws(12)):
            cosine = np.cos(theta) * math.cos(t) + np.sin(theta) * math.sin(t) * np.cos(azimuth - phi)
            paint(cosine > math.cos(math.radians(0.5)), [0.02, 0.02, 0.02])
    return Image.fromarray((np.clip(picture, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8))


SCENE = """
[camera]
origin = [0.9, 4.2, 2.2]
target = [0.06, 0.8, 0.0]
up = [0, 1, 0]
fov_x = 24.0

[film]
width = {width}
height = {height}

[materials.dome]
diffuse = [0.9, 0.9, 0.9]
texture = "{texture}"
wrap = "clamp"

[materials.table]
diffuse = [0.25, 0.25, 0.25]

[[spheres]]
center = [-4.0, 9.0, 4.0]
radius = 2.0
emission = [14.0, 14.0, 14.0]

[[spheres]]
center = [6.0, 8.0, 5.0]
radius = 3.0
emission = [5.0, 5.0, 5.0]

[[meshes]]
material = "table"
vertices = [[-20, 0.55, 20], [20, 0.55, 20], [20, 0.55, -20], [-20, 0.55, -20]]
faces = [[0, 1, 2, 3]]

[[meshes]]
material = "dome"
normals = "smooth"
vertices = {vertices}
uvs = {uvs}
faces = {faces}
"""


def dome(folder, step):
    columns, rows = 96, 32
    texture(step).save(folder / f"dome-{step}.png")
    vertices, uvs, faces = [], [], []
    for row in range(rows + 1):
        theta = max(REACH * (1 - row / rows), 1e-4)
        for column in range(columns + 1):
            azimuth = (column / columns * 2 - 1) * math.pi
            sine = math.sin(theta)
            vertices.append([sine * math.cos(azimuth), math.cos(theta), -sine * math.sin(azimuth)])
            uvs.append([column / columns, row / rows])
    for row in range(rows):
        for column in range(columns):
            a = row * (columns + 1) + column
            faces.append([a, a + 1, a + columns + 2, a + columns + 1])
    scene = folder / f"dome-{step}.toml"
    scene.write_text(SCENE.format(width=WIDTH, height=HEIGHT, texture=f"dome-{step}.png", vertices=vertices, uvs=uvs, faces=faces))
    octolux("render", scene, "--spp", 256, "--estimator", "product", "-o", folder / f"dome-{step}-picture.png", "--quiet")
    return Image.open(folder / f"dome-{step}-picture.png").convert("RGB")


def rings(folder):
    labels = ["the lobe, and the light in it", "two rings bound it; one has an arc", "144 directions, as they are drawn"]
    sheet = Image.new("RGB", (3 * (WIDTH + 8) - 8, HEIGHT + LABEL), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for step, label in enumerate(labels):
        sheet.paste(dome(folder, step), (step * (WIDTH + 8), 0))
        draw.text((step * (WIDTH + 8) + 2, HEIGHT + 2), label, "black", font)
    sheet.save(HERE / "pictures/product-rings.png", optimize=True)


def seconds_a_sample(words, folder):
    """Processor time of one sample a pixel: what 32 more take, the least of five."""

    def used(spp):
        command = [args.octolux, *words, "--spp", spp, "-o", folder / "time.npy", "--quiet"]
        process = subprocess.Popen([str(word) for word in command])
        _, status, usage = os.wait4(process.pid, 0)
        assert status == 0
        return usage.ru_utime + usage.ru_stime

    return (min(used(40) for _ in range(5)) - min(used(8) for _ in range(5))) / 32


def techniques(folder):
    """Veach's scene by four estimators at equal time."""
    scene, width, height = HERE.parent / "scenes/veach-mis.toml", 384, 256
    reference = folder / "reference.npy"
    octolux("render", scene, "--size", f"{width}x{height}", "--estimator", "product", "--adaptive", "--spp", 4096, "--seed", 12345,
            "-o", reference, "--quiet")
    sheet = Image.new("L", (2 * width + 8, 2 * (height + LABEL)), 255)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for i, name in enumerate(["light", "brdf", "mis", "product"]):
        png, npy = folder / f"{name}.png", folder / f"{name}.npy"
        words = ["render", scene, "--size", f"{width}x{height}", "--threads", 1, "--estimator", name]
        words += ["--spp", round(args.time / seconds_a_sample(words, folder))]
        stats = json.loads(octolux(*words, "-o", png, "-o", npy, "--json", "--quiet"))
        errors = json.loads(octolux("compare", npy, reference, "--json"))
        left, top = i % 2 * (width + 8), i // 2 * (height + LABEL)
        # The scene is grey: one channel says it all.
        sheet.paste(Image.open(png).getchannel("G"), (left, top))
        label = f"{name}   {stats['spp']} samples a pixel   relMSE {errors['relmse']:.2g}"
        draw.text((left + 2, top + height + 2), label, 0, font)
        print(label, f"  {stats['rays_together']} lanes, commit {stats['commit']}, {stats['cpu']}")
    sheet.save(HERE / "pictures/product-techniques.png", optimize=True)


with tempfile.TemporaryDirectory() as name:
    if args.only != "techniques":
        rings(pathlib.Path(name))
    if args.only != "rings":
        techniques(pathlib.Path(name))
