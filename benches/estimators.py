#!/usr/bin/env python3
"""relMSE times processor time of each estimator on scenes: the table by which a default is chosen, in Markdown.

    benches/estimators.py scenes/*.toml > table.md
    benches/estimators.py --size 384x256 --seeds 8 --lanes 8 scenes/veach-mis.toml
    benches/estimators.py --size own --seeds 2 --only mis,product,mis2-balance,mis2-power scenes/*.toml

Needs `cargo build --release` and NumPy. An estimator's error is the variance between seeds over r^2 + 1e-4, the mean over pixels and
channels, with r a render of `mis` with 16 times the samples: it sees no bias, which `verify` and the tests look for. Its time is the least
processor time of its renders, start and files included as for all. What takes more than a hundred times the error of `product` at equal time
is shown as >100. Where the reference missed what seeds found, such as the rim of a sun, one pixel can be all of the error: `--without 1` leaves
out the pixel of the largest error of all estimators together, and names it.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
NAMES = ["mis", "product", "light", "projected", "brdf", "mis2-balance", "mis2-power"]
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("scenes", nargs="+")
parser.add_argument("--octolux", default=HERE.parent / "target/release/octolux")
parser.add_argument("--size", default="192x128", help="WxH, or own: the scene's")
parser.add_argument("--spp", type=int, default=64)
parser.add_argument("--seeds", type=int, default=4)
parser.add_argument("--lanes", default="8")
parser.add_argument("--without", type=int, default=0, help="number of pixels to leave out [default: 0]")
parser.add_argument("--only", default=",".join(NAMES), help="estimators, mis and product among them")
args = parser.parse_args()
NAMES = args.only.split(",")
size = [] if args.size == "own" else ["--size", args.size]


def render(scene, name, spp, seed, folder):
    """The picture and the seconds of the processor."""
    out = os.path.join(folder, "picture.npy")
    words = [args.octolux, "render", scene, "--estimator", name, *size, "--spp", spp, "--seed", seed, "--lanes", args.lanes]
    words += ["--threads", 1, "--quiet", "-o", out]
    process = subprocess.Popen([str(word) for word in words])
    _, status, used = os.wait4(process.pid, 0)
    if status != 0:
        raise SystemExit(f"{scene}, {name}: exit status {status}")
    # Of short runs the system tells the sum exactly, and guesses how much was in the program.
    return np.load(out).astype(np.float64), used.ru_utime + used.ru_stime


def ratio(x):
    return ">100" if x > 100 else f"{x:.2f}"


print("| scene | relMSE `mis` | `product` | time | gain over `mis` | best other | gain over it |")
print("| --- | --- | --- | --- | --- | --- | --- |")
with tempfile.TemporaryDirectory() as folder:
    for scene in args.scenes:
        reference, _ = render(scene, "mis", 16 * args.spp, 4711, folder)
        errors, error, time = {}, {}, {}
        for name in NAMES:
            pictures, times = zip(*(render(scene, name, args.spp, seed, folder) for seed in range(args.seeds)))
            errors[name] = (np.var(pictures, axis=0, ddof=1) / (reference**2 + 1e-4)).mean(axis=-1).ravel()
            time[name] = min(times)
        left_out = np.argsort(sum(errors.values()))[len(errors["mis"]) - args.without :]
        for pixel in left_out:
            print(f"{scene}: left out column, row {pixel % reference.shape[1]}, {pixel // reference.shape[1]}", file=sys.stderr)
        for name in NAMES:
            error[name] = float(np.delete(errors[name], left_out).mean())
        cost = {name: error[name] * time[name] for name in NAMES}
        other = min((name for name in NAMES if name != "product"), key=cost.get)
        gain = [ratio(cost[name] / cost["product"]) for name in ("mis", other)]
        cells = [pathlib.Path(scene).stem, f"{error['mis']:.2e}", f"{error['product']:.2e}", f"x {time['product'] / time['mis']:.2f}"]
        print("| " + " | ".join(cells + [gain[0], f"`{other}`", gain[1]]) + " |", flush=True)
