#!/usr/bin/env python3
"""Whether pictures of `render --target-error` are as bright as the truth.

Usage: docs/study/target-bias.py target/release/octolux [SEEDS]       (a minute for 300 seeds)

A plate under a sphere light whose radiance is known in closed form (scenes/tests/sphere-overhead.toml) is rendered with many
seeds by `uniform`, which meets the light once in 126 samples: the heaviest tail of all estimators, at an error of 0.2.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy

SCENE = "scenes/tests/sphere-overhead.toml"
TRUTH = numpy.array([0.1, 0.09375, 0.0625])


def main():
    octolux = pathlib.Path(sys.argv[1]).resolve()
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 300
    for estimator in ("uniform", "mis"):
        ratios, samples = [], []
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "x.npy"
            for seed in range(seeds):
                command = [octolux, "render", SCENE, "--size", "8x8", "--estimator", estimator, "--target-error", "0.2",
                           "--seed", str(seed), "--threads", "1", "-q", "--json", "-o", path]
                figures = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
                # Colours share their samples: their ratios are one number.
                ratios.append((numpy.load(path) / TRUTH).mean() - 1)
                samples.append(figures["spp"])
        mean, error = numpy.mean(ratios), numpy.std(ratios, ddof=1) / math.sqrt(seeds)
        print(f"{estimator}: {100 * mean:+.3f} +- {100 * error:.3f} % over {seeds} seeds, {numpy.mean(samples):.0f} samples a pixel")


main()
