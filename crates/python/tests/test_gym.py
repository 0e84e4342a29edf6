import itertools
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env


import endowire
import endowire.gym
from endowire.gym import InsertionVectorEnv, Task, arches, ends, observations, rewards, targets, vessels
from endowire.gym.autoreset import AutoresetMode


@pytest.fixture(scope="module")
def task(vessel, wire):
    return Task(
        [wire],
        vessels.FixedVessel(vessel),
        rewards=[rewards.Reached(), rewards.Approach(), rewards.ContactForce()],
        ends=[ends.TargetReached(), ends.LeftVessel(), ends.StepLimit(15)],
        wall={"friction": 0.1},
        view={"views": ["3d"], "size_px": [32, 32], "backend": "cpu"},
    )


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["CurvedTube", "AorticArch"])
def test_registered_ids_pass_the_checker(name):
    view = {"views": ["3d"], "size_px": [32, 32], "backend": "cpu"}
    check_env(gymnasium.make(f"endowire/{name}-v0", render_mode="rgb_array", view=view).unwrapped)


def rollout(env, seed, steps=40):
    env.action_space.seed(seed)
    yield env.reset(seed=seed)[0]
    over = False
    for _ in range(steps):
        action = env.action_space.sample()
        if over:
            observation, reward, over = env.reset()[0], 0.0, False
        else:
            observation, reward, terminated, truncated, _ = env.step(action)
            over = terminated or truncated
        yield observation, action, reward, over


def test_a_seed_decides_everything_and_a_vector_does_what_single_ones_do(task):
    singles = [list(rollout(endowire.gym.InsertionEnv(task), 7 + k)) for k in range(3)]
    assert str(singles[0]) == str(list(rollout(endowire.gym.InsertionEnv(task), 7)))
    vector = InsertionVectorEnv(task, 3)
    observed, _ = vector.reset(seed=7)
    for k, single in enumerate(singles):
        assert all(np.array_equal(observed[name][k], part) for name, part in single[0].items())
    ended = 0
    for step in range(1, 41):
        actions = np.stack([single[step][1] for single in singles])
        observed, reward, terminated, truncated, _ = vector.step(actions)
        for k, single in enumerate(singles):
            observation, _, alone, over = single[step]
            assert all(np.array_equal(observed[name][k], part) for name, part in observation.items())
            assert reward[k] == alone and (terminated | truncated)[k] == over
        ended += (terminated | truncated).sum()
    assert ended >= 6
    assert vector.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP


def test_a_failed_environment_is_truncated_and_the_others_go_on(task):
    vector = InsertionVectorEnv(task, 3)
    vector.reset(seed=1)
    actions = np.full((3, 1, 2), 0.3)
    actions[1, 0, 0] = np.nan
    _, _, _, truncated, info = vector.step(actions)
    assert (
        truncated.tolist() == [False, True, False]
        and "NaN" in info["failure"][1]
        and info["failure"][0] == ""
    )
    _, _, _, truncated, info = vector.step(np.full((3, 1, 2), 0.3))
    assert not truncated.any() and not info["failure"].any()
    with pytest.raises(endowire.InputError, match=r"must have the shape \(3, 2\)"):
        vector.step(np.zeros((2, 2)))


def test_an_action_that_is_no_number_is_not_the_last_action(vessel, wire):
    seen = {"last_action": observations.LastAction()}
    vector = InsertionVectorEnv(Task([wire], vessels.FixedVessel(vessel), observations=seen), 2)
    vector.reset(seed=1)
    actions = np.array([[[0.3, 0.3]], [[0.6, 0.6]]])
    before = vector.step(actions)[0]
    actions[1, 0] = [0.9, np.nan]
    observed, *_, info = vector.step(actions)
    assert "NaN" in info["failure"][1] and vector.observation_space.contains(observed)
    assert np.array_equal(observed["last_action"], before["last_action"])


def test_wrong_actions_of_one_are_exceptions(task):
    env = endowire.gym.InsertionEnv(task)
    env.reset(seed=1)
    with pytest.raises(endowire.InputError, match="finite"):
        env.step(np.array([[np.nan, 0.0]]))
    for wrong in ([[1.0j, 0.0]], [["1", "0"]], [[None, 0.0]]):
        with pytest.raises(endowire.InputError, match="must be real numbers"):
            env.step(wrong)
    with pytest.raises(endowire.InputError, match="shape"):
        env.step(np.zeros(4))
    assert env.step(np.array([[0.3, 0.0]]))[4]["failure"] == ""


