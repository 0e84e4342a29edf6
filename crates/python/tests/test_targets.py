"""Targets: those that cannot be reached are told, openings are targets; and pictures are taken from where the vessel shows."""

import numpy as np
import pytest

import endowire
from endowire.gym import InsertionEnv, Task, centreline, ends, observations, reach, targets, tasks, vessels


@pytest.fixture(scope="module")
def arch():
    return vessels.FixedVessel(endowire.Vessel.generate("aortic_arch", edge_mm=3.0))


def begun(arch, target, length_mm=600.0, radius_mm=0.4, **parts):
    wire = endowire.Instrument.uniform(length_mm=length_mm, radius_mm=radius_mm, bending_stiffness_nmm2=10.0)
    env = InsertionEnv(Task(instruments=[wire], vessels=arch, target=target, **parts))
    env.reset(seed=1)
    return env


def test_a_target_out_of_reach_is_refused_with_the_reason(arch):
    carotid, far = targets.NamedTarget("left carotid"), targets.CentrelineTarget(150.0)
    begun(arch, carotid)
    begun(arch, far)
    for target, parts, words in (
        (carotid, {"length_mm": 100.0}, r"cannot be reached: the way to it is 304\.5 mm long, the instruments 100\.0 mm"),
        (carotid, {"radius_mm": 4.5}, r"cannot be reached: the lumen is 4\..* mm in radius .* thinner one"),
        (far, {"length_mm": 100.0}, r"least_mm = 150\.0: no point .* is within the reach of the instruments"),
        (carotid, {"threshold_mm": 500.0}, r"threshold_mm = 500\.0: the target, .* is reached before the first step"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            begun(arch, target, **parts)
    # Where it is barely too short it may cut corners: that is left to the simulation.
    begun(arch, carotid, length_mm=303.0)


def test_random_targets_are_within_reach(arch):
    line = arch.site.centreline
    env = begun(arch, targets.CentrelineTarget(50.0), length_mm=120.0)
    for _ in range(30):
        env.reset()
        assert 50.0 <= env.episodes.way_begun_mm[0] <= 120.0
    assert line.ways_mm(line.positions_mm[0]).max() > 200.0


def test_targets_of_tasks_are_those_without_the_check(arch):
    """All places of the arch are in reach of these wires, so the same ones are drawn."""
    line = arch.site.centreline
    for make in (tasks.aortic_arch, tasks.arch_variety):
        assert reach.reached(line, line.ways_mm(line.positions_mm[0]), make().instruments).all()


def test_reach_is_of_the_part_that_passes():
    table = np.array([[0, 0, 10.0 * k, 2.0, k - 1] for k in range(10)])
    table[4, 3] = 0.5
    line = centreline.Centreline(table)
    sections = [{"length_mm": 25.0, "radius_mm": 0.3}, {"length_mm": 75.0, "radius_mm": 0.8}]
    thin = endowire.Instrument([{**section, "bending_stiffness_nmm2": 5.0} for section in sections])
    told = reach.reached(line, 10.0 * np.arange(10), [thin])
    # The narrow place at 40 mm lets 25 mm of it through.
    assert told.tolist() == [True] * 7 + [False] * 3
    thick = endowire.Instrument.uniform(35.0, 0.6, 5.0)
    assert reach.reached(line, 10.0 * np.arange(10), [thick]).tolist() == [True] * 4 + [False] * 6
    assert np.array_equal(reach.reached(line, 10.0 * np.arange(10), [thick, thin]), told)


def test_a_target_within_the_threshold_is_drawn_again(arch):
    line = arch.site.centreline
    near, far = line.positions_mm[1] * 0.9 + line.positions_mm[0] * 0.1, line.positions_mm[20]

    class Either:
        def sample(self, rng, site, start):
            return [near, far][int(rng.integers(2))]

    env = begun(arch, Either(), threshold_mm=1.05 * np.linalg.norm(near - line.positions_mm[0]))
    for _ in range(10):
        env.reset()
        assert np.array_equal(env.episodes.target_mm[0], far)


def test_any_opening_is_one_that_the_sheath_is_not_in(arch):
    openings = np.array([opening["centre_mm"] for opening in arch.site.vessel.openings])
    env, drawn = begun(arch, targets.NamedTarget("any opening")), set()
    start = arch.site.centreline.positions_mm[0]
    for _ in range(30):
        env.reset()
        drawn.add(int(np.argmin(np.linalg.norm(openings - env.episodes.target_mm[0], axis=1))))
    assert len(drawn) == len(openings) - 1
    assert int(np.argmin(np.linalg.norm(openings - start, axis=1))) not in drawn
    with pytest.raises(endowire.InputError, match="'any opening' is a random opening"):
        begun(arch, targets.NamedTarget("liver"))


@pytest.mark.parametrize(("along", "side"), [([0, 0, 1], (0.0, 0.0)), ([0, 1, 0], (90.0, 0.0)), ([1, 0, 0], (0.0, 0.0))])
def test_pictures_show_the_vessel(along, side):
    axis = np.array(along, dtype=float)
    table = np.array([[*(40.0 * k * axis), 4.0, k - 1] for k in range(4)])
    vessel = endowire.Vessel.generate(table)
    seen = {"own": observations.Fluoroscopy(size_px=(48, 48)), "front": observations.Fluoroscopy(((0.0, 0.0),), (48, 48))}
    wire = endowire.Instrument.uniform(200.0, 0.8, 10.0)
    task = Task([wire], vessels.FixedVessel(vessel), observations=seen, ends=[ends.StepLimit(99)])
    env = InsertionEnv(task)
    observed, _ = env.reset(seed=1)
    assert env.episodes.sites[0].side == side and env.observation_space.contains(observed)
    for _ in range(20):
        observed, *_ = env.step([1.0, 0.0])
    dark = {name: np.squeeze(picture) < np.median(picture) - 25 for name, picture in observed.items()}
    assert dark["own"].sum() > 40
    if side == (0.0, 0.0):
        assert dark["front"].sum() == dark["own"].sum()
    else:
        # From the front a vessel along the line of sight hides the wire in one place, from which the shaft is led out downwards.
        assert dark["front"][:26].sum() < 0.2 * dark["own"].sum()


def test_leaving_the_vessel_ends_the_strict_task_alone(vessel, wire):
    over = {}
    for name in ("ArchVariety", "ArchVarietyAsEvaluated"):
        made = tasks.TASKS[name](instruments=[wire], vessels=vessels.FixedVessel(vessel), target=targets.CentrelineTarget(50.0))
        env = InsertionEnv(made)
        env.reset(seed=1)
        # The target is passed by: none is within a tenth of a millimetre of the way.
        made.threshold_mm = 1e-9
        for _ in range(60):
            *_, terminated, truncated, info = env.step([1.0, 0.0])
            if terminated or truncated:
                break
        over[name] = bool(truncated)
        assert env.episodes.batch.left_through[0] >= 0 and not terminated and info["failure"] == ""
        out_mm = env.episodes.tip_mm[0].copy()
        if not truncated:
            # It is pulled back in, and goes on.
            for _ in range(10):
                *_, terminated, truncated, _ = env.step([-1.0, 0.0])
            assert env.episodes.batch.left_through[0] < 0 and not truncated
            assert np.linalg.norm(env.episodes.tip_mm[0] - out_mm) > 20.0
    assert over == {"ArchVariety": True, "ArchVarietyAsEvaluated": False}
