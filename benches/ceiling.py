#!/usr/bin/env python3
"""How much of Embree's speed a render keeps: its rays a second against bare calls for the very same rays.

    benches/scenes.py triangles 1000000 target
    benches/ceiling.py target/triangles-1000000.toml scenes/veach-mis.toml
    benches/ceiling.py scenes/veach-mis.toml --octolux-option=--cull=off

Needs `cargo build --release`, gcc, and Python 3.8 or later. `benches/ceiling.c` is built in a temporary directory and loaded
between the program and Embree, which does not know of it. It takes turns of some milliseconds: a stretch of the render is timed, the
next one's packets are kept, and packets that were kept before are asked again with nothing in between. A round is two renders, of
which the second keeps what the first timed and the other way round. One thread; times are processor time. Rays are packed as the
renderer packs them, so what this shows is the price of everything but Embree, not whether other packets would be faster. What is
kept is the ratio over all turns, with an interval that holds 95 % of what other turns like these would give (2000 drawings of
turns with replacement, in blocks of eight, each of all rounds together). The estimator is `mis` unless an option says another.
"""

import argparse
import json
import os
import pathlib
import random
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
# So many turns after each other are drawn together, for they are alike.
BLOCK = 8


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", default="384x256")
    parser.add_argument("--spp", type=int, default=64, help="[default: 64]")
    parser.add_argument("--rounds", type=int, default=3, help="[default: 3]")
    parser.add_argument("--octolux", help="the program [default: target/release/octolux]")
    parser.add_argument("--octolux-option", action="append", default=[], help="handed on, such as --octolux-option=--lanes=8")
    return parser.parse_args()


def main():
    args = parse()
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    program = args.octolux or str(target / "release" / "octolux")
    # The hand-out's, unless an option names another one: published figures are of it.
    named = any(option.startswith("--estimator") for option in args.octolux_option)
    estimator = [] if named else ["--estimator", "mis"]
    with tempfile.TemporaryDirectory() as folder:
        library = f"{folder}/ceiling.so"
        subprocess.run(["gcc", "-O3", "-march=native", "-shared", "-fPIC", "-o", library, HERE / "ceiling.c", "-ldl"], check=True)

        def turns(scene, order):
            command = [program, "render", scene, "--size", args.size, "--spp", str(args.spp), "--threads", "1"]
            command += ["--accel", "embree", "--quiet", "-o", f"{folder}/picture.npy", *estimator, *args.octolux_option]
            about = {**os.environ, "LD_PRELOAD": library, "OCTOLUX_CEILING": order}
            return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=about).stdout)["turns"]

        print("| scene | shadow rays an eye ray | bare: eye, shadow [ns a ray] | bare [million rays/s] | Octolux | kept | 95 % | turns |")
        print("| --- | --- | --- | --- | --- | --- | --- | --- |")
        for scene in args.scenes:
            renders = [turns(scene, order) for _ in range(args.rounds) for order in ("render first", "swap")]
            # The same stretch of every render, added up.
            rows = [[sum(column) for column in zip(*stretch)] for stretch in zip(*renders)]
            if not rows:
                raise SystemExit(f"{scene}: too few rays for a turn; raise --spp or --size")
            kept, bare, ours, eye, shadow, of_eye, of_shadow = summary(rows)
            low, high = interval(rows)
            print(
                f"| {pathlib.Path(scene).stem} | {shadow / eye:.2f} | {1e9 * of_eye / eye:.1f}, {1e9 * of_shadow / max(shadow, 1):.1f} "
                f"| {bare / 1e6:.1f} | {ours / 1e6:.1f} | {100 * kept:.1f} % | {100 * low:.1f} to {100 * high:.1f} | {len(rows)} |",
                flush=True,
            )


def summary(rows):
    """What is kept; rays a second of bare calls and of the render; what was replayed."""
    seconds, eye, shadow, of_eye, of_shadow = (sum(column) for column in zip(*rows))
    bare, ours = (eye + shadow) / (of_eye + of_shadow), (eye + shadow) / seconds
    return ours / bare, bare, ours, eye, shadow, of_eye, of_shadow


def interval(rows):
    random.seed(1)
    blocks = [rows[i : i + BLOCK] for i in range(0, len(rows), BLOCK)]
    kept = []
    for _ in range(2000):
        drawn = random.choices(blocks, k=len(blocks))
        kept.append(summary([row for block in drawn for row in block])[0])
    kept.sort()
    return kept[len(kept) // 40], kept[-1 - len(kept) // 40]


if __name__ == "__main__":
    main()
