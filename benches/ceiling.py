#!/usr/bin/env python3
"""How much of Embree's speed a render keeps: its rays a second against bare calls for the very same rays.

    benches/scenes.py triangles 1000000 target
    benches/ceiling.py target/triangles-1000000.toml scenes/veach-mis.toml

Needs `cargo build --release`, gcc, and Python 3.8 or later. `benches/ceiling.c` is built in a temporary directory and loaded
between the program and Embree, which does not know of it. A round is one render whose processor time is taken from its
first packet to its last, and one whose packets are kept and asked again, five times, with nothing in between; of the five
the median counts. One thread; times are processor time. Rays are packed as the renderer packs them, so what this shows
is the price of everything but Embree, not whether other packets would be faster. What else runs on a shared machine only ever
slows a round: "at best" is the fastest render over the fastest replay.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--size", default="384x256")
    parser.add_argument("--spp", type=int, default=16, help="[default: 16]")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--octolux", help="the program [default: target/release/octolux]")
    parser.add_argument("--octolux-option", action="append", default=[], help="handed on, such as --octolux-option=--lanes=8")
    return parser.parse_args()


def main():
    args = parse()
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    program = args.octolux or str(target / "release" / "octolux")
    with tempfile.TemporaryDirectory() as folder:
        library = f"{folder}/ceiling.so"
        subprocess.run(["gcc", "-O2", "-march=native", "-shared", "-fPIC", "-o", library, HERE / "ceiling.c", "-ldl"], check=True)

        def run(scene, mode):
            command = [program, "render", scene, "--size", args.size, "--spp", str(args.spp), "--threads", "1"]
            command += ["--accel", "embree", "--quiet", "-o", f"{folder}/picture.npy", *args.octolux_option]
            about = {**os.environ, "OCTOLUX_CEILING": mode, "LD_PRELOAD": library}
            return json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=about).stdout)

        print("| scene | rays a sample | bare: eye, shadow [ns a ray] | bare [million rays/s] | Octolux | kept, by round | at best |")
        print("| --- | --- | --- | --- | --- | --- | --- |")
        for scene in args.scenes:
            kept, bare, ours, parts = [], [], [], []
            for _ in range(args.rounds):
                rendered, replayed = run(scene, "time"), run(scene, "record")
                eye, shadow = replayed["eye_rays"], replayed["shadow_rays"]
                seconds = statistics.median(sum(pair) for pair in replayed["seconds"])
                parts.append([statistics.median(column) for column in zip(*replayed["seconds"])])
                bare.append((eye + shadow) / seconds)
                ours.append(rendered["timed_rays"] / rendered["seconds"])
                kept.append(ours[-1] / bare[-1])
            by_ray = [1e9 * statistics.median(p[k] for p in parts) / n for k, n in enumerate((eye, max(shadow, 1)))]
            print(
                f"| {pathlib.Path(scene).stem} | {(eye + shadow) / eye:.2f} | {by_ray[0]:.1f}, {by_ray[1]:.1f} "
                f"| {statistics.median(bare) / 1e6:.1f} | {statistics.median(ours) / 1e6:.1f} "
                f"| {' / '.join(f'{100 * ratio:.0f} %' for ratio in sorted(kept))} "
                f"| {100 * max(ours) / max(bare):.0f} % |",
                flush=True,
            )


if __name__ == "__main__":
    main()
