#!/usr/bin/env python3
"""Whether tiles of 16 x 16 pixels show where points of a tile share lists of lights: variograms of the noise across borders and inside.

    benches/tile_borders.py SCENE [--passes 1,2,4,16] [--seeds 4] [--options "--estimator light"]

The noise is a picture minus one of many passes, over the latter. For two pixels at a distance of 1 and of 2 in a row or a column, the mean
squared difference of their noise: of pairs with a border of tiles between them, over that of pairs without one, median over rows and columns of the film
so that single bright pixels count for little. 1 means that nobody can tell where the borders are. Pixels at a distance of 1 have lists of their own (the colours of a
chessboard), pixels at a distance of 2 share one. The column `every light` is the same for `--lights all`, where it can be had. Needs numpy.
"""

import argparse
import os
import pathlib
import shlex
import statistics
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
TILE = 16


def picture(args, folder, passes, seed, options):
    target = f"{folder}/p.npy"
    command = [args.octolux, "render", args.scene, "--size", args.size, "--spp", str(passes), "--seed", str(seed), "--quiet"]
    ended = subprocess.run([*command, *shlex.split(args.options), *options, "-o", target], capture_output=True, text=True)
    if ended.returncode:
        sys.exit(f"error: {ended.stderr}")
    return np.load(target).astype(float).mean(axis=2)


def variogram(noise, apart):
    """Mean squared difference across borders over that inside, along rows and columns."""
    ratios = []
    for field in (noise, noise.T):
        squared = np.minimum((field[:, apart:] - field[:, :-apart]) ** 2, 1.0)
        left = np.arange(squared.shape[1])
        crosses = left // TILE != (left + apart) // TILE
        ratios.append((squared[:, crosses].mean(), squared[:, ~crosses].mean()))
    return sum(a for a, _ in ratios) / sum(b for _, b in ratios)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    parser.add_argument("scene")
    parser.add_argument("--passes", default="1,2,4,16")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--size", default="384x256")
    parser.add_argument("--reference", type=int, default=512, help="passes of the picture that the noise is taken from")
    parser.add_argument("--options", default="")
    parser.add_argument("--octolux", default=str(target / "release" / "octolux"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        truth = picture(args, folder, args.reference, 1000, [])
        print("| passes | noise (rms) | apart 1 | apart 2 |\n|---|---|---|---|")
        for passes in map(int, args.passes.split(",")):
            rows = []
            for seed in range(args.seeds):
                noise = (picture(args, folder, passes, seed, []) - truth) / (truth + 1e-2 * truth.mean())
                rows.append((np.sqrt(np.mean(np.minimum(noise**2, 1.0))), variogram(noise, 1), variogram(noise, 2)))
            cells = [f"{statistics.median(c):.3g} ({min(c):.3g} to {max(c):.3g})" for c in zip(*rows)]
            print(f"| {passes} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
