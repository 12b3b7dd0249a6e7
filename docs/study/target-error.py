#!/usr/bin/env python3
"""Whether `render --target-error E` ends at the error that was asked for, and `--time` at the time.

Usage: docs/study/target-error.py path/to/octolux > table.md       (five minutes on two cores)

Each case is rendered with many seeds. The pictures are independent, so their spread tells the error that they really have,
without trust in what `render` says of itself. How well it tells it is printed too: the noise of some scenes is made by few
pixels, and then even many pictures say little.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy

# Scene, film, error, seeds: errors that are reached in a few seconds, seeds that show them to some hundredths.
CASES = [
    ("veach-mis", "192x128", 0.3, 32),
    ("knot", "96x64", 0.05, 12),
    ("large-lights", "96x64", 0.01, 12),
    ("tests/two-lights", "96x64", 0.01, 12),
    ("sky", "192x128", 0.1, 24),
    ("many-spheres", "96x64", 0.5, 32),
]


def render(octolux, scene, *options):
    """The picture and the figures of one render."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "x.npy"
        command = [octolux, "render", f"scenes/{scene}.toml", "-q", "--json", "-o", path, *options]
        figures = subprocess.run(command, check=True, capture_output=True).stdout
        return numpy.load(path).astype(float), json.loads(figures)


def error(pictures):
    """The error of one of these pictures and its relative uncertainty: that of a variance over so many pixels as there are."""
    variance = pictures.var(axis=0, ddof=1)
    of_pixels = variance.mean(axis=-1)
    count = len(pictures)
    freedom = (count + 1) * of_pixels.sum() ** 2 / (of_pixels**2).sum()
    return math.sqrt(variance.mean()) / pictures.mean(), 1 / math.sqrt(2 * freedom)


def main():
    octolux = pathlib.Path(sys.argv[1]).resolve()
    print("| scene | film | sampler | asked | said | is | is / asked | replicates | samples a pixel | seconds | seeds |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for scene, film, asked, seeds in CASES:
        for sampler in ("sobol", "independent"):
            options = ["--size", film, "--sampler", sampler, "--target-error", str(asked)]
            runs = [render(octolux, scene, *options, "--seed", str(seed)) for seed in range(seeds)]
            really, uncertainty = error(numpy.array([picture for picture, _ in runs]))
            mean = lambda key: sum(figures[key] for _, figures in runs) / seeds
            print(f"| {scene} | {film} | {sampler} | {asked} | {mean('error'):.4f} | {really:.4f} "
                  f"| {really / asked:.2f} ± {really / asked * uncertainty:.2f} | {mean('replicates'):.0f} "
                  f"| {mean('spp'):.0f} | {mean('render_s'):.2f} | {seeds} |", flush=True)
    print("\n| scene | film | asked for | took | off by |\n| --- | --- | --- | --- | --- |")
    for scene in ("veach-mis", "knot", "many-spheres", "large-lights", "still-life"):
        figures = render(octolux, scene, "--time", "5")[1]
        seconds = figures["render_s"]
        print(f"| {scene} | {figures['width']}x{figures['height']} | 5 s | {seconds:.3f} s "
              f"| {100 * (seconds / 5 - 1):+.1f} % |", flush=True)


main()
