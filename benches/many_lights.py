#!/usr/bin/env python3
"""Octolux, Cycles and Mitsuba 3 under many sphere lights, in turn, in one run: error, time, their product, and the means.

    benches/many_lights.py 1024 65536 --spp 64 --rounds 3 --python PYTHON

PYTHON is a Python 3.11 with `pip install bpy mitsuba==3.9.1 numpy` (bpy 5.0.1; LLVM's shared library for Mitsuba, else `--mitsuba-variant
scalar_rgb`). The scene is `lights N` of benches/scenes.py with all balls diffuse. One thread each. Time is the processor's, of sampling alone: a
render of one sample is taken off. The relative error is half the squared difference of two pictures with
different seeds, over the squared mean of all pictures of all rounds: so each is held against its own mean, and the means are compared apart. Pixels
that show a light, and their neighbors, count for nothing: Cycles' lights are hidden from the camera.
"""

import argparse
import json
import os
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile

import scenes

HERE = pathlib.Path(__file__).resolve().parent
SHINY = 'phong = [0.6, 0.6, 0.65]\nexponent = 30.0'
COLOURS = {"floor": (0.5, 0.5, 0.5), "clay": (0.7, 0.5, 0.4), "metal": (0.6, 0.6, 0.65)}


def text(number, folder):
    """The scene for Octolux."""
    told = scenes.lights(number, pathlib.Path(folder))
    assert SHINY in told
    return told.replace(SHINY, SHINY.split("\n")[0].replace("phong", "diffuse"))


