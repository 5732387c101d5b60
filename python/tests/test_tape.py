"""Gradients over steps, against differences between whole runs."""

import numpy as np
import pytest

import foible3d as f

STEPS = 20


def swing(modulus=1e5, beta=0.0, branches=(), density=1000.0, push=0.5, pressure=None, friction=0.0, floor=None, start=0.0, every=None):
    """A bar that is held at one end, or lies on a floor; with the tape of it."""
    world = f.World()
    material = f.Material(modulus, 0.3, density=density, mass_damping=1.0, stiffness_damping=beta, friction=0.0,
                          maxwell_branches=list(branches))
    options = dict(material=material, fidelity=f.Fidelity.REFERENCE, can_sleep=False, tolerance=1e-12, contact_tolerance=1e-12)
    handle = world.add_deformable(f.DeformableBody.cuboid((0.25, 0.0625, 0.0625), (4, 1, 1), max_iterations=400, **options))
    body = world.deformable_bodies[handle]
    collider = None
    if floor is None:
        body.pin(body.positions[:, 0] < -0.249)
    else:
        ground = world.add_body(
            f.RigidBody.fixed(translation=(0, floor - 1, 0)),
            [f.Collider.cuboid(5, 1, 5, friction=friction, friction_combine_rule=f.CoefficientCombineRule.MAX)],
        )
        (collider,) = world.rigid_bodies[ground].colliders
    tip = int(body.positions[:, 0].argmax())
    velocities = body.velocities
    velocities[tip, 1] += start
    body.velocities = velocities
    body.add_force((0, 0, push), [tip])
    tape = f.Tape(world, handle, checkpoint_every=every)
    return world, body, tape, tip, collider


def test_gradients_are_those_of_differences():
    def loss(**changed):
        _, body, tape, tip, _ = swing(**changed)
        tape.step(STEPS)
        return body.positions[tip, 2] + 0.1 * body.velocities[tip, 1], body, tape, tip

    _, body, tape, tip = loss()
    assert len(tape) == STEPS
    of_positions, of_velocities = np.zeros((2, body.vertex_count, 3))
    of_positions[tip, 2], of_velocities[tip, 1] = 1.0, 0.1
    gradient = tape.backward(positions={-1: of_positions}, velocities={STEPS - 1: of_velocities})
    ours = {
        "modulus": gradient.materials["youngs_modulus"].sum(),
        "density": gradient.materials["density"].sum(),
        "push": gradient.forces[:, tip, 2].sum(),
        "start": gradient.initial_velocities[tip, 1],
    }
    for name, at, by in [("modulus", 1e5, 64.0), ("density", 1000.0, 1.0), ("push", 0.5, 2**-7), ("start", 0.0, 2**-7)]:
        slope = (loss(**{name: at + by})[0] - loss(**{name: at - by})[0]) / (2 * by)
        # Central differences: the square of the change.
        assert ours[name] == pytest.approx(slope, rel=1e-4), name
    assert gradient.gravity.shape == (STEPS, 3) and gradient.activation.shape == (STEPS,)
    assert gradient.forces.shape == gradient.velocities.shape == (STEPS, body.vertex_count, 3)
    assert gradient.pressures.shape == gradient.rolls.shape == (STEPS, 0) and gradient.initial_positions.shape == (body.vertex_count, 3)
    # Pins moved alike take the whole of a bar with them, by and by.
    assert np.abs(gradient.pin_targets[:, tip]).max() == 0.0 < np.abs(gradient.pin_targets).max()
    assert "20 steps" in repr(gradient)


def test_the_wind_has_gradients():
    def loss(speed=4.0, drag=1.25):
        _, body, tape, tip, _ = swing()
        body.set_wind((1.0, 0.0, speed), density=4.0, drag=drag)
        tape.step(STEPS)
        return body.positions[tip, 2], body, tape, tip

    _, body, tape, tip = loss()
    of_positions = np.zeros((body.vertex_count, 3))
    of_positions[tip, 2] = 1.0
    gradient = tape.backward(positions={-1: of_positions})
    by = 2**-5
    of_speed = (loss(speed=4.0 + by)[0] - loss(speed=4.0 - by)[0]) / (2 * by)
    of_drag = (loss(drag=1.25 + by)[0] - loss(drag=1.25 - by)[0]) / (2 * by)
    assert gradient.wind_velocity.shape == (STEPS, 3)
    assert gradient.wind_velocity[:, 2].sum() == pytest.approx(of_speed, rel=1e-4) and of_speed > 0.0
    assert gradient.wind_drag.sum() == pytest.approx(of_drag, rel=1e-4)
    # Both are of the force's factor.
    of_densities = gradient.wind_density.sum() * 4.0
    assert of_densities == pytest.approx(gradient.wind_drag.sum() * 1.25 + gradient.wind_friction.sum() * 0.01, rel=1e-9)


