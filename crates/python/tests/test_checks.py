"""Parameters of tasks and their parts that make no sense are refused when these are made, and what own parts give is
checked when it is given.
"""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

import endowire
from endowire.gym import (
    InsertionEnv,
    InsertionVectorEnv,
    Task,
    arches,
    ends,
    evaluation,
    observations,
    policies,
    rewards,
    targets,
    tasks,
    vessels,
)

NAN = float("nan")


@pytest.fixture(scope="module")
def make(vessel, wire):
    fixed = vessels.FixedVessel(vessel)
    return lambda **parts: Task(**{"instruments": [wire], "vessels": fixed, **parts})


@pytest.mark.parametrize(
    ("part", "words"),
    [
        (lambda: ends.StepLimit(0), "steps = 0: must be a whole number of at least 1"),
        (lambda: ends.StepLimit(2.5), "steps = 2.5"),
        (lambda: ends.StepLimit(True), "steps = True"),
        (lambda: ends.ForceLimit(-1.0), "limit_n = -1.0: must be a number of at least 0"),
        (lambda: ends.Laborious(0), "iterations = 0"),
        (lambda: rewards.Reached(NAN), "worth = nan: must be a finite number"),
        (lambda: rewards.EachStep("a"), "worth = 'a'"),
        (lambda: rewards.Approach(NAN), "worth_per_mm = nan"),
        (lambda: rewards.Distance(np.inf), "worth_per_mm = inf"),
        (lambda: rewards.Progress(None), "worth = None"),
        (lambda: rewards.ContactForce(NAN), "worth_per_n = nan"),
        (lambda: rewards.ContactForce(limit_n=-1.0), "limit_n = -1.0"),
        (lambda: targets.CentrelineTarget(-5.0), "least_mm = -5.0"),
        (
            lambda: targets.FixedTarget((NAN, 0.0, 0.0)),
            r"position_mm = \[nan, 0.0, 0.0\]: every number must be finite",
        ),
        (
            lambda: targets.FixedTarget((0.0, 0.0)),
            r"position_mm = .*shape \(2,\): must have the shape \(3,\)",
        ),
        (lambda: targets.FixedTarget("here"), "position_mm = 'here': must be real numbers"),
        (lambda: targets.NamedTarget(), r"names = \(\): give the name of one target or more"),
        (lambda: observations.Shape(()), r"from_tip_mm = \(\): give one length or more"),
        (lambda: observations.Shape((0.0, -5.0)), r"from_tip_mm\[1\] = -5.0: must be a number of at least 0"),
        (lambda: observations.Shape((NAN,)), r"from_tip_mm\[0\] = nan"),
        (lambda: observations.Roadmap(()), r"ahead_mm = \(\): give one length"),
        (lambda: observations.Roadmap((-5.0,)), r"ahead_mm\[0\] = -5.0"),
        (lambda: observations.Roadmap(bend_mm=0.0), "bend_mm = 0.0: must be a number above 0"),
        (lambda: observations.Forces(-1.0), "largest = -1.0"),
        (lambda: observations.Fluoroscopy(planes=()), r"planes = \(\): give primary and secondary angle"),
        (
            lambda: observations.Fluoroscopy(planes=((0.0,),)),
            r"planes = .*: give primary and secondary angle",
        ),
        (lambda: observations.Fluoroscopy(planes=((NAN, 0.0),)), "view.c_arm.primary_deg = NaN"),
        (lambda: observations.Fluoroscopy(size_px=(0, 4)), r"size_px\[0\] = 0"),
        (lambda: observations.Fluoroscopy(view={"foo": 1}), "view: unknown field `foo`"),
        (lambda: arches.ArchVariety(count=0), "count = 0"),
        (lambda: arches.ArchVariety(edge_mm=-1.0), "edge_mm = -1.0"),
        (lambda: policies.Uniform(slowest_mm_s=NAN), "slowest_mm_s = nan"),
        (lambda: tasks.make_env("Curved"), "task = 'Curved': give one of CurvedTube, AorticArch"),
        (lambda: tasks.make_vector_env("CurvedTube", max_episode_steps=0), "steps = 0"),
        (lambda: tasks.navigation("aortic"), "vessel = 'aortic': .*aortic_arch_ii"),
    ],
)
def test_a_part_names_its_wrong_parameter(part, words):
    with pytest.raises(endowire.InputError, match=words) as told:
        part()
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ({"force_limit_n": -1.0}, "force_limit_n = -1.0"),
        ({"threshold_mm": True}, "threshold_mm = True"),
        ({"speed_limits": 35}, r"speed_limits = .*: must have the shape \(2,\)"),
        ({"solves": True}, "solves = True"),
        ({"assessed": "yes"}, "assessed = 'yes': give True or False"),
        ({"view": {"foo": 1}}, "view: unknown field `foo`"),
        ({"view": {"size_px": [0, 4]}}, "view.size_px"),
        ({"wall": 5}, "wall = 5: give a dictionary"),
        ({"instruments": []}, r"instruments = \[\]: give a list of Instruments"),
        ({"instruments": 5}, "instruments = 5"),
        ({"vessels": 5}, "vessels = 5: has no method sample"),
        ({"target": 5}, "target = 5: has no method sample"),
        ({"target": targets.CentrelineTarget}, r"target = CentrelineTarget: is a class: make one of it"),
        ({"rewards": [1]}, r"rewards\[0\] = 1: has no method reward"),
        ({"rewards": rewards.Reached()}, "rewards = .*: give a list of parts"),
        ({"ends": ["a"]}, r"ends\[0\] = 'a': has no method ended"),
        ({"observations": {"a": 1}}, r"observations\['a'\] = 1: has no method observe"),
        ({"observations": [observations.Tip()]}, "observations = .*: give a dictionary of names and parts"),
        ({"coupling": {"foo": 1}}, "coupling = 'foo': is no key of it: names, friction, may_lead, clearance"),
    ],
)
def test_a_task_names_its_wrong_part(make, parts, words):
    with pytest.raises(endowire.InputError, match=words) as told:
        make(**parts)
    assert "\n" not in str(told.value)


