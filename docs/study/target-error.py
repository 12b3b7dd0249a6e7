"""Whether `render --target-error E` ends at the error that was asked for, and `--time` at the time.

Usage: docs/study/target-error.py path/to/octolux

Each case is rendered with four seeds. The pictures are independent, so their spread tells the error that they really have,
without trust in what `render` says of itself.
"""

import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy

CASES = [("veach-mis", 0.1), ("knot", 0.01), ("many-spheres", 0.03), ("large-lights", 0.01), ("tests/two-lights", 0.01)]
SEEDS = 4


def render(octolux, scene, *options):
    """The picture and the figures of one render."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "x.npy"
        command = [octolux, "render", f"scenes/{scene}.toml", "-q", "--json", "-o", path, *options]
        figures = subprocess.run(command, check=True, capture_output=True).stdout
        return numpy.load(path).astype(float), json.loads(figures)


def main():
    octolux = pathlib.Path(sys.argv[1]).resolve()
    print("scene             sampler       asked    said     is       is / asked   samples a pixel   seconds")
    for scene, error in CASES:
        for sampler in ("sobol", "independent"):
            options = ["--size", "192x128", "--sampler", sampler, "--target-error", str(error)]
            runs = [render(octolux, scene, *options, "--seed", str(seed)) for seed in range(SEEDS)]
            pictures = numpy.array([picture for picture, _ in runs])
            is_ = math.sqrt(pictures.var(axis=0, ddof=1).mean()) / pictures.mean()
            mean = lambda key: sum(figures[key] for _, figures in runs) / SEEDS
            print(f"{scene:17} {sampler:12} {error:6.3f}   {mean('error'):.4f}   {is_:.4f}   {is_ / error:6.2f} "
                  f"{mean('spp'):16.0f} {mean('render_s'):12.2f}", flush=True)
    for scene in ("veach-mis", "knot", "many-spheres"):
        seconds = render(octolux, scene, "--time", "5")[1]["render_s"]
        print(f"{scene:17} --time 5 took {seconds:.3f} s, {100 * (seconds / 5 - 1):+.1f} %", flush=True)


main()
