"""Learns to lift a box between two soft pads by the cross-entropy method, in plain NumPy.

The policy is linear in a few of the observations: how high the hand and the box are, how hard the pads press, where the signals are.
Closing and lifting at once misses the box: what is to be learnt is to lift once the pads feel it. Run it with::

    pip install foible3d[gym]
    python examples/train_lift.py
"""

import argparse
import time

import numpy as np

import foible3d.gym as soft

EPISODE = soft.Lift.description["env"]["max_episode_steps"]
# Rows of the policy: the lift, and the grip of both fingers.
OUTPUTS = 2


def features(observations):
    """What the policy sees, a row for each environment; see ``observe`` of the scene for the order."""
    box, hand = observations[:, 1:2], observations[:, 7:8]
    pressures = [observations[:, 9:18].mean(axis=1, keepdims=True), observations[:, 18:27].mean(axis=1, keepdims=True)]
    signals = observations[:, 27:30]
    return np.hstack([np.ones_like(box), box, hand, *pressures, signals])


INPUTS = features(np.zeros((1, 33))).shape[1]


def act(weights, observations):
    """Actions of policies, one for each environment: the lift, and one grip for both fingers."""
    told = np.tanh(np.einsum("eoi,ei->eo", weights, features(observations)))
    return told[:, [0, 1, 1]]


def run(envs, weights, seeds):
    """Returns of an episode of each policy, and whether it ends in success."""
    observations, _ = envs.reset(seed=seeds)
    returns = np.zeros(len(weights))
    for _ in range(EPISODE):
        observations, rewards, _, _, infos = envs.step(act(weights, observations))
        returns += rewards
    return returns, infos["is_success"]


def train(seed=0, population=24, elite=6, generations=12, tell=print):
    """The mean of the last generation, and the mean return of each generation. In a generation all lift the same box."""
    random = np.random.default_rng(seed)
    envs = soft.make_vec("foible3d/Lift-v0", population)
    mean, spread = np.zeros((OUTPUTS, INPUTS)), np.ones((OUTPUTS, INPUTS))
    history = []
    for generation in range(generations):
        weights = mean + spread * random.standard_normal((population, OUTPUTS, INPUTS))
        returns, success = run(envs, weights, [1000 * seed + generation] * population)
        best = weights[np.argsort(returns)[-elite:]]
        mean, spread = best.mean(axis=0), best.std(axis=0) + 0.3 / (1 + generation)
        history.append(returns.mean())
        tell(f"generation {generation}: return {returns.mean():.2f}, best {returns.max():.2f}, {success.mean():.0%} lift")
    return mean, history


def evaluate(mean, episodes=24, seed=10**6):
    """Mean return and share of successes, over boxes that were not trained on."""
    envs = soft.make_vec("foible3d/Lift-v0", episodes)
    returns, success = run(envs, np.repeat(mean[None], episodes, axis=0), seed)
    return returns.mean(), success.mean()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--generations", type=int, default=12)
    arguments = parser.parse_args()
    begin = time.perf_counter()
    before, _ = evaluate(np.zeros((OUTPUTS, INPUTS)))
    mean, history = train(arguments.seed, generations=arguments.generations)
    after, success = evaluate(mean)
    episodes = 24 * len(history)
    print(f"return {before:.2f} before, {after:.2f} after {episodes} episodes; {success:.0%} of 24 new boxes lifted")
    print(f"{time.perf_counter() - begin:.0f} s")


if __name__ == "__main__":
    main()
