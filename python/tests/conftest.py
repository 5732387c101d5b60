"""Scenes that several tests begin from."""

import numpy as np
import pytest

import foible3d as f


def pytest_addoption(parser):
    parser.addoption("--runslow", action="store_true", help="run tests that take a minute")


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--runslow"):
        for item in items:
            if "slow" in item.keywords:
                item.add_marker(pytest.mark.skip(reason="takes a minute: --runslow"))


class Scene:
    """A world with a floor whose top is at y = 0."""

    def __init__(self, **options):
        self.world = f.World(**options)
        floor = f.RigidBody.fixed(translation=(0, -0.1, 0))
        self.floor_body = self.world.add_body(floor, [f.Collider.cuboid(2, 0.1, 2, friction=0.8)])
        (self.floor,) = self.world.rigid_bodies[self.floor_body].colliders

    def cube(self, height=0.1, **options):
        """A soft cube of 20 cm."""
        material = f.Material(1e5, 0.3, mass_damping=5.0)
        options = {"material": material, "translation": (0, height, 0), **options}
        return self.world.add_deformable(f.DeformableBody.cuboid((0.1, 0.1, 0.1), (3, 3, 3), **options))


@pytest.fixture
def scene():
    return Scene()


def gripper(squeeze=20.0):
    """Two soft pads on sliding fingers that hang on a hand led by positions, and a box between them."""
    world = Scene().world
    hand = world.add_body(f.RigidBody.kinematic_position_based(translation=(0, 0.3, 0)))
    box = world.add_body(
        f.RigidBody.dynamic(translation=(0, 0.05, 0), can_sleep=False),
        [f.Collider.cuboid(0.05, 0.05, 0.05, density=500.0, friction=0.8)],
    )
    rubber = f.Material(2e5, 0.4, density=1100.0, friction=0.8, mass_damping=5.0)
    fingers = []
    for side in (-1.0, 1.0):
        finger = world.add_body(
            f.RigidBody.dynamic(translation=(0.09 * side, 0.05, 0), can_sleep=False),
            [f.Collider.cuboid(0.01, 0.03, 0.03, density=1000.0)],
        )
        # Along its axis the finger comes nearer to the box.
        slide = f.PrismaticJoint.builder((-side, 0, 0), local_anchor1=(0.09 * side, -0.25, 0))
        slide = slide.motor_model(f.MotorModel.FORCE_BASED)
        slide = slide.motor(0.1, 0.0, 1000.0, 50.0).motor_max_force(squeeze)
        joint = world.impulse_joints.insert(hand, finger, slide)
        pad = f.DeformableBody.cuboid((0.01, 0.02, 0.02), (2, 3, 3), material=rubber, can_sleep=False)
        pad = world.add_deformable(pad.translation((0.07 * side, 0.05, 0)))
        x = world.deformable_bodies[pad].positions
        held = np.flatnonzero(np.abs(x[:, 0]) > 0.0799)
        fingers.append((joint, pad, world.attach(pad, held, finger)))
    return world, hand, box, fingers


def bits(world):
    """All that moves, to the last bit."""
    soft = [np.vstack([body.positions, body.velocities]) for _, body in world.deformable_bodies]
    rigid = [np.concatenate([*body.position, body.linvel, body.angvel]) for _, body in world.rigid_bodies]
    return [part.tobytes() for part in soft + rigid]
