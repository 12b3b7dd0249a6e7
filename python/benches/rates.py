"""Rays a second of `intersect` and `occluded` for a million rays, beside those of trimesh with embreex, in turn.

`python3 -m pip install ./python trimesh embreex`, then `python3 python/benches/rates.py [TRIANGLES]...`; each scene
is a rumpled sheet of so many triangles. A line each: least / median / most million rays a second over the rounds, and
the ratio of the medians. embreex is asked for what it can answer: which triangle, and whether any.
"""

import argparse
import time

import numpy as np

import octolux as ol

RAYS = 1_000_000
ROUNDS = 7


def sheet(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """Give a rumpled sheet over [-1, 1]^2."""
    n = max(1, round((triangles / 2) ** 0.5))
    y, x = np.divmod(np.arange((n + 1) ** 2), n + 1)
    z = 0.1 * np.sin(9 * x / n * 3) * np.cos(7 * y / n * 3)
    vertices = np.stack([2 * x / n - 1, 2 * y / n - 1, z], axis=1)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], axis=1)
    return vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.uint32)


def main() -> None:
    """Measure."""
    parser = argparse.ArgumentParser()
    parser.add_argument("triangles", type=int, nargs="*", default=[1000, 1_000_000])
    asked = parser.parse_args()
    for triangles in asked.triangles:
        compare(triangles)


def compare(triangles: int) -> None:
    """Measure one scene, coherent rays and the same in another order."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    vertices, faces = sheet(triangles)
    scene = ol.Scene(size=(1000, RAYS // 1000))
    scene.set_camera((0.3, -2, 1.5), (0, 0, 0), (0, 0, 1), fov_x=60)
    scene.add_geometry(ol.Mesh(vertices, faces, brdf_params=(0.5, 0.5, 0.5, 1)))
    other = RayMeshIntersector(trimesh.Trimesh(vertices, faces, process=False))
    origins, directions = scene.eye_rays()
    order = np.random.default_rng(1).permutation(RAYS)
    for name, at in (("coherent", np.arange(RAYS)), ("shuffled", order)):
        o, d = origins[at], directions[at]
        coherent = name == "coherent"
        found = scene.intersect(o, d, coherent=coherent)
        agree = np.mean(found.primitive == other.intersects_first(o, d))
        ways = {
            "intersect": lambda o=o, d=d, c=coherent: scene.intersect(o, d, coherent=c),
            "embreex first": lambda o=o, d=d: other.intersects_first(o, d),
            "occluded": lambda o=o, d=d, c=coherent: scene.occluded(o, d, coherent=c),
            "embreex any": lambda o=o, d=d: other.intersects_any(o, d),
        }
        rates: dict[str, list[float]] = {way: [] for way in ways}
        for _ in range(ROUNDS):
            for way, ask in ways.items():
                begun = time.perf_counter()
                ask()
                rates[way].append(RAYS / 1e6 / (time.perf_counter() - begun))
        median = {way: np.median(rate) for way, rate in rates.items()}
        print(f"{len(faces)} triangles, {name}: {agree:.4%} of the answers agree")
        for way, rate in rates.items():
            print(f"  {way:14} {min(rate):7.2f} / {median[way]:7.2f} / {max(rate):7.2f} million rays a second")
        print(
            f"  ratios: first {median['intersect'] / median['embreex first']:.2f}, "
            f"any {median['occluded'] / median['embreex any']:.2f}"
        )


if __name__ == "__main__":
    main()
