#!/usr/bin/env python3
"""How time and memory grow: pixels, samples, threads, triangles, spheres, lights. Markdown on standard output.

    benches/scale.py --quick                        under a minute, small ends only
    benches/scale.py > docs/scale.md                all of it, some minutes
    benches/scale.py --only pixels,spp > part.md    some tables; see TABLES below

Needs `cargo build --release`, Python 3.8 or later, and for all of it 8 GB of memory. Scenes are made by benches/scenes.py in
a temporary directory. Each row is one process of `octolux render --json`, the fastest of --repeat (one only where it takes
over 5 s); times are its own wall-clock figures, the peak of memory is the system's. Slopes are exponents: least squares
over the logarithms.
"""

import argparse
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import scenes

HERE = pathlib.Path(__file__).resolve().parent
VEACH = HERE.parent / "scenes" / "veach-mis.toml"
FULL = {
    "pixels": (1, 4, 16, 64, 256, 1024, 4096, 8192),
    "spp": (1, 4, 16, 64, 256, 1024, 4096, 16384, 65536),
    "threads": (1, 2, 4, 8),
    "triangles": (12, 100, 1000, 10_000, 100_000, 1_000_000, 10_000_000),
    "spheres": (5, 100, 1000, 10_000, 100_000, 1_000_000),
    "lights": (1, 4, 16, 64, 256, 1024, 4096, 65_536, 1_000_000),
}
QUICK = {
    "pixels": (1, 16, 256, 1024),
    "spp": (1, 16, 256, 4096),
    "threads": (1, 2),
    "triangles": (12, 1000, 100_000),
    "spheres": (5, 1000, 20_000),
    "lights": (1, 16, 256, 4096),
}


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="small ends only")
    parser.add_argument("--only", metavar="TABLES", help=f"of {', '.join(FULL)}; with commas")
    parser.add_argument("--repeat", type=int, default=3, help="runs of a row; 1 with --quick [default: 3]")
    parser.add_argument("--octolux", help="the program [default: target/release/octolux]")
    args = parser.parse_args()
    args.tables = args.only.split(",") if args.only else list(FULL)
    unknown = [name for name in args.tables if name not in FULL]
    if unknown:
        parser.error(f"there is no table {unknown[0]}; there are {', '.join(FULL)}")
    if args.quick:
        args.repeat = 1
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    args.octolux = args.octolux or str(target / "release" / "octolux")
    if not os.access(args.octolux, os.X_OK):
        parser.error(f"there is no {args.octolux}: run `cargo build --release`, or name the program with --octolux")
    return args


ARGS = parse()
LAST = {}


def run(scene, size, spp, threads=1, options=()):
    """Figures of the fastest of some renders."""
    best = None
    with tempfile.TemporaryDirectory() as folder:
        command = [ARGS.octolux, "render", str(scene), "--size", f"{size[0]}x{size[1]}", "--spp", str(spp), "--json"]
        command += ["--quiet", "--estimator", "mis", "--threads", str(threads), "-o", f"{folder}/picture.npy", *options]
        for _ in range(ARGS.repeat):
            begin = time.perf_counter()
            ended = subprocess.run(command, capture_output=True, text=True)
            if ended.returncode:
                sys.exit(f"error: {' '.join(command)}\n{ended.stderr}")
            figures = json.loads(ended.stdout)
            if best is None or figures["render_s"] < best["render_s"]:
                best = figures
            if time.perf_counter() - begin > 5:
                break
    LAST.update(best)
    return best


def slope(points):
    """The exponent k of `y ~ x^k`, by least squares over logarithms."""
    logs = [(math.log(x), math.log(y)) for x, y in points if x > 0 and y > 0]
    n = len(logs)
    if n < 2:
        return float("nan")
    mean_x, mean_y = sum(x for x, _ in logs) / n, sum(y for _, y in logs) / n
    over = sum((x - mean_x) * (y - mean_y) for x, y in logs)
    return over / sum((x - mean_x) ** 2 for x, _ in logs)


def number(x):
    return f"{x:,}".replace(",", " ")


def seconds(x):
    return f"{x:.2g}" if x < 0.1 else f"{x:.2f}"


def table(title, head, rows, *sentences):
    print(f"## {title}\n\n| {' | '.join(head)} |\n|{' ---: |' * len(head)}")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    print("\n" + "\n".join(sentences) + "\n", flush=True)


def per_sample(f, threads=1):
    return 1e9 * f["render_s"] * threads / f["samples"]


def megabytes(f):
    return f["peak_rss_bytes"] / 1e6


