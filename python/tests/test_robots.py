"""Robots from URDF and MJCF files."""

import copy
from pathlib import Path

import numpy as np
import pytest

import foible3d
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


def test_limits_clamp_and_wrong_names_are_told():
    world, robot = arm()
    assert robot.set_motor_position("lift", -99.0, 1.0e4, 1.0e3) > -99.0
    with pytest.raises(foible3d.DeformableBodyError, match="lifter"):
        robot.joint_position("lifter")
    with pytest.raises(foible3d.DeformableBodyError, match="nowhere"):
        world.add_robot("nowhere.urdf")


def test_worlds_with_robots_are_not_copied_without_their_hooks():
    world, _ = arm()
    with pytest.raises(foible3d.SnapshotError, match="robots"):
        copy.deepcopy(world)
