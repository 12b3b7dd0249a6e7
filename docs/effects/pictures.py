#!/usr/bin/env python3
"""Makes docs/pictures/effects/two-samples.png and projected.png: estimators side by side, at as many directions a pixel.

    cargo build --release && python3 docs/effects/pictures.py [PROGRAM]

Octolux renders and measures everything; this only lays its PNG files side by side. Needs Pillow (`pip install pillow`).
"""

import json
import pathlib
import subprocess
import sys
import tempfile

from PIL import Image, ImageDraw, ImageFont

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = sys.argv[1] if len(sys.argv) > 1 else ROOT / "target/release/octolux"
LABEL = 22


def octolux(*words):
    return subprocess.run([PROGRAM, *map(str, words)], check=True, capture_output=True, text=True).stdout


def sheet(name, scene, size, frames, *options):
    """Frames are estimator and samples a pixel; each is labelled with its error."""
    width, height = map(int, size.split("x"))
    whole = Image.new("RGB", (len(frames) * (width + 8) - 8, height + LABEL), "white")
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(14)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        reference = folder / "reference.npy"
        octolux("render", scene, "--size", size, "--spp", 4096, "--seed", 12345, "-o", reference, "--quiet", *options)
        for i, (estimator, spp) in enumerate(frames):
            png, npy = folder / f"{i}.png", folder / f"{i}.npy"
            octolux("render", scene, "--size", size, "--spp", spp, "--estimator", estimator, "-o", png, "-o", npy, "--quiet", *options)
            relmse = json.loads(octolux("compare", npy, reference, "--json"))["relmse"]
            label = f"{estimator}, {spp} {'sample' if spp == 1 else 'samples'} a pixel, relMSE {relmse:.3g}"
            whole.paste(Image.open(png).convert("RGB"), (i * (width + 8), 0))
            draw.text((i * (width + 8) + 2, height + 2), label, "black", font)
            print(label)
    whole.save(ROOT / f"docs/pictures/effects/{name}.png", optimize=True)


VEACH, LOW = ROOT / "scenes/veach-mis.toml", ROOT / "scenes/low-light.toml"
two = [("mis", 8), ("mis2-balance", 4), ("mis2-power", 4)]
sheet("two-samples", VEACH, "320x214", two, "--sampler", "independent")
sheet("projected", LOW, "480x320", [("light", 1), ("projected", 1)])
