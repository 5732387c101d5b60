"""What is refused, and in which words."""

import numpy as np
import pytest

import foible3d as f
from conftest import Scene

NAN = float("nan")


def pad(**options):
    return f.DeformableBody.cuboid((0.1, 0.1, 0.1), (1, 1, 1), **options)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: f.Material(-1, 0.3), "material: Young's modulus is -1, but must be positive and finite"),
        (lambda: f.Material(1e5, 0.5), r"Poisson's ratio is 0.5, but must be in \[0, 0.4999\]"),
        (lambda: f.Material(1e5, NAN), "Poisson's ratio is NaN"),
        (lambda: f.Material(1e5, 0.3, density=0), "density is 0"),
        (lambda: f.Material(1e5, 0.3, maxwell_branches=[(1, 1)] * 5), "5 Maxwell branches, but at most 4"),
        (lambda: f.Material.shore_a(101), "Young's modulus"),
        (lambda: f.World(dt=0.0), "time step 0 s is not positive and finite"),
        (lambda: f.World(gravity=(0, NAN, 0)), "gravity is not finite"),
        (lambda: setattr(f.World(), "dt", NAN), "time step NaN s"),
        (lambda: f.Collider.ball(-1), "radius is -1, but must be positive"),
        (lambda: f.Collider.ball(0.1, friction=-1), "friction is -1"),
        (lambda: f.Collider.cuboid(1, 1e30, 1), "hy is 1e30, but must be at most 1e6 m"),
        (lambda: f.Collider.convex_hull(np.eye(4)[:, :3] * 1e9), r"points\[0\] is beyond 1e6 m"),
        (lambda: f.Collider.halfspace((0, 0, 0)), "no direction"),
        (lambda: f.Collider.convex_hull(np.zeros((3, 3))), "no convex hull"),
        (lambda: f.Collider.trimesh(np.zeros((3, 3)), [[0, 1, 9]]), r"indices\[0\] refers to vertex 9, but there are 3"),
        (lambda: f.Collider.trimesh(np.zeros((3, 3)), [[0, 1, -1]]), r"indices\[0, 2\] is -1"),
        (lambda: f.Collider.trimesh(np.zeros((3, 2)), [[0, 1, 2]]), r"vertices: expected the shape \(n, 3\), got \(3, 2\)"),
        (lambda: f.Collider.trimesh(np.full((3, 3), NAN), [[0, 1, 2]]), r"vertices\[0\] is not finite"),
        (lambda: f.Collider.trimesh([], []), "refused"),
        (lambda: f.Collider.heightfield(np.zeros(3), (1, 1, 1)), "heights: expected two dimensions"),
        (lambda: f.Collider.heightfield([[0, NAN], [0, 0]], (1, 1, 1)), r"heights\[0, 1\] is not finite"),
        (lambda: f.RigidBody.dynamic(linvel=(0, NAN, 0)), "linvel is not finite"),
        (lambda: f.RigidBody.dynamic(position=((0, 0, 0), (0, 0, 0, 0))), "is no rotation"),
        (lambda: f.FixedJoint.builder(limits=(0, 1)), "no free axis"),
        (lambda: f.RevoluteJoint.builder((0, 0, 1), limits=(1, 0)), "min 1 is above max 0"),
        (lambda: f.DeformableBody.ball(0.1, 0.0), "cell size 0 m"),
        (lambda: f.DeformableBody.ball(0.1, NAN), "cell size NaN m"),
        (lambda: f.DeformableBody.cuboid((0.1, 0.1, 0), (1, 1, 1)), "lattice|extent"),
        (lambda: f.DeformableBody.cuboid((0.1, 0.1, 0.1), (0, 1, 1)), "lattice|cells"),
        (lambda: f.DeformableBody.mesh(np.eye(3), [[0, 1, 2, 3]]), "tetrahedron 0 refers to vertex 3"),
        (lambda: f.DeformableBody.mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, NAN]], [[0, 1, 2, 3]]), "vertex 3 is not finite"),
        (lambda: f.DeformableBody.rope([[0, 0, 0]], 0.1), "."),
        (lambda: f.World().add_deformable(pad(translation=(NAN, 0, 0))), "translation is not finite"),
        (lambda: f.World().add_deformable(pad(pinned=[99])), "vertex 99 does not exist: the body has 8"),
        (lambda: f.World().add_deformable(pad(pinned=[True])), "a mask of 1 truth values for 8 vertices"),
        (lambda: f.World().add_deformable(pad(pinned=lambda x: x > 0)), r"pinned: expected the shape \(n,\)"),
        (lambda: pad(regions=lambda x: [0]), "regions: 1 numbers for 5 elements"),
        (lambda: f.step_all([f.World()], threads=0), "threads is 0, but must be at least 1"),
        (lambda: f.step_all([f.World()], n=-2), "n is -2, but must be zero or positive"),
        (lambda: f.World().step(-1), "n is -1, but must be zero or positive"),
        (lambda: f.DeformableBody.cloth((1, 1), (1, -1), 0.01), r"cells\[1\] is -1, but must be zero or positive"),
        (lambda: f.World().find_rest(tolerance=NAN), "tolerance"),
    ],
)
def test_bad_values_are_refused(make, text):
    with pytest.raises(f.DeformableBodyError, match=text) as caught:
        make()
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: f.World(gravity=(0, 1)), r"expected three numbers \(x, y, z\), got \(0, 1\)"),
        (lambda: f.RigidBody.dynamic(colour=1), "unknown option of RigidBodyBuilder: 'colour'"),
        (lambda: pad(stiffness=1), "unknown option of DeformableBodyBuilder: 'stiffness'"),
        (lambda: pad(material=1e5), "material|Material"),
        (lambda: f.Collider.trimesh("abc", [[0, 1, 2]]), "vertices: expected an array of numbers"),
        (lambda: f.Collider.trimesh(np.zeros((3, 3)), [[0, 1.5, 2]]), "indices: expected an array of integers, got float64"),
        (lambda: f.Collider.trimesh([[0, 0, 0], [1, 0]], [[0, 1, 2]]), "vertices: expected an array of numbers"),
        (lambda: f.World().attach(f.RigidBodyHandle(), [0]), "DeformableBodyHandle"),
        (lambda: f.World().attach(f.DeformableBodyHandle(), [0], "floor"), "to: expected a RigidBodyHandle, a Deform"),
        (lambda: f.World().add_body(f.RigidBody.dynamic(), f.Collider.ball(1)), "Sequence"),
    ],
)
def test_bad_types_are_refused(make, text):
    with pytest.raises(TypeError, match=text):
        make()


