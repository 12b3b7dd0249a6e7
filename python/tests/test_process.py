"""Threads, forks, ctrl-c and memory."""

import gc
import os
import resource
import signal
import subprocess
import sys
import textwrap
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import octolux as ol


def test_threads_get_the_same_answers(ball: ol.Scene) -> None:
    """Eight at once, renders and rays, and on one scene."""
    rng = np.random.default_rng(1)
    o, d = rng.uniform(-5, 5, (5000, 3)), rng.normal(size=(5000, 3))
    image, hits = ol.render(ball, spp=4), ball.intersect(o, d)

    def work(i: int) -> bool:
        if i % 2:
            return np.array_equal(ol.render(ball, spp=4), image)
        return np.array_equal(ball.intersect(o, d).t, hits.t)

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(32)))


def test_other_threads_run_meanwhile(ball: ol.Scene) -> None:
    """A render that never ends by itself is stopped by what another thread does: Python's lock is free."""
    enough = threading.Event()
    worker = threading.Thread(target=lambda: [enough.set() for _ in range(1)])
    frames = ol.progressive(ball, spp=1 << 30)
    next(frames)
    worker.start()
    for _ in frames:
        if enough.wait(0):
            break
    worker.join()
    assert enough.is_set()


def child(code: str, **keywords: object) -> subprocess.Popen:
    """Run code in a Python of its own."""
    prelude = """
        import octolux as ol, numpy as np, os, sys
        scene = ol.Scene(size=(64, 48))
        scene.set_camera((0, 0, 5), (0, 0, 0), fov_x=50)
        scene.add_geometry(ol.Sphere((0, 0, 0), 1, brdf_params=(.5, .6, .7, 1)))
        scene.add_geometry(ol.Sphere((0, 4, 1), .5, Le=(10, 9, 8)))
        rng = np.random.default_rng(3)
        V = rng.normal(size=(3000, 3)); F = np.arange(3000).reshape(-1, 3)
        scene.add_geometry(ol.Mesh(V, F, brdf_params=(.5, .5, .5, 1)))
    """
    text = textwrap.dedent(prelude) + textwrap.dedent(code)
    return subprocess.Popen(
        [sys.executable, "-u", "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **keywords
    )


def test_a_forked_process_works(ball: ol.Scene) -> None:
    """After its parent rendered, asked rays and asked the oracle: with the parent's scene, and with one of its own."""
    process = child("""
        before, rays = ol.render(scene, spp=2), scene.intersect(V, -V)
        ol.reference(scene, spp=2)
        pid = os.fork()
        if pid == 0:
            same = np.array_equal(ol.render(scene, spp=2), before) and np.array_equal(scene.intersect(V, -V).t, rays.t)
            scene.add_geometry(ol.Sphere((3, 0, 0), 1))
            same = same and ol.render(scene, spp=2).shape == (48, 64, 3)
            same = same and np.isfinite(ol.reference(scene, spp=2)[0]).all()
            os._exit(0 if same else 1)
        sys.exit(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
    """)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 0, said


def test_ctrl_c_stops_a_render() -> None:
    """With KeyboardInterrupt, in a render of a billion samples a pixel."""
    process = child("""
        print("ready")
        try:
            ol.render(scene, spp=1 << 30)
        except KeyboardInterrupt:
            sys.exit(7)
    """)
    assert process.stdout.readline() == "ready\n"
    threading.Event().wait(0.5)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 7, said


def test_scenes_are_given_back() -> None:
    """A thousand scenes of 100 kB and their threads: the last 500 add less than 15 MB where they would take 50."""

    def one(i: int) -> None:
        scene = ol.Scene(size=(8, 8))
        scene.set_camera((0, 0, 5), (0, 0, 0), fov_x=50)
        vertices = np.random.default_rng(i).normal(size=(900, 3))
        scene.add_geometry(ol.Mesh(vertices, np.arange(900).reshape(-1, 3), brdf_params=(0.5, 0.5, 0.5, 1)))
        scene.intersect((0, 0, 5), (0, 0, -1))

    def resident() -> float:
        gc.collect()
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * resource.getpagesize() / 1e6

    for i in range(500):
        one(i)
    half = resident()
    for i in range(500):
        one(i)
    assert resident() - half < 15
    assert len(os.listdir("/proc/self/task")) < 50
