"""Deformable bodies some regions of which are rigid."""

import numpy as np
import pytest

import foible3d as f

BONE = 1


def bar(**options):
    """20 by 4 by 4 cm, with a core of 10 by 2 by 2 cm."""

    def regions(middles):
        return BONE * (np.abs(middles) < (0.05, 0.01, 0.01)).all(axis=1)

    material = f.Material(1e5, 0.4, density=1_100.0)
    return f.DeformableBody.cuboid((0.1, 0.02, 0.02), (20, 4, 4), material=material, regions=regions, **options)


def test_a_bone_has_the_mass_of_the_solid_and_keeps_its_shape():
    world = f.World()
    floor = world.add_collider(f.Collider.cuboid(5, 0.5, 5, translation=(0, -0.5, 0)))
    thrown = bar(translation=(0, 0.4, 0), angvel=(3, 4, 8), can_sleep=False)
    body, regions = world.add_deformable_with_rigid_regions(thrown, {BONE: 7_800.0})
    bone = world.rigid_bodies[regions[BONE].body]
    assert bone.mass == pytest.approx(0.1 * 0.02 * 0.02 * 7_800.0, rel=1e-5)
    assert regions[BONE].collider is None
    rest = world.deformable_bodies[body].positions
    core = (np.abs(rest - (0, 0.4, 0)) < (0.0501, 0.0101, 0.0101)).all(axis=1)
    assert core.sum() == 11 * 3 * 3 - 9

    def lengths():
        x = world.deformable_bodies[body].positions[core]
        return np.linalg.norm(x[:, None] - x[None], axis=2)

    before, off = lengths(), 0
    for _ in range(120):
        world.step()
        off += np.abs(lengths() - before).max() > 1e-9
    # In an impact that is not solved to the end, the core is off for a step.
    assert off <= 3 and np.abs(lengths() - before).max() < 1e-9
    assert world.attachments[regions[BONE].attachment].body == body
    assert world.contact_force(body, floor)[1] > 0


def test_a_back_is_part_of_a_finger_that_leads_it():
    world = f.World(gravity=(0, 0, 0))
    link = world.add_body(f.RigidBody.kinematic_position_based())
    body, regions = world.add_deformable_with_rigid_regions(bar(), {BONE: link})
    assert regions[BONE].body == link
    world.step()
    world.rigid_bodies[link].set_next_kinematic_translation((0, 0.01, 0))
    world.step(120)
    assert world.deformable_bodies[body].positions[:, 1].mean() == pytest.approx(0.01, abs=1e-4)


def test_pins_are_of_what_is_left():
    world = f.World()
    pinned = bar(pinned=lambda x: x[:, 0] < -0.099)
    body, _ = world.add_deformable_with_rigid_regions(pinned, {BONE: 1_100.0})
    assert len(world.deformable_bodies[body].pinned) == 25


def test_what_cannot_be_rigid_says_why_and_leaves_nothing():
    world = f.World()
    for regions, error, told in [
        ({2: 1e3}, f.DeformableBodyError, "region 2"),
        ({BONE: -1.0}, f.DeformableBodyError, "density"),
        ({BONE: float("nan")}, f.DeformableBodyError, "density"),
        ({BONE: f.RigidBodyHandle(7, 1)}, f.InvalidHandle, "7"),
        ({BONE: "steel"}, TypeError, "regions"),
    ]:
        with pytest.raises(error, match=told):
            world.add_deformable_with_rigid_regions(bar(), regions)
    with pytest.raises((ValueError, IndexError)):
        world.add_deformable_with_rigid_regions(bar(pinned=[100_000]), {BONE: 1e3})
    assert (len(world.rigid_bodies), len(world.deformable_bodies)) == (0, 0)


def test_a_bone_is_saved_midway_and_goes_on_with_the_same_bits():
    world = f.World()
    world.add_collider(f.Collider.cuboid(5, 0.5, 5, translation=(0, -0.5, 0)))
    thrown = bar(translation=(0, 0.2, 0), angvel=(1, 2, 3), can_sleep=False)
    body, regions = world.add_deformable_with_rigid_regions(thrown, {BONE: 7_800.0})
    world.step(20)
    again = f.World.restore(world.snapshot())
    for one in (world, again):
        one.step(60)
    assert (world.deformable_bodies[body].positions == again.deformable_bodies[body].positions).all()
    bone = regions[BONE].body
    assert (world.rigid_bodies[bone].translation == again.rigid_bodies[bone].translation).all()
