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


def test_entry_radius_and_fields_are_parameters_too(vessel):
    simulation = inserted(vessel)
    simulation.set_fields([{"kind": "magnet", "end_mm": 6.0, "moment_am2": 2e-4, "field_t": [0.03, 0.0, 0.01]}])
    simulation.step(0.5)
    by = ["entry", "direction_x", "radius[0]", "field_x[0]"]
    gradient = simulation.gradient(**COMMAND, by=by)
    assert gradient.by == ["entry_x", "entry_y", "entry_z", "direction_x", "radius[0]", "field_x[0]"]
    for name, h in (("entry_x", 2e-5), ("direction_x", 1e-6), ("radius[0]", 1e-6), ("field_x[0]", 1e-4)):
        def tip(by, name=name):
            there = simulation.changed({name: simulation.value(name) + by})
            there.step(**COMMAND)
            return there.tip_mm

        difference = (tip(h) - tip(-h)) / (2.0 * h)
        slope = gradient.of("tip")[:, gradient.by.index(name)]
        assert np.linalg.norm(slope - difference) < 1e-5 * np.linalg.norm(difference), name
        # None of the others is taken for it.
        other = gradient.of("tip")[:, gradient.by.index(name) - 1]
        assert np.linalg.norm(other - difference) > 1e-2 * np.linalg.norm(difference), name


def test_a_change_together_costs_one_parameter_and_has_their_sum(vessel):
    simulation = inserted(vessel)
    moves = np.array([[[1.3, 0.05]], [[1.0, 0.0]]])
    along = {"EI[0]": 0.5, "rest_u[0]": -1e-3, "entry_y": 0.1}
    both = simulation.gradients(moves, by=list(along))[1], simulation.jvp(moves, along)[1]
    assert both[1].by == ["along"]
    for of in ("tip", "push_force"):
        np.testing.assert_allclose(both[1].of(of)[:, 0], both[0].jvp(of, list(along.values())), rtol=1e-5, atol=1e-8)
    with pytest.raises(endowire.InputError, match="stands for several"):
        simulation.jvp(moves, {"entry": 1.0})
    with pytest.raises(endowire.InputError, match="times"):
        simulation.gradients(moves, by=["EI[0]"], times_s=[1.0])


def test_what_has_no_derivative_is_refused(vessel):
    simulation = inserted(vessel)
    gradient = simulation.gradient(**COMMAND, by=["advance"])
    for by, named in (
        (["EI"], "EI\\[0\\]"),
        (["EI[7]"], "2 sections"),
        (["catheter.EI[0]"], "did you mean"),
        (["friction"], "friction above 0"),
        (["steer"], "steered"),
        (["field[0]"], r'^parameter = "field_x\[0\]": no field acts'),
        (["EI[00]"], r'^parameter = "EI\[00\]": did you mean "EI\[0\]"'),
        (["EI[0]", "advance", "EI[0]"], r'^parameter = "EI\[0\]": it occurs twice'),
        (["rest[0]", "rest_v[0]"], r'^parameter = "rest_v\[0\]": it occurs twice'),
    ):
        with pytest.raises(endowire.InputError, match=named):
            simulation.gradient(**COMMAND, by=by)
    # Other calls say the same, not that `gradient` was called.
    with pytest.raises(endowire.InputError, match=r'^parameter = "EI\[7\]": it has 2 sections'):
        simulation.changed({"EI[7]": 1.0})
    with pytest.raises(endowire.InputError, match=r'^parameter = "advance": it belongs to a command'):
        simulation.changed({"advance": 1.0})
    with pytest.raises(endowire.InputError, match=r'^parameter = "EI\[7\]": it has 2 sections'):
        simulation.jvp([[[1.0, 0.0]]], {"EI[7]": 1.0})
    for wrong in (float("nan"), float("inf")):
        with pytest.raises(endowire.InputError, match=r"v\[1\] = .*: must be a finite number"):
            gradient.vjp("tip", [1.0, wrong, 0.0])
        with pytest.raises(endowire.InputError, match=r"dp\[0\] = .*: must be a finite number"):
            gradient.jvp("tip", [wrong])
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
