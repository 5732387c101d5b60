"""Arrays that are filled: the numbers of the world to the last bit, without allocations, refused by name where they do not fit."""

import tracemalloc

import numpy as np
import pytest

import foible3d as f
from conftest import Scene, bits


def crowd():
    """Cubes and a sheet, which move."""
    scene = Scene()
    handles = [scene.cube(height=0.12), scene.cube(height=0.5)]
    sheet = f.DeformableBody.cloth((0.4, 0.4), (4, 4), 0.01, translation=(1, 0.2, 0))
    handles.append(scene.world.add_deformable(sheet))
    scene.world.step(10)
    return scene.world, handles


def test_a_filled_array_is_the_users_own_and_has_the_bits():
    world, handles = crowd()
    for handle in handles:
        body = world.deformable_bodies[handle]
        for get, told in [
            (body.read_positions, body.positions),
            (body.read_velocities, body.velocities),
            (body.read_von_mises, body.von_mises()),
        ]:
            out = np.full_like(told, np.nan)
            assert get(out) is out and get(out=out) is out
            assert (out == told).all() and (get() == told).all()
    out = np.empty((sum(world.deformable_bodies[handle].vertex_count for handle in handles), 3))
    assert world.read_positions(out=out) is out
    slices = world.vertex_slices()
    assert list(slices) == [handle for handle, _ in world.deformable_bodies]
    for handle, own in slices.items():
        assert (out[own] == world.deformable_bodies[handle].positions).all()
        assert (world.read_velocities()[own] == world.deformable_bodies[handle].velocities).all()
    assert f.World().read_positions().shape == (0, 3)


def test_nothing_is_allocated_with_out():
    world, handles = crowd()
    body = world.deformable_bodies[handles[0]]
    own, velocities, all_of_them = body.read_positions(), body.read_velocities(), world.read_positions()

    def read(times):
        for _ in range(times):
            body.read_positions(out=own)
            body.read_velocities(out=velocities)
            world.read_positions(out=all_of_them)

    places = [array.ctypes.data for array in (own, velocities, all_of_them)]
    tracemalloc.start()
    read(100)
    before = tracemalloc.get_traced_memory()[0]
    tracemalloc.reset_peak()
    read(1000)
    peak = tracemalloc.get_traced_memory()[1] - before
    tracemalloc.stop()
    # A copy of one pad's positions alone would be 1536 bytes; small objects of Python's come and go.
    assert own.nbytes == 1536 and peak < own.nbytes
    assert places == [array.ctypes.data for array in (own, velocities, all_of_them)]


def test_what_does_not_fit_is_refused_by_name():
    world, handles = crowd()
    body = world.deformable_bodies[handles[0]]
    wide, column = np.empty((64, 6)), np.empty((64, 3), order="F")
    still = np.empty((64, 3))
    still.flags.writeable = False
    total = world.read_positions().shape[0]
    for out, kind, text in [
        ([[0.0] * 3] * 64, TypeError, "out: expected an array of float64, got .*list"),
        (np.empty((64, 3), np.float32), TypeError, "out: expected an array of float64, got one of float32"),
        (np.empty((63, 3)), ValueError, r"out: expected the shape \(64, 3\), got \(63, 3\)"),
        (np.empty(192), ValueError, r"out: expected the shape \(64, 3\), got \(192\)"),
        (wide[:, ::2], ValueError, "out: the array is not C-contiguous"),
        (column, ValueError, "out: the array is not C-contiguous"),
        (still, ValueError, "out: the array is read-only"),
    ]:
        for get in (body.read_positions, body.read_velocities):
            with pytest.raises(kind, match=text):
                get(out=out)
    with pytest.raises(ValueError, match=rf"out: expected the shape \({total}, 3\), got \(64, 3\)"):
        world.read_positions(out=np.empty((64, 3)))
    with pytest.raises(ValueError, match=r"out: expected the shape \(135\), got \(64, 3\)"):
        body.read_von_mises(out=np.empty((64, 3)))


def test_what_is_read_can_be_set_again_to_the_bit():
    world, _ = crowd()
    positions, velocities, state = world.read_positions(), world.read_velocities(), bits(world)
    # Velocities that single precision does not hold are among them.
    assert (velocities != velocities.astype(np.float32)).any()
    world.set_positions(positions + 1.0)
    world.set_velocities(2.0 * velocities)
    assert (world.read_positions() == positions + 1.0).all() and (world.read_velocities() == 2.0 * velocities).all()
    world.set_positions(positions)
    world.set_velocities(velocities)
    assert bits(world) == state
    # Nothing is changed where one number is refused, be it of the last body.
    wrong = positions + 1.0
    wrong[-1, 2] = np.nan
    for set_all, name in [(world.set_positions, "positions"), (world.set_velocities, "velocities")]:
        with pytest.raises(ValueError, match=rf"{name}\[{len(wrong) - 1}\] is not finite"):
            set_all(wrong)
        with pytest.raises(ValueError, match=f"{len(wrong) - 1} vertices are given where {len(wrong)} are expected"):
            set_all(positions[:-1])
        with pytest.raises(ValueError, match=rf"{name}: expected the shape \(n, 3\)"):
            set_all(positions[:, :2])
    assert bits(world) == state
