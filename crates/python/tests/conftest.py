import signal

import pytest

import endowire

# A shell ignores Ctrl-C for what it starts in the background, and Python then does so too: tests that interrupt would wait for ever.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def vessel():
    return endowire.Vessel.generate("curved_tube", edge_mm=2.0)


@pytest.fixture(scope="session")
def wire():
    tip = {
        "length_mm": 20.0,
        "radius_mm": 0.45,
        "bending_stiffness_nmm2": 5.0,
        "rest_curvature_per_mm": [0.05, 0.0],
    }
    shaft = {"length_mm": 280.0, "radius_mm": 0.45, "bending_stiffness_nmm2": 20.0}
    return endowire.Instrument([tip, shaft])


@pytest.fixture(scope="session")
def prepared(vessel, wire):
    return endowire.Simulation(
        vessel, wire, wall={"friction": 0.1}, method={"name": "kirchhoff", "element_mm": 4.0}
    )


@pytest.fixture
def simulation(prepared):
    """Nothing inserted yet."""
    return prepared.copy()
