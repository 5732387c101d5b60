"""Recordings: what is written is what was."""

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import types
import zlib

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


def decoded(page):
    """The frames of a page, read by the description of its bytes alone: header, positions of the soft vertices, poses, contacts."""
    text = re.search(r'id="replay-data" type="text/plain">([^<]*)<', page).group(1)
    data = zlib.decompress(base64.b64decode(text))
    size = int.from_bytes(data[:4], "little")
    head, at = json.loads(data[4 : 4 + size]), 4 + size

    def take(kind, *shape):
        nonlocal at
        got = np.frombuffer(data, kind, int(np.prod(shape)), at).reshape(shape)
        at += got.nbytes
        return got

    frames = len(head["times"])
    rigid = [mesh for mesh in head["meshes"] if not mesh["soft"]]
    points = sum(mesh["vertices"] for mesh in head["meshes"] if mesh["soft"])
    triangles = [take("<u4", mesh["triangles"], 3) for mesh in head["meshes"]]
    shapes = [take("<f4", mesh["vertices"], 3) for mesh in rigid]
    poses = take("<f4", frames, len(rigid), 7)
    counts = take("<u4", frames)
    contacts = take("<f4", counts.sum(), 6)
    steps = np.cumsum(take("<u2", 3, frames, points), axis=1, dtype=np.uint16)
    stress = np.cumsum(take("u1", frames, points), axis=0, dtype=np.uint8)
    assert at == len(data)
    least, largest = np.array(head["least"]), np.array(head["largest"])
    quantum = (largest - least) / 65535
    positions = least + np.moveaxis(steps, 0, -1) * quantum
    return head, positions, quantum, poses, np.split(contacts, np.cumsum(counts)[:-1]), triangles, shapes, stress


def test_a_page_holds_what_was_to_half_a_step_of_its_numbers(tmp_path):
    scene = Scene()
    cube = scene.cube(height=0.15)
    crate = f.RigidBody.dynamic(translation=(0, 0.5, 0))
    crate = scene.world.add_body(crate, [f.Collider.ball(0.05, density=500.0, translation=(0.01, 0, 0))])
    scene.world.add_body(f.RigidBody.fixed(), [f.Collider.cuboid(1, 1, 1, sensor=True)])
    seen = []

    class Seen:
        def push(self, world, time):
            body = world.deformable_bodies[cube]
            translation, rotation = world.rigid_bodies[crate].position
            force = world.contacts()["force"].sum(axis=0)
            seen.append((time, body.positions, translation, rotation, force, body.von_mises().max()))

    with record.HtmlReplay(tmp_path / "fall.html", title="a < b", names={cube: "cube", crate: "ball"}) as replay:
        record.run(scene.world, replay, Seen(), steps=60, every=3)
    assert len(replay) == 21
    page = (tmp_path / "fall.html").read_text()
    assert "<title>a &lt; b</title>" in page
    # Nothing is fetched from elsewhere.
    assert "http://" not in page and "https://" not in page
    head, positions, quantum, poses, contacts, triangles, shapes, stress = decoded(page)
    assert [mesh["name"] for mesh in head["meshes"]] == ["cube", "rigid", "ball"] and head["up"] == "y"
    body = scene.world.deformable_bodies[cube]
    surface = np.unique(body.triangles)
    assert (surface[triangles[0]] == body.triangles).all()
    assert np.linalg.norm(shapes[1], axis=1) == pytest.approx(0.05, rel=1e-5)
    largest = max(frame[5] for frame in seen)
    # Von Mises' stress is convex: that of a vertex, of its tetrahedra's mean stress, is no larger than theirs.
    assert 0.0 < head["stress"] <= largest * 1.0001 and stress.max() == 255
    for k, (time, x, translation, rotation, force, _) in enumerate(seen):
        assert head["times"][k] == time
        # Half a step, and the rounding of rapier's single precision.
        assert (abs(positions[k] - x[surface]) <= 0.5 * quantum + 1e-7).all()
        # The collider is on its body, a centimetre off along its axis.
        i, j, n, w = rotation
        axis = np.array([1 - 2 * (j * j + n * n), 2 * (i * j + w * n), 2 * (i * n - w * j)])
        assert poses[k, 1, :3] == pytest.approx(translation + 0.01 * axis, abs=1e-6)
        assert contacts[k][:, 3:].sum(axis=0) == pytest.approx(force, abs=1e-3)
    # No larger than its numbers and the player are.
    numbers = 7 * 21 * len(surface) + 28 * 42 + 24 * sum(map(len, contacts)) + 12 * sum(map(len, triangles + shapes))
    assert len(page) < 25_000 + 4 / 3 * (numbers + 4_000)


