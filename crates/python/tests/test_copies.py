"""Copies and pickles of simulations, batches and environments go on to the bit."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import endowire
from endowire.gym import InsertionEnv, InsertionVectorEnv, Task, vessels

SCENES = Path(__file__).parents[3] / "assets" / "scenes"


def pickled(thing):
    return pickle.loads(pickle.dumps(thing))


@pytest.fixture(params=[copy.copy, copy.deepcopy, pickled])
def copied(request):
    return request.param


def test_a_simulation_goes_on(simulation, copied):
    simulation.run(np.tile([[[2.0, 0.1]]], (20, 1, 1)))
    other = copied(simulation)
    assert np.array_equal(other.step(2.0).push_force_n, simulation.step(2.0).push_force_n)
    assert np.array_equal(other.positions_mm, simulation.positions_mm)
    # Each on its own.
    other.step(2.0)
    assert not np.array_equal(other.tip_mm, simulation.tip_mm)


def test_a_simulation_of_several_keeps_what_it_was_told(vessel, wire):
    catheter = endowire.Instrument(
        [{"length_mm": 250.0, "radius_mm": 0.9, "inner_radius_mm": 0.6, "bending_stiffness_nmm2": 30.0}]
    )
    simulation = endowire.Simulation(
        vessel, [wire, catheter], friction=[0.1, 0.0], wall={"friction": 0.2}, sheath_friction_n=0.1
    )
    simulation.step([30.0, 20.0], [0.3, 0.0])
    other = pickled(simulation)
    for one in (simulation, other):
        one.step([5.0, 5.0])
    assert np.array_equal(other.positions_mm, simulation.positions_mm)
    assert np.array_equal(other.report.push_force_n, simulation.report.push_force_n)


def test_a_simulation_of_a_scene_goes_on(copied):
    scene = endowire.Scene(SCENES / "curved_tube_exact.toml")
    simulation = scene.simulation()
    simulation.step(20.0)
    other = copied(simulation)
    assert np.array_equal(other.step(2.0).push_force_n, simulation.step(2.0).push_force_n)
    assert copied(scene).name == scene.name


def test_a_batch_goes_on_and_its_vessel_is_in_a_pickle_once(vessel, wire, copied):
    # A surface: a centre line is smaller than a state.
    surface = endowire.Vessel.from_arrays(vessel.vertices_mm, vessel.triangles)
    simulation = endowire.Simulation(surface, wire, wall={"friction": 0.1})
    batch, moves = endowire.Batch([simulation] * 6), np.arange(12.0).reshape(6, 1, 2)
    batch.step(moves)
    other = copied(batch)
    for one in (batch, other):
        one.step(moves)
    assert np.array_equal(other.tip_mm, batch.tip_mm) and len(other) == 6
    assert len(pickle.dumps(batch)) < 2 * len(pickle.dumps(batch.simulation(0)))


def test_environments_go_on(vessel, wire, copied):
    if copied is copy.copy:
        pytest.skip("a shallow copy of an environment shares its episode, as everywhere")
    task = Task([wire], vessels.FixedVessel(vessel))
    for env in (InsertionEnv(task), InsertionVectorEnv(task, 3)):
        env.reset(seed=3)
        action = np.full(env.action_space.shape, 0.7)
        for _ in range(4):
            env.step(action)
        other = copied(env)
        assert str(other.step(action)) == str(env.step(action))
        # The next episode comes from the same generator.
        assert str(other.reset()) == str(env.reset())
