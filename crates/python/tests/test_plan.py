"""Plans: ways that are found on copies before the first command."""

import numpy as np
import pytest

import endowire
from endowire import planning
from endowire.gym import InsertionEnv, Task, arches, ends, policies, tasks, vessels


@pytest.fixture(scope="module")
def branch():
    """An arch in which a push straight on passes by the branch, and the way into it."""
    env = InsertionEnv(tasks.arch_variety(vessels=arches.ArchVariety(count=None)))
    env.reset(seed=900_003)
    return env.simulation, env.episodes.paths[0].table_mm


@pytest.fixture(scope="module")
def found(branch):
    return endowire.plan(*branch)


def test_a_plan_is_what_its_commands_lead_to(branch, found):
    simulation, path_mm = branch
    assert found.reached and found.trials > 0 and found.left_mm <= 5.0 and found.moves.shape[1:] == (1, 2)
    assert simulation.inserted_mm[0] == 0.0
    there = simulation.copy()
    for move, tip_mm in zip(found.moves, found.tips_mm, strict=True):
        there.step(*move[0])
        assert np.array_equal(there.tip_mm, tip_mm)
    assert np.array_equal(there.positions_mm, found.simulation.positions_mm)
    assert np.linalg.norm(there.tip_mm - path_mm[-1, :3]) < 10.0
    # It only pushes and turns, within what a step of an environment takes.
    assert found.moves[..., 0].min() >= 0.0 and found.moves[..., 0].max() <= 4.0
    assert np.abs(found.moves[..., 1]).max() <= planning.TURN_RAD + 1e-12
    again = endowire.plan(*branch)
    assert np.array_equal(again.moves, found.moves) and again.trials == found.trials


def test_a_plan_takes_fewer_commands_than_looking_ahead_at_each(branch, found):
    simulation, path_mm = branch
    ahead, there, commands = endowire.Controller.search_ahead(path_mm), simulation.copy(), 0
    while (move := ahead.next(there)) is not None:
        there.step(*move[0])
        commands += 1
    assert ahead.ended == "arrived" and len(found.moves) < 0.7 * commands
    # Looking ahead tries 20 mm with each of six turns, pushed and pulled, for every 20 mm: more than a hundred commands.
    assert found.steps < 3 * len(found.moves)


def test_where_no_turn_helps_the_way_is_followed(branch, monkeypatch):
    monkeypatch.setattr(planning, "TURNS_RAD", ())
    monkeypatch.setattr(planning, "FOLLOWED_MM", (np.inf,))
    simulation, path_mm = branch
    followed = endowire.plan(simulation, path_mm)
    # As far as the hand itself comes before it pulls back, or farther by the push at the end.
    hand, alone = endowire.Controller.follow_path(path_mm), simulation.copy()
    planner, farthest_mm = endowire.Planner(path_mm), 0.0
    while (move := hand.next(alone)) is not None and not hand.retries:
        alone.step(*move[0])
        farthest_mm = max(farthest_mm, planner.on_path(alone.tip_mm)[0])
    assert followed.reached == (hand.ended == "arrived")
    assert followed.trials >= 1 and planner.on_path(followed.simulation.tip_mm)[0] >= farthest_mm - 2.0


def test_without_turns_it_does_not_arrive(branch, monkeypatch):
    monkeypatch.setattr(planning, "TURNS_RAD", ())
    monkeypatch.setattr(planning, "FOLLOWED_MM", ())
    straight = endowire.plan(*branch)
    assert not straight.reached and straight.left_mm > 5.0 and straight.trials == 0
    hand = endowire.Planner(branch[1])
    simulation = branch[0].copy()
    while (move := hand.next(simulation)) is not None:
        simulation.step(*move[0])
    # It has gone as far as it could.
    assert hand.ended == "given up" and hand.left_mm(simulation.tip_mm) == straight.left_mm


