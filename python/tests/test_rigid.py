"""Rapier's bodies, colliders and joints."""

import math

import numpy as np
import pytest

import foible3d as f


def test_a_ball_falls_and_comes_to_rest(scene):
    world = scene.world
    ball = world.add_body(f.RigidBody.dynamic(translation=(0, 0.5, 0)), [f.Collider.ball(0.1, density=1000.0)])
    body = world.rigid_bodies[ball]
    assert body.mass == pytest.approx(1000 * 4 / 3 * math.pi * 1e-3, rel=1e-5)
    world.step()
    assert body.linvel[1] == pytest.approx(-9.81 / 60, rel=1e-5)
    world.step(240)
    assert body.translation[1] == pytest.approx(0.1, abs=2e-3)
    assert body.rotation.shape == (4,) and body.body_type == f.RigidBodyType.DYNAMIC


@pytest.mark.parametrize(
    "collider",
    [
        f.Collider.cuboid(1, 0.1, 1, translation=(0, -0.1, 0)),
        f.Collider.halfspace((0, 2, 0)),
        f.Collider.cylinder(0.1, 1.0, translation=(0, -0.1, 0)),
        f.Collider.convex_hull(np.array([[x, y, z] for x in (-1, 1) for y in (-0.2, 0) for z in (-1, 1)])),
        f.Collider.trimesh([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], [[0, 1, 2], [0, 2, 3]]),
        f.Collider.heightfield(np.zeros((4, 5)), (2, 1, 2)),
    ],
    ids=repr,
)
def test_every_shape_carries_a_soft_cube(collider):
    world = f.World()
    floor = world.add_collider(collider)
    cube = f.DeformableBody.cuboid((0.1,) * 3, (2, 2, 2), material=f.Material(1e5, 0.3, mass_damping=5.0))
    cube = world.add_deformable(cube.translation((0.03, 0.1, 0.02)))
    world.step(120)
    assert world.contact_force(cube, floor)[1] == pytest.approx(8 * 9.81, rel=1e-4)


def test_heights_are_along_z_by_rows_and_along_x_by_columns():
    heights = np.zeros((3, 5))
    heights[2, 0] = 1.0
    for x, z, y in [(-0.9, 0.9, 0.9), (0.9, -0.9, 0.0)]:
        world = f.World()
        world.add_collider(f.Collider.heightfield(heights, (2, 1, 2)))
        ball = f.RigidBody.dynamic(translation=(x, 2, z), linear_damping=1.0, enabled_translations=(False, True, False))
        ball = world.add_body(ball, [f.Collider.ball(0.01)])
        world.step(200)
        lands = world.rigid_bodies[ball].translation[1]
        assert abs(lands - y) < 0.35, (x, z, lands)


def test_kinematic_bodies_go_where_they_are_led():
    world = f.World()
    led = world.add_body(f.RigidBody.kinematic_position_based(), [f.Collider.ball(0.1)])
    driven = world.add_body(f.RigidBody.kinematic_velocity_based(linvel=(1, 0, 0)), [f.Collider.ball(0.1)])
    world.rigid_bodies[led].set_next_kinematic_translation((0, 0.1, 0))
    world.step()
    assert world.rigid_bodies[led].translation == pytest.approx([0, 0.1, 0])
    assert world.rigid_bodies[led].linvel == pytest.approx([0, 6.0, 0], rel=1e-4)
    world.step(59)
    assert world.rigid_bodies[driven].translation == pytest.approx([1, 0, 0], rel=1e-4)


def test_forces_and_impulses():
    world = f.World(gravity=(0, 0, 0))
    handle = world.add_body(f.RigidBody.dynamic(), [f.Collider.ball(0.1, mass=2.0)])
    body = world.rigid_bodies[handle]
    body.add_force((4, 0, 0))
    world.step(60)
    assert body.linvel == pytest.approx([2, 0, 0], rel=1e-4)
    assert body.user_force == pytest.approx([4, 0, 0])
    body.reset_forces()
    body.apply_impulse((-4, 0, 0))
    assert body.linvel == pytest.approx([0, 0, 0], abs=1e-4)
    body.position = ((1, 2, 3), (0, 0, math.sin(0.5), math.cos(0.5)))
    assert body.translation == pytest.approx([1, 2, 3])
    assert body.rotation == pytest.approx([0, 0, math.sin(0.5), math.cos(0.5)])