def scene(number):
    """The same scene as numbers."""
    draw = random.Random(number)
    radius = 0.4 * number**-0.5
    lamps = [(draw.uniform(-4, 4), draw.uniform(1, 4), draw.uniform(-4, 4)) for _ in range(number)]
    centers = {kind: [] for kind in ("clay", "metal")}
    for i in range(24):
        centers["clay" if i % 2 else "metal"].append((i % 6 - 2.5, -1.1, i // 6 - 1.5))
    floor = [[-20, -1.4, 20], [20, -1.4, 20], [20, -1.4, -20], [-20, -1.4, -20]]
    return {
        "origin": (0, 3.5, 7),
        "target": (0, 0, 0),
        "up": (0, 1, 0),
        "fov_x": 42,
        "lamps": lamps,
        "lamp_radius": radius,
        "lamp_le": 20 / number / radius**2,
        "balls": [(kind, COLOURS[kind], places, 0.3) for kind, places in centers.items()],
        "meshes": [(floor, [[0, 1, 2, 3]], COLOURS["floor"])],
    }


class Octolux:
    def __init__(self, args, number, folder):
        self.path = pathlib.Path(folder) / f"{number}.toml"
        self.path.write_text(text(number, folder))
        self.args, self.spp = args, args.spp
        self.name = f"Octolux {args.estimator}"

    def render(self, seed, target):
        return self.call(seed, self.spp, target) - self.call(seed, 1, target + ".one.npy")

    def call(self, seed, spp, target):
        command = [self.args.octolux, "render", str(self.path), "--size", self.args.size, "--spp", str(spp), "--seed", str(seed)]
        command += ["--threads", "1", "--estimator", self.args.estimator, "--json", "--quiet", "-o", target, *self.args.octolux_option]
        before = os.times()
        ended = subprocess.run(command, capture_output=True, text=True)
        after = os.times()
        if ended.returncode:
            sys.exit(f"error: {ended.stderr}")
        self.about = json.loads(ended.stdout)
        return after.children_user + after.children_system - before.children_user - before.children_system


class Peer:
    """A process that renders when it is asked."""

    def __init__(self, name, command, args, spp):
        self.name, self.spp = name, spp
        self.process = subprocess.Popen([args.python, *command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=HERE)
        self.about = self.answer()

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            sys.exit(f"error: {self.name} ended without an answer")
        figures = json.loads(line)
        if "error" in figures:
            sys.exit(f"error: {figures['error']}")
        return figures

    def call(self, seed, spp, target):
        self.process.stdin.write(f"{seed} {spp} {target}\n")
        self.process.stdin.flush()
        return self.answer()["render_s"]

    def render(self, seed, target):
        whole = self.call(seed, self.spp, target)
        return whole - self.call(seed, 1, target + ".one.npy")


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    parser.add_argument("numbers", type=int, nargs="+")
    parser.add_argument("--spp", type=int, default=64, help="ours [default: 64]")
    parser.add_argument("--peer-spp", type=int, default=64, help="theirs [default: 64]")
    parser.add_argument("--rounds", type=int, default=3, help="each with two seeds [default: 3]")
    parser.add_argument("--size", default="192x128")
    parser.add_argument("--estimator", default="light")
    parser.add_argument("--octolux", default=str(target / "release" / "octolux"))
    parser.add_argument("--octolux-option", action="append", default=[])
    parser.add_argument("--python", default=sys.executable)
    parser.add_argument("--mitsuba-variant", default="llvm_ad_rgb", help="or scalar_rgb")
    parser.add_argument("--skip", default="", help="cycles, mitsuba")
    parser.add_argument("--keep", help="a folder for the mean pictures")
    return parser.parse_args()


def main():
    args = parse()
    import numpy as np

    for number in args.numbers:
        with tempfile.TemporaryDirectory() as folder:
            there = [Octolux(args, number, folder)]
            if "cycles" not in args.skip:
                command = ["peer_cycles.py", str(number), "--size", args.size]
                there.append(Peer("Cycles", command, args, args.peer_spp))
            if "mitsuba" not in args.skip:
                command = ["peer_mitsuba_lights.py", str(number), "--size", args.size, "--variant", args.mitsuba_variant]
                there.append(Peer("Mitsuba", command, args, args.peer_spp))
            for peer in there[1:]:
                peer.render(1000, f"{folder}/x.npy")  # compiles, or builds
            rounds = []
            for i in range(args.rounds):
                row = []
                for peer in there:
                    files = [f"{folder}/{j}.npy" for j in (1, 2)]
                    seconds = [peer.render(2 * i + j, file) for j, file in zip((1, 2), files)]
                    row.append((sum(seconds) / 2, *(np.load(file).astype(float) for file in files)))
                rounds.append(row)
            means = [np.mean([picture for row in rounds for picture in row[k][1:]], axis=0) for k in range(len(there))]
            # Pixels that show a light, by ours or by Mitsuba, and their neighbors.
            bright = np.max(means, axis=(0, 3))
            bright = bright > 4 * np.median(bright)
            for axis in (0, 1):
                bright = bright | np.roll(bright, 1, axis) | np.roll(bright, -1, axis)
            dull = ~bright
            about = there[0].about
            print(f"\n{number} lights, {args.size}, {args.spp} spp of ours and {args.peer_spp} of theirs, one thread, {args.rounds} rounds, "
                  f"{100 * (1 - dull.mean()):.2f} % of the pixels left out; commit {about['commit']}, {about['cpu']}, {about['lanes']} lanes, "
                  f"load {os.getloadavg()[0]:.1f}; {', '.join(f'{peer.name} ' + peer.about['version'] for peer in there[1:])}\n")
            print("| | seconds | relMSE | relMSE x s | over ours | mean over ours |\n|---|---|---|---|---|---|")
            ours = None
            for k, peer in enumerate(there):
                reference = means[k][dull] ** 2 + 1e-4
                errors = [float(np.mean((row[k][1] - row[k][2])[dull] ** 2 / 2 / reference)) for row in rounds]
                times = [row[k][0] for row in rounds]
                both = [a * b for a, b in zip(errors, times)]
                ours = ours or both
                over = [a / b for a, b in zip(both, ours)]
                show = lambda x: f"{statistics.median(x):.3g} ({min(x):.3g} to {max(x):.3g})"
                off = float(means[k][dull].mean() / means[0][dull].mean())
                print(f"| {peer.name} | {show(times)} | {show(errors)} | {show(both)} | {show(over)} | {off:.5f} |", flush=True)
                if args.keep:
                    np.save(f"{args.keep}/{number}-{peer.name.replace(' ', '-')}.npy", means[k])


if __name__ == "__main__":
    main()
