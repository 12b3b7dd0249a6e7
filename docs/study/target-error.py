#!/usr/bin/env python3
"""Whether `render --target-error E` ends at the requested error, and `--time` at the requested time.

Usage: docs/study/target-error.py target/release/octolux > docs/study/target-error.md       (about five minutes)

Each case is rendered with many seeds. The pictures are independent, so their spread shows their real error, whatever `render`
reports. The uncertainty of that is printed too: in some scenes a few pixels make the noise, and then even many pictures show it badly.
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy

# Scene, film, error, seeds: errors that are reached in a few seconds, seeds that show them to some hundredths.
CASES = [
    ("veach-mis", "96x64", 0.3, 32),
    ("knot", "96x64", 0.1, 12),
    ("large-lights", "96x64", 0.02, 12),
    ("tests/two-lights", "96x64", 0.01, 12),
    ("sky", "96x64", 0.1, 24),
    ("many-spheres", "48x32", 1.0, 32),
]


def render(octolux, scene, *options):
    """The picture and the figures of one render."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "x.npy"
        command = [octolux, "render", f"scenes/{scene}.toml", "-q", "--json", "--estimator", "mis", "-o", path, *options]
        figures = subprocess.run(command, check=True, capture_output=True).stdout
        return numpy.load(path).astype(float), json.loads(figures)


def error(pictures):
    """The error of one of these pictures and its relative uncertainty: that of a variance over so many pixels as there are."""
    variance = pictures.var(axis=0, ddof=1)
    of_pixels = variance.mean(axis=-1)
    count = len(pictures)
    freedom = (count + 1) * of_pixels.sum() ** 2 / (of_pixels**2).sum()
    return math.sqrt(variance.mean()) / pictures.mean(), 1 / math.sqrt(2 * freedom)


HEAD = """# Whether a target is reached

`--target-error E` renders replicates, pictures with different seeds, in two halves. Each half stops when the *other* half shows that its
error is below √2 E, certain enough that both together are known to 15 % (`src/run/halves.rs`,
[why](../explanation/decisions.md#estimators-and-random-numbers)). The picture is the mean of both halves, and what `render` reports is
computed from the errors that the halves showed for each other.

All renders are by `mis`. This page is made by `docs/study/target-error.py`.

| column | |
| --- | --- |
| asked | the requested error, `--target-error` |
| reported | what `render` prints, mean over seeds |
| real | the root of the mean variance of a pixel over the seeds, divided by the picture's mean: computed from independent pictures alone |
| real / asked | with its own standard error |
| replicates, samples a pixel | means over seeds |
"""


def main():
    octolux = pathlib.Path(sys.argv[1]).resolve()
    load = os.getloadavg()[0]
    print(HEAD)
    print("| scene | film | sampler | asked | reported | real | real / asked | replicates | samples a pixel | seeds |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for scene, film, asked, seeds in CASES:
        for sampler in ("sobol", "independent"):
            options = ["--size", film, "--sampler", sampler, "--target-error", str(asked)]
            runs = [render(octolux, scene, *options, "--seed", str(seed)) for seed in range(seeds)]
            really, uncertainty = error(numpy.array([picture for picture, _ in runs]))
            mean = lambda key: sum(figures[key] for _, figures in runs) / seeds
            print(f"| {scene} | {film} | {sampler} | {asked} | {mean('error'):.4f} | {really:.4f} "
                  f"| {really / asked:.2f} ± {really / asked * uncertainty:.2f} | {mean('replicates'):.0f} "
                  f"| {mean('spp'):.0f} | {seeds} |", flush=True)
    print("\n| scene | film | `--time` | took | off by |\n| --- | --- | --- | --- | --- |")
    for scene in ("veach-mis", "knot", "many-spheres", "large-lights", "still-life"):
        figures = render(octolux, scene, "--time", "5")[1]
        seconds = figures["render_s"]
        print(f"| {scene} | {figures['width']} x {figures['height']} | 5 | {seconds:.3f} s "
              f"| {100 * (seconds / 5 - 1):+.1f} % |", flush=True)
    print(f"\nCommit {figures['commit']}, {figures['cpu']}, {figures['threads']} threads, {figures['lanes']} lanes, "
          f"{figures['target_features']}, Embree {figures['embree_version']}, load before {load:.1f}.")


main()