def test_contact_forces_have_gradients():
    def force(density):
        _, _, tape, _, collider = swing(density=density, floor=-0.0625, push=0.0, friction=1.0)
        tape.step(8)
        return tape.contact_force(-1, collider), tape, collider

    found, tape, collider = force(1000.0)
    gradient = tape.backward(contact_forces={(-1, collider): (0.0, 1.0, 0.0)})
    slope = (force(1001.0)[0][1] - force(999.0)[0][1]) / 2
    assert found[1] > 10.0 and gradient.materials["density"].sum() == pytest.approx(slope, rel=1e-4)
    assert isinstance(gradient.friction, float)


def test_cables_have_gradients():
    def pull(tension=None, length=None):
        world, body, tape, tip, _ = swing(push=0.0)
        points = [f.CablePoint.inside(body.handle, at) for at in [(0.2, 0.05, 0.01), (0.0, 0.05, 0.01)]]
        points.append(f.CablePoint.world((-0.5, 0.1, 0.0)))
        cable = world.add_cable(points, tension=tension, length=length, compliance=1e-3)
        tape.step(STEPS)
        return body.positions[tip, 1] + 0.01 * world.cables[cable].tension, body, tape, tip, cable

    for options, column in [({"tension": 4.0}, "cable_tensions"), ({"length": 0.69}, "cable_lengths")]:
        _, body, tape, tip, cable = pull(**options)
        of_positions = np.zeros((body.vertex_count, 3))
        of_positions[tip, 1] = 1.0
        gradient = tape.backward(positions={-1: of_positions}, tensions={(-1, cable): 0.01})
        ((name, at),) = options.items()
        by = 1e-3 * at
        slope = (pull(**{name: at + by})[0] - pull(**{name: at - by})[0]) / (2 * by)
        assert gradient.cables == [cable] and getattr(gradient, column).shape == (STEPS, 1)
        assert getattr(gradient, column).sum() == pytest.approx(slope, rel=1e-3), name
    other = {"cable_tensions": "cable_lengths", "cable_lengths": "cable_tensions"}[column]
    assert np.abs(getattr(gradient, other)).max() == 0.0


def test_what_has_no_gradient_is_refused():
    world, body, tape, _, _ = swing()
    tape.step(3)
    seed = np.zeros((body.vertex_count, 3))
    for bad, text in [({3: seed}, "step 3 is not among the 3"), ({-4: seed}, "step -4"), ({0: seed[:-1]}, "rows, but the body")]:
        with pytest.raises(f.DeformableBodyError, match=text):
            tape.backward(positions=bad)
    body.body_type = f.RigidBodyType.KINEMATIC_POSITION_BASED
    with pytest.raises(f.DeformableBodyError, match="the body is not dynamic"):
        tape.step()
    tape.clear()
    assert len(tape) == 0
    other = f.World()
    with pytest.raises(f.InvalidHandle):
        f.Tape(other, body.handle)


def test_stiffness_damping_has_a_gradient():
    def loss(beta):
        _, body, tape, tip, _ = swing(beta=beta)
        tape.step(STEPS)
        return body.positions[tip, 2], body, tape, tip

    _, body, tape, tip = loss(0.01)
    of_positions = np.zeros((body.vertex_count, 3))
    of_positions[tip, 2] = 1.0
    (found,) = tape.backward(positions={-1: of_positions}).materials["stiffness_damping"]
    slope = (loss(0.01 + 1e-5)[0] - loss(0.01 - 1e-5)[0]) / 2e-5
    assert found == pytest.approx(slope, rel=1e-4) and found != 0.0


