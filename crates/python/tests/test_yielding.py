"""A vessel that yields to a wire."""

import pickle

import numpy as np
import pytest

import endowire

YIELDING = {"bending_stiffness_nmm2": 300.0, "support_n_per_mm2": 0.005, "ends": "free"}


def simulation(yielding):
    rows = [[2.0 * (1.0 - np.cos(k / 10.0)), 0.0, 4.0 * k, 1.5, k - 1] for k in range(40)]
    vessel = endowire.Vessel.generate(np.array(rows))
    wire = endowire.Instrument([{"length_mm": 300.0, "radius_mm": 0.4, "bending_stiffness_nmm2": 5000.0}])
    start = {"position_mm": [0.0, 0.0, 1.0], "direction": [0.0, 0.0, 1.0]}
    return endowire.Simulation(vessel, wire, yielding=yielding, **start)


def test_a_wire_straightens_its_vessel():
    yields, still = simulation(YIELDING), simulation(None)
    for _ in range(28):
        report, at_rest = yields.step(advance_mm=5.0), still.step(advance_mm=5.0)
    assert report.vessel_energy_mj > 1e-3 and at_rest.vessel_energy_mj == 0.0
    # It bends less, and pushes less.
    assert report.bend_energy_mj < 0.9 * at_rest.bend_energy_mj
    again = pickle.loads(pickle.dumps(yields))
    for one in (again, yields):
        one.step(advance_mm=1.0)
    assert np.array_equal(again.positions_mm, yields.positions_mm)
    assert yields.places_mm == {}


def test_what_is_missing_is_named():
    with pytest.raises(endowire.InputError, match="vessel.yielding.support_n_per_mm2 = missing"):
        simulation({"bending_stiffness_nmm2": 300.0})
    with pytest.raises(endowire.InputError, match="presett"):
        simulation({"presett": "iliac"})
