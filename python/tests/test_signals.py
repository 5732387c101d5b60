"""Signals: by name, within ranges and rates."""

import numpy as np
import pytest

import foible3d as f
from conftest import gripper


def test_a_signal_goes_to_its_command_at_its_rate():
    world, _, _, fingers = gripper()
    motor = f.JointMotorAxis(f.JointAxis.LIN_X, stiffness=1000.0, damping=50.0)
    assert (motor.axis, motor.stiffness, motor.damping) == (f.JointAxis.LIN_X, 1000.0, 50.0)
    for name, (joint, _, _) in zip(("right", "left"), fingers):
        world.actuators.insert(name, f.Actuator.joint_position(joint, motor), (-0.05, 0.1), rate=0.06)
    assert world.actuators.names() == ["left", "right"] == list(world.actuators) and len(world.actuators) == 2
    assert world.actuators.values().tolist() == [0.0, 0.0]
    assert world.actuators.ranges().tolist() == [[-0.05, 0.1]] * 2
    world.actuators.command("left", -1.0)
    signal = world.actuators["left"]
    assert signal.command == -0.05 and signal.value == 0.0 and signal.range == (-0.05, 0.1) and signal.rate == 0.06
    world.step(30)
    assert world.actuators.values() == pytest.approx([-0.06 * 30 * world.dt, 0.0], abs=1e-9)
    again = world.copy()
    again.step(60)
    assert again.actuators.get("left").value == -0.05 and not again.actuators.get("left").is_missing
    assert world.actuators.values()[0] > -0.05
    world.actuators.command_all(np.array([0.02, 0.01]))
    assert [world.actuators[name].command for name in world.actuators] == [0.02, 0.01]


def test_cables_cavities_and_muscles_are_driven():
    world = f.World(gravity=(0, 0, 0))
    block = world.add_deformable(f.DeformableBody.cuboid((0.05, 0.05, 0.05), (2, 2, 2), can_sleep=False))
    points = [f.CablePoint.vertex(block, 0), f.CablePoint.world((0, 2, 0))]
    cable = world.add_cable(points, length=3.0)
    world.actuators.insert("pull", f.Actuator.cable_tension(cable), (0, 5), start=1.0)
    world.actuators.insert("muscle", f.Actuator.activation(block), (0.5, 1.0))
    world.actuators.insert("air", f.Actuator.cavity_pressure(block), (0, 100))
    assert world.actuators["muscle"].value == 0.5 and world.actuators["pull"].value == 1.0
    world.actuators.command("pull", 2.0)
    world.step()
    assert world.cables[cable].tension == pytest.approx(2.0, rel=1e-9)
    # The cube has no cavity.
    assert world.actuators["air"].is_missing and not world.actuators["pull"].is_missing
    world.remove_cable(cable)
    world.actuators.command("pull", 3.0)
    world.step()
    assert world.actuators["pull"].is_missing
    world.actuators.remove("air")
    assert "air" not in world.actuators and world.actuators.get("air") is None


def test_what_no_signal_is_is_refused():
    world = f.World()
    block = world.add_deformable(f.DeformableBody.cuboid((0.05, 0.05, 0.05), (2, 2, 2)))
    muscle = f.Actuator.activation(block)
    world.actuators.insert("m", muscle, (0.5, 1.0))
    for arguments, text in [
        (("m", muscle, (0.5, 1.0)), 'there is a signal "m" already'),
        (("n", muscle, (1.0, 0.5)), "range"),
        (("n", muscle, (0.0, 1.0), -1.0), "rate"),
        (("n", muscle, (0.0, 1.0), 1.0, 2.0), "start"),
    ]:
        with pytest.raises(f.DeformableBodyError, match=text):
            world.actuators.insert(*arguments)
    with pytest.raises(f.UnknownSignal, match='there is no signal "x"') as caught:
        world.actuators.command("x", 1.0)
    assert isinstance(caught.value, KeyError)
    with pytest.raises(f.DeformableBodyError, match="not finite"):
        world.actuators.command("m", float("nan"))
    with pytest.raises(f.DeformableBodyError, match="values: 2 for 1 signals"):
        world.actuators.command_all([1.0, 2.0])
    with pytest.raises(f.UnknownSignal):
        world.actuators["x"]