def test_what_comes_and_goes_is_in_its_frames_only(tmp_path):
    scene = Scene(gravity=(0, 0, -9.81))
    first = scene.cube(height=0.3)
    replay = record.HtmlReplay(tmp_path / "x.html", names={first: "first"})
    replay.push(scene.world, 0.0)
    was = scene.world.deformable_bodies[first].positions
    scene.world.remove_deformable(first)
    second = scene.cube(height=0.7)
    ball = scene.world.add_body(f.RigidBody.dynamic(translation=(1, 0, 0)), [f.Collider.ball(0.1)])
    replay.push(scene.world, 0.5)
    scene.world.remove_body(ball)
    scene.world.step()
    replay.push(scene.world, 1.0)
    replay.close()
    head, positions, quantum, poses, *_ = decoded((tmp_path / "x.html").read_text())
    assert head["up"] == "z"
    spans = {(mesh["soft"], mesh["first"], mesh["end"]) for mesh in head["meshes"]}
    assert spans == {(True, 0, 1), (True, 1, 3), (False, 0, 3), (False, 1, 2)}
    surface = np.unique(scene.world.deformable_bodies[second].triangles)
    assert (abs(positions[:, : len(surface)] - was[surface]) <= 0.5 * quantum + 1e-7).all()
    assert (poses[:, 1, 0] == 1.0).all()
    now = scene.world.deformable_bodies[second].positions[surface]
    assert (abs(positions[2, len(surface) :] - now) <= 0.5 * quantum + 1e-7).all()


def test_replays_that_make_no_sense_are_refused(tmp_path):
    scene = Scene()
    with pytest.raises(f.DeformableBodyError, match='up is "x", but must be "y" or "z"'):
        record.HtmlReplay(tmp_path / "x.html", up="x")
    with pytest.raises(OSError, match="nowhere"):
        record.HtmlReplay(tmp_path / "nowhere" / "x.html")
    replay = record.HtmlReplay(tmp_path / "x.html")
    with pytest.raises(f.DeformableBodyError, match="without frames"):
        replay.close()
    replay.push(scene.world, 1.0)
    for time in (1.0, 0.5, float("nan"), float("inf")):
        with pytest.raises(f.DeformableBodyError, match=f"time is {'NaN' if time != time else time}"):
            replay.push(scene.world, time)
    assert len(replay) == 1
    # An error on the way leaves what was seen before it.
    with pytest.raises(RuntimeError):
        with record.HtmlReplay(tmp_path / "y.html") as replay:
            replay.push(scene.world, 0.0)
            raise RuntimeError
    assert len(decoded((tmp_path / "y.html").read_text())[0]["times"]) == 1


@pytest.mark.slow
def test_a_browser_draws_the_page(tmp_path):
    browser = os.environ.get("FOIBLE_BROWSER") or shutil.which("chromium")
    if browser is None:
        pytest.skip("no Chromium: set FOIBLE_BROWSER")
    scene = Scene()
    scene.cube(height=0.15)
    crate = f.RigidBody.dynamic(translation=(0.02, 0.35, 0))
    scene.world.add_body(crate, [f.Collider.convex_hull(np.random.default_rng(0).normal(0, 0.05, (20, 3)), density=500.0)])
    with record.HtmlReplay(tmp_path / "fall.html") as replay:
        record.run(scene.world, replay, steps=60)
    options = ["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    options += ["--hide-scrollbars", "--window-size=1000,760", "--enable-logging=stderr", "--virtual-time-budget=8000"]
    page = f"file://{tmp_path}/fall.html#t=0.8"
    found = subprocess.run([browser, *options, "--dump-dom", page], capture_output=True, text=True, check=True, timeout=120)
    assert 'data-replay="ready"' in found.stdout and "CONSOLE" not in found.stderr, found.stderr
    picture = tmp_path / "page.png"
    subprocess.run([browser, *options, f"--screenshot={picture}", page], capture_output=True, check=True, timeout=120)
    # A page of one colour packs to next to nothing.
    assert picture.stat().st_size > 20_000
    print(picture)
