"""Rays a second of `intersect` and `occluded`, beside the queries below Python and trimesh with embreex, in turn.

    python3 -m pip install ./python trimesh embreex
    (cd python && cargo build --release --example layer)
    benches/scenes.py triangles 1000000 target
    python3 python/benches/rates.py scenes/veach-mis.toml scenes/knot.toml target/triangles-1000000.toml

asks a million rays of the camera of each scene, in order and shuffled. A line each: least / median / most million rays
a second over the rounds, then ratios, each the median over rounds with the middle half of them. The queries below
Python (`benches/layer.rs`) write into arrays that exist; `intersect` and `occluded` make theirs. embreex is asked for
less: which triangle, and whether any; and it has the meshes of the scene without its spheres.

Ratios are also given in processor time: on a busy machine the system favours a process that has slept, as the other
has while embreex worked in this one. embreex works in one thread, so on cores that are free the ratio to it is this
times the number of threads.
"""

import argparse
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import octolux as ol

SIZE = (1000, 1000)
LAYER = Path(__file__).resolve().parents[2] / "target/release/examples/layer"


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser()
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--rounds", type=int, default=16)
    parser.add_argument("--layer", type=Path, default=LAYER, help="the program of benches/layer.rs")
    asked = parser.parse_args()
    for path in asked.scenes:
        compare(path, asked.layer, asked.rounds)


def meshes(scene: ol.Scene) -> object:
    """Give the meshes of a scene to trimesh, as one."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    vertices, faces, before = [], [], 0
    for i in range(scene.built.counts[0]):
        v, f, _ = scene.built.mesh(i)
        vertices.append(v)
        faces.append(f + before)
        before += len(v)
    return RayMeshIntersector(trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False))


def compare(path: Path, layer: Path, rounds: int) -> None:
    """Measure one scene, rays in order and the same shuffled."""
    scene = ol.load(path)
    other = meshes(scene)
    origins, directions = scene.eye_rays(SIZE)
    order = np.random.default_rng(1).permutation(len(origins))
    for name, at in (("coherent", np.arange(len(origins))), ("shuffled", order)):
        o, d = np.ascontiguousarray(origins[at]), np.ascontiguousarray(directions[at])
        with tempfile.TemporaryDirectory() as folder:
            files = [str(Path(folder) / file) for file in ("origins", "directions")]
            o.tofile(files[0])
            d.tofile(files[1])
            below = subprocess.Popen([layer, path, *files], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            measure(scene, other, (o, d), below, f"{path.name}, {name}", rounds)
            below.communicate()


def measure(scene: ol.Scene, other: object, rays: tuple, below: subprocess.Popen[str], name: str, rounds: int) -> None:
    """Take turns, and print what came of them."""
    o, d = rays
    coherent = name.endswith("coherent")

    def layer(what: str) -> float:
        below.stdin.write(f"{what} {'coherent' if coherent else ''}".rstrip() + "\n")
        below.stdin.flush()
        return float(below.stdout.readline())

    ways = {
        "intersect": timed(lambda: scene.intersect(o, d, coherent=coherent)),
        "below": lambda: layer("intersect"),
        "embreex first": timed(lambda: other.intersects_first(o, d)),
        "occluded": timed(lambda: scene.occluded(o, d, coherent=coherent)),
        "below any": lambda: layer("occluded"),
        "embreex any": timed(lambda: other.intersects_any(o, d)),
    }
    for ask in ways.values():
        ask()
    rates, costs = ({way: np.empty(rounds) for way in ways} for _ in range(2))
    for i in range(rounds):
        # Who comes after embreex finds the caches full of its memory: every other round goes backwards.
        for way, ask in list(ways.items())[:: 1 - 2 * (i % 2)]:
            process = below.pid if "below" in way else os.getpid()
            before = spent(process)
            rates[way][i] = len(o) / 1e6 / ask()
            costs[way][i] = spent(process) - before
    print(name)
    for way, rate in rates.items():
        print(f"  {way:14} {rate.min():7.2f} / {np.median(rate):7.2f} / {rate.max():7.2f} million rays a second")
    for mine, others in (("intersect", ("below", "embreex first")), ("occluded", ("below any", "embreex any"))):
        for way in others:
            low, middle, high = np.quantile(rates[mine] / rates[way], [0.25, 0.5, 0.75])
            print(f"  {mine} / {way}: {middle:.3f} ({low:.3f} to {high:.3f})")
            low, middle, high = np.quantile(costs[way] / costs[mine], [0.25, 0.5, 0.75])
            print(f"    by processor time {middle:.3f} ({low:.3f} to {high:.3f})")


def spent(process: int) -> float:
    """Give the processor seconds of all threads of a process."""
    threads = Path(f"/proc/{process}/task").glob("*/schedstat")
    return sum(int(thread.read_text().split()[0]) for thread in threads) / 1e9


def timed(ask: Callable[[], object]) -> Callable[[], float]:
    """Give a function that asks and returns the seconds."""

    def run() -> float:
        begun = time.perf_counter()
        ask()
        return time.perf_counter() - begun

    return run


if __name__ == "__main__":
    main()
