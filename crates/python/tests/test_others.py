"""Environments as other libraries take them: names, shapes, resets, pictures, experts."""

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

import endowire
from endowire.gym import InsertionEnv, InsertionVectorEnv, Task, ends, observations, policies, tasks, vessels
from endowire.gym.autoreset import AutoresetMode, autoreset

#: Words that a TensorDict of TorchRL keeps for itself; a part of an observation of such a name cannot be read.
OF_TENSORDICT = {"shape", "device", "batch_size", "data", "action", "reward", "done", "terminated", "truncated", "next"}
VIEW = {"views": ["3d"], "size_px": [32, 24], "backend": "cpu"}


@pytest.fixture(scope="module")
def task(vessel, wire):
    over = [ends.TargetReached(), ends.StepLimit(4)]
    return Task([wire], vessels.FixedVessel(vessel), ends=over, wall={"friction": 0.1}, view=VIEW)


@pytest.mark.filterwarnings("ignore:.*the built-in")
@pytest.mark.parametrize("name", list(tasks.TASKS))
@pytest.mark.parametrize("observed", ["scaled", "physical"])
def test_parts_have_names_and_actions_a_shape_that_others_take(name, observed):
    made = tasks.TASKS[name](observed=observed)
    assert not OF_TENSORDICT & set(made.observation_spaces())
    assert made.action_space().shape == (2 * len(made.instruments),)


def test_a_name_that_others_keep_would_be_seen(task):
    seen = {"shape_mm": observations.Shape()}
    assert OF_TENSORDICT & set(Task(task.instruments, task.vessels, observations=seen).observation_spaces())


def test_actions_in_rows_are_the_same_as_in_one_vector(task):
    told = []
    for shape in ((2,), (1, 2)):
        env = InsertionEnv(task)
        env.reset(seed=1)
        told.append(env.step(np.array([0.7, 0.2]).reshape(shape))[0])
    vector = InsertionVectorEnv(task, 2)
    vector.reset(seed=[1, 1])
    told += [{name: part[0] for name, part in vector.step(np.full((2, 2), [0.7, 0.2]))[0].items()}]
    assert all(np.array_equal(told[0][name], other[name]) for other in told for name in told[0])
    with pytest.raises(endowire.InputError, match=r"an array of shape \(2, 1\): must have the shape \(2,\)"):
        InsertionEnv(task).step(np.zeros((2, 1)))


def run(task, mode, steps=9):
    """Rewards and tips of two environments, with resets as the mode has them."""
    vector, told = InsertionVectorEnv(task, 2, autoreset_mode=mode), []
    observed, _ = vector.reset(seed=3)
    while len(told) < steps:
        observed, reward, terminated, truncated, info = vector.step(np.full((2, 2), [0.8, 0.1]))
        over = terminated | truncated
        if mode == "SAME_STEP":
            told.append((reward, info["final_obs"][0]["tip"] if over[0] else observed["tip"][0]))
            assert ("final_obs" in info) == over.any()
            if over.any():
                assert info["_final_obs"].tolist() == over.tolist() == info["_final_info"].tolist()
                assert info["final_info"]["steps"].tolist() == [4, 4] and info["steps"].tolist() == [0, 0]
            continue
        told.append((reward, observed["tip"][0]))
        if mode == "DISABLED" and over.any():
            with pytest.raises(ResetNeeded, match=r"environments \[0, 1\] are over"):
                vector.step(np.zeros((2, 2)))
            vector.reset(options={"reset_mask": over})
        if mode == "NEXT_STEP" and over.any():
            assert not vector.step(np.ones((2, 2)))[1].any()
    return told


def test_episodes_are_the_same_whenever_the_next_begins(task):
    told = [run(task, mode) for mode in ("NEXT_STEP", "SAME_STEP", "DISABLED")]
    for other in told[1:]:
        for (reward, tip), (as_reward, as_tip) in zip(told[0], other, strict=True):
            assert np.array_equal(reward, as_reward) and np.array_equal(tip, as_tip)
    # The second episode is another one.
    assert not np.array_equal(told[0][0][1], told[0][4][1])


def test_a_mode_is_named_as_gymnasium_names_it(task):
    assert autoreset("SameStep") is autoreset("SAME_STEP") is autoreset(AutoresetMode.SAME_STEP)
    made = gymnasium.make_vec("endowire/CurvedTube-v0", num_envs=2, autoreset_mode="DISABLED")
    assert made.metadata["autoreset_mode"] is made.autoreset_mode is AutoresetMode.DISABLED
    with pytest.raises(endowire.InputError, match="autoreset_mode = 'never': give NEXT_STEP, SAME_STEP"):
        InsertionVectorEnv(task, 2, autoreset_mode="never")


