"""Hands, policies, evaluation, and the vector of stable-baselines3."""

import dataclasses
import json
import pickle

import numpy as np
import pytest

import endowire
from endowire.gym import (
    Episodes,
    InsertionEnv,
    Task,
    arches,
    centreline,
    ends,
    evaluation,
    observations,
    policies,
    rewards,
    vessels,
)


@pytest.fixture(scope="module")
def task(vessel, wire):
    return Task(
        [wire],
        vessels.FixedVessel(vessel),
        observations={"roadmap": observations.Roadmap(), "last_action": observations.LastAction()},
        rewards=[rewards.Reached(), rewards.Approach()],
        ends=[ends.TargetReached(), ends.LeftVessel(), ends.StepLimit(30)],
        wall={"friction": 0.1},
    )


def way(task):
    line = task.vessels.site.centreline
    return line, line.path(line.positions_mm[-1])


def test_a_path_leads_from_the_root_to_a_place():
    table = np.array([[0, 0, 0, 3, -1], [0, 0, 10, 3, 0], [0, 0, 20, 1, 1], [8, 0, 10, 2, 1]], dtype=float)
    line = centreline.Centreline(table)
    path = line.path(np.array([0.0, 1.0, 15.0]))
    assert path.table_mm.tolist() == [[0, 0, 0, 3], [0, 0, 10, 3], [0, 0, 15, 2]]
    assert path.length_mm == 15.0 and path.nearest(np.array([2.0, 0.0, 12.0])) == (12.0, 2.0, 2.6)
    assert path.at_mm(np.array([5.0, 12.0, 99.0]))[:, 2].tolist() == [5.0, 12.0, 15.0]
    branch = line.path(np.array([4.0, 0.0, 10.0]))
    assert branch.table_mm[-1].tolist() == [4.0, 0.0, 10.0, 2.5] and branch.length_mm == 14.0
    # At a point, before the root, and at a fork: the way ends in it and is no point.
    assert line.path(np.array([0.0, 0.0, 10.0])).length_mm == 10.0
    assert 0.0 < line.path(np.array([0.0, 0.0, -1.0])).length_mm < 0.2


def target_of(line):
    """Between two points of the line."""
    return line.point_mm(len(line.lengths_mm) - 3, 0.3)


def test_ways_of_many_are_those_of_each():
    rng, ways, alone = np.random.default_rng(1), centreline.Ways(3), centreline.Ways(1)
    tables = [arches.arch(np.random.default_rng(seed))[0] for seed in (4, 6, 7)]
    lines = [centreline.Centreline(table) for table in (tables[0][:20], *tables[1:])]
    # A longer tree after a shorter one, and a shorter one in the place of a longer.
    for k, line in [(0, lines[0]), (2, lines[1]), (1, lines[1]), (2, lines[2]), (1, lines[0])]:
        ways.put(k, line, target_of(line))
    for _ in range(20):
        points = rng.uniform(*arches.ArchVariety.bounds_mm, (3, 3))
        told = ways.left_mm(points)
        for k, line in enumerate((lines[0], lines[0], lines[2])):
            segment, part, _ = line.nearest(points[k])
            rows, length = line.ways_mm(target_of(line)), line.lengths_mm[segment]
            child, parent = rows[segment + 1], rows[line.parents[segment + 1]]
            expected = min(child + (1 - part) * length, parent + part * length)
            if segment == len(line.lengths_mm) - 3:
                expected = abs(part - 0.3) * length
            assert told[k] == pytest.approx(expected, abs=1e-9)
            alone.put(0, line, target_of(line))
            assert alone.left_mm(points[k : k + 1])[0] == told[k]
    # On the target's own segment it is the distance along that, on either side.
    segment = len(lines[0].lengths_mm) - 3
    alone.put(0, lines[0], target_of(lines[0]))
    for part in (0.0, 0.1, 0.3, 0.4, 1.0):
        left = alone.left_mm(lines[0].point_mm(segment, part)[None])
        assert left == pytest.approx(abs(part - 0.3) * lines[0].lengths_mm[segment], abs=1e-9)


