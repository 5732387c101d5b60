"""Deformable bodies: rest, pins, beams, shapes, muscles, contacts."""

import math

import numpy as np
import pytest

import foible3d as f
from conftest import Scene


def test_the_floor_carries_the_weight_of_a_cube_at_rest(scene):
    cube = scene.cube(height=0.11)
    world, body = scene.world, scene.world.deformable_bodies[cube]
    world.step(240)
    weight = body.mass * 9.81
    assert body.mass == pytest.approx(8.0)
    assert world.contact_force(cube, scene.floor)[1] == pytest.approx(weight, rel=1e-5)
    assert body.max_speed < 1e-5
    contacts = world.contacts(body=cube, collider=scene.floor)
    assert contacts["force"].sum(axis=0) == pytest.approx([0, weight, 0], abs=1e-5 * weight)
    assert (contacts["normal"][:, 1] > 0.999).all() and (np.abs(contacts["gap"]) < 1e-4).all()
    assert (contacts["collider"] == [scene.floor.index, scene.floor.generation]).all()
    assert contacts["weights"].sum(axis=1) == pytest.approx(1.0)
    tractions = world.contact_tractions(cube) * body.vertex_areas()[:, None]
    assert tractions.sum(axis=0)[1] == pytest.approx(weight, rel=1e-5)
    assert world.contact_area(cube) == pytest.approx(0.04, rel=0.05)
    assert world.counters()["active_contacts"] >= 4 or body.is_sleeping


def test_arrays_have_their_shapes_and_types(scene):
    body = scene.world.deformable_bodies[scene.cube()]
    n, m = body.vertex_count, len(body.tetrahedra)
    assert (n, m) == (64, 135)
    for array, shape, dtype in [
        (body.positions, (n, 3), np.float64),
        (body.velocities, (n, 3), np.float64),
        (body.rest_positions, (n, 3), np.float64),
        (body.normals, (n, 3), np.float64),
        (body.triangles, (6 * 9 * 2, 3), np.uint32),
        (body.tetrahedra, (m, 4), np.uint32),
        (body.tetrahedron_regions, (m,), np.uint32),
        (body.vertex_masses, (n,), np.float64),
        (body.stresses(), (m, 3, 3), np.float64),
        (body.vertex_stresses(), (n, 3, 3), np.float64),
        (body.von_mises(), (m,), np.float64),
        (body.elastic_forces(), (n, 3), np.float64),
        (body.center_of_mass, (3,), np.float64),
        (body.linvel, (3,), np.float64),
    ]:
        assert array.shape == shape and array.dtype == dtype
    assert body.vertex_masses.sum() == pytest.approx(body.mass)
    assert body.volume == pytest.approx(8e-3)


def test_positions_and_velocities_are_set():
    body = Scene(gravity=(0, 0, 0))
    body = body.world.deformable_bodies[body.cube()]
    x = body.positions
    x[:, 0] *= 1.01
    body.positions = x
    assert np.array_equal(body.positions, x)
    # E / (1 − ν²)-like stretch: the stress along x is positive and the largest.
    assert (body.stresses()[:, 0, 0] > 1000.0).all() and body.elastic_energy() > 0
    body.velocities = np.tile([1.0, 2.0, 3.0], (len(x), 1))
    assert body.linvel == pytest.approx([1, 2, 3])
    body.linvel = (0, 0, 0)
    body.angvel = (0, 1, 0)
    assert body.angvel == pytest.approx([0, 1, 0]) and body.kinetic_energy() > 0
    body.position = ((5, 0, 0), (0, 0, 0, 1))
    assert body.center_of_mass[0] == pytest.approx(5.0, abs=0.01)


