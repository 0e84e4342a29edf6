"""Sequences that are too long to be taken, or have no end, are refused; none is taken into memory."""

import itertools
from collections.abc import Sequence

import numpy as np
import pytest

import endowire


class Longest(Sequence):
    """A sequence that says so."""

    def __len__(self):
        return 10**12

    def __getitem__(self, index):
        return 1.0


ENDLESS = {
    "range": range(10**12),
    "nested": [range(10**12)],
    "says so": Longest(),
    "counts": itertools.count(),
    "generator": (1.0 for _ in itertools.count()),
    "repeats itself": np.broadcast_to(0.0, (10**12, 3)),
}
ENDLESS["in itself"] = [ENDLESS["range"]]
ENDLESS["in itself"].append(ENDLESS["in itself"])
PATH = np.array([[0.0, 0.0, 0.0, 5.0], [0.0, 0.0, 50.0, 5.0]])
CALLS = {
    "advance_mm": lambda given, s: s.step(advance_mm=given),
    "rotate_rad": lambda given, s: s.step(rotate_rad=given),
    "run": lambda given, s: s.run(given),
    "points_mm": lambda given, s: s.points_mm(given),
    "Simulation": lambda given, s: endowire.Simulation(given[0], given),
    "Batch": lambda given, s: endowire.Batch(given),
    "Batch.step": lambda given, s: endowire.Batch([s]).step(given),
    "Batch.points_mm": lambda given, s: endowire.Batch([s]).points_mm(given),
    "vertices_mm": lambda given, s: endowire.Vessel.from_arrays(given, [[0, 1, 2]]),
    "triangles": lambda given, s: endowire.Vessel.from_arrays([[0.0, 0.0, 0.0]], given),
    "generate": lambda given, s: endowire.Vessel.generate(given),
    "path_mm": lambda given, s: endowire.Controller.follow_path(given),
    "followers": lambda given, s: endowire.Controller.follow_path(PATH, followers=given),
    "turned": lambda given, s: endowire.Controller.search_ahead(PATH, turned=given),
    "merge_sweeps": lambda given, s: endowire.merge_sweeps(given, "nothing.parquet"),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("given", ENDLESS)
def test_what_has_no_end_is_refused(call, given, simulation):
    with pytest.raises((endowire.InputError, TypeError)):
        CALLS[call](ENDLESS[given], simulation)


def test_keywords_of_several_are_refused(vessel, wire):
    for key in ("names", "friction", "may_lead", "clearance"):
        with pytest.raises(endowire.InputError, match="10000000 are taken"):
            endowire.Simulation(vessel, [wire, wire], **{key: range(10**12)})
    with pytest.raises(endowire.InputError, match="10000000 are taken"):
        endowire.Simulation(vessel, range(10**12))


def test_what_is_like_a_list_is_taken(simulation):
    for given in ([1.0], (1.0,), np.array([1.0]), range(1, 2)):
        assert simulation.copy().step(advance_mm=given).inserted_mm[0] == 1.0
    assert simulation.points_mm(range(3)).shape == (3, 3)
