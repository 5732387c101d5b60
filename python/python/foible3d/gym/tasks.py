"""The tasks that are registered."""

import numpy as np

from .env import SoftEnv
from .scenes import HOLD, LIFT, REACH


class Reach(SoftEnv):
    """``foible3d/Reach-v0``: a soft finger of 12 cm that hangs from its base is drawn by four tendons on winches until its tip is at a goal.

    The goal is where the tip of an inextensible finger that is bent to an arc would be. The reward is minus the distance [dm], and 1 more
    within 5 mm.
    """

    description = REACH
    length, largest_bend = 0.12, 0.3

    def sample_goal(self):
        """The end of an arc, bent by up to 0.3 rad in any direction."""
        bend = self.largest_bend * np.sqrt(self.np_random.uniform(0.05, 1.0))
        turn = self.np_random.uniform(-np.pi, np.pi)
        aside = self.length * (1.0 - np.cos(bend)) / bend
        return [aside * np.cos(turn), -self.length * np.sin(bend) / bend, aside * np.sin(turn)]

    def distance(self):
        """From the tip to the goal [m]."""
        return float(np.linalg.norm(self.position("tip") - self.goal))

    def reward(self, action):
        """See the class."""
        return -10.0 * self.distance() + float(self.is_success())

    def is_success(self):
        """The tip is within 5 mm of the goal."""
        return self.distance() < 0.005


class Lift(SoftEnv):
    """``foible3d/Lift-v0``: two soft pads on motors close on a box of half a kilogram, and lift it by 10 cm.

    The box is up to 1 cm off its place, and weighs up to a fifth more or less. The reward is the height of the box over that of the goal,
    and a tenth while both pads carry a force.
    """

    description = LIFT
    height = 0.1

    def sample_goal(self):
        """10 cm above where the box stands."""
        return [0.0, 0.05 + self.height, 0.0]

    def randomise(self):
        """Moves the box along the fingers, and changes what it weighs."""
        box = self.body("box")
        box.translation = (self.np_random.uniform(-0.01, 0.01), 0.05, 0.0)
        (collider,) = box.colliders
        self.world.colliders[collider].density = 500.0 * self.np_random.uniform(0.8, 1.2)

    def lifted(self):
        """Height of the box over that of the goal [–]."""
        return (self.position("box")[1] - 0.05) / self.height

    def reward(self, action):
        """See the class."""
        is_held = all(self.touch(pad).total[2] < -0.5 for pad in ("left", "right"))
        return float(np.clip(self.lifted(), 0.0, 1.0)) + 0.1 * is_held

    def is_success(self):
        """The box is within a fifth of its goal."""
        return bool(self.lifted() > 0.8)


class Hold(SoftEnv):
    """``foible3d/Hold-v0``: two soft pads hold a box in the air that is pushed about; pressing costs.

    In every step of the environment the box gets an impulse of 30 mN s, normally distributed, along each axis. The reward is 1, less what
    the box is away from its goal [cm] and a tenth of what the pads press with [10 N]; when it has fallen by 5 cm, the episode is over.
    """

    description = HOLD
    impulse = 0.03

    def sample_goal(self):
        """Where the box is held as the episode begins."""
        return self.position("box")

    def disturb(self):
        """Pushes the box."""
        self.body("box").apply_impulse(self.np_random.normal(0.0, self.impulse, 3))

    def off(self):
        """How far the box is from its goal [m]."""
        return float(np.linalg.norm(self.position("box") - self.goal))

    def reward(self, action):
        """See the class."""
        pressed = sum(max(-self.touch(pad).total[2], 0.0) for pad in ("left", "right"))
        return 1.0 - 100.0 * self.off() - 0.01 * pressed

    def is_success(self):
        """The box is within 5 mm of its goal."""
        return self.off() < 0.01

    def is_failure(self):
        """The box has fallen by 5 cm."""
        return bool(self.goal[1] - self.position("box")[1] > 0.05)
