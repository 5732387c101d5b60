"""Gradients over steps of several bodies that touch, against differences between whole runs."""

import numpy as np
import pytest

import foible3d as f

STEPS = 12


def stack(lower=1e5, upper=1e5, density=1000.0, along=0.0, floor=False, every=None):
    """A block on another one, which is pinned at its bottom or lies on a floor; with the tape of both."""
    world = f.World()
    options = dict(fidelity=f.Fidelity.REFERENCE, can_sleep=False, tolerance=1e-12, contact_tolerance=1e-12, max_iterations=400)

    def material(modulus, density=1000.0):
        return f.Material(modulus, 0.3, density=density, mass_damping=1.0, friction=0.5)

    below = f.DeformableBody.cuboid((0.2, 0.1, 0.2), (2, 1, 2), translation=(0, -0.1, 0), material=material(lower), **options)
    above = f.DeformableBody.cuboid((0.1, 0.1, 0.1), (1, 1, 1), translation=(0.03, 0.1, 0.02), material=material(upper, density), **options)
    below = world.add_deformable(below if floor else below.pinned(lambda x: x[:, 1] < -0.199))
    above = world.add_deformable(above)
    collider = None
    if floor:
        ground = world.add_body(f.RigidBody.fixed(translation=(0, -1.2, 0)), [f.Collider.cuboid(5, 1, 5, friction=1.0)])
        (collider,) = world.rigid_bodies[ground].colliders
    world.deformable_bodies[above].velocities = np.tile((along, 0.0, 0.0), (world.deformable_bodies[above].vertex_count, 1))
    return world, below, above, f.Tape(world, [below, above], checkpoint_every=every), collider


def seed(world, handle, derivative):
    return np.tile(derivative, (world.deformable_bodies[handle].vertex_count, 1))


def test_what_lies_on_another_has_gradients():
    def loss(**changed):
        world, below, above, tape, _ = stack(**changed)
        tape.step(STEPS)
        force = tape.body_force(7, above, below)
        positions = world.deformable_bodies[above].positions
        return np.array([positions[:, 1].sum() + 0.5 * positions[:, 0].sum(), force[1]]), world, below, above, tape

    found, world, below, above, tape = loss()
    assert tape.bodies == [below, above] and len(tape) == STEPS
    assert np.allclose(tape.body_force(7, above, below), -tape.body_force(7, below, above)) and found[1] > 50.0
    of_state = tape.backward_all(positions={(-1, above): seed(world, above, (0.5, 1.0, 0.0))})
    of_force = tape.backward_all(body_forces={(7, above, below): (0.0, 1.0, 0.0)})
    assert list(of_state) == [below, above]
    for name, at, by, body, key in [
        ("lower", 1e5, 64.0, below, "youngs_modulus"),
        ("upper", 1e5, 64.0, above, "youngs_modulus"),
        ("density", 1000.0, 1.0, above, "density"),
    ]:
        slopes = (loss(**{name: at + by})[0] - loss(**{name: at - by})[0]) / (2 * by)
        for gradients, slope in zip([of_state, of_force], slopes):
            assert gradients[body].materials[key].sum() == pytest.approx(slope, rel=1e-3), name
    by = 2.0**-9
    (slope, _) = (loss(along=by)[0] - loss(along=-by)[0]) / (2 * by)
    assert of_state[above].initial_velocities[:, 0].sum() == pytest.approx(slope, rel=1e-3)


def test_forces_of_colliders_name_the_body():
    def force(density):
        world, below, above, tape, floor = stack(density=density, floor=True)
        tape.step(STEPS)
        return tape.contact_force(-1, floor, below)[1], below, above, tape, floor

    found, below, above, tape, floor = force(1000.0)
    gradients = tape.backward_all(contact_forces={(-1, floor, below): (0.0, 1.0, 0.0)})
    slope = (force(1001.0)[0] - force(999.0)[0]) / 2
    assert found > 100.0 and gradients[above].materials["density"].sum() == pytest.approx(slope, rel=1e-3)
    assert not tape.contact_force(-1, floor, above).any()


def test_checkpoints_of_several_bodies_replay_to_the_same_numbers():
    def push(step, world):
        for _, body in world.deformable_bodies:
            body.reset_forces()
            body.add_force((0.25 * step, 0, 0), [0])

    found = []
    for every in [None, 1, 5]:
        world, below, above, tape, _ = stack(along=0.5, every=every)
        for step in range(STEPS):
            push(step, world)
            tape.step()
        seeds = {(-1, above): seed(world, above, (1.0, 0.0, 0.0)), (3, below): seed(world, below, (0.0, 1.0, 0.0))}
        gradients = tape.backward_all(velocities=seeds, **({} if every is None else {"control": push}))
        found.append([gradients[body].initial_velocities for body in (below, above)])
    for other in found[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(found[0], other))
    assert all(np.abs(of).max() > 0.1 for of in found[0])