def test_numbers_of_numpy_are_numbers(make):
    task = make(
        threshold_mm=np.float32(4.0),
        solves=np.int64(40),
        assessed=np.bool_(False),
        force_limit_n=np.inf,
        ends=[ends.StepLimit(np.int32(5))],
        speed_limits=np.array([20.0, 2.0]),
        observations={"seen": observations.Fluoroscopy(planes=np.zeros((1, 2)), size_px=np.array([16, 16]))},
        view={"views": ["3d"], "size_px": np.array([32, 32]), "backend": "cpu"},
    )
    env = InsertionEnv(task, render_mode="rgb_array")
    assert env.reset(seed=1)[0]["seen"].shape == (1, 16, 16) and env.render().shape == (32, 32, 3)


@pytest.mark.parametrize("count", [0, -1, 2.5])
def test_there_is_an_environment_or_more(make, count):
    with pytest.raises(endowire.InputError, match=f"num_envs = {count}"):
        InsertionVectorEnv(make(), count)
    with pytest.raises(endowire.InputError, match=f"num_envs = {count}"):
        evaluation.evaluate(make(), policies.Straight(), [1], num_envs=count)


def test_a_target_is_in_the_vessel(make, vessel):
    line = vessel.centreline
    inside, far_mm = line[len(line) // 2, :3], np.array([1e4, 0.0, 0.0])
    # On the wall, and outside it by less than the threshold: the tip can be so near.
    for near_mm in (0.0, 4.5, 8.0):
        place_mm = inside + [0.0, near_mm, 0.0]
        InsertionEnv(make(target=targets.FixedTarget(place_mm))).reset(seed=1)
    for place_mm in (far_mm, inside + [0.0, 12.0, 0.0]):
        env = InsertionEnv(make(target=targets.FixedTarget(place_mm)))
        with pytest.raises(
            endowire.InputError, match="target = .*: is outside the vessel, .* mm from its centre line"
        ):
            env.reset(seed=1)
    with pytest.raises(endowire.InputError, match="target = 'liver': the vessel names no targets"):
        InsertionEnv(make(target=targets.NamedTarget("liver"))).reset(seed=1)
    with pytest.raises(endowire.InputError, match="least_mm = 1000000"):
        InsertionEnv(make(target=targets.CentrelineTarget(1e6))).reset(seed=1)


class Own:
    """A part whose values are those of a function of the number of environments."""

    terminates = True

    def __init__(self, of):
        self.of = of

    def reward(self, episodes):
        return self.of(len(episodes.sites))

    ended = observe = reward

    def space(self, task):
        return spaces.Box(-1.0, 1.0, (2,), np.float32)


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (lambda n: np.ones((n, 1)), r"rewards\[1\] = float64 of shape \(3, 1\) from Own: .*shape \(3,\)"),
        (lambda n: np.ones(2), r"rewards\[1\] = .*shape \(2,\)"),
        (lambda n: None, r"rewards\[1\] = object"),
        (lambda n: ["a"] * n, r"rewards\[1\]"),
        (lambda n: [[1.0], [1.0, 2.0]], r"rewards\[1\] = .*: is no array"),
        (lambda n: np.ones(n) * 1j, r"rewards\[1\] = complex128"),
        (
            lambda n: np.array([0.0, NAN, 0.0]),
            r"rewards\[1\] = \[0.0, nan, 0.0\] from Own: every number must be finite",
        ),
    ],
)
def test_a_reward_is_one_number_for_each(make, of, words):
    env = InsertionVectorEnv(make(rewards=[rewards.EachStep(), Own(of)]), 3)
    env.reset(seed=1)
    with pytest.raises(endowire.InputError, match=words):
        env.step(np.ones((3, 1, 2)))


