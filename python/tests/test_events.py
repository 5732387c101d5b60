"""Events of the last step."""

import pytest

import foible3d as f
from conftest import Scene


def test_a_landing_and_a_removal_are_told_once_each():
    scene = Scene()
    cube = scene.cube(height=0.3, active_events=True)
    silent = scene.cube(height=1.3)
    told = []
    for _ in range(60):
        scene.world.step()
        told += [(event, scene.world.deformable_bodies[cube].positions[:, 1].min()) for event in scene.world.collision_events()]
    (event, lowest), *_ = told
    assert event.started and event.body == cube and event.partner == scene.floor and not event.sensor
    assert abs(lowest) < 0.01
    assert scene.world.contact_force_events() == []
    scene.world.remove_deformable(cube)
    scene.world.step()
    (event,) = [event for event in scene.world.collision_events() if event.partner == scene.floor]
    assert not event.started and event.removed
    assert silent in scene.world.deformable_bodies


def test_a_force_above_its_threshold_is_told_in_every_step():
    scene = Scene()
    for threshold, count in ((10.0, 1), (1e3, 0)):
        cube = scene.cube(active_events=(False, True), contact_force_event_threshold=threshold, can_sleep=False)
        scene.world.step(120)
        weight = scene.world.deformable_bodies[cube].mass * 9.81
        events = scene.world.contact_force_events()
        assert len(events) == count and scene.world.collision_events() == []
        for event in events:
            assert event.body == cube and event.partner == scene.floor and not event.started
            assert event.total_force[1] == pytest.approx(weight, rel=1e-4)
            assert event.total_force_magnitude >= weight * 0.9999 and event.max_force_magnitude < weight
            assert event.max_force_direction[1] > 0.5
        scene.world.remove_deformable(cube)
    with pytest.raises(f.DeformableBodyError, match="contact_force_event_threshold is -1"):
        scene.cube(contact_force_event_threshold=-1.0)
