"""Magnets and weight, and what comes with a simulation that is in a field."""

import copy
import pickle
from pathlib import Path

import endowire
import numpy as np
import pytest

VESSELS = Path(__file__).parents[3] / "assets" / "vessels"
MAGNET = {"kind": "magnet", "end_mm": 4.0, "moment_am2": 4e-3, "field_t": [0.05, 0.0, 0.0]}


@pytest.fixture
def simulation():
    vessel = endowire.Vessel.generate("aortic_arch", edge_mm=4.0)
    wire = endowire.Instrument.uniform(length_mm=200.0, radius_mm=0.3, bending_stiffness_nmm2=10.0)
    started = endowire.Simulation(vessel, wire)
    started.step(30.0)
    return started


def test_a_magnet_steers_the_tip_and_takes_it_back(simulation):
    before = simulation.tip_mm
    simulation.set_fields([MAGNET])
    report = simulation.step()
    # Couple m B = 0.2 N·mm over 28 mm of wire: 0.5 rad at most, so several millimetres.
    assert report.converged and report.field_energy_mj < -0.01
    assert np.linalg.norm(simulation.tip_mm - before) > 2.0
    simulation.set_fields([])
    assert simulation.step().field_energy_mj == 0.0
    np.testing.assert_allclose(simulation.tip_mm, before, atol=1e-4)


def test_copies_and_pickles_stay_in_the_field(simulation):
    simulation.set_fields([MAGNET, {"kind": "weight", "force_n_per_mm": [0.0, 0.0, -1e-5]}])
    simulation.step()
    others = [copy.copy(simulation), pickle.loads(pickle.dumps(simulation))]
    simulation.step(2.0)
    for other in others:
        other.step(2.0)
        np.testing.assert_array_equal(other.tip_mm, simulation.tip_mm)
        assert other.report.field_energy_mj == simulation.report.field_energy_mj != 0.0


def pickled(thing):
    return pickle.loads(pickle.dumps(thing))


def in_a_batch(simulation):
    return pickled(endowire.Batch([simulation])).simulation(0)


def restored(simulation):
    bare = simulation.copy()
    bare.set_fields([])
    bare.step()
    batch = endowire.Batch([bare])
    batch.restore(0, endowire.State.from_bytes(simulation.state().to_bytes()))
    return batch.simulation(0)


@pytest.mark.parametrize("copied", [copy.copy, pickled, in_a_batch, restored])
@pytest.mark.parametrize("is_stepped", [False, True])
def test_fields_that_are_set_come_with_what_is_copied(simulation, copied, is_stepped):
    simulation.set_fields([MAGNET])
    if is_stepped:
        simulation.step()
    other = copied(simulation)
    for one in (simulation, other):
        one.step(2.0)
    assert other.report.field_energy_mj < -0.01
    assert other.state().to_bytes() == simulation.state().to_bytes()
    assert other.report.to_dict() == simulation.report.to_dict()


@pytest.mark.parametrize("copied", [pickled, in_a_batch])
def test_fields_of_a_scene_that_are_removed_stay_away(copied):
    text = (
        'name = "in a field"\n[vessel]\ntree = "straight_tube.csv"\n[device]\n[[device.section]]\nlength_mm = 100.0\n'
        "radius_mm = 0.3\nbending_stiffness_nmm2 = 10.0\n[sheath]\nopening = 0\n"
        '[[field]]\nkind = "weight"\nforce_n_per_mm = [0.0, 1e-5, 0.0]\n'
    )
    simulation = endowire.Scene(VESSELS / "scene.toml", text=text).simulation()
    simulation.step(20.0)
    assert copied(simulation).step(1.0).field_energy_mj != 0.0
    simulation.set_fields([])
    assert copied(simulation).step(1.0).field_energy_mj == 0.0


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"kind": "magnet", "end_mm": 4.0, "moment_am2": 4e-3, "field_t": [50.0, 0.0, 0.0]}, "field_t = 50"),
        ({"kind": "weight", "force_n_per_mm": [float("nan"), 0.0, 0.0]}, "every number must be finite"),
        ({"kind": "weight", "instrument": 3, "force_n_per_mm": [0.0, 0.0, 1e-5]}, r"field\[0\].instrument = 3: there are 1"),
        ({**MAGNET, "end_mm": 4000.0}, r"field\[0\].end_mm = 4000: must be within the instrument, 200 mm"),
        (["weight", 0, [0.0, 0.0, 1e-5]], r"fields\[0\] = .*: must be a dictionary"),
        ({"kind": "wind"}, "wind"),
    ],
)
def test_what_is_no_field_is_refused_and_nothing_changes(simulation, wrong, says):
    simulation.set_fields([MAGNET])
    simulation.step()
    before = simulation.tip_mm
    with pytest.raises(endowire.InputError, match=says):
        simulation.set_fields([wrong])
    simulation.step()
    np.testing.assert_array_equal(simulation.tip_mm, before)


def test_the_package_has_a_version():
    assert endowire.__version__.count(".") == 2


@pytest.mark.parametrize(
    "part",
    [{"threshold_mm": -1.0}, {"force_limit_n": float("nan")}, {"control_period_s": 0.0}, {"speed_limits": (-5.0, 1.0)}, {"solves": 2.5}],
)
def test_limits_of_a_task_are_above_zero(part):
    tasks = pytest.importorskip("endowire.gym.tasks")
    with pytest.raises(endowire.InputError, match=next(iter(part))):
        tasks.arch_variety(**part)