def test_a_list_of_one_is_as_one():
    found = []
    for is_listed in [False, True]:
        world, below, above, _, _ = stack()
        world.remove_deformable(above)
        tape = f.Tape(world, [below] if is_listed else below)
        tape.step(4)
        rows = seed(world, below, (0.0, 1.0, 0.0))
        gradients = [tape.backward(positions={key: rows}) for key in (-1, (-1, below))]
        gradients += [gradient for gradient in tape.backward_all(positions={3: rows}).values()]
        found += [gradient.initial_positions for gradient in gradients]
    assert len(found) == 6 and np.abs(found[0]).max() > 0.0
    assert all(np.array_equal(found[0], other) for other in found)


def test_a_cable_is_of_the_body_that_it_runs_through():
    def pull(tension):
        world, below, above, _, _ = stack()
        top = world.deformable_bodies[above].positions.max(axis=0)
        points = [f.CablePoint.inside(above, tuple(top - 0.01)), f.CablePoint.world((0.5, 0.3, 0.0))]
        cable = world.add_cable(points, tension=tension)
        tape = f.Tape(world, [below, above])
        tape.step(STEPS)
        return world.deformable_bodies[above].positions[:, 0].sum(), world, below, above, tape, cable

    _, world, below, above, tape, cable = pull(4.0)
    gradients = tape.backward_all(positions={(-1, above): seed(world, above, (1.0, 0.0, 0.0))}, tensions={(5, cable, above): 3.0})
    slope = (pull(4.0 + 2**-6)[0] - pull(4.0 - 2**-6)[0]) / 2**-5
    assert gradients[above].cables == [cable] and gradients[below].cables == []
    # A tension that is given is its own derivative.
    assert gradients[above].cable_tensions.sum() - 3.0 == pytest.approx(slope, rel=1e-3)
    with pytest.raises(f.DeformableBodyError):
        tape.backward_all(tensions={(5, cable, below): 3.0})


def test_what_no_tape_of_several_takes_is_refused():
    world, below, above, tape, _ = stack()
    tape.step(2)
    rows = seed(world, above, (0.0, 1.0, 0.0))
    stranger = world.add_deformable(f.DeformableBody.cuboid((0.1, 0.1, 0.1), (1, 1, 1), translation=(5, 0, 0)))
    for call, text in [
        (lambda: tape.backward(), "see backward_all"),
        (lambda: tape.backward_all(positions={-1: rows}), "positions: the tape is of several bodies"),
        (lambda: tape.backward_all(positions={(-1, stranger): rows}), "is not on the tape"),
        (lambda: tape.backward_all(positions={(-1, below): rows}), "8 rows, but the body 18 vertices"),
        (lambda: tape.backward_all(body_forces={(0, above, above): (0, 1, 0)}), "body_forces: a body has no force on itself"),
        (lambda: tape.backward_all(body_forces={(0, above, stranger): (0, 1, 0)}), "body_forces: the body at slot 2"),
        (lambda: tape.body_force(0, above, above), "no force on itself"),
        (lambda: tape.body_force(0, above, stranger), "is not on the tape"),
        (lambda: tape.contact_force(0, f.ColliderHandle()), "of several bodies"),
        (lambda: f.Tape(world, []), "names no body"),
        (lambda: f.Tape(world, [below, below]), "names a body twice"),
    ]:
        with pytest.raises(f.DeformableBodyError, match=text):
            call()
    for call, text in [
        (lambda: tape.backward_all(positions={"last": rows}), r"positions: expected a step or \(step, body\), got 'last'"),
        (lambda: tape.backward_all(contact_forces={-1: (0, 1, 0)}), r"contact_forces: expected \(step, collider\)"),
        (lambda: tape.backward_all(tensions={(-1, f.CableHandle(7), above): "x"}), "tensions: "),
        (lambda: f.Tape(world, world.deformable_bodies[below]), "expected a DeformableBodyHandle or a list"),
    ]:
        with pytest.raises(TypeError, match=text):
            call()
    alone = f.Tape(world, below)
    with pytest.raises(f.DeformableBodyError, match="not on the tape"):
        alone.step()