def pendulum(joint):
    world = f.World()
    anchor = world.add_body(f.RigidBody.fixed())
    bob = world.add_body(f.RigidBody.dynamic(translation=(0.5, 0, 0)), [f.Collider.cuboid(0.2, 0.2, 0.2, mass=1.0)])
    return world, bob, world.impulse_joints.insert(anchor, bob, joint)


def test_joints_hold_and_let_move():
    for joint, at in [
        (f.FixedJoint.builder(local_anchor1=(0.5, 0, 0)), [0.5, 0, 0]),
        (f.PrismaticJoint.builder((0, 1, 0), local_anchor1=(0.5, 0, 0), limits=(-0.2, 0.2)), [0.5, -0.2, 0]),
    ]:
        world, bob, _ = pendulum(joint)
        world.step(240)
        assert world.rigid_bodies[bob].translation == pytest.approx(at, abs=5e-3)
    for joint in [f.RevoluteJoint.builder((0, 0, 1)), f.SphericalJoint.builder()]:
        world, bob, _ = pendulum(joint.local_anchor2((-0.5, 0, 0)))
        world.step(15)
        x = world.rigid_bodies[bob].translation
        assert x[1] < -0.1 and np.linalg.norm(x) == pytest.approx(0.5, rel=1e-2)


def test_a_motor_holds_a_hinge_where_it_is_wanted():
    hinge = f.RevoluteJoint.builder((0, 0, 1), local_anchor2=(-0.5, 0, 0), motor_position=(0.5, 1e4, 1e3))
    hinge = hinge.motor_model(f.MotorModel.FORCE_BASED)
    world, bob, joint = pendulum(hinge)
    # Rapier's own solver, which this is, gives way under few iterations.
    world.num_solver_iterations = 64
    world.step(240)
    x = world.rigid_bodies[bob].translation
    assert math.atan2(x[1], x[0]) == pytest.approx(0.5, abs=0.01)
    world.impulse_joints[joint].set_motor_max_force(0.0)
    world.step(20)
    assert world.rigid_bodies[bob].translation[1] < x[1] - 0.05


def test_spherical_joints_want_to_know_the_axis():
    joint = f.SphericalJoint.builder(limits=(-0.1, 0.1, f.JointAxis.ANG_X))
    assert "JointBuilder" in repr(joint)
    with pytest.raises(ValueError, match="several free axes"):
        joint.limits(-0.1, 0.1)


def test_what_is_removed_is_gone(scene):
    world = scene.world
    handle = world.add_body(f.RigidBody.dynamic(), [f.Collider.ball(0.1), f.Collider.ball(0.1)])
    body, colliders = world.rigid_bodies[handle], world.rigid_bodies[handle].colliders
    joint = world.impulse_joints.insert(scene.floor_body, handle, f.FixedJoint.builder())
    assert (len(world.rigid_bodies), len(world.colliders), len(world.impulse_joints)) == (2, 3, 1)
    world.remove_collider(colliders[0])
    world.remove_body(handle)
    assert (len(world.rigid_bodies), len(world.colliders), len(world.impulse_joints)) == (1, 1, 0)
    assert handle not in world.rigid_bodies and joint not in world.impulse_joints
    for stale in [
        lambda: body.linvel,
        lambda: world.rigid_bodies[handle],
        lambda: world.colliders[colliders[1]],
        lambda: world.impulse_joints[joint],
        lambda: world.remove_body(handle),
        lambda: world.add_collider(f.Collider.ball(0.1), handle),
        lambda: world.impulse_joints.insert(scene.floor_body, handle, f.FixedJoint.builder()),
    ]:
        with pytest.raises(f.InvalidHandle, match="^no (rigid body|collider|joint) at slot [0-9]+ of generation [0-9]+$"):
            stale()
    assert world.rigid_bodies.get(handle) is None


def test_builders_are_not_changed_by_their_methods():
    builder = f.RigidBody.dynamic(translation=(1, 0, 0))
    builder.translation((2, 0, 0))
    world = f.World()
    assert world.rigid_bodies[world.add_body(builder)].translation[0] == 1.0