def test_a_planner_plans_again_where_the_tip_is_elsewhere(branch, found):
    simulation, path_mm = branch
    for disturbed in (False, True):
        hand, there = endowire.Planner(path_mm), simulation.copy()
        for k in range(300):
            move = hand.next(there)
            if move is None:
                break
            there.step(*move[0])
            if disturbed and k == 20:
                there.step(advance_mm=-15.0, rotate_rad=1.0)
        assert hand.ended == "arrived" and hand.retries == int(disturbed)
        assert k == len(found.moves) or disturbed


def test_an_expert_that_plans_arrives_in_an_environment(vessel, wire):
    task = Task([wire], vessels.FixedVessel(vessel), ends=[ends.TargetReached(), ends.StepLimit(100)], wall={"friction": 0.1})
    env, expert = InsertionEnv(task), policies.Steered("plan")
    env.reset(seed=4)
    over = False
    while not over:
        *_, terminated, truncated, info = env.step(policies.action(expert, env))
        over = terminated or truncated
    assert terminated and info["reached"]


def test_others_stay_where_one_is_led(vessel, wire):
    catheter = endowire.Instrument(
        [{"length_mm": 150.0, "radius_mm": 0.9, "inner_radius_mm": 0.6, "bending_stiffness_nmm2": 30.0}]
    )
    both = endowire.Simulation(vessel, [wire, catheter], method={"name": "kirchhoff", "element_mm": 5.0})
    both.step([10.0, 10.0])
    path_mm = vessel.path(vessel.centreline[40, :3].tolist())
    found = endowire.plan(both, path_mm)
    assert found.reached and not found.moves[:, 1].any()
    assert found.simulation.inserted_mm[1] == 10.0 and found.simulation.inserted_mm[0] > 20.0
    assert endowire.plan(both, path_mm, lead=1).moves[:, 1].any()


def test_others_follow_in_a_plan_as_behind_other_controllers(vessel, wire):
    catheter = endowire.Instrument(
        [{"length_mm": 150.0, "radius_mm": 0.9, "inner_radius_mm": 0.6, "bending_stiffness_nmm2": 30.0}]
    )
    both = endowire.Simulation(vessel, [wire, catheter], method={"name": "kirchhoff", "element_mm": 5.0})
    path_mm = vessel.path(vessel.centreline[40, :3].tolist())
    found = endowire.plan(both, path_mm, followers=[(1, 15.0)])
    wire_mm, catheter_mm = found.simulation.inserted_mm
    assert found.reached and catheter_mm == pytest.approx(wire_mm - 15.0) and catheter_mm > 5.0
    assert not found.moves[:, 1, 1].any()
    # The same by the controller that carries it out.
    hand, there = endowire.Controller.plan(path_mm, followers=[(1, 15.0)]), both.copy()
    while (move := hand.next(there)) is not None:
        there.step(move[:, 0], move[:, 1])
    assert hand.ended == "arrived" and np.array_equal(there.inserted_mm, found.simulation.inserted_mm)
    assert isinstance(hand, endowire.Planner)
    for followers in ([(0, 5.0)], [(2, 5.0)]):
        with pytest.raises(endowire.InputError, match="each is in a team once"):
            endowire.plan(both, path_mm, followers=followers)


def test_wrong_input_is_named(branch):
    simulation, path_mm = branch
    for make, words in (
        (lambda: endowire.Planner(path_mm[:1]), "path_mm = 1 rows"),
        (lambda: endowire.Planner(path_mm[:, :3]), r"the shape \(n, 4\)"),
        (lambda: endowire.Planner(path_mm, arrived_mm=-1.0), "arrived_mm = -1: must be a distance"),
        (lambda: endowire.Planner(path_mm, lead=-1), "lead = -1"),
        (lambda: endowire.plan(simulation, path_mm, lead=2), "lead = 2: there are 1"),
        (lambda: endowire.Controller.plan(path_mm, followers=[(1, -1.0)]), "followers = -1"),
    ):
        with pytest.raises(endowire.InputError, match=words):
            make()