def test_pins_stay_and_a_cantilever_droops():
    world = f.World()
    length, height, modulus, density = 1.0, 0.1, 1e6, 20.0
    beam = f.DeformableBody.cuboid(
        (length / 2, height / 2, height / 2),
        (40, 4, 4),
        material=f.Material(modulus, 0.0, density=density),
        smoothed=True,
        pinned=lambda x: x[:, 0] < -0.4999,
    )
    beam = world.deformable_bodies[world.add_deformable(beam)]
    before = beam.positions
    assert len(beam.pinned) == 25
    found = world.find_rest(tolerance=1e-8)
    assert found["is_found"] and found["steps"] < 40
    assert np.array_equal(beam.positions[beam.pinned], before[beam.pinned])
    # Euler and Bernoulli: w L⁴ / 8 E I, with w the weight per length: a thirtieth of the length.
    droop = density * height**2 * 9.81 * length**4 / (8 * modulus * height**4 / 12)
    tip = before[:, 0] > 0.4999
    assert (before - beam.positions)[tip, 1].mean() == pytest.approx(droop, rel=0.05)
    assert beam.pin_force == pytest.approx([0, beam.mass * 9.81, 0], rel=1e-4, abs=1e-3)
    assert beam.von_mises().max() > 2 * np.median(beam.von_mises())


def test_pins_are_moved(scene):
    body = scene.world.deformable_bodies[scene.cube(height=0.5)]
    top = body.positions[:, 1] > 0.599
    body.pin(top)
    assert np.array_equal(body.pinned, np.flatnonzero(top))
    targets = body.positions[top] + [0, 0.01, 0]
    body.move_pins(top, targets)
    scene.world.step()
    assert body.positions[top] == pytest.approx(targets, abs=1e-6)
    body.set_pin_velocities(top, (0, 0.6, 0))
    scene.world.step(10)
    assert body.positions[top] == pytest.approx(targets + [0, 0.1, 0], abs=1e-5)
    body.unpin(np.flatnonzero(top))
    assert len(body.pinned) == 0
    with pytest.raises(f.DeformableBodyError, match="vertex 0 is not pinned"):
        body.unpin([0])


def test_shapes_are_filled_and_meshes_taken():
    corner = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    octahedron = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]) * 0.5
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    for builder, volume in [
        (f.DeformableBody.ball(0.5, 0.125), math.pi / 6),
        (f.DeformableBody.cylinder(0.5, 0.25, 0.1), math.pi / 16),
        (f.DeformableBody.capsule(0.25, 0.25, 0.1), math.pi / 32 + math.pi / 48),
        (f.DeformableBody.surface(octahedron, faces, 0.1), 1 / 6),
        (f.DeformableBody.mesh(*corner), 1 / 6),
    ]:
        world = f.World()
        body = world.deformable_bodies[world.add_deformable(builder)]
        assert body.volume == pytest.approx(volume, rel=0.03)
        assert body.mass == pytest.approx(1000 * body.volume)


def test_meshes_are_read_from_files(tmp_path):
    file = tmp_path / "corner.mesh"
    file.write_text(
        "MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
        "Tetrahedra\n1\n1 2 3 4 7\nEnd\n"
    )
    world = f.World()
    body = world.deformable_bodies[world.add_deformable(f.DeformableBody.file(file, scale=0.1))]
    assert body.volume == pytest.approx(1e-3 / 6) and body.regions == [7]
    surface = tmp_path / "tetrahedron.obj"
    surface.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
    filled = world.add_deformable(f.DeformableBody.file(str(surface), cell_size=0.1))
    assert world.deformable_bodies[filled].volume == pytest.approx(1 / 6, rel=0.05)
    with pytest.raises(f.DeformableBodyError, match="cell_size"):
        f.DeformableBody.file(surface)
    with pytest.raises(f.DeformableBodyError, match="none.msh"):
        f.DeformableBody.file("none.msh")


def test_sheets_and_ropes_hang():
    world = f.World()
    cotton = f.Material(5e6, 0.3, density=400.0, mass_damping=2.0)
    flag = f.DeformableBody.cloth((0.3, 0.2), (12, 8), 5e-4, material=cotton, pinned=lambda x: x[:, 0] < -0.299)
    flag = world.deformable_bodies[world.add_deformable(flag)]
    points = np.linspace([0, 0, 2], [1, 0, 2], 21)
    rope = f.DeformableBody.rope(points, 0.01, material=f.Material(1e7, 0.3, mass_damping=2.0), pinned=[0, 20])
    rope = world.deformable_bodies[world.add_deformable(rope)]
    assert flag.mass == pytest.approx(400 * 0.6 * 0.4 * 5e-4, rel=1e-6)
    world.step(120)
    assert flag.positions[:, 1].min() < -0.3 and flag.sheet_stresses().shape == (len(flag.triangles), 3, 3)
    assert rope.positions[10, 1] < -0.001 and rope.rod_tensions().shape == (20,) and (rope.rod_tensions() > 0).all()