def test_maxwell_branches_have_gradients():
    def loss(ratio, time):
        _, body, tape, tip, _ = swing(branches=[(0.5, 0.2), (ratio, time)])
        tape.step(STEPS)
        return body.positions[tip, 2], body, tape, tip

    _, body, tape, tip = loss(0.8, 0.05)
    of_positions = np.zeros((body.vertex_count, 3))
    of_positions[tip, 2] = 1.0
    found = tape.backward(positions={-1: of_positions}).materials
    assert found["maxwell_ratios"].shape == found["maxwell_times"].shape == (1, 4)
    of_ratio = (loss(0.801, 0.05)[0] - loss(0.799, 0.05)[0]) / 2e-3
    of_time = (loss(0.8, 0.0501)[0] - loss(0.8, 0.0499)[0]) / 2e-4
    assert found["maxwell_ratios"][0, 1] == pytest.approx(of_ratio, rel=1e-4) and of_ratio != 0.0
    assert found["maxwell_times"][0, 1] == pytest.approx(of_time, rel=1e-4) and of_time != 0.0
    assert not found["maxwell_ratios"][0, 2:].any()


def test_woven_cloth_has_gradients():
    def loss(warp, shear):
        world = f.World()
        # Poisson's ratio of bending would go with the moduli.
        woven = f.Material.orthotropic_sheet(warp, 2.5e4, 0.4, shear).replace(youngs_modulus=6e4, poisson_ratio=0.2, mass_damping=1.0)
        cloth = f.DeformableBody.cloth((0.25, 0.25), (4, 4), 0.01, warp=(1, 0, 0.4), material=woven, fidelity=f.Fidelity.REFERENCE,
                                       can_sleep=False, tolerance=1e-12, max_iterations=400)
        handle = world.add_deformable(cloth.pinned(lambda x: x[:, 0] < -0.249))
        body = world.deformable_bodies[handle]
        tip = int(body.positions[:, 0].argmax())
        tape = f.Tape(world, handle)
        tape.step(STEPS)
        return body.positions[tip, 1], body, tape, tip

    _, body, tape, tip = loss(1e5, 2e4)
    of_positions = np.zeros((body.vertex_count, 3))
    of_positions[tip, 1] = 1.0
    found = tape.backward(positions={-1: of_positions}).materials["sheet"]
    assert found.shape == (1, 4)
    of_warp = (loss(1.001e5, 2e4)[0] - loss(0.999e5, 2e4)[0]) / 200
    of_shear = (loss(1e5, 2.002e4)[0] - loss(1e5, 1.998e4)[0]) / 40
    assert found[0, 0] == pytest.approx(of_warp, rel=1e-4) and of_warp != 0.0
    assert found[0, 3] == pytest.approx(of_shear, rel=1e-4) and of_shear != 0.0


def test_checkpoints_replay_to_the_same_numbers():
    def push(step, world):
        ((_, body),) = world.deformable_bodies
        body.reset_forces()
        body.add_force((0, 0, 0.05 * step), [int(body.positions[:, 0].argmax())])

    gradients = []
    for every in [None, 1, 7, 100]:
        world, body, tape, tip, _ = swing(push=0.0, every=every)
        for step in range(STEPS):
            push(step, world)
            tape.step()
        of_positions = np.zeros((body.vertex_count, 3))
        of_positions[tip, 2] = 1.0
        control = {} if every is None else {"control": push}
        gradients.append(tape.backward(positions={-1: of_positions, 4: of_positions}, **control))
        assert len(tape) == STEPS
        if every is None:
            with pytest.raises(f.DeformableBodyError, match="control"):
                tape.backward(control=push)
        elif every == 7:
            # Nothing done, or not the same, is found out; an error of the user's comes back; the tape may be used meanwhile.
            for bad in [None, lambda step, world: push(step - 1, world), lambda step, world: world.step()]:
                with pytest.raises(f.DeformableBodyError, match="leads elsewhere"):
                    tape.backward(control=bad)
            with pytest.raises(f.DeformableBodyError, match="step 13 is not kept: with checkpoints the tape has the steps from 14 on"):
                tape.contact_force(13, f.ColliderHandle.from_raw_parts(0, 0))
            with pytest.raises(ZeroDivisionError):
                tape.backward(control=lambda step, world: 1 / 0)
            lengths = []
            tape.backward(control=lambda step, world: (push(step, world), lengths.append(len(tape))))
            assert lengths == [STEPS] * (STEPS - 3)
    first, *others = gradients
    for other in others:
        for name in ["initial_positions", "initial_velocities", "forces", "pin_targets", "gravity"]:
            assert np.array_equal(getattr(first, name), getattr(other, name)), name
        assert all(np.array_equal(value, other.materials[name]) for name, value in first.materials.items())
    with pytest.raises(f.DeformableBodyError, match="at least 1"):
        swing(every=0)