def test_the_simulation_is_seen_through_wrappers_and_not_moved(task):
    env = gymnasium.wrappers.TimeLimit(gymnasium.wrappers.FlattenObservation(InsertionEnv(task)), 9)
    with pytest.raises(ResetNeeded, match="reset comes before simulation"):
        _ = env.unwrapped.simulation
    env.reset(seed=1)
    env.step(np.array([1.0, 0.0]))
    seen = env.unwrapped.simulation
    assert np.array_equal(seen.tip_mm, env.unwrapped.episodes.tip_mm[0])
    seen.step(advance_mm=3.0)
    assert env.unwrapped.simulation.inserted_mm[0] == seen.inserted_mm[0] - 3.0


@pytest.mark.parametrize("kind", ["follow_path", "search_ahead"])
def test_an_expert_acts_in_any_environment(kind):
    ways = []
    for unit in ("scaled", "physical"):
        env = gymnasium.make("endowire/CurvedTube-v0", actions=unit)
        expert = policies.Steered(kind)
        _, info = env.reset(seed=2)
        with pytest.raises(endowire.InputError, match="changes its actions"):
            policies.action(expert, gymnasium.wrappers.RescaleAction(env, np.float32(0.0), np.float32(1.0)))
        for _ in range(6):
            action = policies.action(expert, gymnasium.wrappers.FlattenObservation(env))
            assert env.action_space.contains(action)
            *_, info = env.step(action)
        ways.append(float(info["way_mm"]))
    assert ways[0] == pytest.approx(ways[1], abs=1e-3)
    vector = gymnasium.make_vec("endowire/CurvedTube-v0", num_envs=2)
    vector.reset(seed=2)
    expert = policies.Steered(kind)
    for _ in range(6):
        actions = policies.action(expert, vector)
        assert vector.action_space.contains(actions)
        *_, info = vector.step(actions)
    assert info["way_mm"][0] == pytest.approx(ways[0], abs=1e-3)


def test_an_expert_refuses_other_environments(task):
    expert = policies.Steered("follow_path")
    with pytest.raises(ResetNeeded, match="reset comes before action"):
        policies.action(expert, InsertionEnv(task))
    many = gymnasium.vector.SyncVectorEnv([lambda: InsertionEnv(task)] * 2)
    for other in (many, gymnasium.make("CartPole-v1")):
        with pytest.raises(endowire.InputError, match="give an environment of endowire"):
            policies.action(expert, other)


def test_an_expert_fills_a_data_set(task, tmp_path):
    pytest.importorskip("av")
    pytest.importorskip("pyarrow")
    from endowire.gym.lerobot_log import LeRobotLog

    env = LeRobotLog(gymnasium.make("endowire/CurvedTube-v0", max_episode_steps=3), tmp_path / "shown")
    expert = policies.Steered("follow_path")
    env.reset(seed=1)
    over = False
    while not over:
        *_, terminated, truncated, _ = env.step(policies.action(expert, env))
        over = terminated or truncated
    env.close()
    assert any((tmp_path / "shown" / "data").rglob("*.parquet"))


def test_a_vector_of_stable_baselines_is_recorded(task, tmp_path):
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import VecVideoRecorder

    from endowire.gym.sb3 import SB3VecEnv

    vector = SB3VecEnv(task, 2, seed=1)
    vector.reset()
    pictures = vector.get_images()
    assert [picture.shape for picture in pictures] == [(24, 32, 3)] * 2 and pictures[0].std() > 0.0
    assert np.array_equal(vector.env_method("render", indices=[1])[0], pictures[1])
    assert vector.render().shape[2] == 3 and vector.get_attr("spec") == [None, None]
    VecVideoRecorder(vector, str(tmp_path), record_video_trigger=lambda step: step == 0, video_length=3)
    assert SB3VecEnv(task, 2, render_mode=None).get_images() == [None, None]
    for wrong, words in (
        (lambda: vector.set_attr("x", 1), "attr_name = 'x'"),
        (lambda: vector.env_method("push"), "method_name = 'push'"),
        (lambda: vector.set_options({"a": 1}), "there are none for reset"),
        (lambda: vector.step_async(np.zeros((3, 2))), r"must have the shape \(2, 2\)"),
        (lambda: SB3VecEnv(task, 1, render_mode="human"), "render_mode = 'human'"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            wrong()


@pytest.mark.parametrize("name", ["CurvedTube", "ArchVariety"])
def test_torchrl_takes_them(name):
    pytest.importorskip("torchrl")
    from torchrl.envs import GymEnv, GymWrapper, check_env_specs

    single = GymEnv(f"endowire/{name}-v0")
    check_env_specs(single)
    assert single.rollout(3).batch_size == (3,)
    many = gymnasium.make_vec(f"endowire/{name}-v0", num_envs=2, max_episode_steps=4, autoreset_mode="DISABLED")
    rolled = GymWrapper(many).rollout(9, break_when_any_done=False)
    assert rolled["next", "done"].squeeze(-1).int().tolist() == [[0, 0, 0, 1, 0, 0, 0, 1, 0]] * 2