def test_a_reward_may_be_the_same_number_for_all(make):
    env = InsertionVectorEnv(make(rewards=[rewards.EachStep(0.5), Own(lambda n: 1)]), 3)
    env.reset(seed=1)
    assert env.step(np.ones((3, 1, 2)))[1].tolist() == [1.5] * 3


@pytest.mark.parametrize("of", [lambda n: np.ones(2, bool), lambda n: None, lambda n: np.ones((n, 1), bool)])
def test_an_end_is_one_truth_for_each(make, of):
    env = InsertionVectorEnv(make(ends=[Own(of)]), 3)
    env.reset(seed=1)
    with pytest.raises(endowire.InputError, match=r"ends\[0\] = .* from Own"):
        env.step(np.ones((3, 1, 2)))


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (lambda n: np.zeros((n, 3)), r"observations\['own'\] = .*\(1, 3\): must have the shape \(1, 2\)"),
        (lambda n: 0.5, r"observations\['own'\] = .*\(\): must have the shape"),
        (lambda n: np.full((n, 2), NAN), r"observations\['own'\]: every number must be real and finite"),
        (lambda n: np.full((n, 2), 1j), r"observations\['own'\]: every number must be real and finite"),
    ],
)
def test_an_observation_fits_its_space(make, of, words):
    env = InsertionEnv(make(observations={"own": Own(of)}))
    with pytest.raises(endowire.InputError, match=words):
        env.reset(seed=1)


def test_an_observation_beyond_its_space_is_clipped(make):
    env = InsertionEnv(make(observations={"own": Own(lambda n: np.full((n, 2), 50.0))}))
    assert env.reset(seed=1)[0]["own"].tolist() == [1.0, 1.0]


def test_a_mask_resets_some_environments(make):
    vector = InsertionVectorEnv(make(), 3)
    with pytest.raises(gymnasium.error.ResetNeeded):
        vector.reset(seed=1, options={"reset_mask": np.array([True, False, True])})
    vector.reset(seed=1)
    for _ in range(3):
        vector.step(np.full((3, 1, 2), 0.8))
    observed, info = vector.reset(seed=7, options={"reset_mask": np.array([False, True, False])})
    assert info["steps"].tolist() == [3, 0, 3]
    single, _ = InsertionEnv(make()).reset(seed=8)
    assert all(np.array_equal(observed[name][1], part) for name, part in single.items())
    # The others go on with their own generators.
    other = InsertionVectorEnv(make(), 3)
    other.reset(seed=1)
    assert str(other.reset()[0]["target"][0]) == str(vector.reset()[0]["target"][0])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"reset_mask": np.array([True, False])}, r"reset_mask = an array of shape \(2,\)"),
        ({"reset_mask": np.array([1, 0, 1])}, "reset_mask = .* of int64"),
        ({"reset_mask": np.zeros(3, bool)}, "reset_mask = all False"),
        ({"foo": 1}, r"options = \['foo'\]: there is none but reset_mask"),
    ],
)
def test_other_options_are_refused(make, options, words):
    vector = InsertionVectorEnv(make(), 3)
    vector.reset(seed=1)
    with pytest.raises(endowire.InputError, match=words):
        vector.reset(options=options)
    with pytest.raises(endowire.InputError, match="options = .*: there are none for reset"):
        InsertionEnv(make()).reset(options=options)
