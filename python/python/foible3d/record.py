"""Recordings of runs: files for ParaView, pages with a player in 3D, and the viewer of rerun.

::

    with foible3d.record.VtkRecorder("fall.pvd") as recorder:
        foible3d.record.run(world, recorder, steps=120, every=4)
"""

import os
from xml.sax.saxutils import quoteattr

import numpy as np

from ._native import _Replay

__all__ = ["HtmlReplay", "RerunRecorder", "VtkRecorder", "run"]


def run(world, *recorders, steps, every=1, time=0.0):
    """Steps a world, which is at ``time`` [s], and has recorders take it at the start and after ``every`` steps. Returns the time at
    the end [s]."""
    for recorder in recorders:
        recorder.push(world, time)
    for step in range(1, steps + 1):
        world.step()
        time += world.dt
        if step % every == 0:
            for recorder in recorders:
                recorder.push(world, time)
    return time


class VtkRecorder:
    """A ``.pvd`` file with the times of ``.vtu`` files beside it, as ParaView plays them. Those have what `World.write_vtu` tells: stresses,
    strains, velocities and tractions of the deformable bodies."""

    def __init__(self, path):
        self.path = os.fspath(path)
        self._frames = []
        self._write()

    def push(self, world, time):
        """Adds a frame at a time [s]: writes ``NAME_00000.vtu`` and so on, then the list again, which is whole at any time."""
        folder, name = os.path.split(self.path)
        name = f"{os.path.splitext(name)[0]}_{len(self._frames):05}.vtu"
        world.write_vtu(os.path.join(folder, name))
        self._frames.append((float(time), name))
        self._write()

    def _write(self):
        lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">']
        lines += ["  <Collection>"]
        for time, name in self._frames:
            lines.append(f'    <DataSet timestep="{time}" part="0" file={quoteattr(name)}/>')
        lines += ["  </Collection>", "</VTKFile>", ""]
        with open(self.path, "w", encoding="utf-8") as file:
            file.write("\n".join(lines))

    def __len__(self):
        return len(self._frames)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


class HtmlReplay:
    """A page with a player in 3D, whole in one file that needs no network: surfaces of the deformable bodies coloured by their stress, rigid
    colliders, and contact forces, over time. Written by ``close``, or at the end of ``with``.

    A frame takes 7 bytes of a vertex of the surface and 24 of a contact before it is compressed, in memory 16 and 24. Positions are kept
    in 65535 steps of the space that all deformable bodies go through. ``up`` is "y" or "z", that of gravity if it is not told; ``names`` is a
    table from handles of bodies and colliders. Colliders keep the shape that they are first seen with. Sensors, joints and cables are not drawn.
    """

    def __init__(self, path, title=None, up=None, names=None):
        self.path = os.fspath(path)
        self._title = title if title is not None else os.path.splitext(os.path.basename(self.path))[0]
        self._replay = _Replay(up=up, names=names)
        # What cannot be written is told before the run.
        with open(self.path, "w", encoding="utf-8"):
            pass

    def push(self, world, time):
        """Adds a frame at a time [s], later than that of the last."""
        self._replay.push(world, time)

    def close(self):
        """Writes the page of the frames so far; ValueError without any."""
        page = self._replay.page(self._title)
        with open(self.path, "w", encoding="utf-8") as file:
            file.write(page)

    def __len__(self):
        return len(self._replay)

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        # What was seen before an error is worth looking at.
        if kind is None or len(self):
            self.close()


class RerunRecorder:
    """Sends frames to rerun: its viewer, or a ``.rrd`` file at ``path``; wants ``pip install rerun-sdk``.

    Deformable bodies are meshes, coloured from blue to red by the von Mises stress if that is told as ``stress`` [Pa], rigid bodies
    are frames, cables lines, and contacts arrows of 1 cm per N times ``force_scale``. Those of a name are called so, ``names`` being a
    table from handles.
    """

    def __init__(self, name="foible3d", path=None, stress=None, force_scale=1.0, names=None):
        try:
            import rerun
        except ImportError as error:
            raise ImportError("RerunRecorder wants rerun: pip install rerun-sdk") from error
        self._rerun, self._stress, self._scale, self._names = rerun, stress, 0.01 * force_scale, names or {}
        self._count = 0
        rerun.init(name, spawn=path is None)
        if path is not None:
            rerun.save(os.fspath(path))

    def push(self, world, time):
        """Adds a frame at a time [s]."""
        rerun = self._rerun
        if hasattr(rerun, "set_time"):
            rerun.set_time("time", duration=float(time))
        else:
            rerun.set_time_seconds("time", float(time))
        for handle, body in world.deformable_bodies:
            rerun.log(self._path("deformable", handle), self._mesh(body))
        for handle, body in world.rigid_bodies:
            translation, rotation = body.position
            placed = rerun.Transform3D(translation=translation, quaternion=rerun.Quaternion(xyzw=rotation))
            rerun.log(self._path("rigid", handle), placed)
        for handle, cable in world.cables:
            rerun.log(self._path("cable", handle), rerun.LineStrips3D([cable.points]))
        contacts = world.contacts()
        rerun.log("contacts", rerun.Arrows3D(origins=contacts["point"], vectors=self._scale * contacts["force"]))
        self._count += 1

    def _path(self, kind, handle):
        number = handle.id if hasattr(handle, "id") else f"{handle.index}.{handle.generation}"
        return f"{kind}/{self._names.get(handle, number)}"

    def _mesh(self, body):
        told = {"vertex_positions": body.positions, "triangle_indices": body.triangles}
        told["vertex_normals"] = body.normals
        if self._stress is not None:
            told["vertex_colors"] = colours(body, self._stress)
        return self._rerun.Mesh3D(**told)

    def __len__(self):
        return self._count

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


def colours(body, stress):
    """Colours of the vertices, an array of shape (n, 3) of bytes: from blue without to red at a von Mises stress [Pa]; those of a vertex are
    the mean of its tetrahedra, and blue where it has none."""
    count, tetrahedra = body.vertex_count, body.tetrahedra
    summed, shares = np.zeros(count), np.zeros(count)
    if len(tetrahedra):
        np.add.at(summed, tetrahedra, body.von_mises()[:, None])
        np.add.at(shares, tetrahedra, 1.0)
    part = np.clip(summed / np.maximum(shares, 1.0) / stress, 0.0, 1.0)
    return (255 * np.stack([part, np.zeros(count), 1.0 - part], axis=1)).astype(np.uint8)
