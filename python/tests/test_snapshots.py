"""Worlds as bytes, and many of them."""

import copy
import os
import pickle
import select
import signal
import threading
import time

import pytest

import foible3d as f
from conftest import Scene, bits, gripper


@pytest.mark.parametrize(
    "again",
    [lambda world: f.World.restore(world.snapshot()), lambda world: pickle.loads(pickle.dumps(world)), f.World.copy, copy.copy, copy.deepcopy],
    ids=["restore", "pickle", "method", "copy", "deepcopy"],
)
def test_a_world_goes_on_with_the_same_bits(again):
    world, hand, box, fingers = gripper()
    world.step(30)
    other = again(world)
    assert other is not world and bits(other) == bits(world) and other.dt == world.dt
    for step in range(60):
        for each in (world, other):
            # Handles name the same things in both.
            each.rigid_bodies[hand].set_next_kinematic_translation((0, 0.3 + 0.001 * step, 0))
            each.step()
    assert bits(other) == bits(world)
    assert (other.attachments[fingers[0][2]].force == world.attachments[fingers[0][2]].force).all()
    assert other.snapshot() == world.snapshot()


def test_all_that_is_plain_is_pickled():
    for value in [
        f.RigidBodyHandle(3, 1),
        f.AttachmentHandle(300),
        f.Material(1e5, 0.3, friction=0.1, maxwell_branches=[(0.5, 0.1)], strain_limits=(0.5, 1.5)),
        f.InteractionGroups(1, 2),
        f.Fidelity.GAME,
        f.JointAxis.ANG_Z,
    ]:
        assert pickle.loads(pickle.dumps(value)) == value
        assert hash(value) is not None if not isinstance(value, (f.Material, f.InteractionGroups)) else True
    assert f.Material(1e5, 0.3).replace(density=2.0).density == 2.0


def test_what_is_no_snapshot_is_refused():
    saved = Scene().world.snapshot()
    for damaged, text in [
        (b"", "these 0 bytes are no snapshot"),
        (b"no snapshot", "no snapshot"),
        (saved[:10], "ends within its head"),
        (saved[:8] + b"\x63\0\0\0" + saved[12:], "of version 99; this package reads version 6"),
        (saved[:-3], "damaged"),
        (saved + b"x", "1 bytes are left"),
    ]:
        with pytest.raises(f.SnapshotError, match=text):
            f.World.restore(damaged)
    for place in range(12, len(saved)):
        turned = bytearray(saved)
        turned[place] ^= 0x55
        # An error, or a world.
        try:
            f.World.restore(bytes(turned))
        except (f.SnapshotError, RuntimeError):
            pass


def test_worlds_side_by_side_have_the_bits_that_they_have_alone():
    def worlds():
        made = [gripper(squeeze=15.0 + k)[0] for k in range(8)]
        return made

    alone, together = worlds(), worlds()
    begin = time.perf_counter()
    for world in alone:
        world.step(60)
    middle = time.perf_counter()
    f.step_all(together, n=60)
    end = time.perf_counter()
    print(f"8 worlds, 60 steps: {middle - begin:.2f} s one by one, {end - middle:.2f} s together")
    assert [bits(world) for world in together] == [bits(world) for world in alone]
    f.step_all(together, 1, threads=1)
    f.step_all([], 1)
    with pytest.raises(ValueError, match="is there twice"):
        f.step_all([together[0], together[1], together[0]])
    with pytest.raises(ValueError, match="threads"):
        f.step_all(together, threads=0)
    with pytest.raises(TypeError):
        f.step_all([1])


def test_other_threads_run_during_a_step():
    world, *_ = gripper()
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    world.step(120)
    during = counted[0] - before
    done.set()
    thread.join()
    assert during > 5


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_child_by_fork_steps_on():
    world = f.World()
    for x in range(8):
        # Several bodies that do not touch: solved on several threads.
        cube = f.DeformableBody.cuboid((0.1,) * 3, (3, 3, 3), translation=(x, 0, 0), can_sleep=False)
        world.add_deformable(cube)
    world.step(5)
    f.step_all([world, world.copy()], 5, threads=2)
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        world.step(5)
        f.step_all([world], 5, threads=2)
        os.write(write, b"stepped")
        os._exit(0)
    os.close(write)
    told, _, _ = select.select([read], [], [], 20)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    assert told and os.read(read, 7) == b"stepped"


def test_control_c_is_heard():
    world = f.World()
    # What is started in the background of a shell has it ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        for step in (world.step, lambda n: f.step_all([world], n)):
            timer = threading.Timer(0.2, lambda: signal.raise_signal(signal.SIGINT))
            timer.start()
            with pytest.raises(KeyboardInterrupt):
                step(10**12)
            timer.join()
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_world_is_used_from_several_threads():
    world, _, box, _ = gripper()
    threads = [threading.Thread(target=world.step, args=(20,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        assert world.rigid_bodies[box].translation.shape == (3,)
    other, *_ = gripper()
    other.step(80)
    assert bits(world) == bits(other)