def test_stale_handles_are_told():
    scene = Scene()
    handle = scene.cube()
    body = scene.world.deformable_bodies[handle]
    scene.world.remove_deformable(handle)
    successor = scene.cube()
    assert (successor.index, successor.generation) != (handle.index, handle.generation) and successor != handle
    for stale in [
        lambda: body.positions,
        lambda: body.pin([0]),
        lambda: setattr(body, "linvel", (0, 0, 0)),
        lambda: scene.world.deformable_bodies[handle],
        lambda: scene.world.contact_force(handle, scene.floor),
        lambda: scene.world.contacts(body=handle),
        lambda: scene.world.contact_tractions(handle),
        lambda: scene.world.remove_deformable(handle),
        lambda: scene.world.attach(handle, [0]),
    ]:
        with pytest.raises(f.InvalidHandle) as caught:
            stale()
        assert isinstance(caught.value, KeyError)
        assert str(caught.value) == "no deformable body at slot 0 of generation 0"
    with pytest.raises(f.InvalidHandle, match="no collider at slot 7 of generation 0"):
        scene.world.contact_force(successor, f.ColliderHandle(7, 0))
    assert "removed" in repr(body)


def test_bad_values_for_a_body_change_nothing():
    scene = Scene()
    body = scene.world.deformable_bodies[scene.cube()]
    before = body.positions
    wrong = before.copy()
    wrong[5, 1] = NAN
    for bad in [
        lambda: setattr(body, "positions", wrong),
        lambda: setattr(body, "velocities", wrong),
        lambda: setattr(body, "positions", before[1:]),
        lambda: setattr(body, "linvel", (NAN, 0, 0)),
        lambda: setattr(body, "activation", NAN),
        lambda: body.add_force((0, NAN, 0)),
        lambda: body.add_force((0, 1, 0), vertices=[]),
        lambda: body.pin([64]),
        lambda: body.move_pins([0], [0, 0, 0]),
        lambda: body.apply_impulse_at_point((0, 1, 0), (0, float("inf"), 0)),
        lambda: body.set_region_material(3, f.Material(1e5, 0.3)),
        lambda: body.set_next_kinematic_positions(before),
    ]:
        with pytest.raises(f.DeformableBodyError):
            bad()
    assert np.array_equal(body.positions, before) and not body.velocities.any()


def test_a_function_that_raises_is_heard():
    with pytest.raises(ZeroDivisionError):
        f.World().add_deformable(pad(pinned=lambda x: 1 / 0))
    with pytest.raises(ZeroDivisionError):
        pad(regions=lambda x: 1 / 0)
