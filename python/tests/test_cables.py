"""Cables, against statics."""

import pickle

import numpy as np
import pytest

import foible3d as f
from conftest import Scene


def weight(world, at):
    """A cube of 10 cm and 1 kg; its handle, and the vertex in the middle of its upper face."""
    material = f.Material(1e6, 0.3, mass_damping=5.0)
    cube = f.DeformableBody.cuboid((0.05, 0.05, 0.05), (2, 2, 2), material=material, can_sleep=False)
    handle = world.add_deformable(cube.translation(at))
    off = world.deformable_bodies[handle].positions - (np.array(at) + (0, 0.05, 0))
    return handle, int(np.argmin((off**2).sum(axis=1)))


def test_a_cable_over_a_pulley_carries_the_weight_at_both_ends():
    world = f.World()
    block, top = weight(world, (0, 0, 0))
    points = [
        f.CablePoint.vertex(block, top),
        f.CablePoint.world((0, 1, 0)),
        f.CablePoint.world((1, 1, 0)),
    ]
    handle = world.add_cable(points)
    cable = world.cables[handle]
    assert len(cable) == 3 and cable.bodies == [block] and cable.free_length is None
    assert cable.length == pytest.approx(1.95) and cable.points[0] == pytest.approx([0, 0.05, 0])
    world.step(300)
    load = world.deformable_bodies[block].mass * 9.81
    assert cable.tensions == pytest.approx([load, load], rel=1e-6) and cable.tension == cable.tensions[-1]
    assert cable.force(0) == pytest.approx([0, load, 0], rel=1e-6, abs=1e-6)
    # The pulley is pulled down by one part, and aside by the other.
    assert cable.forces[1] == pytest.approx([load, -load, 0], rel=1e-6, abs=1e-6)
    assert cable.free_length == pytest.approx(1.95) and cable.length == pytest.approx(1.95, abs=1e-5)


def test_friction_at_a_pulley_is_eulers():
    world = f.World()
    block, top = weight(world, (0, 0, 0))
    points = [f.CablePoint.vertex(block, top), f.CablePoint.world((0, 1, 0)), f.CablePoint.world((1, 1, 0))]
    cable = world.cables[world.add_cable(points, friction=0.3, length=1.95, speed=0.1)]
    world.step(120)
    cable.set_length(1.7)
    world.step(60)
    low, high = cable.tensions
    assert high / low == pytest.approx(np.exp(0.3 * np.pi / 2), rel=1e-4)
    cable.friction = 0.0
    assert cable.friction == 0.0 and cable.compliance == 0.0
    world.step(120)
    assert cable.tensions[0] == pytest.approx(cable.tensions[1], rel=1e-9)
    assert cable.free_length == pytest.approx(1.7)


def test_a_tension_is_held_and_a_winch_gives_way():
    world = f.World(gravity=(0, 0, 0))
    block, top = weight(world, (0, 0, 0))
    world.deformable_bodies[block].pin(world.deformable_bodies[block].positions[:, 1] < -0.049)
    hook = world.add_body(f.RigidBody.fixed(translation=(0, 1, 0)))
    points = [f.CablePoint.vertex(block, top), f.CablePoint.rigid_body(hook, (0, 0.5, 0))]
    cable = world.cables[world.add_cable(points, tension=3.0)]
    assert cable.points[1] == pytest.approx([0, 1.5, 0])
    world.step(30)
    assert cable.tension == pytest.approx(3.0, rel=1e-9)
    cable.set_max_tension(5.0)
    cable.set_speed(1.0)
    cable.set_length(1.0)
    world.step(60)
    assert cable.tension == pytest.approx(5.0, rel=1e-9)


def test_a_tendon_bends_a_finger_as_a_beam():
    world = f.World(gravity=(0, 0, 0))
    rubber = f.Material(1e6, 0.0, mass_damping=20.0)
    finger = f.DeformableBody.cuboid((0.06, 0.01, 0.01), (24, 4, 4), material=rubber, can_sleep=False)
    finger = world.add_deformable(finger)
    body = world.deformable_bodies[finger]
    body.pin(body.positions[:, 0] < -0.059)
    tip = body.positions[:, 0] > 0.059
    points = [f.CablePoint.inside(finger, (x, -0.005, 0)) for x in np.linspace(0.0599, -0.0599, 7)]
    handle = world.add_cable(points)
    bent = []
    for tension in (0.25, 0.5):
        world.cables[handle].set_tension(tension)
        world.step(180)
        bent.append(body.positions[tip, 1].mean())
    # M l² / 2 E I of the moment of the tendon, 5 mm off the axis; tetrahedra of this size are a tenth too stiff.
    beam = 0.5 * 0.005 * 0.12**2 / (2 * 1e6 * 0.02**4 / 12)
    assert 0.85 * beam < -bent[1] < 1.02 * beam and bent[1] / bent[0] == pytest.approx(2.0, rel=0.02)
    again = pickle.loads(pickle.dumps(world))
    world.step(10), again.step(10)
    assert (again.cables[handle].points == world.cables[handle].points).all()
    assert pickle.loads(pickle.dumps(handle)) == handle and world.cables.handles() == [handle]


def test_what_no_cable_is_is_refused():
    world = Scene().world
    block, top = weight(world, (0, 0.5, 0))
    ends = [f.CablePoint.vertex(block, top), f.CablePoint.world((0, 2, 0))]
    refusals = [
        (ends[:1], {}, "two points at least"),
        (ends[1:] * 2, {}, "none of its points is on a deformable body"),
        ([f.CablePoint.inside(block, (0, 5, 0)), ends[1]], {}, "5"),
        ([f.CablePoint.vertex(block, 99), ends[1]], {}, "99"),
        (ends, {"friction": -1.0}, "its friction is not a number from 0 on"),
        (ends, {"speed": float("nan")}, "its speed is negative or NaN"),
    ]
    for points, options, text in refusals:
        with pytest.raises(f.DeformableBodyError, match=text):
            world.add_cable(points, **options)
    with pytest.raises(f.InvalidHandle, match="no rigid body"):
        world.add_cable([ends[0], f.CablePoint.rigid_body(f.RigidBodyHandle(7, 7), (0, 0, 0))])
    handle = world.add_cable(ends)
    cable = world.cables[handle]
    with pytest.raises(f.DeformableBodyError, match="its tension is not a number from 0 on"):
        cable.set_tension(-1.0)
    with pytest.raises(IndexError, match="point 2 does not exist: the cable has 2"):
        cable.force(2)
    world.remove_cable(handle)
    assert handle not in world.cables and len(world.cables) == 0
    with pytest.raises(f.InvalidHandle, match="no cable of number 0"):
        cable.set_tension(1.0)
    with pytest.raises(f.InvalidHandle):
        world.remove_cable(handle)
