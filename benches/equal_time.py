#!/usr/bin/env python3
"""Error times seconds of several ways to render one scene, in turn, in one run.

    benches/equal_time.py SCENE "--lights 16 --spp 32" "--lights 8 --spp 64" "OCTOLUX_RIVAL=bounds --lights 2 --spp 32"

Each way is options of `octolux render`, after variables of the environment if it needs any (OCTOLUX_RIVAL needs a build with `--features
rival`: each point walks down the tree of lights by itself, N/2 times with `--lights N`, by `moments` or by pbrt's `bounds`). A round renders each
way with two seeds. The relative error is half the squared difference of the two, over the squared mean of all pictures of the way: no
reference, so no way is favoured. Pixels of more than four times the median (or `--bright`), and their neighbors, are left out: they show lights, whose
edges are noise of another kind. Seconds are of the processor, those of a render of one pass taken off: on a busy machine they mean more than those of a
clock. Cells: median (least to most) over the rounds; ratios are round by round over the first way. The last
column is the mean of the way's pictures over that of the first way's. Needs numpy.
"""

import argparse
import json
import os
import pathlib
import re
import shlex
import statistics
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent


def render(program, scene, way, size, threads, seed, folder, once=False):
    words = shlex.split(re.sub(r"--spp \d+", "--spp 1", way) if once else way)
    set_to = dict(word.split("=", 1) for word in words if "=" in word and not word.startswith("-"))
    options = [word for word in words if "=" not in word or word.startswith("-")]
    target = f"{folder}/picture.npy"
    command = [program, "render", scene, "--size", size, "--seed", str(seed), "--threads", str(threads), "--json", "--quiet"]
    before = os.times()
    ended = subprocess.run([*command, *options, "-o", target], capture_output=True, text=True, env={**os.environ, **set_to})
    after = os.times()
    if ended.returncode:
        sys.exit(f"error: {way}: {ended.stderr}")
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    return {**json.loads(ended.stdout), "cpu_s": seconds}, np.load(target).astype(float)


def show(numbers):
    return f"{statistics.median(numbers):.3g} ({min(numbers):.3g} to {max(numbers):.3g})"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    parser.add_argument("scene")
    parser.add_argument("ways", nargs="+")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--size", default="192x128")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1, help="of the first round")
    parser.add_argument("--bright", type=float, help="radiance from which a pixel shows a light [default: four times the median]")
    parser.add_argument("--octolux", default=str(target / "release" / "octolux"))
    split = sys.argv.index("--") if "--" in sys.argv else None
    args = parser.parse_args(sys.argv[1:split])
    rounds = []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(args.rounds):
            row = []
            for way in args.ways:
                both = [render(args.octolux, args.scene, way, args.size, args.threads, args.seed + 2 * i + j, folder) for j in (0, 1)]
                about = both[0][0]
                one, _ = render(args.octolux, args.scene, way, args.size, args.threads, args.seed, folder, True)
                spp = both[0][0]["spp"]
                seconds = (statistics.mean(f["cpu_s"] for f, _ in both) - one["cpu_s"]) * spp / (spp - 1)
                row.append((seconds, *(picture for _, picture in both), both[0][0]))
            rounds.append(row)
    # Pixels that show lights, and their neighbors.
    bright = np.mean([picture for row in rounds for way in row for picture in way[1:3]], axis=0).max(axis=2)
    bright = bright > (args.bright or 4 * np.median(bright))
    for axis in (0, 1):
        bright = bright | np.roll(bright, 1, axis) | np.roll(bright, -1, axis)
    dull = ~bright
    print(f"{args.scene}, {args.size}, {args.threads} thread, {args.rounds} rounds; commit {about['commit']}, {about['cpu']}, {about['lanes']} "
          f"lanes, load {os.getloadavg()[0]:.1f}, {100 * bright.mean():.1f} % of the pixels left out\n\n| way | seconds | rays a sample | relMSE | relMSE x s | over the first | mean |\n|---|---|---|---|---|---|---|")
    first = None
    for k, way in enumerate(args.ways):
        mean = np.mean([picture for row in rounds for picture in row[k][1:3]], axis=0)
        error = [float(np.mean(((row[k][1] - row[k][2]) ** 2 / 2 / (mean**2 + 1e-4))[dull])) for row in rounds]
        times = [row[k][0] for row in rounds]
        both = [a * b for a, b in zip(error, times)]
        first = first or (both, mean[dull].mean())
        over = [a / b for a, b in zip(both, first[0])]
        rays = rounds[0][k][3]["shadow_rays"] / rounds[0][k][3]["samples"]
        print(f"| `{way}` | {show(times)} | {rays:.2f} | {show(error)} | {show(both)} | {show(over)} | {mean[dull].mean() / first[1]:.4f} |", flush=True)


if __name__ == "__main__":
    main()
