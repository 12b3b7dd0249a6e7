#!/usr/bin/env python3
"""Where the time of a render goes: nanoseconds of processor time per sample, stage by stage, as a table for docs/performance-log.md.

    benches/stages.py scenes/veach-mis.toml
    benches/stages.py scenes/veach-mis.toml -- --lanes 8 --accel embree

Needs `cargo build --release`, Linux's `perf`, binutils and Python 3.8 or later. What follows `--` is handed to `render`; each
render runs on one thread, by `mis` unless that says another estimator. A stage is one function with everything inlined, so every sample of the profile is given to the
stage that the inlined frames at its address name (`addr2line -i`). Embree's wheel has no symbols: what it does is one row.
The rows sum to the whole. Times are means over the rounds, with the least and the largest total.
"""

import argparse
import collections
import os
import pathlib
import re
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent

# The first rule counts whose file and function are among the inlined frames, innermost first; "" is any.
RULES = [
    ("linear/cull.rs", "", "culling by tile and light"),
    ("linear/shapes.rs", "", "culling by tile and light"),
    ("pipeline/tracer.rs", "bound_points|cull|sides|keep_all", "culling by tile and light"),
    ("pipeline/stage/shadow.rs", "occluded", "shadow: occluders"),
    ("", "occluded", "shadow: occluders"),
    ("pipeline/stage/shadow.rs", "", "shadow: packets and film"),
    ("", "nearest", "camera: first hits"),
    ("pipeline/stage/shade.rs", "", "shade: lights sampled and weighed"),
    ("pipeline/stage/camera.rs", "", "camera: numbers, rays, hits into streams"),
    ("film/", "", "shadow: packets and film"),
]
ORDER = [
    "camera: numbers, rays, hits into streams",
    "camera: first hits",
    "shade: lights sampled and weighed",
    "shadow: occluders",
    "shadow: packets and film",
    "culling by tile and light",
    "Embree",
    "start-up, files, the system",
]


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--spp", type=int, default=256, help="[default: 256]")
    parser.add_argument("--size", default="768x512")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--octolux", help="the program [default: target/release/octolux]")
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    args = parser.parse_args(words[:split])
    args.options = words[split + 1 :]
    return args


def segments(program):
    """Where the parts of the file lie in the address space it was linked for."""
    headers = subprocess.run(["readelf", "-lW", program], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"LOAD\s+0x([0-9a-f]+) 0x([0-9a-f]+) 0x[0-9a-f]+ 0x([0-9a-f]+)", headers)
    return [tuple(int(number, 16) for number in segment) for segment in found]


def profile(program, args, folder):
    """Samples by place in the program's file, and those in other files by name; seconds of processor time."""
    data = str(folder / "perf.data")
    render = [program, "render", args.scene, "--spp", str(args.spp), "--size", args.size, "--threads", "1", "-q"]
    if not any(option.startswith("--estimator") for option in args.options):
        render += ["--estimator", "mis"]
    command = ["perf", "record", "-q", "-e", "cpu-clock", "-F", "2000", "-o", data]
    before = os.times()
    subprocess.run([*command, *render, *args.options, "-o", str(folder / "x.npy")], check=True)
    after = os.times()
    script = ["perf", "script", "-i", data, "--show-mmap-events", "-F", "comm,ip,dso,event"]
    listing = subprocess.run(script, capture_output=True, text=True, check=True).stdout
    name, here, elsewhere, mapped = os.path.basename(program), collections.Counter(), collections.Counter(), None
    for line in listing.splitlines():
        mapping = re.search(r"\[0x([0-9a-f]+)\(0x([0-9a-f]+)\) @ (\S+) .*: r-xp .*/(\S+)$", line)
        if mapping:
            if mapping.group(4) == name:
                mapped = [int(mapping.group(i), 16) for i in (1, 2, 3)]
            continue
        sample = re.search(r"([0-9a-f]{6,16})\s+\((.*)\)\s*$", line)
        if not sample:
            continue
        at = int(sample.group(1), 16)
        if mapped and 0 <= at - mapped[0] < mapped[1]:
            here[at - mapped[0] + mapped[2]] += 1
        else:
            elsewhere[os.path.basename(sample.group(2))] += 1
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    return here, elsewhere, seconds


def stage(frames):
    for file, function, name in RULES:
        for inlined, place in frames:
            if file in place and re.search(function, inlined):
                return name
    return "start-up, files, the system"


def stages(program, here):
    parts = segments(program)
    linked = {at: next((at - file + address for file, address, size in parts if file <= at < file + size), at) for at in here}
    places = sorted(here)
    lines = ["addr2line", "-aifCe", program, *(hex(linked[at]) for at in places)]
    told = subprocess.run(lines, capture_output=True, text=True, check=True).stdout
    counts = collections.Counter()
    for at, block in zip(places, re.split(r"^0x[0-9a-f]+\n", told, flags=re.M)[1:]):
        words = block.strip().splitlines()
        counts[stage(list(zip(words[::2], words[1::2])))] += here[at]
    return counts


def main():
    args = parse()
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", HERE.parent / "target"))
    program = args.octolux or str(target / "release" / "octolux")
    width, height = map(int, args.size.split("x"))
    samples = width * height * args.spp
    rows, totals = collections.Counter(), []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(args.rounds):
            here, elsewhere, seconds = profile(program, args, pathlib.Path(folder))
            counts = stages(program, here)
            for name, count in elsewhere.items():
                embree = "embree" in name or "tbb" in name
                counts["Embree" if embree else "start-up, files, the system"] += count
            total = 1e9 * seconds / samples
            totals.append(total)
            for name, count in counts.items():
                rows[name] += total * count / sum(counts.values()) / args.rounds
    mean = sum(totals) / len(totals)
    print("| stage | ns per sample | |\n| --- | --- | --- |")
    for name in ORDER:
        if rows[name] > 0:
            print(f"| {name} | {rows[name]:.1f} | {100 * rows[name] / mean:.0f} % |")
    print(f"| **all** | **{mean:.1f}** ({min(totals):.1f} to {max(totals):.1f}) | |")


if __name__ == "__main__":
    main()