def test_regions_have_materials_of_their_own():
    soft, stiff = f.Material(1e5, 0.45, density=1100.0), f.Material(1e9, 0.4, density=1200.0)
    finger = f.DeformableBody.cuboid((0.05, 0.01, 0.01), (20, 4, 4), material=soft)
    finger = finger.regions(lambda x: (x[:, 1] > 0.005).astype(int)).region_material(1, stiff)
    world = f.World()
    finger = world.deformable_bodies[world.add_deformable(finger)]
    assert finger.mass == pytest.approx(4e-5 * 1125.0)
    assert finger.regions == [0, 1] and finger.region_material(1) == stiff and finger.material == soft
    assert (finger.tetrahedron_regions == 1).mean() == pytest.approx(0.25)
    high = finger.rest_positions[finger.tetrahedra].mean(axis=1)[:, 1] > 0.005
    assert np.array_equal(high, finger.tetrahedron_regions == 1)
    assert np.array_equal(finger.region_vertices(1), np.unique(finger.tetrahedra[high]))


def test_a_muscle_contracts():
    world = f.World(gravity=(0, 0, 0))
    material = f.Material(5e4, 0.3, fibre_modulus=2e5, mass_damping=10.0)
    muscle = f.DeformableBody.cuboid((0.02, 0.15, 0.02), (2, 15, 2), material=material, fibres=(0, 1, 0))
    fan = f.DeformableBody.cuboid((0.02, 0.15, 0.02), (2, 15, 2), material=material, translation=(1, 0, 0))
    fan = fan.fibres(lambda x: np.tile([0, 1, 0], (len(x), 1)))
    bodies = [world.deformable_bodies[world.add_deformable(builder)] for builder in (muscle, fan)]
    for body in bodies:
        body.activation = 0.6
    world.step(240)
    # Along a bar whose sides are free: E (s − 1) + E_f (s − a) = 0.
    expected = 0.3 * (5e4 + 2e5 * 0.6) / 2.5e5
    for body in bodies:
        assert np.ptp(body.positions[:, 1]) == pytest.approx(expected, rel=0.02)


def test_fibres_of_a_region_contract_alone():
    world = f.World(gravity=(0, 0, 0))
    material = f.Material(5e4, 0.3, fibre_modulus=2e5, mass_damping=10.0)
    bar = f.DeformableBody.cuboid((0.02, 0.15, 0.02), (2, 14, 2), material=material, fibres=(0, 1, 0))
    body = world.deformable_bodies[world.add_deformable(bar.regions(lambda x: x[:, 1] > 0))]
    body.set_region_activation(1, 0.6)
    assert (body.region_activation(0), body.region_activation(1)) == (1.0, 0.6)
    world.step(240)
    middle = body.positions[np.abs(body.rest_positions[:, 1]) < 1e-6, 1].mean()
    expected = 0.15 * (5e4 + 2e5 * 0.6) / 2.5e5
    assert body.positions[:, 1].max() - middle == pytest.approx(expected, rel=0.03)
    assert middle - body.positions[:, 1].min() == pytest.approx(0.15, rel=0.03)
    with pytest.raises(f.DeformableBodyError, match="region"):
        body.set_region_activation(7, 0.6)


def test_woven_cloth_stretches_by_its_threads():
    # E of a pull along the warp, along the weft: what hangs on two strips.
    world = f.World(gravity=(0, -9.81, 0))
    cloth = f.Material.orthotropic_sheet(1e6, 2e5, 0.0, 1e5).replace(mass_damping=20.0, density=500.0)
    assert cloth.sheet == (1e6, 2e5, 0.0, 1e5)
    lengths = []
    for place, along in enumerate((lambda x: np.tile([0.0, 0.0, 1.0], (len(x), 1)), (1, 0, 0))):
        strip = f.DeformableBody.cloth((0.05, 0.25), (4, 20), 0.001, material=cloth, warp=along)
        strip = strip.rotation((np.pi / 2, 0, 0)).translation((place, 0, 0)).pinned(lambda x: x[:, 1] > 0.249)
        body = world.deformable_bodies[world.add_deformable(strip)]
        lengths.append(body)
    world.step(400)
    stretch = [np.ptp(body.positions[:, 1]) - 0.5 for body in lengths]
    # ρ g L²/(2 E).
    for own, modulus in zip(stretch, (1e6, 2e5)):
        assert own == pytest.approx(500 * 9.81 * 0.25 / (2 * modulus), rel=0.1)
    with pytest.raises(f.DeformableBodyError, match="warp"):
        world.add_deformable(f.DeformableBody.cloth((0.05, 0.25), (4, 20), 0.001, material=cloth))


