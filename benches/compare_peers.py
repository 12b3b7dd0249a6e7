#!/usr/bin/env python3
"""Octolux and Mitsuba 3 on one scene, in turn, in one run: speed, error, memory, start-up, and the ratios.

    benches/compare_peers.py scenes/veach-mis.toml --spp 64 --threads 2 --rounds 5 --reference veach.npy

Needs `cargo build --release`, and a Python of 3.11 or later with `pip install mitsuba==3.9.1 numpy` and LLVM's shared
library (Debian: libllvm19): the running one, or another one by --python. Mitsuba always runs `mis` (peer_mitsuba.py);
ours is `--estimator`. Mitsuba stays in memory between rounds with its kernel compiled and one render thrown away;
Octolux is a new process each round, of which the rendering itself is timed (`render_s`: no scene, BVH or files), as it
is for Mitsuba. First pictures are whole processes, from the call to the picture on disk, with Mitsuba's kernels in its
cache. Nothing foreign is built. Exit status 1 if a picture does not agree with the reference.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
# The mean of a whole picture at some passes is true to far less; what differs by so much has another meaning.
MEANS_AGREE = 0.01


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default=str(HERE.parent / "scenes" / "veach-mis.toml"))
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--estimator", default="mis", help="ours, by name: mis, product, ...")
    parser.add_argument("--sampler", default="sobol", help="ours: sobol, independent")
    parser.add_argument("--lanes", default="8", help="ours: 1, 8, 16")
    parser.add_argument("--octolux-option", action="append", default=[], help="handed on, such as --octolux-option=--adaptive")
    parser.add_argument("--mitsuba-sampler", default="independent", help="independent, multijitter (its best), stratified")
    parser.add_argument("--reference", help=".npy to compare with [default: one by `octolux render --spp 4096`]")
    parser.add_argument("--reference-error", metavar="FILE", help=".npy of its standard errors: their share of relMSE is subtracted, on both sides")
    parser.add_argument("--octolux", help="the program [default: target/release/octolux]")
    parser.add_argument("--python", help="the Python that has mitsuba and numpy [default: this one]")
    parser.add_argument("--ceiling", action="store_true", help="also hold ours against bare calls of Embree: ceiling.py")
    parser.add_argument("--json", metavar="FILE", help="write every figure")
    return parser.parse_args()


def stop(sentence):
    sys.exit(f"error: {sentence}")


ARGS = parse()
if ARGS.python and pathlib.Path(ARGS.python).absolute() != pathlib.Path(sys.executable).absolute():
    os.execv(ARGS.python, [ARGS.python, __file__, *sys.argv[1:]])
if sys.version_info < (3, 11):
    stop("Python 3.11 or later is needed (tomllib); name another one with --python")
try:
    import numpy as np
except ImportError:
    stop("this Python has no numpy: `python3 -m pip install mitsuba==3.9.1 numpy`, or name another one with --python")


class Octolux:
    """A process a render."""

    name = "Octolux"

    def __init__(self, folder):
        target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
        self.program = ARGS.octolux or str(target / "release" / "octolux")
        if not os.access(self.program, os.X_OK):
            stop(f"there is no {self.program}: run `cargo build --release`, or name the program with --octolux")
        self.folder = folder

    def run(self, spp, seed, target, estimator, sampler, options=()):
        command = [self.program, "render", ARGS.scene, "--spp", str(spp), "--seed", str(seed), "--json", "--quiet"]
        command += ["--estimator", estimator, "--sampler", sampler, "--threads", str(ARGS.threads), "-o", target]
        ended = subprocess.run([*command, *options], capture_output=True, text=True)
        if ended.returncode:
            stop(f"Octolux failed: {ended.stderr.strip()}")
        return json.loads(ended.stdout)

    def render(self, seed, target, spp=None):
        options = ["--lanes", ARGS.lanes, *ARGS.octolux_option]
        return self.run(spp or ARGS.spp, seed, target, ARGS.estimator, ARGS.sampler, options)

    def first_picture(self, target):
        begin = time.perf_counter()
        self.render(1, target, spp=1)
        return time.perf_counter() - begin


class Mitsuba:
    """One process that renders when it is asked."""

    name = "Mitsuba"

    def __init__(self, spp):
        command = [sys.executable, str(HERE / "peer_mitsuba.py"), ARGS.scene, "--spp", str(spp)]
        command += ["--threads", str(ARGS.threads), "--sampler", ARGS.mitsuba_sampler]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.about = self.answer()

    def answer(self):
        line = self.process.stdout.readline()
        if not line:
            stop("Mitsuba ended without an answer; what it said is above")
        figures = json.loads(line)
        if "error" in figures:
            stop(figures["error"])
        return figures

    def render(self, seed, target):
        self.process.stdin.write(f"{seed} {target}\n")
        self.process.stdin.flush()
        figures = self.answer()
        return {**figures, "samples_per_s": figures["samples"] / figures["render_s"]}

    def close(self):
        self.process.stdin.close()
        self.process.wait()

    @classmethod
    def first_picture(cls, target):
        begin = time.perf_counter()
        renderer = cls(1)
        renderer.render(1, target)
        renderer.close()
        return time.perf_counter() - begin


def reference_share(reference):
    """What the reference's own noise adds to every relMSE: it is independent of the pictures, so both variances add."""
    if not ARGS.reference_error:
        return 0.0
    errors = np.load(ARGS.reference_error).astype(np.float64)
    if errors.shape != reference.shape:
        stop(f"the errors are {errors.shape}, the reference {reference.shape}: they must belong together")
    return float(np.mean(errors**2 / (reference**2 + 1e-4)))


