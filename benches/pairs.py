#!/usr/bin/env python3
"""Two ways to render a scene, in turn: how many times as fast the second is, and how sure that is.

    benches/pairs.py scenes/veach-mis.toml "--lanes 1 --spp 8" "--lanes 8 --spp 64"
    benches/pairs.py scenes/veach-mis.toml "" "" --program OLD/octolux --program target/release/octolux

Needs `cargo build --release` and Python 3.8 or later. Compared is rendering alone, `render_s` of the statistics, per sample. A round is
one render each way, the second time the other way round; of all rounds the median of the ratios counts, with the interval that
holds the median of such rounds with a probability of 95 % (order statistics). On a shared machine many short rounds are
worth more than few long ones: what else runs then changes from one round to the next, not from one render to the other.
"""

import argparse
import json
import math
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("options", nargs=2, help="what to hand to `render`, as one word each, such as \"--lanes 8\"")
    parser.add_argument("--program", action="append", help="the program; twice for one each [default: target/release/octolux]")
    parser.add_argument("--rounds", type=int, default=100, help="[default: 100]")
    parser.add_argument("--size", default="192x128", help="[default: 192x128]")
    parser.add_argument("--threads", default="1", help="[default: 1]")
    args = parser.parse_args()
    if not 6 <= args.rounds <= 1000:
        parser.error("--rounds is from 6, below which no interval is sure to 95 %, to 1000")
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    programs = args.program or [str(target / "release" / "octolux")]
    args.ways = [[programs[i % len(programs)], *options.split()] for i, options in enumerate(args.options)]
    return args


def interval(count):
    """Places of two order statistics that hold the median of `count` values between them with 95 %."""
    low, below = 0, 0.5**count
    while below + math.comb(count, low + 1) * 0.5**count < 0.025:
        low += 1
        below += math.comb(count, low) * 0.5**count
    return low, count - 1 - low


def main():
    args = parse()
    times = [[], []]
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(args.rounds):
            for i in (0, 1) if turn % 2 == 0 else (1, 0):
                program, *options = args.ways[i]
                command = [program, "render", args.scene, "--size", args.size, "--threads", args.threads, "--quiet", "--json"]
                command += ["-o", f"{folder}/picture.npy", *options]
                done = subprocess.run(command, capture_output=True, text=True)
                if done.returncode != 0:
                    sys.exit(f"{' '.join(command)}:\n{done.stderr}")
                figures = json.loads(done.stdout)
                times[i].append(1e9 * figures["render_s"] / figures["samples"])
    ratios = sorted(a / b for a, b in zip(*times))
    low, high = interval(len(ratios))
    for way, ns in zip(args.options, times):
        print(f"{statistics.median(ns):8.2f} ns a sample, at best {min(ns):.2f}: {way}")
    print(
        f"the second is {statistics.median(ratios):.3f} times as fast ({ratios[low]:.3f} to {ratios[high]:.3f}), "
        f"best over best {min(times[0]) / min(times[1]):.3f}, {args.rounds} rounds"
    )


if __name__ == "__main__":
    main()
