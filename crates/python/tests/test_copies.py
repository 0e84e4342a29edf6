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


def test_pickled_instruments_keep_their_options(vessel, wire):
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


@pytest.fixture
def deploying(vessel):
    """A coil on its pusher in a microcatheter, out of it."""
    thin = {"radius_mm": 0.15, "bending_stiffness_nmm2": 0.5}
    coil = endowire.Instrument([{**thin, "length_mm": 6.0}, {**thin, "length_mm": 100.0}], coil_mm=6.0)
    catheter = endowire.Instrument(
        [{"length_mm": 80.0, "radius_mm": 0.45, "inner_radius_mm": 0.25, "bending_stiffness_nmm2": 5.0}]
    )
    method = {"element_mm": 2.0, "self_contact": True}
    simulation = endowire.Simulation(vessel, [coil, coil, catheter], method=method)
    simulation.step([5.0, 0.0, 5.0])
    simulation.step([7.0, 0.0, 0.0])
    return simulation


def test_a_coil_stays_one(deploying, copied):
    other = copied(deploying)
    assert [one.coil_mm for one in other.instruments] == [6.0, 6.0, 0.0]
    for one in (deploying, other):
        one.detach(0)
    assert other.state().to_bytes() == deploying.state().to_bytes()
    # With a detached coil, too.
    after = copied(other)
    assert len(after.coils) == 1
    for one in (deploying, after):
        one.step([0.0, 3.0, 0.0])
    assert after.state().to_bytes() == deploying.state().to_bytes()


def test_a_batch_of_coils_goes_on(deploying, copied):
    deploying.detach(0)
    batch = copied(endowire.Batch([deploying] * 2))
    assert batch.step([[[0.0, 0.0], [3.0, 0.0], [0.0, 0.0]]] * 2) == {}
    deploying.step([0.0, 3.0, 0.0])
    assert batch.state(1).to_bytes() == deploying.state().to_bytes()


def test_a_batch_detaches_the_coils_of_some(deploying):
    batch = endowire.Batch([deploying] * 2)
    before = batch.state(0).to_bytes()
    assert batch.detach([None, 0]) == {}
    deploying.detach(0)
    assert batch.state(0).to_bytes() == before
    assert batch.state(1).to_bytes() == deploying.state().to_bytes()
    # What cannot be detached is reported, and the others are not affected.
    failures = batch.detach([0, 0])
    assert list(failures) == [1] and "detached already" in str(failures[1])
    with pytest.raises(endowire.InputError, match="instruments = 1: give one for each of the 2"):
        batch.detach([None])


def test_an_instrument_stays_a_coil(copied):
    read = endowire.Instrument.read(SCENES.parent / "devices" / "coil_010_helix_2x6_soft.toml")
    assert copied(read).coil_mm == read.coil_mm == pytest.approx(60.0)
    assert "a coil of" in repr(read) and endowire.Instrument(read.sections).coil_mm == 0.0
    again = endowire.Instrument(read.sections, coil_mm=read.coil_mm)
    assert again.sections == read.sections and again.coil_mm == read.coil_mm
    for wrong in (5.1, -1.0, float("nan"), read.length_mm):
        with pytest.raises(endowire.InputError, match="coil_mm"):
            endowire.Instrument(read.sections, coil_mm=wrong)


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