def test_reset_comes_first(task):
    single = endowire.gym.InsertionEnv(task, render_mode="rgb_array")
    vector = InsertionVectorEnv(task, 2, render_mode="rgb_array")
    for env in (single, vector):
        with pytest.raises(gymnasium.error.ResetNeeded, match="reset comes before step"):
            env.step(env.action_space.sample())
        with pytest.raises(gymnasium.error.ResetNeeded, match="reset comes before render"):
            env.render()


def test_an_action_is_a_part_of_the_limits_or_a_velocity(vessel, wire):
    seen = {"last_action": observations.LastAction(), "tip_mm": observations.Tip()}
    made = {
        unit: endowire.gym.InsertionEnv(
            Task([wire], vessels.FixedVessel(vessel), observations=seen, actions=unit)
        )
        for unit in ("scaled", "physical")
    }
    assert made["scaled"].action_space.high.tolist() == [1.0, 1.0]
    assert np.allclose(made["physical"].action_space.high, [35.0, 3.14])
    told = {}
    for unit, action in (("scaled", [[0.5, -2.0]]), ("physical", [[17.5, -6.28]])):
        made[unit].reset(seed=1)
        told[unit] = made[unit].step(np.array(action))[0]
    assert np.array_equal(told["scaled"]["tip"], told["physical"]["tip"])
    assert told["scaled"]["last_action"].tolist() == [[0.5, -1.0]]
    assert np.allclose(told["physical"]["last_action"], [[17.5, -3.14]])
    with pytest.raises(endowire.InputError, match="actions = 'metres'"):
        Task([wire], vessels.FixedVessel(vessel), actions="metres")


def test_steps_of_a_fixed_cost_are_behind_the_hand_and_come_to_where_it_led(vessel, wire):
    parts = {"wall": {"friction": 0.1}, "ends": [ends.StepLimit(60)]}
    made = [InsertionVectorEnv(Task([wire], vessels.FixedVessel(vessel), solves=n, **parts), 2) for n in (2, None)]
    behind = []
    for environments in made:
        environments.reset(seed=3)
        for k in range(50):
            push = np.full((2, 1, 2), [0.1, 0.05] if k < 20 else [0.0, 0.0])
            *_, info = environments.step(push)
            behind.append(info["behind_mm"].max())
    in_ticks, in_steps = (environments.episodes for environments in made)
    assert max(behind[:50]) > 0.5 and behind[49] == 0.0 and max(behind[50:]) == 0.0
    assert in_ticks.batch.inserted_mm == pytest.approx(in_steps.batch.inserted_mm, abs=1e-9)
    assert np.linalg.norm(in_ticks.tip_mm - in_steps.tip_mm, axis=1).max() < 0.05
    # Hands are ahead by no more than a step's way, and push nothing beyond the end of the wire.
    made[0].reset(seed=3)
    for _ in range(60):
        *_, info = made[0].step(np.full((2, 1, 2), [1.0, 0.0]))
        assert not info["failure"].any() and info["behind_mm"].max() <= 35.0 / 7.5 + 1e-9
    with pytest.raises(endowire.InputError, match="solves = 0"):
        Task([wire], vessels.FixedVessel(vessel), solves=0)


def test_an_episode_that_is_over_is_assessed(vessel, wire):
    made = Task([wire], vessels.FixedVessel(vessel), assessed=True, ends=[ends.StepLimit(5)])
    environments = InsertionVectorEnv(made, 2)
    _, info = environments.reset(seed=1)
    assert list(info["assessment"]) == [None, None]
    way_mm = np.zeros(2)
    before_mm = environments.episodes.tip_mm.copy()
    for k in range(5):
        *_, info = environments.step(np.full((2, 1, 2), [1.0 if k != 2 else -0.5, 0.2]))
        way_mm += np.linalg.norm(environments.episodes.tip_mm - before_mm, axis=1)
        before_mm = environments.episodes.tip_mm.copy()
    for told, path_mm in zip(info["assessment"], info["path_length_mm"], strict=True):
        told = {one["name"]: one["value"] for one in told}
        assert told["total_s"] == pytest.approx(5 * made.control_period_s)
        assert told["tip_path_mm"] == pytest.approx(path_mm, abs=1e-9) and path_mm > 0.0
        assert told["beam_on_s"] is None and told["wrong_branches"] is not None
    # The next episode is one of its own.
    *_, info = environments.step(np.zeros((2, 1, 2)))
    assert list(info["assessment"]) == [None, None]


