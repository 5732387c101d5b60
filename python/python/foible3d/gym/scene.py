"""Worlds from descriptions: dicts of plain values, or TOML files of the same.

Every table but ``world`` and ``env`` names things, each a table of its own:

===============  ====================================================================================================
``world``        ``gravity`` [m/s²], ``dt`` [s]
``material``     the arguments of `foible3d.Material`
``rigid``        ``type`` and options of `foible3d.RigidBody`; ``colliders``, a list of ``shape``, ``size`` and options
``deformable``   ``shape`` and ``args`` of `foible3d.DeformableBody`, and options; ``pinned``, a region
``attach``       a region ``where`` of the vertices of ``body`` that are attached ``to`` a rigid body, or the world
``joint``        ``type`` (with ``axis``) and ``bodies``, and options of the joint's builder
``cable``        ``points``, as ``["inside", body, [x, y, z]]``, ``["world", [x, y, z]]``, ...; options of ``add_cable``
``point``        the vertex of ``body`` nearest to a place ``at`` in the world [m], for observations
``pad``          a `foible3d.TactilePad` on ``body``: ``frame``, ``half_extents``, ``taxels``
``signal``       ``drives`` (a kind of `foible3d.Actuator`) and ``of`` what, ``range``, ``rate``, ``start``; of joints also
                 ``axis``, ``stiffness`` and ``damping``
``settle``       a list of phases before an episode begins: ``steps``, and ``commands`` to signals
``env``          ``actions``, ``observe``, ``steps_per_action``, ``max_episode_steps``; see `foible3d.gym.SoftEnv`
===============  ====================================================================================================

A region is where vertices are as the scene is made, ``{"x": [least, largest], ...}`` [m].
"""

import math

import numpy as np

import foible3d as f

# Options whose values are names in a description.
CHOICES = {
    "axis": f.JointAxis,
    "motor_model": f.MotorModel,
    "friction_combine_rule": f.CoefficientCombineRule,
    "restitution_combine_rule": f.CoefficientCombineRule,
    "elasticity": f.Elasticity,
    "integrator": f.Integrator,
    "fidelity": f.Fidelity,
}


def load(path):
    """Reads a description from a TOML file; wants Python 3.11, or the package ``tomli``."""
    try:
        import tomllib
    except ImportError:
        import tomli as tomllib
    with open(path, "rb") as file:
        return tomllib.load(file)


class Scene:
    """A world, and what its description named: handles in ``bodies``, ``joints``, ``cables``; ``points`` (body and vertex) and
    ``pads`` (body and pad)."""

    def __init__(self, description):
        self.world = f.World(**description.get("world", {}))
        self.bodies, self.joints, self.cables, self.points, self.pads = {}, {}, {}, {}, {}
        materials = {
            name: f.Material(**options(table)) for name, table in description.get("material", {}).items()
        }
        makers = [
            ("rigid", self._rigid),
            ("deformable", lambda name, table: self._deformable(name, table, materials)),
            ("attach", self._attach),
            ("joint", self._joint),
            ("cable", self._cable),
            ("point", self._point),
            ("pad", self._pad),
            ("signal", self._signal),
        ]
        known = {kind for kind, _ in makers} | {"world", "material", "settle", "env"}
        for kind in description:
            if kind not in known:
                raise ValueError(f"a scene has no table '{kind}'")
        for kind, make in makers:
            for name, table in description.get(kind, {}).items():
                try:
                    make(name, dict(table))
                except KeyError as error:
                    raise ValueError(f"{kind} '{name}': {error} is missing or not known") from error
        for phase in description.get("settle", []):
            for name, value in phase.get("commands", {}).items():
                self.world.actuators.command(name, value)
            self.world.step(phase["steps"])

    def _rigid(self, name, table):
        colliders = []
        for collider in table.pop("colliders", []):
            collider = dict(collider)
            shape = getattr(f.Collider, collider.pop("shape"))
            colliders.append(shape(*listed(collider.pop("size")), **options(collider)))
        make = getattr(f.RigidBody, table.pop("type"))
        self.bodies[name] = self.world.add_body(make(**options(table)), colliders)

    def _deformable(self, name, table, materials):
        material, pinned = materials[table.pop("material")], table.pop("pinned", None)
        make = getattr(f.DeformableBody, table.pop("shape"))
        handle = self.world.add_deformable(make(*table.pop("args"), material=material, **options(table)))
        self.bodies[name] = handle
        if pinned is not None:
            self.world.deformable_bodies[handle].pin(self._where(handle, pinned))

    def _attach(self, _, table):
        body, to = self.bodies[table.pop("body")], table.pop("to", None)
        vertices = self._where(body, table.pop("where"))
        self.world.attach(body, vertices, self.bodies[to] if to else None, **options(table))

    def _joint(self, name, table):
        kind = {"prismatic": f.PrismaticJoint, "revolute": f.RevoluteJoint}.get(table["type"])
        kind = kind or {"fixed": f.FixedJoint, "spherical": f.SphericalJoint}[table["type"]]
        axis = [table.pop("axis")] if "axis" in table else []
        first, second = (self.bodies[body] for body in table.pop("bodies"))
        del table["type"]
        builder = kind.builder(*axis, **options(table))
        self.joints[name] = self.world.impulse_joints.insert(first, second, builder)

    def _cable(self, name, table):
        points = [self._cable_point(*point) for point in table.pop("points")]
        self.cables[name] = self.world.add_cable(points, **options(table))

    def _cable_point(self, kind, *where):
        if kind == "world":
            return f.CablePoint.world(*where)
        return getattr(f.CablePoint, kind)(self.bodies[where[0]], where[1])

    def _point(self, name, table):
        handle = self.bodies[table["body"]]
        off = self.world.deformable_bodies[handle].positions - np.asarray(table["at"], float)
        self.points[name] = (handle, int((off**2).sum(axis=1).argmin()))

    def _pad(self, name, table):
        handle = self.bodies[table["body"]]
        frame = tuple(tuple(part) for part in table["frame"])
        body = self.world.deformable_bodies[handle]
        self.pads[name] = (handle, f.TactilePad(body, frame, tuple(table["half_extents"]), tuple(table["taxels"])))

    def _signal(self, name, table):
        kind, of = table["drives"], table["of"]
        make = getattr(f.Actuator, kind)
        if kind.startswith("joint"):
            axis = getattr(f.JointAxis, table["axis"])
            motor = f.JointMotorAxis(axis, table.get("stiffness", 0.0), table.get("damping", 0.0))
            actuator = make(self.joints[of], motor)
        elif kind.startswith("cable"):
            actuator = make(self.cables[of])
        else:
            actuator = make(self.bodies[of])
        extent = tuple(table["range"])
        self.world.actuators.insert(name, actuator, extent, table.get("rate", math.inf), table.get("start"))

    def _where(self, handle, region):
        x = self.world.deformable_bodies[handle].positions
        within = np.ones(len(x), bool)
        for axis, (least, largest) in region.items():
            along = x[:, "xyz".index(axis)]
            within &= (along >= least) & (along <= largest)
        return within


def listed(value):
    """The arguments of a shape: one or several."""
    return value if isinstance(value, (list, tuple)) else [value]


def options(table):
    """Keyword arguments of a description's values: tuples for lists, choices for their names."""
    told = {}
    for name, value in table.items():
        if name in CHOICES and isinstance(value, str):
            value = getattr(CHOICES[name], value)
        told[name] = tuple(value) if isinstance(value, list) else value
    return told