def pixels(sides):
    """About four million samples a row, but no film more than 65 536 passes."""
    found = [(side, run(VEACH, (side, side), max(1, min(65536, 2**22 // side**2)))) for side in sides]
    rows = [
        (f"{number(side)}²", number(f["spp"]), f"{per_sample(f):.1f}", seconds(f["render_s"]), seconds(f["write_s"]),
         f"{megabytes(f):.0f}", f"{f['peak_rss_bytes'] / side**2:.0f}" if side >= 256 else "")
        for side, f in found
    ]
    large = [(side**2, f) for side, f in found if side >= 64]
    table(
        "Pixels", ("film", "spp", "ns a sample", "render [s]", "write [s]", "peak memory [MB]", "bytes a pixel"), rows,
        "Veach's scene, `mis`, 1 thread. From 64² on the time a sample goes as pixels to the power "
        f"{slope([(x, per_sample(f)) for x, f in large]):+.2f}.",
    )  # fmt: skip


def spp(counts):
    found = [(n, run(VEACH, (48, 32), n)) for n in counts]
    rows = [(number(n), f"{per_sample(f):.1f}", seconds(f["render_s"]), f"{megabytes(f):.1f}") for n, f in found]
    table(
        "Samples a pixel", ("spp", "ns a sample", "render [s]", "peak memory [MB]"), rows,
        "Veach's scene, 48 x 32, `mis`, 1 thread. Time goes as spp to the power "
        f"{slope([(n, f['render_s']) for n, f in found if n >= 64]):.2f} from 64 on, memory as spp to the power "
        f"{slope([(n, megabytes(f)) for n, f in found]):.3f}.",
    )  # fmt: skip


def threads(counts):
    found = [(n, run(VEACH, (768, 512), 32, n)) for n in counts]
    one = found[0][1]["render_s"]
    cores = os.cpu_count()
    rows = [
        (str(n), seconds(f["render_s"]), f"{1e-6 * f['samples_per_s']:.1f}", f"{one / f['render_s']:.2f}", f"{megabytes(f):.0f}")
        for n, f in found
    ]
    table(
        "Threads", ("threads", "render [s]", "million samples a second", "times one thread", "peak memory [MB]"), rows,
        f"Veach's scene, 768 x 512, 32 spp, `mis`. This machine has {cores} cores.",
    )


def shapes(kind, counts, size, samples, what):
    """A table of scenes from benches/scenes.py, through Embree."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for n in counts:
            scene = scenes.write(kind, n, folder)
            found.append((n, run(scene, size, samples, options=("--accel", "embree"))))
            for path in pathlib.Path(folder).iterdir():
                path.unlink()
    rays = lambda f: (f["eye_rays"] + f["shadow_rays"]) / f["samples"]
    rows = [
        (number(n), seconds(f["load_s"]), seconds(f["build_s"]), f"{per_sample(f):.1f}", f"{rays(f):.2f}",
         f"{per_sample(f) / rays(f):.1f}", f"{megabytes(f):.0f}")
        for n, f in found
    ]
    many = [(n, f) for n, f in found if n >= 1000]
    powers = ", ".join(
        f"{word} {slope([(n, value(f)) for n, f in many]):.2f}"
        for word, value in (("loading", lambda f: f["load_s"]), ("building", lambda f: f["build_s"]), ("memory", megabytes))
    )
    growth = slope([(n, per_sample(f)) for n, f in (found if kind == "lights" else many)])
    sentence = f"{what} {size[0]} x {size[1]}, {samples} spp, `mis`, 1 thread, `--accel embree`."
    first = "all" if kind == "lights" else "1000 on"
    sentence += f" Exponents of the number, from {first}: time a sample {growth:.2f}"
    sentence += "." if kind == "lights" else f", {powers}."
    head = ("number", "load [s]", "build [s]", "ns a sample", "rays a sample", "ns a ray", "peak memory [MB]")
    table(kind.capitalize(), head, rows, sentence)


TABLES = {
    "pixels": pixels,
    "spp": spp,
    "threads": threads,
    "triangles": lambda n: shapes("triangles", n, (384, 256), 16, "A sphere with waves on a floor, smooth normals, three lights."),
    "spheres": lambda n: shapes("spheres", n, (384, 256), 16, "A cube full of spheres on a floor, three lights."),
    "lights": lambda n: shapes("lights", n, (384, 256), 16, "24 spheres on a floor under lights that share one power, more than 64 of them by lists."),
}


def main():
    print("# How time and memory grow\n")
    load = os.getloadavg()[0]
    for name in ARGS.tables:
        TABLES[name]((QUICK if ARGS.quick else FULL)[name])
    how = "`benches/scale.py" + (" --quick" if ARGS.quick else "") + (f" --only {ARGS.only}" if ARGS.only else "") + "`"
    print(
        f"Taken by {how}: the fastest of {ARGS.repeat}, commit {LAST['commit']}, {LAST['cpu']} ({os.cpu_count()} cores, load "
        f"{load:.2f} before), target features {LAST['target_features']}, {LAST['lanes']} lanes, Embree "
        f"{LAST['embree_version']}. Wall-clock seconds; `build` is Embree's hierarchy with the tables around it."
    )


if __name__ == "__main__":
    main()
