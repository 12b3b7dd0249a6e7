#!/usr/bin/env python3
"""SHA-256 of small renders of every scene: two programs that print the same list render the same bits.

    benches/bits.py target/release/octolux > before
    benches/bits.py other/octolux | diff before -

Every scene of scenes/ and scenes/tests/, the eight estimators (`--estimators` where a program has fewer), each width of packets that the processor has, both accelerators: 48 x 32
pixels, 4 samples a pixel. What is hashed are the radiances (.npy), which nothing but the renderer decides.
"""

import argparse
import hashlib
import itertools
import pathlib
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ESTIMATORS = ["uniform", "light", "brdf", "mis", "mis2-balance", "mis2-power", "projected", "product"]
ACCELS = ["linear", "embree"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--lanes", default="1,8,16", help="widths of packets (default: 1,8,16)")
    parser.add_argument("--estimators", default=",".join(ESTIMATORS), help="default: all eight")
    parser.add_argument("--jobs", type=int, default=2, help="renders at a time (default: 2)")
    options = parser.parse_args()
    scenes = pathlib.Path(__file__).resolve().parent.parent / "scenes"
    paths = sorted(scenes.glob("*.toml")) + sorted((scenes / "tests").glob("*.toml"))
    settings = list(itertools.product(options.estimators.split(","), options.lanes.split(","), ACCELS))

    def one(path, setting):
        estimator, lanes, accel = setting
        with tempfile.TemporaryDirectory() as folder:
            picture = pathlib.Path(folder) / "x.npy"
            command = [options.program, "render", str(path), "--size", "48x32", "--spp", "4", "--estimator", estimator]
            command += ["--lanes", lanes, "--accel", accel, "--threads", "1", "--quiet", "-o", str(picture)]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                lines = done.stderr.strip().splitlines() or [""]
                return f"exit code {done.returncode}: {lines[0].replace(str(scenes), 'scenes')}"
            return hashlib.sha256(picture.read_bytes()).hexdigest()

    with ThreadPoolExecutor(options.jobs) as pool:
        for path in paths:
            found = pool.map(lambda setting, path=path: one(path, setting), settings)
            for (estimator, lanes, accel), result in zip(settings, found):
                print(path.relative_to(scenes), estimator, lanes, accel, result)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
