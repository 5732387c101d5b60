"""Many environments of one kind, whose worlds are stepped side by side."""

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

import foible3d as f


class SoftVectorEnv(gymnasium.vector.VectorEnv):
    """So many environments that ``make`` gives, stepped by `foible3d.step_all` on ``threads`` threads: as many as there are processors
    unless told. Each gets the bits that it would alone. Episodes are cut at ``max_episode_steps``, as many as of the environments unless
    told.

    An environment that has ended begins its next episode in the next step, whose action it does not heed (``AutoresetMode.NEXT_STEP``).
    """

    def __init__(self, make, num_envs, threads=None, max_episode_steps=None):
        self.envs = [make() for _ in range(num_envs)]
        self.num_envs, self.threads = num_envs, threads
        self.metadata = {**self.envs[0].metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}
        self.render_mode = self.envs[0].render_mode
        self.single_action_space = self.envs[0].action_space
        self.single_observation_space = self.envs[0].observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._longest = max_episode_steps or self.envs[0].max_episode_steps
        self._steps = np.zeros(num_envs, int)
        self._ended = np.zeros(num_envs, bool)

    def reset(self, *, seed=None, options=None):
        """Begins an episode of each: observations of shape (num_envs, n), and an info. The seeds are ``seed``, ``seed + 1``, ..., or
        those of a list."""
        seeds = [None if seed is None else seed + k for k in range(self.num_envs)] if not np.iterable(seed) else seed
        told = [env.reset(seed=s, options=options) for env, s in zip(self.envs, seeds)]
        self._steps[:], self._ended[:] = 0, False
        return np.stack([observation for observation, _ in told]), self._infos([info for _, info in told])

    def step(self, actions):
        """Steps all: observations, rewards, which are over, which are cut short, and an info."""
        going = [k for k in range(self.num_envs) if not self._ended[k]]
        for k in going:
            self.envs[k].command(actions[k])
        f.step_all([self.envs[k].world for k in going], self.envs[0].steps_per_action, self.threads)
        observations, infos = [], []
        rewards, over, cut = np.zeros(self.num_envs), *np.zeros((2, self.num_envs), bool)
        for k, env in enumerate(self.envs):
            if self._ended[k]:
                observation, info = env.reset()
                self._steps[k] = 0
            else:
                observation, rewards[k], over[k], _, info = env.result(actions[k])
                self._steps[k] += 1
                cut[k] = self._longest is not None and self._steps[k] >= self._longest
            observations.append(observation)
            infos.append(info)
        self._ended = over | cut
        return np.stack(observations), rewards, over, cut, self._infos(infos)

    def render(self):
        """Pictures of all, of which each has its own; None without ``render_mode="rgb_array"``."""
        return None if self.render_mode is None else tuple(env.render() for env in self.envs)

    def _infos(self, infos):
        told = {}
        for k, info in enumerate(infos):
            told = self._add_info(told, info, k)
        return told