@pytest.mark.parametrize("kind", ["follow_path", "search_ahead"])
def test_hands_of_the_library_arrive(prepared, task, kind):
    _, path = way(task)
    end = path.table_mm[: len(path.table_mm) // 2]
    hand, simulation = getattr(endowire.Controller, kind)(end), prepared.copy()
    while (move := hand.next(simulation)) is not None:
        assert move.shape == (1, 2) and np.abs(move[0]).max() <= 2.0
        simulation.step(*move[0])
        assert simulation.inserted_mm[0] < 280.0
    assert hand.ended == "arrived" and hand.retries >= 0
    assert np.linalg.norm(simulation.tip_mm - end[-1, :3]) < 10.0


def test_hands_refuse_what_they_cannot_steer(prepared, task):
    _, path = way(task)
    with pytest.raises(endowire.InputError, match="path_mm = 1 rows: must have two rows"):
        endowire.Controller.follow_path(path.table_mm[:1])
    with pytest.raises(endowire.InputError, match="path_mm"):
        endowire.Controller.follow_path(np.full((3, 4), np.nan))
    with pytest.raises(endowire.InputError, match=r"the shape \(n, 4\)"):
        endowire.Controller.search_ahead(path.table_mm[:, :3])
    for hand in (
        endowire.Controller.search_ahead(path.table_mm, turned=[1]),
        endowire.Controller.follow_path(path.table_mm, lead=3),
    ):
        with pytest.raises(endowire.InputError, match="there are 1, the innermost is 0"):
            hand.next(prepared.copy())
        assert hand.ended is None


def roadmap(task, prepared, roll, inserted_mm):
    """What is seen with so much inserted, and the same computed by lengths and angles alone."""
    part, episodes, simulation = task.observations["roadmap"], Episodes(task, 1), prepared.copy()
    episodes.begin({0: np.random.default_rng(3)})
    simulation.step(rotate_rad=roll)
    simulation.run(np.tile([[5.0, 0.0]], (inserted_mm // 5, 1, 1)))
    episodes.batch.replace(0, simulation)
    seen = part.observe(episodes)[0]
    tip, root, behind = simulation.points_mm([0.0, 16.0, 20.0])
    along = (root - behind) / np.linalg.norm(root - behind)
    at_mm, off_mm, radius_mm = episodes.paths[0].nearest(tip)
    ahead = episodes.paths[0].at_mm(np.array([at_mm + 20.0]))[0] - tip
    assert np.linalg.norm(seen[6:9]) * 20.0 == pytest.approx(np.linalg.norm(ahead))
    assert seen[8] * 20.0 == pytest.approx(ahead @ along)
    assert seen[12] > 0.1 and seen[12] * 16.0 == pytest.approx(np.linalg.norm(np.cross(tip - root, along)))
    left_mm = episodes.paths[0].length_mm - at_mm
    assert seen[14:] == pytest.approx(
        [left_mm / 100, off_mm / radius_mm, radius_mm / 10, (inserted_mm - at_mm) / 50]
    )
    return seen


def test_a_roadmap_is_seen_from_the_bent_tip(task, prepared):
    # In a straight piece all rolls look alike from the tip, in a bend they do not.
    assert roadmap(task, prepared, 0.0, 60) == pytest.approx(roadmap(task, prepared, 2.0, 60), abs=0.02)
    bent = [roadmap(task, prepared, roll, 130) for roll in (0.0, 2.0)]
    assert not np.allclose(*bent, atol=0.1)


def test_a_roadmap_is_seen_before_anything_is_in(task):
    env = InsertionEnv(task)
    first, _ = env.reset(seed=1)
    assert env.observation_space.contains(first) and np.isfinite(first["roadmap"]).all()
    assert first["roadmap"][2::3][:4] == pytest.approx([1.0] * 4, abs=0.1)


def alone(task, policy, seed):
    env, k = InsertionEnv(task), 0
    env.reset(seed=seed)
    while True:
        *_, terminated, truncated, info = env.step(policy.act(env.episodes)[0])
        k += 1
        if terminated or truncated:
            return seed, bool(info["reached"]), k, float(info["way_mm"])


def test_evaluation_is_of_the_episodes_of_its_seeds(task):
    seeds = [5, 3, 8, 1, 2]
    told = evaluation.evaluate(task, policies.Straight(), seeds, num_envs=2)
    singles = [alone(task, policies.Straight(), seed) for seed in seeds]
    assert [(o.seed, o.reached, o.steps, o.way_mm) for o in told] == singles
    assert len({o.steps for o in told}) > 1 and all(o.failure == "" and o.safety == 1.0 for o in told)
    document = json.loads(json.dumps(evaluation.table(told)))
    assert [row["seed"] for row in document["episodes"]] == seeds
    of_all = document["summary"]
    assert of_all["success_rate"] == sum(o.reached for o in told) / 5
    low, high = of_all["safe_success_rate_interval"]
    assert low <= of_all["safe_success_rate"] <= min(high, of_all["success_rate"])
    assert all(o.path_length_mm >= 0.9 * o.steps and o.wall_time_s > 0.0 for o in told)
    steered = evaluation.evaluate(task, policies.Steered("follow_path"), seeds[:2], num_envs=2)
    assert [o.seed for o in steered] == seeds[:2]
    drawn = [evaluation.evaluate(task, policies.Uniform(seed), [1]) for seed in (0, 0, 1)]
    assert drawn[0] == drawn[1] != drawn[2]


def test_success_is_safe_where_no_force_of_the_episode_was_above_the_limit(task):
    task = dataclasses.replace(task, ends=[ends.TargetReached(), ends.StepLimit(200)])
    (easy,) = evaluation.evaluate(task, policies.Steered("follow_path"), [5])
    assert easy.reached and easy.safe_success and easy.largest_wall_force_n > 0.0
    strict = dataclasses.replace(task, force_limit_n=0.5 * easy.largest_wall_force_n)
    (hard,) = evaluation.evaluate(strict, policies.Steered("follow_path"), [5])
    assert hard.reached and not hard.safe_success
    # The largest force of an episode is the largest that any of its steps has reported.
    env, seen = InsertionEnv(task), []
    env.reset(seed=5)
    for _ in range(40):
        *_, info = env.step(np.array([[0.8, 0.2]]))
        seen.append((info["wall_force_n"], info["tip_force_n"]))
        assert info["largest_wall_force_n"] == max(wall for wall, _ in seen)
        assert info["largest_tip_force_n"] == max(tip for _, tip in seen)
        assert info["tip_force_n"] >= 0.0 and info["wall_time_s"] == 0.0
    assert max(wall for wall, _ in seen) > 0.0 and info["steps"] == 40


def test_what_cannot_be_evaluated_is_refused(task):
    assert evaluation.evaluate(task, policies.Straight(), []) == []
    assert evaluation.evaluate(task, policies.Straight(), np.array([], dtype=int)) == []
    for wrong, words in (
        (lambda: evaluation.evaluate(task, policies.Straight(), [1], num_envs=0), "num_envs = 0: must be a whole"),
        (lambda: evaluation.table([]), "episodes = 0: must be 1 or more"),
        (lambda: evaluation.interval(0, 0), "episodes = 0: must be 1 or more"),
        (lambda: evaluation.interval(4, 3), "successes = 4: must be 0 to 3"),
        (lambda: policies.Steered("next"), "kind = 'next': give follow_path, search_ahead, plan"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            wrong()


def test_an_episode_ends_where_steps_take_too_much(task):
    for most, over in ((1, True), (1_000_000, False)):
        env = InsertionEnv(Task(task.instruments, task.vessels, ends=[ends.Laborious(most)], wall=task.wall))
        env.reset(seed=1)
        *_, terminated, truncated, _ = env.step(np.array([[30.0, 1.0]]))
        batch = env.episodes.batch
        assert batch.iterations[0] == batch.simulation(0).report.iterations > 1
        assert truncated == over and not terminated


def test_intervals_are_those_of_wilson():
    # Newcombe (1998), table I: 81 of 263, 15 of 148, 0 of 20.
    for counts, expected in (
        ((81, 263), (0.2553, 0.3662)),
        ((15, 148), (0.0624, 0.1605)),
        ((0, 20), (0.0, 0.1611)),
    ):
        assert evaluation.interval(*counts) == pytest.approx(expected, abs=5e-5)


def test_a_vector_of_stable_baselines_does_what_single_environments_do(task):
    pytest.importorskip("stable_baselines3")
    from endowire.gym.sb3 import SB3VecEnv

    vector, singles = SB3VecEnv(task, 2, seed=7), [InsertionEnv(task) for _ in range(2)]
    observed, ended = vector.reset(), 0
    begun = [env.reset(seed=7 + k)[0] for k, env in enumerate(singles)]
    rng, limits = np.random.default_rng(0), singles[0].action_space.high
    for _ in range(45):
        for k, single in enumerate(begun):
            assert all(np.array_equal(observed[name][k], values) for name, values in single.items())
        actions = rng.uniform(-0.2, 1.0, (2, 1, 2))
        observed, reward, over, infos = vector.step(actions)
        for k, env in enumerate(singles):
            begun[k], alone, terminated, truncated, _ = env.step(actions[k] * limits)
            assert reward[k] == np.float32(alone) and over[k] == (terminated or truncated)
            if over[k]:
                ended += 1
                assert infos[k]["TimeLimit.truncated"] == truncated
                last = infos[k]["terminal_observation"]
                assert all(np.array_equal(last[name], values) for name, values in begun[k].items())
                begun[k], _ = env.reset()
    assert ended >= 2
    vector.seed(7)
    again = vector.reset()
    assert all(np.array_equal(again[name][0], values) for name, values in singles[0].reset(seed=7)[0].items())
    vector.close()


def test_a_model_of_stable_baselines_learns_and_acts(task):
    stable_baselines3 = pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import VecNormalize

    from endowire.gym.sb3 import Learned, SB3VecEnv

    vector = VecNormalize(SB3VecEnv(task, 2, seed=1), norm_reward=False)
    model = stable_baselines3.PPO("MultiInputPolicy", vector, n_steps=16, batch_size=32, seed=1, device="cpu")
    model.learn(64)
    (outcome,) = evaluation.evaluate(task, Learned(model, vector), [4])
    assert outcome.seed == 4 and outcome.steps > 0
    # Actions that are drawn come from the seed, not from torch's own generator, which they leave as it is.
    import torch

    acts = [Learned(model, vector, seed=seed).act(vector.venv.episodes) for seed in (5, 5, 6, None)]
    assert np.array_equal(acts[0], acts[1])
    assert not np.array_equal(acts[0], acts[2]) and not np.array_equal(acts[0], acts[3])
    before = torch.random.get_rng_state()
    Learned(model, vector, seed=5).act(vector.venv.episodes)
    assert torch.equal(before, torch.random.get_rng_state())
    assert pickle.loads(pickle.dumps(task)).observations["roadmap"].bend_mm == 16.0
