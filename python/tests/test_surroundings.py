"""Rays and points against surfaces, and wind, against geometry and the law of drag."""

import numpy as np
import pytest

import foible3d as f


def two_cubes():
    world = f.World(gravity=(0, 0, 0))
    cubes = [
        world.add_deformable(f.DeformableBody.cuboid((0.2, 0.2, 0.2), (2, 2, 2), translation=(x, 0, 0)))
        for x in (0.0, 1.0)
    ]
    return world, cubes


def test_a_ray_meets_the_first_surface():
    world, (near, far) = two_cubes()
    hit = world.cast_ray((-2, 0.05, 0.02), (3, 0, 0))
    assert hit.body == near and hit.distance == pytest.approx(1.8, abs=1e-6)
    assert hit.point == pytest.approx([-0.2, 0.05, 0.02], abs=1e-6) and hit.normal == pytest.approx([-1, 0, 0])
    corners = world.deformable_bodies[near].positions[hit.vertices]
    assert hit.weights @ corners == pytest.approx(hit.point, abs=1e-6) and hit.weights.sum() == pytest.approx(1.0)
    assert world.cast_ray((-2, 0, 0), (1, 0, 0), bodies=[far]).distance == pytest.approx(2.8, abs=1e-6)
    assert world.cast_ray((-2, 0, 0), (1, 0, 0), max_distance=1.0) is None
    assert world.cast_ray((-2, 0, 0), (-1, 0, 0)) is None


def test_a_point_is_projected_to_the_nearest_surface():
    world, (near, far) = two_cubes()
    found = world.project_point((0.05, 0.5, 0.0))
    assert found.body == near and found.distance == pytest.approx(0.3, abs=1e-6)
    assert found.point == pytest.approx([0.05, 0.2, 0.0], abs=1e-6)
    assert world.project_point((1.1, 0.05, 0.0)).distance == 0.0
    assert world.project_point((0.05, 0.5, 0.0), max_distance=0.2) is None
    with pytest.raises(f.DeformableBodyError, match="point is not finite"):
        world.project_point((0, np.nan, 0))


def test_wind_pushes_a_cube_by_the_law_of_drag():
    world, (cube, other) = two_cubes()
    body = world.deformable_bodies[cube]
    body.set_wind((0, 0, 2.0), density=1.2, drag=1.0, friction=0.0)
    world.step(10)
    # rho/2 C A u²; the cube hardly moves.
    push = 0.5 * 1.2 * 1.0 * 0.4**2 * 2.0**2
    assert body.linvel[2] * body.mass / (10 * world.dt) == pytest.approx(push, rel=0.01)
    assert np.abs(world.deformable_bodies[other].linvel).max() < 1e-12
    before = body.linvel[2]
    body.set_wind(None)
    world.step(10)
    assert body.linvel[2] == pytest.approx(before, rel=1e-6)
    with pytest.raises(f.DeformableBodyError, match="finite"):
        body.set_wind((np.inf, 0, 0))
