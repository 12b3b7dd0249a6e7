#!/usr/bin/env python3
"""Makes docs/pictures/estimators.png: six estimators side by side at equal time, with their errors.

    cargo build --release && python3 docs/estimators.py [--octolux PROGRAM] [--reference FILE.npy] [--time SECONDS]

Octolux renders and measures everything; this script only lays its PNG files side by side. For the documentation alone:
nothing of Octolux needs Python at run time. Needs Pillow (`pip install pillow`).
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

from PIL import Image, ImageDraw, ImageFont

HERE = pathlib.Path(__file__).resolve().parent
parser = argparse.ArgumentParser()
parser.add_argument("--octolux", default=HERE.parent / "target/release/octolux")
parser.add_argument("--scene", default=HERE.parent / "scenes/veach-mis.toml")
parser.add_argument("--reference", help="a converged .npy of 384 x 256 [default: product, 16384 samples a pixel, another seed]")
parser.add_argument("--time", default="0.1")
parser.add_argument("--threads", default="1")
parser.add_argument("--output", default=HERE / "pictures/estimators.png")
args = parser.parse_args()

WIDTH, HEIGHT, LABEL = 384, 256, 22
NAMES = ["uniform", "light", "brdf", "mis", "mis2-power", "product"]
COLUMNS = 3


def octolux(*words):
    done = subprocess.run([args.octolux, *map(str, words)], check=True, capture_output=True, text=True)
    return done.stdout


with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    size = f"{WIDTH}x{HEIGHT}"
    reference = args.reference
    if reference is None:
        reference = folder / "reference.npy"
        octolux("render", args.scene, "--size", size, "--spp", 16384, "--seed", 12345, "--estimator", "product", "-o", reference,
                "--quiet")
    rows = len(NAMES) // COLUMNS
    sheet = Image.new("L", (COLUMNS * (WIDTH + 8) - 8, rows * (HEIGHT + LABEL)), 255)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(15)
    for i, name in enumerate(NAMES):
        png, npy = folder / f"{name}.png", folder / f"{name}.npy"
        stats = json.loads(octolux(
            "render", args.scene, "--size", size, "--time", args.time, "--threads", args.threads, "--estimator", name,
            "-o", png, "-o", npy, "--json", "--quiet",
        ))
        errors = json.loads(octolux("compare", npy, reference, "--json"))
        left, top = i % COLUMNS * (WIDTH + 8), i // COLUMNS * (HEIGHT + LABEL)
        # The scene is grey: one channel says it all.
        sheet.paste(Image.open(png).getchannel("G"), (left, top))
        label = f"{name}   {stats['spp']} samples a pixel   relMSE {errors['relmse']:.3g}"
        draw.text((left + 2, top + HEIGHT + 1), label, 0, font)
        print(label, f"  {stats['render_s']:.3f} s, commit {stats['commit']}, {stats['cpu']}")
    sheet.save(args.output, optimize=True)