def test_a_hard_limit_holds():
    world = f.World()
    rope = f.DeformableBody.rope([(0, -0.05 * k, 0) for k in range(11)], 0.005)
    rope = rope.material(f.Material(1e4, 0.3, hard_strain_limits=(0.0, 1.02), mass_damping=2.0)).pinned(lambda x: x[:, 1] > -0.01)
    body = world.deformable_bodies[world.add_deformable(rope)]
    world.step(200)
    assert np.linalg.norm(np.diff(body.positions, axis=0), axis=1).max() < 0.05 * 1.021


def test_every_solver_can_be_asked_for():
    world = f.World(gravity=(0, 0, 0))
    for k, solver in enumerate((f.Solver.PROJECTIVE, f.Solver.CONJUGATE_GRADIENTS, f.Solver.GAUSS_SEIDEL, f.Solver.XPBD, f.Solver.JACOBI, f.Solver.NEWTON, f.Solver.AUTOMATIC)):
        cube = f.DeformableBody.cuboid((0.1, 0.1, 0.1), (2, 2, 2), solver=solver, translation=(k, 0, 0), linvel=(0, 1, 0))
        body = world.deformable_bodies[world.add_deformable(cube)]
        world.step(6)
        assert body.linvel == pytest.approx((0, 1, 0), abs=1e-9)


def test_bodies_touch_one_another(scene):
    lower, upper = scene.cube(height=0.1), scene.cube(height=0.3)
    scene.world.step(240)
    assert scene.world.contact_force(lower, scene.floor)[1] == pytest.approx(16 * 9.81, rel=1e-4)
    assert scene.world.pair_force(upper, lower)[1] == pytest.approx(8 * 9.81, rel=1e-4)
    pairs = scene.world.pair_contacts()
    assert pairs["vertices"].shape[1:] == (2, 3)
    assert np.abs(pairs["force"].sum(axis=0)[1]) == pytest.approx(8 * 9.81, rel=1e-4)


def test_collision_groups_let_through(scene):
    ghost = scene.cube(height=0.3, collision_groups=f.InteractionGroups(2, 2))
    scene.world.colliders[scene.floor].collision_groups = f.InteractionGroups(1, 1)
    scene.world.step(60)
    assert scene.world.deformable_bodies[ghost].center_of_mass[1] < -1


def test_forces_move_and_sleepers_wake(scene):
    body = scene.world.deformable_bodies[scene.cube()]
    scene.world.step(240)
    assert body.is_sleeping
    body.apply_impulse((0, 16, 0))
    assert not body.is_sleeping and body.linvel == pytest.approx([0, 2, 0], abs=1e-6)
    body.linvel = (0, 0, 0)
    scene.world.gravity = (0, 0, 0)
    body.add_force((8, 0, 0))
    body.material = f.Material(1e5, 0.3, friction=0.0)
    body.position = ((0, 1, 0), (0, 0, 0, 1))
    scene.world.step(60)
    assert body.linvel[0] == pytest.approx(1.0, rel=1e-3)
    body.reset_forces()
    side = body.positions[:, 0] > body.positions[:, 0].max() - 1e-3
    assert body.add_traction((100, 0, 0), side) == pytest.approx(0.04)


def test_fidelity_and_knobs():
    world = f.World()
    builder = f.DeformableBody.cuboid((0.5, 0.1, 0.1), (10, 2, 2), pinned=lambda x: x[:, 0] < -0.499, can_sleep=False)
    seen = world.add_deformable(builder.fidelity(f.Fidelity.PREVIEW))
    measured = world.add_deformable(builder.translation((0, 0, 1)).fidelity(f.Fidelity.ENGINEERING).integrator(f.Integrator.BDF2))
    world.prepare()
    world.step()
    assert world.deformable_bodies[seen].last_iterations == 1
    assert world.deformable_bodies[measured].last_converged
