"""Closed rooms of bodies with something in them."""

import numpy as np
import pytest

import foible3d as f
from conftest import Scene


def hollow_cube(scene, **options):
    """A cube of 40 cm with a hollow cube of 20 cm in it: tetrahedra of a lattice without those in the middle."""
    whole = scene.world.add_deformable(f.DeformableBody.cuboid((0.2, 0.2, 0.2), (4, 4, 4)))
    body = scene.world.deformable_bodies[whole]
    x, tetrahedra = body.rest_positions, body.tetrahedra
    scene.world.remove_deformable(whole)
    is_wall = (np.abs(x[tetrahedra].mean(axis=1)) > 0.1).any(axis=1)
    kept, numbers = np.unique(tetrahedra[is_wall], return_inverse=True)
    mesh = f.DeformableBody.mesh(x[kept], numbers.reshape(-1, 4).astype(np.uint32), **options)
    return scene.world.add_deformable(mesh)


def test_a_sealed_chamber_keeps_its_gas():
    scene = Scene()
    rubber = f.Material(1e5, 0.3, mass_damping=5.0)
    handle = hollow_cube(scene, material=rubber, translation=(0, 0.2, 0))
    body = scene.world.deformable_bodies[handle]
    assert body.cavity_volumes == pytest.approx([0.008]) and body.cavity_pressures.tolist() == [0.0]
    assert body.cavity_centers == pytest.approx(np.zeros((1, 3)))
    body.set_cavity_pressure(0, 3e3)
    scene.world.step(120)
    grown = body.cavity_volumes[0]
    assert grown > 1.005 * 0.008 and body.cavity_pressures.tolist() == [3e3]
    body.seal_cavity(0, exponent=1.0)
    box = f.RigidBody.dynamic(translation=(0, 0.55, 0))
    scene.world.add_body(box, [f.Collider.cuboid(0.2, 0.1, 0.2, density=5000.0)])
    scene.world.step(240)
    assert body.cavity_volumes[0] < 0.999 * grown
    kept = (body.cavity_pressures[0] + 101_325.0) * body.cavity_volumes[0]
    assert kept == pytest.approx((3e3 + 101_325.0) * grown, rel=1e-9)
    again = f.World.restore(scene.world.snapshot())
    assert again.deformable_bodies[handle].cavity_pressures == pytest.approx(body.cavity_pressures)
    body.fill_cavity(0, 0.008)
    body.empty_cavity(0)
    assert body.cavity_pressures.tolist() == [0.0]


def test_what_no_cavity_holds_is_refused():
    scene = Scene()
    body = scene.world.deformable_bodies[hollow_cube(scene)]
    with pytest.raises(f.DeformableBodyError, match="cavity 1 does not exist: the body has 1"):
        body.set_cavity_pressure(1, 0.0)
    with pytest.raises(f.DeformableBodyError, match="cavity 0 cannot be: its pressure is not finite"):
        body.set_cavity_pressure(0, float("nan"))
    with pytest.raises(f.DeformableBodyError, match="its volume is not positive"):
        body.fill_cavity(0, -1.0)
