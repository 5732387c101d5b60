"""Deformable bodies with rigid ones: attachments, a gripper."""

import numpy as np
import pytest

import foible3d as f
from conftest import gripper


def test_a_block_hangs_on_what_it_is_attached_to():
    world = f.World()
    hook = world.add_body(f.RigidBody.kinematic_position_based(translation=(0, 1, 0)))
    material = f.Material(1e5, 0.3, mass_damping=5.0)
    block = f.DeformableBody.cuboid((0.1,) * 3, (2, 2, 2), material=material, can_sleep=False)
    block = world.add_deformable(block)
    body = world.deformable_bodies[block]
    top = body.positions[:, 1] > 0.099
    glue = world.attach(block, top, hook)
    world.step(120)
    attachment = world.attachments[glue]
    assert attachment.force == pytest.approx([0, 8 * 9.81, 0], abs=0.1)
    assert (attachment.body, attachment.compliance, attachment.length, attachment.is_broken) == (block, 0, 0, False)
    world.rigid_bodies[hook].set_next_kinematic_translation((0, 1.01, 0))
    world.step()
    assert body.positions[top, 1] == pytest.approx(0.11, abs=1e-5)
    attachment.compliance = 1e-3
    world.step(240)
    # Nine vertices, each giving way by 1 mm/N.
    assert 0.11 - body.positions[top, 1].mean() == pytest.approx(8 * 9.81 / 9 * 1e-3, rel=1e-3)
    attachment.break_force = 10.0
    world.step()
    assert attachment.is_broken
    world.detach(glue)
    with pytest.raises(f.InvalidHandle, match="no attachment of number 0"):
        attachment.force
    with pytest.raises(KeyError):
        world.detach(glue)


def test_attachments_to_the_world_and_to_one_another():
    world = f.World()
    cube = f.DeformableBody.cuboid((0.1,) * 3, (2, 2, 2), material=f.Material(1e5, 0.3, mass_damping=5.0), can_sleep=False)
    upper = world.add_deformable(cube)
    lower = world.add_deformable(cube.translation((0, -0.2, 0)).collision_groups(f.InteractionGroups.none()))
    up, low = world.deformable_bodies[upper], world.deformable_bodies[lower]
    ceiling = world.attach(upper, np.flatnonzero(up.positions[:, 1] > 0.099))
    seam = world.attach(
        lower, low.positions[:, 1] > -0.101, upper, to_vertices=up.positions[:, 1] < -0.099
    )
    world.step(240)
    assert world.attachments[ceiling].force[1] == pytest.approx(16 * 9.81, rel=1e-3)
    assert world.attachments[seam].force[1] == pytest.approx(8 * 9.81, rel=1e-3)
    assert world.attachments.handles() == [ceiling, seam] and ceiling.id == 0
    with pytest.raises(f.DeformableBodyError, match="is not on the surface"):
        world.attach(upper, [13])
    with pytest.raises(f.DeformableBodyError, match="the list of vertices is empty"):
        world.attach(upper, [])
    with pytest.raises(f.DeformableBodyError, match="to_vertices"):
        world.attach(upper, [0], lower)


def test_a_gripper_lifts_a_box_by_friction():
    world, hand, box, fingers = gripper()
    world.step(60)
    start = world.rigid_bodies[box].translation[1]
    weight = world.rigid_bodies[box].mass * 9.81
    (collider,) = world.rigid_bodies[box].colliders
    for step in range(60):
        world.rigid_bodies[hand].set_next_kinematic_translation((0, 0.3 + 0.1 * (step + 1) / 60, 0))
        world.step()
    world.step(60)
    assert world.rigid_bodies[box].translation[1] - start == pytest.approx(0.1, abs=2e-3)
    # What the pads do to the box: its weight together, and the squeeze from either side.
    forces = [-world.contact_force(pad, collider) for _, pad, _ in fingers]
    assert sum(forces)[1] == pytest.approx(weight, rel=1e-3)
    assert [force[0] for force in forces] == pytest.approx([20, -20], rel=0.02)
    for joint, _, glue in fingers:
        # The first axis is the one that the finger slides along.
        assert abs(world.joint_force(joint, 0)) == pytest.approx(20, rel=0.02)
        assert world.impulse_joints[joint].forces[0] == world.joint_force(joint, 0)
        assert np.linalg.norm(world.attachments[glue].force) > 19
    for joint, _, _ in fingers:
        world.impulse_joints[joint].set_motor_max_force(1.0)
    world.step(60)
    assert world.rigid_bodies[box].translation[1] < start + 0.05
