"""Measures many worlds on two threads against one, and what Python adds to a step: ``python benches/worlds.py``."""

import pathlib
import statistics
import sys
import time

import foible3d as f

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "tests"))

from conftest import bits, gripper  # noqa: E402

WORLDS = 64
STEPS = 60
REPEATS = 5
EMPTY_STEPS = 20_000


def seconds(work):
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def side_by_side():
    """64 grippers that squeeze and hold a box, on one thread and on two, from the same states, in turns."""
    settled = gripper()[0]
    settled.step(30)
    took = {1: [], 2: []}
    for _ in range(REPEATS):
        ends = []
        for threads, times in took.items():
            worlds = [settled.copy() for _ in range(WORLDS)]
            f.step_all(worlds, 1, threads)  # makes factors, as a first step does
            times.append(seconds(lambda: f.step_all(worlds, STEPS, threads)))
            ends.append([bits(world) for world in worlds])
        assert ends[0] == ends[1], "the bits depend on the number of threads"
    # The least disturbed ones: other work on the machine can only add.
    one, two = (min(times) for times in took.values())
    rate = WORLDS * STEPS / two
    print(f"{WORLDS} grippers, {STEPS} steps: {one:.2f} s on one thread, {two:.2f} s on two: {one / two:.2f} times, {rate:.0f} steps/s")
    assert one / two > 1.2, "measured 2.0 times on an idle machine of two processors"
    print(f"single runs, s: {[round(t, 2) for t in took[1]]} on one, {[round(t, 2) for t in took[2]]} on two")


def overhead():
    """An empty world, stepped one by one from Python and all at once in Rust."""
    world = f.World()

    def one_by_one():
        for _ in range(EMPTY_STEPS):
            world.step()

    loops = [seconds(one_by_one) for _ in range(REPEATS)]
    inside = [seconds(lambda: world.step(EMPTY_STEPS)) for _ in range(REPEATS)]
    python, rust = (1e6 * min(times) / EMPTY_STEPS for times in (loops, inside))
    print(f"an empty world: {python:.2f} µs a step from Python, {rust:.2f} µs in Rust: {python - rust:.2f} µs on top")
    assert python - rust < 1.5, "measured 0.5 µs"
    world, _, box, fingers = gripper()
    pad = fingers[0][1]
    for name, read in [
        ("positions of a pad", lambda: world.deformable_bodies[pad].positions),
        ("velocity of a box", lambda: world.rigid_bodies[box].linvel),
        ("contacts", world.contacts),
        ("snapshot", world.snapshot),
        ("copy", world.copy),
    ]:
        times = [seconds(read) for _ in range(200)]
        print(f"{name}: {1e6 * statistics.median(times):.1f} µs")


def filled():
    """Positions of 20 cubes of 1331 vertices as arrays of their own, one for each, and in one array that is filled."""
    world = f.World()
    for k in range(20):
        world.add_deformable(f.DeformableBody.cuboid((0.1,) * 3, (10, 10, 10), translation=(k, 0, 0)))
    bodies = [body for _, body in world.deformable_bodies]
    out, one = world.read_positions(), bodies[0].read_positions()
    took = {}
    for name, read in [
        ("a copy for each", lambda: [body.positions for body in bodies]),
        ("one filled for each", lambda: [body.read_positions(out=one) for body in bodies]),
        ("all in one that is filled", lambda: world.read_positions(out=out)),
    ]:
        took[name] = min(seconds(read) for _ in range(200))
    each, _, together = took.values()
    print(f"{len(out)} positions: " + ", ".join(f"{1e6 * time:.0f} µs {name}" for name, time in took.items()))
    assert together < 0.9 * each, "measured 0.6 of the time of copies"


if __name__ == "__main__":
    overhead()
    filled()
    side_by_side()
