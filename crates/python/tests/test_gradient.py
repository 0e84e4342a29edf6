"""Derivatives of what a command leads to."""

import numpy as np
import pytest

import endowire

METHOD = {"name": "kirchhoff", "element_mm": 4.0, "tolerance": 1e-11}
COMMAND = {"advance_mm": 1.3, "rotate_rad": 0.05}


def wire(tip_nmm2=5.0, curvature=0.06):
    tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": tip_nmm2, "rest_curvature_per_mm": [curvature, 0.0]}
    return endowire.Instrument([tip, {"length_mm": 300.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 12.0}])


def inserted(vessel, **tip):
    simulation = endowire.Simulation(vessel, wire(**tip), method=METHOD)
    for _ in range(20):
        simulation.step(2.0, 0.03)
    return simulation


@pytest.fixture(scope="module")
def vessel():
    return endowire.Vessel.generate("curved_tube")


def test_a_gradient_is_the_limit_of_differences(vessel):
    simulation = inserted(vessel)
    gradient = simulation.gradient(**COMMAND, by=["hand", "EI[0]", "rest[0]", "wall"])
    assert gradient.by == ["advance", "rotate", "EI[0]", "rest_u[0]", "rest_v[0]", "wall"]
    assert np.array_equal(simulation.positions_mm, inserted(vessel).positions_mm)

    def tip(h, name):
        there = simulation.copy()
        there.step(**{**COMMAND, name: COMMAND[name] + h})
        return there.positions_mm[-1]

    for k, name in enumerate(COMMAND):
        difference = (tip(1e-5, name) - tip(-1e-5, name)) / 2e-5
        assert np.linalg.norm(gradient.of("tip")[:, k] - difference) < 1e-5 * np.linalg.norm(difference)
    # Without friction the way does not matter.
    changed = [inserted(vessel, tip_nmm2=5.0 + h) for h in (-1e-3, 1e-3)]
    for one in changed:
        one.step(**COMMAND)
    difference = (changed[1].positions_mm[-1] - changed[0].positions_mm[-1]) / 2e-3
    slope = gradient.of("tip")[:, 2]
    assert np.linalg.norm(slope - difference) < 1e-4 * np.linalg.norm(difference)
    assert np.linalg.norm(slope) > 1e-6


def test_products_are_those_of_the_matrix(vessel):
    gradient = inserted(vessel).gradient(**COMMAND, by=["hand", "EI[0]", "GJ[1]"])
    for of in ("tip", "shape", "push_force", "torque", "energy", "wall_force"):
        matrix = gradient.of(of)
        assert matrix.shape[1] == 4
        weights, changes = np.linspace(1.0, 2.0, matrix.shape[0]), np.array([0.1, -0.2, 0.3, 0.4])
        np.testing.assert_allclose(gradient.vjp(of, weights), weights @ matrix, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(gradient.jvp(of, changes), matrix @ changes, rtol=1e-12, atol=1e-15)
    assert gradient.of("shape").shape == (gradient.positions_mm.size, 4)
    assert gradient.margin_n > 0.0 and gradient.margin_mm >= 0.0
    assert gradient.report.converged and gradient.one_sided.dtype == bool


def test_what_has_no_derivative_is_refused(vessel):
    simulation = inserted(vessel)
    gradient = simulation.gradient(**COMMAND, by=["advance"])
    for by, named in (
        (["EI"], "EI\\[0\\]"),
        (["EI[7]"], "2 sections"),
        (["catheter.EI[0]"], "did you mean"),
        (["friction"], "friction above 0"),
        (["steer"], "steered"),
    ):
        with pytest.raises(endowire.InputError, match=named):
            simulation.gradient(**COMMAND, by=by)
    with pytest.raises(endowire.InputError, match="moves"):
        simulation.gradient(by=["advance"])
    with pytest.raises(endowire.InputError, match="shape"):
        gradient.of("tips")
    with pytest.raises(endowire.InputError, match="3"):
        gradient.vjp("tip", [1.0, 2.0])
    with pytest.raises(endowire.InputError, match="1 parameters"):
        gradient.jvp("tip", [1.0, 2.0])
    other = endowire.Simulation(vessel, endowire.Instrument.uniform(300.0, 0.2, 5.0), method={"name": "mass-spring"})
    with pytest.raises(endowire.InputError, match="kirchhoff"):
        other.gradient(1.0, by=["advance"])
