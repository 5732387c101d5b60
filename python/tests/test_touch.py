"""Touch, against weights and geometry."""

import numpy as np
import pytest

import foible3d as f

# z of the frame points up, x along x, y along -z.
UP = ((0, 0.005, 0), (-np.sqrt(0.5), 0, 0, np.sqrt(0.5)))


def pad_with_ball(mass=0.1):
    """A pad 4 cm wide and 1 cm thick that is held from below, and a ball on it."""
    world = f.World()
    rubber = f.Material(1e5, 0.4, mass_damping=20.0)
    pad = f.DeformableBody.cuboid((0.02, 0.005, 0.02), (16, 4, 16), material=rubber)
    pad = world.add_deformable(pad)
    body = world.deformable_bodies[pad]
    body.pin(body.positions[:, 1] < -0.0049)
    ball = f.RigidBody.dynamic(translation=(0.005, 0.0149, 0), enabled_rotations=(False, False, False))
    ball = world.add_body(ball, [f.Collider.ball(0.01, mass=mass)])
    return world, pad, ball


def test_taxels_sum_to_the_weight_and_are_highest_under_the_ball():
    world, pad, ball = pad_with_ball()
    body = world.deformable_bodies[pad]
    skin = f.TactilePad(body, UP, (0.02, 0.02), (8, 6))
    world.step(240)
    reading = skin.read(body)
    assert skin.taxels == (8, 6) and reading.forces.shape == (6, 8, 3)
    assert reading.pressure.shape == reading.areas.shape == (6, 8) and reading.shear.shape == (6, 8, 2)
    assert reading.areas.sum() == pytest.approx(0.04**2, rel=1e-6)
    assert reading.total[2] == pytest.approx(-0.1 * 9.81, abs=0.01)
    assert reading.forces.sum(axis=(0, 1)) == pytest.approx(reading.total)
    assert (reading.pressure * reading.areas).sum() == pytest.approx(-reading.total[2])
    assert (reading.shear * reading.areas[..., None]).sum(axis=(0, 1)) == pytest.approx(reading.total[:2])
    # The ball is at x = 5 mm: in the sixth of eight columns of 5 mm, between the two rows in the middle.
    row, column = np.unravel_index(reading.pressure.argmax(), (6, 8))
    assert row in (2, 3) and column in (4, 5)
    # In a frame of the world the force is up.
    level = skin.read(body, ((0, 0, 0), (0, 0, 0, 1)))
    assert level.total[1] == pytest.approx(reading.total[2], rel=1e-6)
    markers, moved = skin.markers(body), skin.marker_displacements(body, UP)
    assert markers.shape == moved.shape == (6, 8, 3) and np.isfinite(moved).all()
    assert markers[..., 1] - 0.005 == pytest.approx(moved[..., 2], abs=1e-7)
    assert moved[row, column, 2] < -5e-5 and abs(moved[0, 0, 2]) < 2e-5
    again = world.copy()
    assert (skin.read(again.deformable_bodies[pad]).areas == reading.areas).all()


def test_there_is_no_marker_where_there_is_no_surface():
    world, pad, _ = pad_with_ball()
    body = world.deformable_bodies[pad]
    skin = f.TactilePad(body, UP, (0.04, 0.02), (8, 4))
    markers = skin.markers(body)
    assert np.isnan(markers[:, [0, 1, 6, 7]]).all() and np.isfinite(markers[:, 2:6]).all()
    assert (skin.read(body).areas[:, 0] == 0).all()


def test_a_wrench_is_the_weight_and_its_moment():
    world, pad, ball = pad_with_ball()
    world.step(240)
    weight = 0.1 * 9.81
    (collider,) = world.rigid_bodies[ball].colliders
    for by in (None, ball, collider):
        force, moment = world.contact_wrench(pad, about=(1.0, 0, 0), by=by)
        assert force[1] == pytest.approx(-weight, abs=0.01)
        # The lever of the ball is 5 mm - 1 m; what friction there is acts 5 mm above the axis.
        assert moment[2] == pytest.approx(-(0.005 - 1.0) * weight, abs=0.015)
    assert force == pytest.approx(world.contact_force(pad, collider), abs=1e-6)
    floor = world.add_body(f.RigidBody.fixed())
    assert world.contact_wrench(pad, by=floor)[0].tolist() == [0, 0, 0]
    with pytest.raises(f.InvalidHandle, match="no rigid body"):
        world.contact_wrench(pad, by=f.RigidBodyHandle(9, 9))
    with pytest.raises(TypeError, match="by: expected"):
        world.contact_wrench(pad, by=3)


def test_a_camera_sees_the_depth_of_a_wall_and_nothing_beside_it():
    world = f.World()
    wall = world.add_deformable(f.DeformableBody.cuboid((0.05, 0.05, 0.01), (2, 2, 1)))
    body = world.deformable_bodies[wall]
    camera = f.DepthCamera(((0, 0, -0.1), (0, 0, 0, 1)), np.pi / 2, (32, 24), (0.01, 1.0))
    image = camera.render(body)
    assert image.shape == (24, 32) and camera.size == (32, 24)
    # At 9 cm the wall's half, 5 cm, is at 12 pixels times 5/9.
    columns = np.abs(np.arange(32) + 0.5 - 16) < 12 * 5 / 9
    rows = np.abs(np.arange(24) + 0.5 - 12) < 12 * 5 / 9
    seen = np.outer(rows, columns)
    assert image[seen] == pytest.approx(0.09, abs=1e-6) and np.isinf(image[~seen]).all()
    near = camera.render(body, pose=((0, 0, -0.05), (0, 0, 0, 1)))
    assert near[12, 16] == pytest.approx(0.04, abs=1e-6)
    other = world.add_deformable(f.DeformableBody.cuboid((0.01, 0.01, 0.01), (1, 1, 1), translation=(0, 0, -0.05)))
    both = camera.render(body, world.deformable_bodies[other])
    assert both[12, 16] == pytest.approx(0.04, abs=1e-6) and (both <= image).all()


def test_what_no_pad_and_no_camera_is_is_refused():
    world, pad, _ = pad_with_ball()
    body = world.deformable_bodies[pad]
    with pytest.raises(f.DeformableBodyError, match="it has no taxels, or too many"):
        f.TactilePad(body, UP, (0.02, 0.02), (0, 8))
    with pytest.raises(f.DeformableBodyError, match="its extents are not positive"):
        f.TactilePad(body, UP, (0.0, 0.02), (8, 8))
    with pytest.raises(f.DeformableBodyError, match="field of view"):
        f.DepthCamera(UP, 4.0, (8, 8), (0.1, 1.0))
    with pytest.raises(f.DeformableBodyError, match="frame is no rotation"):
        f.TactilePad(body, ((0, 0, 0), (0, 0, 0, 2)), (0.02, 0.02), (8, 8))
    other = world.add_deformable(f.DeformableBody.cuboid((0.02, 0.005, 0.02), (2, 2, 2)))
    with pytest.raises(f.DeformableBodyError, match="vert"):
        f.TactilePad(body, UP, (0.02, 0.02), (8, 8)).read(world.deformable_bodies[other])