def test_a_record_of_ones_own_is_measured_copied_and_pickled(vessel, wire):
    simulation, record = endowire.Simulation(vessel, wire), endowire.Record()
    for k in range(1, 6):
        simulation.step(4.0, 0.1)
        record.note(simulation, 0.5 * k, 4.0, 0.1)
    assert len(record) == 5 and len(record.copy()) == 5
    measured = record.assess(vessel, vessel.centreline[-1, :3])
    assert {one["name"]: one["value"] for one in measured}["total_s"] == 2.5
    assert pickle.loads(pickle.dumps(record)).assess(vessel, vessel.centreline[-1, :3]) == measured
    assert record.assess() != measured
    # From the sheath's mouth on, the way is as long as what went in, and without it that of the first step is missing.
    simulation, whole = endowire.Simulation(vessel, wire), endowire.Record(endowire.Simulation(vessel, wire))
    simulation.step(4.0)
    whole.note(simulation, 0.5, 4.0)
    (with_it,) = (one["value"] for one in whole.assess() if one["name"] == "tip_path_mm")
    assert with_it == pytest.approx(4.0, abs=0.1)
    with pytest.raises(endowire.InputError, match="time_s = 1"):
        record.note(simulation, 1.0)
    with pytest.raises(endowire.InputError, match="target"):
        record.assess(target="nowhere")
    batch = endowire.Batch([simulation, simulation])
    with pytest.raises(endowire.InputError, match="records = 1"):
        batch.note([record], np.zeros((2, 1, 2)), np.zeros(2))


def test_observations_are_numbers_of_about_one_or_physical(vessel, wire):
    parts = {"tip_mm": observations.Tip(), "hands": observations.Hands(), "forces": observations.Forces()}
    made = {
        unit: endowire.gym.InsertionEnv(Task([wire], vessels.FixedVessel(vessel), observations=parts, observed=unit))
        for unit in ("scaled", "physical")
    }
    told = {}
    for unit, env in made.items():
        env.reset(seed=1)
        for _ in range(20):
            told[unit] = env.step(np.array([[1.0, 0.0]]))[0]
            assert env.observation_space.contains(told[unit])
    scaled, physical = told["scaled"], told["physical"]
    low, high = made["scaled"].task.vessels.bounds_mm
    assert np.allclose((low + high) / 2 + scaled["tip"] * (high - low).max() / 2, physical["tip_mm"], atol=1e-3)
    assert np.allclose(scaled["hands"][0] * [wire.length_mm, 1.0, 1.0], physical["hands"][0], atol=1e-3)
    assert np.allclose(scaled["forces"], np.clip(physical["forces"], -10.0, 10.0), atol=1e-4)
    assert all(np.abs(part).max() <= 1.0 for part in (scaled["tip"], scaled["hands"]))
    # The twin: in mm they are none.
    assert np.abs(physical["tip_mm"]).max() > 10.0
    with pytest.raises(endowire.InputError, match="observed = 'metres'"):
        Task([wire], vessels.FixedVessel(vessel), observed="metres")


def test_progress_is_the_difference_of_a_potential(vessel, wire):
    env = endowire.gym.InsertionEnv(Task([wire], vessels.FixedVessel(vessel), rewards=[rewards.Progress()]))
    _, begun = env.reset(seed=3)
    sums = []
    for push in (1.0, 1.0, -1.0, 1.0, 1.0, 1.0):
        sums.append(env.step(np.array([[push, 0.3]]))[1])
        left = env.episodes.way_mm[0] / begun["way_mm"]
        assert abs(sum(sums) - (1.0 - left)) < 1e-9
    assert sums[2] < 0.0 < sums[0]


def test_a_surface_alone_is_learnt_in_as_the_vessel_that_it_is_of(vessel, wire):
    surface = endowire.Vessel.from_arrays(vessel.vertices_mm, vessel.triangles)
    target = targets.FixedTarget(tuple(vessel.centreline[-1, :3]))
    ways = {}
    for name, made in (("known", vessel), ("found", surface)):
        env = endowire.gym.InsertionEnv(Task([wire], vessels.FixedVessel(made, opening=vessel.inlet), target))
        env.reset(seed=1)
        ways[name] = [env.step(np.array([[1.0, 0.0]]))[4]["way_mm"] for _ in range(6)]
    assert np.abs(np.subtract(ways["found"], ways["known"])).max() < 1.0
    # The twin: a step later the way is another by more.
    assert np.abs(np.subtract(ways["found"][1:], ways["known"][:-1])).max() > 3.0
    # Ways begin at the sheath.
    entered = vessels.FixedVessel(surface, opening=1)
    begun = entered.site.centreline.positions_mm[0] - surface.openings[1]["centre_mm"]
    assert np.linalg.norm(begun) < 2.0


