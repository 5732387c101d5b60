"""Recordings: what is written is what was."""

import re
import sys
import types

import numpy as np
import pytest

import foible3d as f
from conftest import Scene
from foible3d import record


def test_a_series_has_the_times_and_the_files(tmp_path):
    scene = Scene()
    cube = scene.cube(height=0.3)
    with record.VtkRecorder(tmp_path / "a & b.pvd") as recorder:
        end = record.run(scene.world, recorder, steps=12, every=4)
    assert len(recorder) == 4 and end == pytest.approx(12 / 60, rel=1e-6)
    text = (tmp_path / "a & b.pvd").read_text()
    times = [float(time) for time in re.findall(r'timestep="([^"]*)"', text)]
    assert times == pytest.approx(np.arange(4) * 4 / 60, rel=1e-6)
    assert re.findall(r'file="([^"]*)"', text)[-1] == "a &amp; b_00003.vtu"
    frames = sorted(tmp_path.glob("*.vtu"))
    assert [frame.name for frame in frames] == [f"a & b_{k:05}.vtu" for k in range(4)]
    assert b"von_mises" in frames[-1].read_bytes()
    # What was written can be read: the mesh of where the cube was at the end.
    again = f.DeformableBody.file(frames[-1])
    again = scene.world.deformable_bodies[scene.world.add_deformable(again)]
    lowest = scene.world.deformable_bodies[cube].positions[:, 1].min()
    assert again.positions[:, 1].min() == pytest.approx(lowest, abs=1e-6)


def test_what_cannot_be_written_is_told(tmp_path):
    with pytest.raises(f.DeformableBodyError, match="nowhere"):
        Scene().world.write_vtu(tmp_path / "nowhere" / "x.vtu")


def stub(calls):
    """What of rerun's is called."""
    module = types.ModuleType("rerun")
    for name in ("Mesh3D", "Transform3D", "Quaternion", "LineStrips3D", "Arrows3D"):
        setattr(module, name, lambda *rest, _name=name, **told: (_name, rest, told))
    for name in ("init", "save", "log", "set_time"):
        setattr(module, name, lambda *rest, _name=name, **told: calls.append((_name, rest, told)))
    return module


def test_rerun_gets_meshes_frames_cables_and_contacts(monkeypatch, tmp_path):
    calls = []
    monkeypatch.setitem(sys.modules, "rerun", stub(calls))
    scene = Scene()
    cube = scene.cube()
    cable = scene.world.add_cable([f.CablePoint.vertex(cube, 0), f.CablePoint.world((0, 1, 0))], tension=0.0)
    recorder = record.RerunRecorder(path=tmp_path / "x.rrd", stress=1e4, names={cube: "cube"})
    record.run(scene.world, recorder, steps=60, every=60)
    assert calls[0] == ("init", ("foible3d",), {"spawn": False}) and calls[1][0] == "save" and len(recorder) == 2
    last = {rest[0]: rest[1] for name, rest, _ in calls if name == "log"}
    assert set(last) == {"deformable/cube", "rigid/0.0", f"cable/{cable.id}", "contacts"}
    body = scene.world.deformable_bodies[cube]
    mesh = last["deformable/cube"][2]
    assert (mesh["vertex_positions"] == body.positions).all() and mesh["vertex_colors"].dtype == np.uint8
    arrows = last["contacts"][2]
    # 1 cm per newton.
    assert arrows["vectors"].sum(axis=0)[1] == pytest.approx(0.01 * body.mass * 9.81, rel=1e-3)
    times = [told["duration"] for name, _, told in calls if name == "set_time"]
    assert times == pytest.approx([0.0, 1.0], rel=1e-6)


def test_colours_go_from_blue_to_red():
    scene = Scene()
    body = scene.world.deformable_bodies[scene.cube()]
    assert (record.colours(body, 1e9) == (0, 0, 255)).all()
    scene.world.step(60)
    assert (record.colours(body, 1e-9) == (255, 0, 0)).all()


def test_without_rerun_it_is_told_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(ImportError, match="pip install rerun-sdk"):
        record.RerunRecorder()
