"""Robots from URDF and MJCF files."""

import copy
import pickle
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import foible3d as f
from conftest import bits
from foible3d import World

MODELS = Path(__file__).parents[2] / "robots" / "models"


def arm(**options):
    world = World(gravity=(0.0, 0.0, -9.81), dt=1.0 / 120.0)
    return world, world.add_robot(MODELS / "arm.urdf", soft_parts=MODELS / "arm.soft.toml", **options)


@pytest.mark.parametrize("multibody", [True, False])
def test_pads_of_an_arm_hang_on_its_fingers(multibody):
    world, robot = arm(multibody=multibody)
    assert {"left_finger", "right_finger"} <= set(robot.links)
    assert set(robot.parts) == {"left pad", "right pad"}
    target = robot.set_motor_position("lift", -0.1, 1.0e5, 5.0e3)
    assert target == pytest.approx(-0.1)
    world.step(240)
    assert robot.joint_position("lift") == pytest.approx(-0.1, abs=2e-3)
    for name, pad in robot.parts.items():
        weight = world.deformable_bodies[pad].mass * 9.81
        held = world.attachments[robot.attachments[name]].force
        assert held[2] == pytest.approx(weight, rel=0.01)


def test_a_hand_of_mjcf_has_its_soft_tips():
    world = World(gravity=(0.0, 0.0, -9.81), dt=1.0 / 120.0)
    hand = world.add_robot(MODELS / "hand.xml")
    assert len(hand.parts) == 3 and "palm_lift" in hand.joints
    hand.set_motor_position("palm_lift", 0.05, 2.0e3, 1.0e2)
    world.step(120)
    assert np.isfinite(hand.joint_position("palm_lift"))


def test_an_actuator_draws_its_joint(tmp_path):
    file = tmp_path / "slide.xml"
    file.write_text("""<mujoco><worldbody><body name="base"><geom type="box" size="0.02 0.02 0.02" mass="1"/>
        <body name="table" pos="0 0 0.2"><joint name="lift" type="slide" axis="0 0 1"/><geom type="box" size="0.1 0.1 0.01" mass="1"/></body>
        </body></worldbody><actuator><position name="lift" joint="lift" kp="500" kv="60" ctrlrange="-0.1 0.3"/></actuator></mujoco>""")
    world = World(gravity=(0.0, 0.0, -9.81), dt=1.0 / 120.0)
    robot = world.add_robot(file, fixed_base=True)
    assert robot.actuators == ["lift"]
    assert robot.set_control("lift", 0.9) == pytest.approx(0.3)
    world.step(600)
    assert robot.joint_position("lift") == pytest.approx(0.3 - 9.81 / 500, abs=2e-4)
    with pytest.raises(f.DeformableBodyError, match="no actuator `drop`; there are lift"):
        robot.set_control("drop", 0.0)


def test_limits_clamp_and_wrong_names_are_told():
    world, robot = arm()
    assert robot.set_motor_position("lift", -99.0, 1.0e4, 1.0e3) > -99.0
    with pytest.raises(f.DeformableBodyError, match="lifter"):
        robot.joint_position("lifter")
    with pytest.raises(f.DeformableBodyError, match="nowhere"):
        world.add_robot("nowhere.urdf")


def drive(world):
    """Steps and commands, of robots found by their names in the world; what everything has come to, as bits."""
    for step in range(100):
        for robot in world.robots:
            if "lift" in robot.joints:
                robot.set_motor_position("lift", -0.1 - 0.0005 * step, 1.0e5, 5.0e3)
            else:
                robot.set_motor_position("palm_lift", 0.0005 * step, 2.0e3, 1.0e2)
        world.step()
    forces = [world.attachments[handle].force for robot in world.robots for handle in robot.attachments.values()]
    return b"".join(bits(world)) + np.array(forces).tobytes()


def robots(multibody=True):
    """An arm and a hand in one world, in motion."""
    world, robot = arm(multibody=multibody)
    world.add_robot(MODELS / "hand.xml", position=(3, 0, 0), multibody=multibody)
    robot.set_motor_position("lift", -0.1, 1.0e5, 5.0e3)
    world.step(30)
    return world


GOES_ON = """
import pickle, sys
sys.path.insert(0, {tests!r})
from test_robots import drive
sys.stdout.buffer.write(drive(pickle.load(open({file!r}, "rb"))))
"""


@pytest.mark.parametrize("multibody", [True, False])
def test_a_world_with_robots_goes_on_with_the_same_bits_in_another_process(multibody, tmp_path):
    world = robots(multibody)
    file = tmp_path / "world.pickle"
    file.write_bytes(pickle.dumps(world))
    script = GOES_ON.format(tests=str(Path(__file__).parent), file=str(file))
    told = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, timeout=120).stdout
    copied = drive(copy.deepcopy(world))
    here = drive(world)
    assert len(here) > 1000 and told == here and copied == here


def test_what_a_robot_has_comes_back_with_its_world():
    world = robots()
    again = f.World.restore(world.snapshot())
    assert len(again.robots) == 2 and f.World().robots == []
    for old, new in zip(world.robots, again.robots):
        assert (new.links, new.parts, new.attachments) == (old.links, old.parts, old.attachments)
        assert (new.joints, new.warnings, repr(new)) == (old.joints, old.warnings, repr(old))
        assert [new.joint_position(name) for name in new.joints] == [old.joint_position(name) for name in old.joints]
    assert again.snapshot() == world.snapshot()
    # Limits and hooks too: a target beyond them ends at them, and a pad does not touch its own finger.
    (limit,) = {each.robots[0].set_motor_position("lift", -99.0, 1.0e4, 1.0e3) for each in (world, again)}
    assert limit > -99.0
    again.step(5)
    pads = again.robots[0].parts.values()
    assert pads and all(len(again.contacts(body=pad)) == 0 for pad in pads)


def test_damaged_robots_are_refused():
    world, robot = arm()
    saved = world.snapshot()
    assert len(World.restore(saved).robots) == 1
    for cut in (1, 10, 100):
        with pytest.raises(f.SnapshotError, match="damaged"):
            World.restore(saved[:-cut])
    # The limits of a joint stand as two numbers one after another: turned round they are refused.
    low = robot.set_motor_position("lift", -99.0, 1.0e4, 1.0e3)
    high = robot.set_motor_position("lift", 99.0, 1.0e4, 1.0e3)
    ordered, turned = struct.pack("<ff", low, high), struct.pack("<ff", high, low)
    place = saved.rindex(ordered)
    with pytest.raises(f.SnapshotError, match="damaged"):
        World.restore(saved[:place] + turned + saved[place + 8 :])
    # Whatever byte of the last part is damaged: an error, or a world that can be driven.
    random = np.random.default_rng(5)
    for place in random.integers(len(saved) - 1500, len(saved), 200):
        damaged = bytearray(saved)
        damaged[place] ^= random.integers(1, 256)
        try:
            again = World.restore(bytes(damaged))
        except (f.SnapshotError, RuntimeError):
            continue
        for each in again.robots:
            for joint in each.joints:
                try:
                    each.set_motor_position(joint, 0.1, 1.0e3, 1.0e2)
                    each.joint_position(joint)
                except f.DeformableBodyError:
                    pass
        again.step()