def test_an_episode_is_as_long_as_make_says():
    def steps(env):
        env.reset(seed=0)
        for step in range(1, 12):
            *_, truncated, _ = env.step(np.zeros(env.action_space.shape))
            if np.any(truncated):
                return step
        return None

    name = "endowire/CurvedTube-v0"
    assert steps(gymnasium.make(name, max_episode_steps=5)) == 5
    assert steps(gymnasium.make_vec(name, num_envs=2, max_episode_steps=5)) == 5
    assert steps(gymnasium.make_vec(name, num_envs=2, vectorization_mode="sync", max_episode_steps=5)) == 5
    assert steps(gymnasium.make_vec(name, num_envs=2)) is None, "the twin"


def test_a_window_is_refused_with_the_wrapper_that_has_one():
    with pytest.raises(endowire.InputError, match="HumanRendering"):
        gymnasium.make("endowire/CurvedTube-v0", render_mode="human")
    with pytest.raises(endowire.InputError, match="give rgb_array"):
        gymnasium.make_vec("endowire/CurvedTube-v0", num_envs=2, render_mode="ansi")


def test_seeds_without_end_are_refused(task):
    with pytest.raises(endowire.InputError, match="seed = 3 and more numbers"):
        InsertionVectorEnv(task, 2).reset(seed=itertools.count())


def test_pictures_of_two_planes_are_observed(vessel, wire):
    planes = observations.Fluoroscopy(
        planes=((0.0, 0.0), (90.0, 0.0)), size_px=(24, 16), view={"backend": "cpu"}
    )
    env = endowire.gym.InsertionEnv(
        Task([wire], vessels.FixedVessel(vessel), observations={"fluoroscopy": planes})
    )
    first, again, other = (env.reset(seed=seed)[0]["fluoroscopy"] for seed in (5, 5, 6))
    assert first.shape == (2, 16, 24) and env.observation_space["fluoroscopy"].contains(first)
    assert np.array_equal(first, again) and not np.array_equal(first, other)


def test_tasks_are_sent_to_other_processes(task):
    sent = pickle.loads(pickle.dumps(task))
    assert str(list(rollout(endowire.gym.InsertionEnv(sent), 3, 3))) == str(
        list(rollout(endowire.gym.InsertionEnv(task), 3, 3))
    )


def test_arches_vary_and_come_from_their_seed():
    tables = [arches.arch(np.random.default_rng(seed))[0] for seed in (4, 4, 6)]
    assert np.array_equal(tables[0], tables[1]) and not np.array_equal(tables[0][-1], tables[2][-1])
    for table in tables:
        low, high = arches.ArchVariety.bounds_mm
        assert (table[:, :3] > low).all() and (table[:, :3] < high).all() and (table[:, 3] > 2.0).all()


def test_an_arch_has_its_targets_in_its_branches():
    variety = arches.ArchVariety(count=1, edge_mm=6.0, seed=4)
    env = gymnasium.make("endowire/ArchVariety-v0", vessels=variety).unwrapped
    first, _ = env.reset(seed=1)
    other, _ = env.reset(seed=2)
    assert not np.array_equal(first["target"], other["target"])
    assert env.observation_space.contains(first)
    for _ in range(5):
        *_, info = env.step(np.array([[0.9, 0.3]]))
    assert info["failure"] == "" and info["way_mm"] > 0.0


def test_an_arch_whose_wall_cannot_be_computed_is_drawn_again():
    # The first draw of arch 47 has branches that meet in a crease.
    with pytest.raises(endowire.ComputationError, match="crease"):
        _ = endowire.Vessel.generate(arches.arch(np.random.default_rng([0, 47]))[0], edge_mm=4.0).triangles
    seed = next(s for s in range(1000) if np.random.default_rng(s).integers(50) == 47)
    site = arches.ArchVariety(count=50).sample(np.random.default_rng(seed))
    assert len(site.vessel.triangles) > 1000
