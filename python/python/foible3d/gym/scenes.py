"""Descriptions of the scenes of the tasks."""

import math

_TENDONS = {"east": (1, 0), "north": (0, 1), "west": (-1, 0), "south": (0, -1)}


def _tendon(x, z, offset=0.012):
    """From the tip to the base, beside the axis."""
    heights = [-0.1199, -0.1, -0.08, -0.06, -0.04, -0.02, -0.0001]
    return [["inside", "finger", [offset * x, y, offset * z]] for y in heights]


REACH = {
    "world": {"dt": 1 / 120},
    "material": {"rubber": {"youngs_modulus": 5e5, "poisson_ratio": 0.4, "mass_damping": 20.0}},
    "deformable": {
        "finger": {
            "shape": "cuboid",
            "args": [[0.015, 0.06, 0.015], [2, 10, 2]],
            "material": "rubber",
            "translation": [0, -0.06, 0],
            "can_sleep": False,
            "pinned": {"y": [-1e-4, 1e-4]},
        }
    },
    "cable": {name: {"points": _tendon(*side), "length": 0.12} for name, side in _TENDONS.items()},
    "point": {"tip": {"body": "finger", "at": [0, -0.12, 0]}},
    "signal": {
        name: {"drives": "cable_length", "of": name, "range": [0.11, 0.13], "rate": 0.05, "start": 0.12}
        for name in _TENDONS
    },
    "env": {
        "actions": list(_TENDONS),
        "observe": {
            "position:tip": 10.0,
            "velocity:tip": 1.0,
            **{f"tension:{name}": 0.05 for name in _TENDONS},
            **{f"signal:{name}": 1.0 for name in _TENDONS},
            "goal": 10.0,
        },
        "steps_per_action": 8,
        "max_episode_steps": 60,
    },
}


def _finger(side, name):
    """A finger that slides on the hand, with a soft pad on it; ``side`` is 1 on the right."""
    quarter = math.sqrt(0.5)
    return {
        "rigid": {
            f"{name} finger": {
                "type": "dynamic",
                "translation": [0.09 * side, 0.05, 0],
                "can_sleep": False,
                "colliders": [{"shape": "cuboid", "size": [0.01, 0.03, 0.03], "density": 1000.0}],
            }
        },
        "deformable": {
            f"{name} pad": {
                "shape": "cuboid",
                "args": [[0.01, 0.02, 0.02], [2, 3, 3]],
                "material": "silicone",
                "translation": [0.07 * side, 0.05, 0],
                "can_sleep": False,
            }
        },
        "attach": {
            f"{name} mount": {
                "body": f"{name} pad",
                "to": f"{name} finger",
                "where": {"x": [0.0799, 0.0801] if side > 0 else [-0.0801, -0.0799]},
            }
        },
        "joint": {
            f"{name} slide": {
                "type": "prismatic",
                # Along its axis the finger comes nearer to the box.
                "axis": [-side, 0, 0],
                "bodies": ["hand", f"{name} finger"],
                "local_anchor1": [0.09 * side, -0.25, 0],
                "motor_model": "FORCE_BASED",
                "motor": [0.0, 0.0, 1000.0, 50.0],
            }
        },
        "pad": {
            name: {
                "body": f"{name} pad",
                # z of the frame points to the box.
                "frame": [[-0.01 * side, 0, 0], [0, -quarter * side, 0, quarter]],
                "half_extents": [0.02, 0.02],
                "taxels": [3, 3],
            }
        },
        "signal": {
            f"{name} grip": {
                "drives": "joint_position",
                "of": f"{name} slide",
                "axis": "LIN_X",
                "stiffness": 1000.0,
                "damping": 50.0,
                "range": [0.0, 0.04],
                "rate": 0.03,
            }
        },
    }


def _gripper():
    """A hand on a vertical slide, with two fingers and a box between them on a floor."""
    scene = {
        "material": {
            "silicone": {
                "youngs_modulus": 2e5,
                "poisson_ratio": 0.4,
                "density": 1100.0,
                "friction": 0.8,
                "mass_damping": 5.0,
            }
        },
        "rigid": {
            "floor": {
                "type": "fixed",
                "translation": [0, -0.1, 0],
                "colliders": [{"shape": "cuboid", "size": [1, 0.1, 1], "friction": 0.8}],
            },
            "mast": {"type": "fixed", "translation": [0, 0.3, 0]},
            "hand": {
                "type": "dynamic",
                "translation": [0, 0.3, 0],
                "additional_mass": 2.0,
                "can_sleep": False,
                "enabled_rotations": [False, False, False],
            },
            "box": {
                "type": "dynamic",
                "translation": [0, 0.05, 0],
                "can_sleep": False,
                "colliders": [{"shape": "cuboid", "size": [0.05, 0.05, 0.05], "density": 500.0, "friction": 0.8}],
            },
        },
        "joint": {
            "lift": {
                "type": "prismatic",
                "axis": [0, 1, 0],
                "bodies": ["mast", "hand"],
                "motor_model": "FORCE_BASED",
                "motor": [0.0, 0.0, 2e4, 1e3],
            }
        },
        "signal": {
            "lift": {
                "drives": "joint_position",
                "of": "lift",
                "axis": "LIN_X",
                "stiffness": 2e4,
                "damping": 1e3,
                "range": [0.0, 0.12],
                "rate": 0.2,
            }
        },
    }
    for side, name in ((1, "right"), (-1, "left")):
        for kind, things in _finger(side, name).items():
            scene.setdefault(kind, {}).update(things)
    return scene


LIFT = {
    **_gripper(),
    "env": {
        "actions": ["lift", "left grip", "right grip"],
        "observe": {
            "position:box": 10.0,
            "velocity:box": 1.0,
            "position:hand": 10.0,
            "pressure:left": 1e-4,
            "pressure:right": 1e-4,
            "signal:lift": 1.0,
            "signal:left grip": 1.0,
            "signal:right grip": 1.0,
            "goal": 10.0,
        },
        "steps_per_action": 4,
        "max_episode_steps": 40,
    },
}

HOLD = {
    **_gripper(),
    "settle": [
        {"steps": 90, "commands": {"left grip": 0.03, "right grip": 0.03}},
        {"steps": 60, "commands": {"lift": 0.1}},
    ],
    "env": {
        "actions": ["left grip", "right grip"],
        "observe": {
            "position:box": 10.0,
            "velocity:box": 1.0,
            "rotation:box": 1.0,
            "force:left": 0.1,
            "force:right": 0.1,
            "signal:left grip": 1.0,
            "signal:right grip": 1.0,
            "goal": 10.0,
        },
        "steps_per_action": 2,
        "max_episode_steps": 100,
    },
}
