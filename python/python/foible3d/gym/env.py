"""Environments of scenes: signals are actions, what sensors and bodies tell are observations."""

import gymnasium
import numpy as np
from gymnasium import spaces

import foible3d as f

from .scene import Scene, load, options

# Beyond that observations are clipped: spaces are to be bounded.
LARGEST = 1.0e6


class SoftEnv(gymnasium.Env):
    """An environment of a scene; see `foible3d.gym.scene` for its description, a dict or the path of a TOML file.

    Its table ``env`` has

    - ``actions``: names of signals, each scaled from [-1, 1] to its range; all of them unless told,
    - ``observe``: a table from what is observed to a factor that it is multiplied by, in that order: ``position:NAME`` [m] and
      ``velocity:NAME`` [m/s] of bodies (deformable ones: of the centre of mass) and of points, ``rotation:NAME`` of rigid bodies
      (x, y, z, w), ``pressure:NAME`` [Pa] and ``force:NAME`` [N] of pads, ``tension:NAME`` [N] of cables, ``signal:NAME`` in [-1, 1], and
      ``goal`` [m],
    - ``steps_per_action``: steps of the world in each of the environment; 4 unless told,
    - ``max_episode_steps``,
    - ``render``: arguments of `foible3d.World.render` for pictures (``size``, ``center``, ``radius``, ``yaw``, ``pitch``); 480 by 360 pixels of
      all that moves as an episode begins, and half as much around it, unless told.

    With ``render_mode="rgb_array"`` ``render`` gives a picture, drawn without a window. A subclass tells ``reward`` and, if it wants to, ``sample_goal``, ``randomise``, ``disturb``, ``is_success`` and ``is_failure``.
    The same seed and actions give the same bits.
    """

    metadata = {"render_modes": ["rgb_array"]}
    description = None

    def __init__(self, description=None, render_mode=None):
        told = self.description if description is None else description
        self.description = told if isinstance(told, dict) else load(told)
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise ValueError(f"render_mode is {render_mode!r}, but must be None or 'rgb_array'")
        self.render_mode = render_mode
        self.scene = Scene(self.description)
        self._start = self.scene.world.snapshot()
        env = self.description.get("env", {})
        self.steps_per_action = int(env.get("steps_per_action", 4))
        self.max_episode_steps = env.get("max_episode_steps")
        self.actions = list(env.get("actions", self.scene.world.actuators.names()))
        self._ranges = np.array([self.scene.world.actuators[name].range for name in self.actions]).reshape(-1, 2)
        self._observed = [(*name.partition(":")[::2], factor) for name, factor in env.get("observe", {}).items()]
        self._begin()
        # Pictures a second, as fast as the world is.
        rate = round(1.0 / (self.world.dt * self.steps_per_action))
        self.metadata = {**self.metadata, "render_fps": max(rate, 1)}
        self._look = {"size": (480, 360), **options(env.get("render", {}))}
        if "center" not in self._look:
            self._look["center"], self._look["radius"] = self._extent()
        self.action_space = spaces.Box(-1.0, 1.0, (len(self.actions),), np.float32)
        self.observation_space = spaces.Box(-LARGEST, LARGEST, self.observation().shape, np.float32)

    def _begin(self):
        self.world = f.World.restore(self._start)
        self.goal = np.zeros(3)

    def _extent(self):
        """The middle of all that can move, and one and a half times the radius of the ball around it [m]."""
        world = self.world
        parts = [body.positions for _, body in world.deformable_bodies]
        parts += [np.array([body.translation]) for _, body in world.rigid_bodies if body.body_type != f.RigidBodyType.FIXED]
        points = np.concatenate(parts) if parts else np.zeros((1, 3))
        low, high = points.min(axis=0), points.max(axis=0)
        return tuple(0.5 * (low + high)), max(0.75 * float(np.linalg.norm(high - low)), 1e-3)

    # What a task is.

    def sample_goal(self):
        """Where something is to be [m]; draws from ``self.np_random``."""
        return np.zeros(3)

    def randomise(self):
        """Changes the world as an episode begins; draws from ``self.np_random``."""

    def disturb(self):
        """Acts on the world before every step of the environment; draws from ``self.np_random``."""

    def reward(self, action):
        """What the last step was worth."""
        raise NotImplementedError

    def is_success(self):
        """Whether the goal is reached; told as ``is_success`` in the info of a step."""
        return False

    def is_failure(self):
        """Whether the episode is over, as the goal cannot be reached any more."""
        return False

    # What gymnasium asks for.

    def reset(self, *, seed=None, options=None):
        """Begins an episode: the observation, and an info."""
        super().reset(seed=seed)
        self._begin()
        self.goal = np.asarray(self.sample_goal(), float)
        self.randomise()
        return self.observation(), self.info()

    def step(self, action):
        """Asks the signals for an action and steps the world: observation, reward, is it over, is it cut short, info."""
        self.command(action)
        self.world.step(self.steps_per_action)
        return self.result(action)

    def render(self):
        """A picture of now, an array of shape (height, width, 3) of bytes; None without ``render_mode="rgb_array"``."""
        return self.world.render(**self._look) if self.render_mode == "rgb_array" else None

    def command(self, action):
        """What an action does before the world is stepped."""
        action = np.clip(np.asarray(action, float), -1.0, 1.0)
        low, high = self._ranges.T
        for name, value in zip(self.actions, low + 0.5 * (action + 1.0) * (high - low)):
            self.world.actuators.command(name, value)
        self.disturb()

    def result(self, action):
        """What is told after the world was stepped."""
        return self.observation(), float(self.reward(action)), bool(self.is_failure()), False, self.info()

    def info(self):
        """What is told beside the observation."""
        return {"is_success": bool(self.is_success())}

    def observation(self):
        """What is observed now."""
        parts = [factor * np.ravel(self.observe(kind, name)) for kind, name, factor in self._observed]
        told = np.concatenate(parts) if parts else np.zeros(0)
        return np.clip(told, -LARGEST, LARGEST).astype(np.float32)

    def observe(self, kind, name):
        """One thing that is observed, in SI units."""
        if kind == "goal":
            return self.goal
        if kind == "position":
            return self.position(name)
        if kind == "velocity":
            return self.velocity(name)
        if kind == "rotation":
            return self.world.rigid_bodies[self.scene.bodies[name]].rotation
        if kind == "pressure":
            return self.touch(name).pressure
        if kind == "force":
            return self.touch(name).total
        if kind == "tension":
            return self.world.cables[self.scene.cables[name]].tension
        if kind == "signal":
            signal = self.world.actuators[name]
            low, high = signal.range
            return 2.0 * (signal.value - low) / (high - low) - 1.0
        raise ValueError(f"nothing of the kind '{kind}' can be observed")

    # What tasks ask for.

    def body(self, name):
        """The body of a name."""
        handle = self.scene.bodies[name]
        is_soft = isinstance(handle, f.DeformableBodyHandle)
        return self.world.deformable_bodies[handle] if is_soft else self.world.rigid_bodies[handle]

    def position(self, name):
        """Where a body or a point is [m]."""
        if name in self.scene.points:
            handle, vertex = self.scene.points[name]
            return self.world.deformable_bodies[handle].positions[vertex]
        body = self.body(name)
        return body.center_of_mass if isinstance(body, f.DeformableBody) else body.translation

    def velocity(self, name):
        """How fast a body or a point is [m/s]."""
        if name in self.scene.points:
            handle, vertex = self.scene.points[name]
            return self.world.deformable_bodies[handle].velocities[vertex]
        return self.body(name).linvel

    def touch(self, name):
        """What a pad felt in the last step."""
        handle, pad = self.scene.pads[name]
        return pad.read(self.world.deformable_bodies[handle])
