#!/usr/bin/env python3
"""Whether tiles of 16 x 16 pixels show where points of a tile share lists of lights: variograms of the noise across borders and inside.

    benches/tile_borders.py SCENE [--passes 1,2,4,16] [--pairs 3] [--options "--estimator light"]

The noise is the difference of two pictures with different seeds, over the mean of all pictures (no reference, whose own error would have tiles).
For two pixels at a distance of 1, 2, 4 and 8 in a row or a column, the mean squared difference of their noise: of pairs with a border of tiles
between them, over that of pairs without one. 1 means that nobody can tell where the borders are. `tile` is the noise of the mean of a tile
over that of the mean of as many independent pixels, and `4 x 4` that of such squares: 1 for white noise. Pixels of more than four times the
median, and their neighbors, are left out: they show lights. Cells: median (least to most) over the pairs. Needs numpy.
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


def variogram(noise, counts, apart):
    """Mean squared difference across borders over that inside, along rows and columns."""
    across, inside = [], []
    for field, dull in ((noise, counts), (noise.T, counts.T)):
        # One bright pixel does not decide.
        squared = np.minimum((field[:, apart:] - field[:, :-apart]) ** 2, 1.0)
        both = dull[:, apart:] & dull[:, :-apart]
        left = np.arange(squared.shape[1])
        crosses = np.broadcast_to(left // TILE != (left + apart) // TILE, both.shape)
        across.append(squared[both & crosses])
        inside.append(squared[both & ~crosses])
    return np.concatenate(across).mean() / np.concatenate(inside).mean()


def blocks(noise, counts, size):
    """Noise of means of squares over that of means of white noise."""
    rows, columns = (n // size for n in noise.shape)
    cut = lambda field: field[: rows * size, : columns * size].reshape(rows, size, columns, size).sum((1, 3))
    sums, numbers = cut(np.where(counts, noise, 0.0)), cut(counts)
    whole = numbers > size * size / 2
    return np.sqrt((sums[whole] ** 2).sum() / numbers[whole].sum() / (noise[counts] ** 2).mean())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    parser.add_argument("scene")
    parser.add_argument("--passes", default="1,2,4,16")
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--size", default="384x256")
    parser.add_argument("--options", default="")
    parser.add_argument("--octolux", default=str(target / "release" / "octolux"))
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        print("| passes | noise (rms) | 1 apart | 2 apart | 4 apart | 8 apart | tile | 4 x 4 |\n|---|---|---|---|---|---|---|---|")
        for passes in map(int, args.passes.split(",")):
            pictures = [picture(args, folder, passes, seed, []) for seed in range(1, 2 * args.pairs + 1)]
            mean = np.mean(pictures, axis=0)
            bright = mean > 4 * np.median(mean)
            for axis in (0, 1):
                bright = bright | np.roll(bright, 1, axis) | np.roll(bright, -1, axis)
            dull, rows = ~bright, []
            for one, other in zip(pictures[::2], pictures[1::2]):
                noise = np.clip((one - other) / np.sqrt(2) / (mean + 1e-2 * mean.mean()), -1, 1)
                rms = np.sqrt((noise[dull] ** 2).mean())
                rows.append((rms, *(variogram(noise, dull, d) for d in (1, 2, 4, 8)), *(blocks(noise, dull, n) for n in (TILE, 4))))
            cells = [f"{statistics.median(c):.3g} ({min(c):.3g} to {max(c):.3g})" for c in zip(*rows)]
            print(f"| {passes} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
