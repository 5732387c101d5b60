"""Rods that are held against roll."""

import numpy as np
import pytest

import foible3d as f


def test_a_cord_is_twisted_and_its_torque_turns_a_disc():
    world = f.World(gravity=(0, 0, 0))
    radius, modulus, length = 0.01, 1e6, 0.5
    points = [(0.05 * k, 0, 0) for k in range(11)]
    rod = f.DeformableBody.rope(points, radius, material=f.Material(modulus, 0.0), can_sleep=False)
    handle = world.add_deformable(rod)
    cord = world.deformable_bodies[handle]
    assert cord.twist() is None and cord.twist_torque() == 0.0
    cord.pin([0, 1])
    cord.hold_twist(4 * np.pi)
    stiffness = modulus / 2 * np.pi * radius**4 / 2 / length
    assert cord.twist() == pytest.approx(4 * np.pi) and cord.twist_torque() == pytest.approx(4 * np.pi * stiffness)
    disc = world.add_body(f.RigidBody.dynamic(translation=(length, 0, 0)), [f.Collider.ball(0.1)])
    world.attach(handle, [9, 10], disc)
    world.step(10)
    # The cord turns it back.
    assert world.rigid_bodies[disc].angvel[0] < -0.1 and cord.twist() < 4 * np.pi
    again = f.World.restore(world.snapshot())
    assert again.deformable_bodies[handle].twist() == cord.twist()
    world.actuators.insert("chuck", f.Actuator.twist(handle), (0, 10), start=1.0)
    world.step()
    assert not world.actuators["chuck"].is_missing and "twist" in repr(f.Actuator.twist(handle))
    cord.release_twist()
    assert cord.twist() is None
    with pytest.raises(f.DeformableBodyError, match="rod 3 does not exist: the body has 1"):
        cord.hold_twist(1.0, rod=3)
