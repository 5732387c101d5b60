"""Gradients over steps through rigid bodies that yield, against differences between whole runs."""

import numpy as np
import pytest

import foible3d as f


def carried(modulus=1e5, density=512.0, launch=0.0, every=None):
    """A plate that a block carries, after ten steps: its place, its gradient and its handle."""
    world = f.World()
    options = dict(fidelity=f.Fidelity.REFERENCE, can_sleep=False, tolerance=1e-12, contact_tolerance=1e-12, max_iterations=400)
    material = f.Material(modulus, 0.3, density=1000.0, mass_damping=1.0, friction=1.0)
    block = f.DeformableBody.cuboid((0.125, 0.125, 0.125), (2, 2, 2), translation=(0, -0.125, 0), material=material, **options)
    block = world.add_deformable(block.pinned(lambda x: x[:, 1] < -0.249))
    plate = f.RigidBody.dynamic(translation=(0.01, 0.032, -0.005), linvel=(launch, -0.5, 0.0), can_sleep=False)
    plate = world.add_body(plate, [f.Collider.cuboid(0.25, 0.03125, 0.25, density=density, friction=1.0)])
    tape = f.Tape(world, block, checkpoint_every=every, rigid_bodies=[plate])
    assert tape.rigid_bodies == [plate]
    tape.step(10)
    place, mass = world.rigid_bodies[plate].translation.astype(float), world.rigid_bodies[plate].mass
    gradient = tape.backward(rigid_bodies={(-1, plate): {"position": (1.0, 1.0, 0.0), "linvel": (0.0, 0.5, 0.0)}})
    loss = place[0] + place[1] + 0.5 * float(world.rigid_bodies[plate].linvel[1])
    return loss, gradient, plate, mass


def test_what_a_block_carries_has_gradients():
    loss, gradient, plate, mass = carried()
    of_plate = gradient.rigid_bodies[plate]
    assert of_plate["forces"].shape == (10, 3) and list(gradient.rigid_bodies) == [plate]
    for name, at, by, ours in [
        ("modulus", 1e5, 256.0, gradient.materials["youngs_modulus"].sum()),
        ("density", 512.0, 4.0, of_plate["mass"] * mass / 512.0),
        ("launch", 0.0, 2.0**-6, of_plate["initial_linvel"][0]),
    ]:
        slope = (carried(**{name: at + by})[0] - carried(**{name: at - by})[0]) / (2 * by)
        # Rapier's positions and velocities are in single precision.
        assert ours == pytest.approx(slope, rel=2e-3, abs=1e-8 / by), name


def test_checkpoints_have_the_same_gradient():
    (_, whole, plate, _), (_, parts, again, _) = carried(), carried(every=3)
    for name, of in whole.rigid_bodies[plate].items():
        assert np.array_equal(of, parts.rigid_bodies[again][name]), name


def test_what_is_not_on_the_tape_is_told():
    world = f.World()
    block = world.add_deformable(f.DeformableBody.cuboid((0.1, 0.1, 0.1), (1, 1, 1)))
    fixed = world.add_body(f.RigidBody.fixed(), [])
    with pytest.raises(f.DeformableBodyError, match="not dynamic"):
        f.Tape(world, block, rigid_bodies=[fixed])
    plate = world.add_body(f.RigidBody.dynamic(translation=(0, 1, 0)), [f.Collider.ball(0.1)])
    tape = f.Tape(world, block)
    tape.step()
    with pytest.raises(ValueError, match="not on the tape"):
        tape.backward(rigid_bodies={(0, plate): {"position": (1, 0, 0)}})
    tape = f.Tape(world, block, rigid_bodies=[plate])
    tape.step()
    with pytest.raises(ValueError, match="'place' is none of"):
        tape.backward(rigid_bodies={(0, plate): {"place": (1, 0, 0)}})
    with pytest.raises(TypeError, match="rigid_bodies"):
        tape.backward(rigid_bodies={(0, plate): (1, 0, 0)})
    # It falls freely: as far as its gravity, its velocity and its place say.
    (of_plate,) = tape.backward(rigid_bodies={(0, plate): {"position": (0, 1, 0)}}).rigid_bodies.values()
    assert of_plate["initial_position"][1] == 1.0 and of_plate["mass"] == 0.0
    assert of_plate["initial_linvel"][1] == pytest.approx(1 / 60, rel=1e-6)
