"""Environments for gymnasium, of scenes with soft bodies; wants ``pip install foible3d[gym]``.

Importing this registers ``foible3d/Reach-v0``, ``foible3d/Lift-v0`` and ``foible3d/Hold-v0``::

    import gymnasium, foible3d.gym
    env = gymnasium.make("foible3d/Lift-v0")
"""

try:
    import gymnasium
except ImportError as error:
    raise ImportError("foible3d.gym wants gymnasium: pip install gymnasium, or foible3d[gym]") from error

from .env import SoftEnv
from .scene import Scene, load
from .tasks import Hold, Lift, Reach
from .vector import SoftVectorEnv

__all__ = ["Hold", "Lift", "Reach", "Scene", "SoftEnv", "SoftVectorEnv", "load", "make_vec"]

TASKS = {"foible3d/Reach-v0": Reach, "foible3d/Lift-v0": Lift, "foible3d/Hold-v0": Hold}



def _vector_of(task):
    """What gymnasium makes several environments with; it names the longest episode, which the task has."""

    def make(num_envs=1, threads=None, max_episode_steps=None, **options):
        return SoftVectorEnv(lambda: task(**options), num_envs, threads, max_episode_steps)

    return make


for _name, _task in TASKS.items():
    if _name not in gymnasium.registry:
        gymnasium.register(
            _name,
            entry_point=_task,
            max_episode_steps=_task.description["env"]["max_episode_steps"],
            vector_entry_point=_vector_of(_task),
        )


def make_vec(name, num_envs, threads=None):
    """So many environments of a registered name, whose worlds are stepped on several threads."""
    return SoftVectorEnv(TASKS[name], num_envs, threads)
