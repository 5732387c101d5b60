"""Environments: checked by gymnasium, the same bits for the same seeds, and solved by simple controllers."""

import pathlib
import sys
import warnings

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", minversion="1.1")

import foible3d as f  # noqa: E402
import foible3d.gym as soft  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

NAMES = ["foible3d/Reach-v0", "foible3d/Lift-v0", "foible3d/Hold-v0"]


@pytest.mark.parametrize("name", NAMES)
def test_gymnasiums_checker_finds_nothing(name):
    env = gymnasium.make(name)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.reset(seed=1)
    assert env.spec.max_episode_steps == env.unwrapped.max_episode_steps


@pytest.mark.parametrize("name", NAMES)
def test_pictures_show_what_moves(name):
    env = gymnasium.make(name, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.reset(seed=1)
    first, again = env.render(), env.render()
    assert first.shape == (360, 480, 3) and first.dtype == np.uint8 and (first == again).all()
    # Soft bodies are the only coloured things.
    coloured = np.ptp(first.astype(int), axis=2) > 60
    assert 200 < coloured.sum() < coloured.size / 2
    for _ in range(10):
        env.step(np.array([1.0, -1.0, 1.0, -1.0])[: env.action_space.shape[0]])
    moved = (env.render() != first).any(axis=2)
    assert 200 < moved.sum() < moved.size / 2
    assert gymnasium.make(name).unwrapped.render() is None


def test_a_picture_shows_a_ball_where_it_is():
    world = f.World()
    radius = 0.1
    world.add_body(f.RigidBody.fixed(translation=(0.5, 2.0, -1.0)), [f.Collider.ball(radius)])
    picture = world.render((300, 200), center=(0.5, 2.0, -1.0), radius=2 * radius, yaw=20, pitch=10)
    seen = (picture != picture[0, 0]).any(axis=2)
    rows, columns = np.nonzero(seen)
    # In the middle. The camera sees the ball of twice the radius to the edge: of tan = 0.36, at a distance of 2 r √(1 + 0.36²) / 0.36, so
    # the ball is the cone of sin = r / distance; and a polyhedron within it.
    assert abs(rows.mean() - 99.5) < 0.6 and abs(columns.mean() - 149.5) < 0.6
    sine = 0.5 * 0.36 / np.hypot(1.0, 0.36)
    pixels = 100 * sine / np.sqrt(1.0 - sine**2) / 0.36
    assert np.sqrt(seen.sum() / np.pi) == pytest.approx(pixels, rel=0.02)
    # A body aside of it is seen beside it: along x to the right.
    world.add_body(f.RigidBody.fixed(translation=(0.6, 2.0, -1.0)), [f.Collider.ball(0.02)])
    world.add_body(f.RigidBody.fixed(translation=(0.5, 2.15, -1.0)), [f.Collider.ball(0.02)])
    both = (world.render((300, 200), center=(0.5, 2.0, -1.0), radius=2 * radius, yaw=20, pitch=10) != picture).any(axis=2)
    assert both[:80].any() and both[:, 180:].any() and not both[120:].any() and not both[:, :120].any()


def test_stress_is_coloured():
    world = f.World(gravity=(0, 0, 0))
    cube = world.add_deformable(f.DeformableBody.cuboid((0.1, 0.1, 0.1), (2, 2, 2)).material(f.Material.ecoflex_00_30()))
    at_rest = world.render((64, 48), stress=1e3)
    assert (at_rest != world.render((64, 48))).any()
    positions = world.read_positions()
    positions[:, 0] *= 1.2
    world.set_positions(positions)
    assert cube in world.deformable_bodies
    stretched = world.render((64, 48), stress=1e3, center=(0, 0, 0), radius=0.3)
    # A fifth longer it bears some 9 kPa: red where it was blue.
    middle_before = world.render((64, 48), stress=1e6, center=(0, 0, 0), radius=0.3)[24, 32]
    middle = stretched[24, 32]
    assert middle[0] > middle[2] and middle_before[0] < middle_before[2]
    with pytest.raises(f.DeformableBodyError, match="stress is 0, but must be positive"):
        world.render(stress=0.0)


def test_pictures_that_cannot_be_are_refused():
    world = f.World()
    # Nothing but the background.
    assert (world.render((16, 16)) == world.render((16, 16))[0, 0]).all()
    for options, text in [
        ({"size": (15, 480)}, "width is 15 pixels, but must be 16 to 4096"),
        ({"size": (480, 5000)}, "height is 5000 pixels"),
        ({"center": (0, 0, 0)}, "tell both, or neither"),
        ({"center": (0, 0, 0), "radius": 0.0}, "radius is 0, but must be positive"),
        ({"center": (0, float("nan"), 0), "radius": 1.0}, "center is not finite"),
        ({"yaw": float("inf")}, "yaw is not finite"),
    ]:
        with pytest.raises(f.DeformableBodyError, match=text):
            world.render(**options)
    with pytest.raises(ValueError, match="render_mode is 'human'"):
        soft.Lift(render_mode="human")


@pytest.mark.parametrize("name", NAMES)
def test_a_seed_and_actions_give_the_same_bits(name):
    told = []
    for env in (gymnasium.make(name), gymnasium.make(name)):
        for _ in range(2):
            observations = [env.reset(seed=7)[0]]
            random = np.random.default_rng(3)
            for _ in range(10):
                observation, reward, *_ = env.step(random.uniform(-1, 1, env.action_space.shape))
                observations += [observation, np.array([reward])]
            told.append(b"".join(part.tobytes() for part in observations))
        env.reset(seed=8)
        other = env.step(np.zeros(env.action_space.shape))[0]
        env.reset(seed=7)
        assert (env.step(np.zeros(env.action_space.shape))[0] != other).any()
    assert len(set(told)) == 1


def test_many_worlds_give_the_bits_of_each():
    envs = gymnasium.make_vec("foible3d/Lift-v0", num_envs=3, threads=2)
    alone = [soft.Lift() for _ in range(3)]
    observations, _ = envs.reset(seed=5)
    mine = [env.reset(seed=5 + k)[0] for k, env in enumerate(alone)]
    assert (observations == np.stack(mine)).all()
    random = np.random.default_rng(0)
    for _ in range(5):
        actions = random.uniform(-1, 1, (3, 3)).astype(np.float32)
        observations, rewards, over, cut, infos = envs.step(actions)
        mine = [env.step(action) for env, action in zip(alone, actions)]
        assert (observations == np.stack([each[0] for each in mine])).all()
        assert rewards.tolist() == [each[1] for each in mine]
    assert not over.any() and not cut.any() and infos["is_success"].tolist() == [False] * 3
    assert envs.observation_space.contains(observations) and envs.render() is None
    pictures = gymnasium.make_vec("foible3d/Lift-v0", num_envs=2, render_mode="rgb_array")
    pictures.reset(seed=5)
    assert [picture.shape for picture in pictures.render()] == [(360, 480, 3)] * 2


def test_an_episode_that_ends_begins_anew_in_the_next_step():
    envs = soft.make_vec("foible3d/Reach-v0", 2)
    start, _ = envs.reset(seed=0)
    actions = -np.ones((2, 4))
    for step in range(60):
        _, _, over, cut, _ = envs.step(actions)
        assert cut.all() == (step == 59) and not over.any()
    observations, rewards, _, cut, _ = envs.step(actions)
    assert not cut.any() and rewards.tolist() == [0.0, 0.0]
    # The finger hangs as at first, and has another goal.
    assert (observations[:, :-3] == start[:, :-3]).all() and (observations[:, -3:] != start[:, -3:]).any()


def run(env, seed, policy):
    observation, _ = env.reset(seed=seed)
    total = 0.0
    for step in range(env.max_episode_steps):
        observation, reward, over, _, info = env.step(policy(step, observation))
        total += reward
        if over:
            break
    return total, info["is_success"], step + 1


def test_tendons_that_pull_towards_the_goal_reach_it():
    env = soft.Reach()
    assert env.actions == ["east", "north", "west", "south"]
    pull = np.zeros(2)

    def policy(step, observation):
        tip, goal = observation[:3] / 10, observation[-3:] / 10
        pull[:] = np.clip((pull if step else 0.0) + 3.0 * (goal - tip)[[0, 2]], -1, 1)
        # What is taken in on one side is let out on the other.
        return np.concatenate([-pull, pull])

    assert all(run(env, seed, policy)[1] for seed in range(8))


def test_a_box_is_lifted_by_who_grips_first_only():
    env = soft.Lift()
    for seed in range(3):
        total, is_success, _ = run(env, seed, lambda step, _: (1 if step > 12 else -1, 1, 1))
        assert is_success and total > 20
        assert run(env, seed, lambda *_: (1, 1, 1))[0] < 2
        assert run(env, seed, lambda *_: (1, -1, -1))[0] == 0


def test_a_box_is_held_by_who_presses_and_best_with_little():
    env = soft.Hold()
    for seed in range(2):
        firm, light = (run(env, seed, lambda *_, a=a: (a, a)) for a in (1.0, 0.0))
        assert firm[1] and light[1] and light[2] == 100 and firm[0] < light[0]
        assert run(env, seed, lambda *_: (-1, -1))[2] < 100


def test_a_scene_can_be_a_file(tmp_path):
    pytest.importorskip("tomllib" if sys.version_info >= (3, 11) else "tomli")
    (tmp_path / "muscle.toml").write_text("""
        [material.flesh]
        youngs_modulus = 1e5
        poisson_ratio = 0.4
        [deformable.block]
        shape = "cuboid"
        args = [[0.05, 0.05, 0.05], [2, 2, 2]]
        material = "flesh"
        translation = [0.0, 1.0, 0.0]
        [cable.rope]
        points = [["vertex", "block", 0], ["world", [0.0, 2.0, 0.0]]]
        length = 1.0
        [signal.winch]
        drives = "cable_length"
        of = "rope"
        range = [0.5, 1.5]
        start = 1.0
        [env]
        observe = { "position:block" = 2.0, "tension:rope" = 1.0, "signal:winch" = 1.0 }
    """)

    class Hoist(soft.SoftEnv):
        def reward(self, action):
            return self.position("block")[1]

    env = Hoist(tmp_path / "muscle.toml")
    observation, _ = env.reset(seed=0)
    assert env.actions == ["winch"] and observation == pytest.approx([0, 2, 0, 0, 0], abs=1e-6)
    observation, reward, *_ = env.step([0.5])
    assert observation[-1] == 0.5 and observation[1] == pytest.approx(2 * reward)


def test_what_no_scene_is_is_told():
    with pytest.raises(ValueError, match="a scene has no table 'rigids'"):
        soft.Scene({"rigids": {}})
    with pytest.raises(ValueError, match="deformable 'a': 'rubber' is missing or not known"):
        soft.Scene({"deformable": {"a": {"shape": "cuboid", "material": "rubber"}}})


@pytest.mark.slow
def test_the_cross_entropy_method_learns_to_lift(monkeypatch):
    monkeypatch.syspath_prepend(str(pathlib.Path(__file__).parents[1] / "examples"))
    import train_lift

    before, _ = train_lift.evaluate(np.zeros((train_lift.OUTPUTS, train_lift.INPUTS)))
    mean, history = train_lift.train(seed=0, generations=10)
    after, success = train_lift.evaluate(mean)
    assert before < 10 < 25 < after and success >= 0.9
    assert history[-1] > 3 * history[0]