def judge(figures, target, reference, share):
    """Adds relMSE, its product with the time, and how far the picture's mean is off."""
    picture = np.load(target).astype(np.float64)
    if picture.shape != reference.shape:
        stop(f"the picture is {picture.shape}, the reference {reference.shape}: they must have the scene's size")
    relmse = float(np.mean((picture - reference) ** 2 / (reference**2 + 1e-4))) - share
    off = float(picture.mean() / reference.mean() - 1)
    return {**figures, "relmse": relmse, "relmse_s": relmse * figures["render_s"], "mean_off": off}


def spread(values):
    return {"min": min(values), "median": statistics.median(values), "max": max(values)}


def reference_picture(octolux, folder):
    if ARGS.reference:
        return np.load(ARGS.reference).astype(np.float64), ARGS.reference
    target = f"{folder}/reference.npy"
    octolux.run(4096, 20_000_003, target, "mis", "sobol")
    return np.load(target).astype(np.float64), "made by `octolux render --spp 4096` (so it shares our faults, if any)"


def report(title, unit, scale, ours, theirs, better):
    """A line of the table and the ratio round by round: neighbours in time share the machine's mood."""
    rows = [(spread([x * scale for x in side]) if side else None) for side in (ours, theirs)]
    ratios = None
    if ours and theirs:
        ratios = spread([a / b if better == "high" else b / a for a, b in zip(ours, theirs)])
    cells = [f"{r['min']:.4g} / {r['median']:.4g} / {r['max']:.4g}" if r else "" for r in (*rows, ratios)]
    print(f"| {title} [{unit}] | " + " | ".join(cells) + " |")
    return {"octolux": rows[0], "mitsuba": rows[1], "ratio": ratios}


def bare_calls(octolux):
    """What Octolux keeps of Embree's speed on this scene, on one thread."""
    print("\nAgainst bare calls of Embree for the same rays, packed alike (benches/ceiling.py; 1 thread):\n", flush=True)
    command = [sys.executable, str(HERE / "ceiling.py"), ARGS.scene, "--octolux", octolux.program]
    subprocess.run([*command, f"--octolux-option=--lanes={ARGS.lanes}"], check=True)


def main():
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        target = f"{folder}/picture.npy"
        octolux, mitsuba = Octolux(folder), Mitsuba(ARGS.spp)
        mitsuba.render(0, target)  # compiles
        reference, origin = reference_picture(octolux, folder)
        share = reference_share(reference)
        rounds = []
        for seed in range(1, ARGS.rounds + 1):
            pair = []
            for renderer in (octolux, mitsuba):
                pair.append(judge(renderer.render(seed, target), target, reference, share))
            rounds.append(pair)
        mitsuba.close()
        first = [[r.first_picture(target) for r in (octolux, Mitsuba)] for _ in range(ARGS.rounds)]

    ours, theirs = [pair[0] for pair in rounds], [pair[1] for pair in rounds]
    about = ours[0]
    print(f"{ARGS.scene}: {about['width']} x {about['height']}, {ARGS.spp} spp, {ARGS.threads} threads, {ARGS.rounds} rounds")
    print(f"Octolux: {about['kernel']}, {' '.join([about['sampler'], *ARGS.octolux_option])}, commit {about['commit']}, "
          f"{about['target_features']}, Embree {about['embree_version']}")
    print(f"Mitsuba: {mitsuba.about['version']}, llvm_ad_rgb, the estimator mis, {ARGS.mitsuba_sampler}")
    print(f"{about['cpu']}, load {load:.2f} before and {os.getloadavg()[0]:.2f} after; reference: {origin}")
    print(f"Subtracted from relMSE as the reference's own share: {share:.2e}\n")
    print("Each cell: min / median / max over the rounds. A ratio above 1 is in Octolux's favour, round by round.\n")
    print("| | Octolux | Mitsuba | ratio |\n|---|---|---|---|")
    column = lambda side, key: [figures[key] for figures in side]
    summary = {}
    for key, title, unit, scale, better in (
        ("samples_per_s", "samples", "million/s", 1e-6, "high"),
        ("rays_per_s", "rays", "million/s", 1e-6, "high"),
        ("relmse", "relMSE", "1", 1, "low"),
        ("relmse_s", "relMSE x s", "s", 1, "low"),
        ("peak_rss_bytes", "peak memory", "MB", 1e-6, "low"),
    ):
        both = column(ours, key), column(theirs, key) if key in theirs[0] else []
        summary[key] = report(title, unit, scale, *both, better)
    summary["first_picture_s"] = report("first picture", "s", 1, [f[0] for f in first], [f[1] for f in first], "low")
    off = {r.name: statistics.mean(column(side, "mean_off")) for r, side in ((Octolux, ours), (Mitsuba, theirs))}
    print("\nMean against the reference's: " + ", ".join(f"{name} {100 * x:+.3f} %" for name, x in off.items()))
    if ARGS.ceiling:
        bare_calls(octolux)
    if ARGS.json:
        everything = {"arguments": vars(ARGS), "reference": origin, "reference_share": share, "mitsuba": mitsuba.about, "load": load,
                      "rounds": rounds, "first_picture_s": first, "mean_off": off, "summary": summary}
        pathlib.Path(ARGS.json).write_text(json.dumps(everything, indent=1) + "\n")
    wrong = [name for name, x in off.items() if abs(x) > MEANS_AGREE]
    if wrong:
        stop(f"{' and '.join(wrong)}: the mean is more than {100 * MEANS_AGREE:.0f} % off the reference's")


if __name__ == "__main__":
    main()
