"""Parameters found from what was observed."""

import numpy as np
import pytest

import endowire
from endowire import Observed

METHOD = {"name": "kirchhoff", "element_mm": 4.0, "tolerance": 1e-9}
#: 30 commands of advance and rotation.
MOVES = np.stack([np.full(30, 2.0), 0.1 * np.sin(np.arange(30.0))], axis=1)[:, None, :]
SIGMA_MM, SIGMA_N = 0.2, 1e-4


@pytest.fixture(scope="module")
def vessel():
    return endowire.Vessel.generate("curved_tube")


def simulation(vessel, tip_nmm2, shaft_nmm2, friction):
    tip = {"length_mm": 15.0, "radius_mm": 0.2, "bending_stiffness_nmm2": tip_nmm2, "rest_curvature_per_mm": [0.06, 0.0]}
    shaft = {"length_mm": 300.0, "radius_mm": 0.2, "bending_stiffness_nmm2": shaft_nmm2}
    wire = endowire.Instrument([tip, shaft])
    return endowire.Simulation(vessel, wire, method=METHOD, wall={"friction": friction})


def recorded(truth, rng):
    """Places on the wire after some of the commands, and push forces, with noise."""
    observed, now = [], truth.copy()
    for k, moves in enumerate(MOVES):
        report = now.step(*moves[0])
        if k % 5 == 4:
            from_tip_mm = np.linspace(0.0, 0.9 * now.from_tip_mm[0], 8)
            seen = Observed(k, "points", np.zeros(24), SIGMA_MM, from_tip_mm=from_tip_mm)
            places = seen.residual(truth.gradients(MOVES[: k + 1], by=["EI[0]"])[k])[0] * SIGMA_MM
            seen.value = places + SIGMA_MM * rng.standard_normal(24)
            force_n = report.push_force_n + SIGMA_N * rng.standard_normal(1)
            observed += [seen, Observed(k, "push_force", force_n, SIGMA_N)]
    return observed


def test_stiffness_and_friction_are_found_again(vessel):
    truth = simulation(vessel, 6.0, 14.0, 0.15)
    observed = recorded(truth, np.random.default_rng(1))
    found = endowire.fit(simulation(vessel, 4.0, 10.0, 0.1), MOVES, observed, ["EI[0]", "EI[1]", "friction"])
    assert found.converged and not found.not_shown, found
    off = (found.values - [6.0, 14.0, 0.15]) / found.sigma
    assert np.all(np.abs(off) < 3.5), (found.values, found.sigma)
    # The stiffness of the tip shows best, that of the shaft barely: its curve is given by the tube.
    assert np.all(found.sigma < [0.1, 7.0, 0.05]), (found.values, found.sigma)
    # As many squares as numbers, less those that were fitted.
    assert abs(found.chi2 - found.n_residuals) < 4.0 * np.sqrt(2.0 * found.n_residuals)
    assert found.simulation.value("EI[1]") == found.values[1]
    # The start was not it.
    assert found.chi2 < 0.8 * endowire.fit(
        simulation(vessel, 4.0, 10.0, 0.1), MOVES, observed, ["EI[0]"], most_iterations=1
    ).chi2


def test_what_the_data_do_not_show_is_named(vessel):
    # Where neither wall nor load acts nothing shows the stiffness of a wire, but its rest shape.
    truth = simulation(vessel, 6.0, 14.0, 0.0)
    moves = np.array([[[3.0, 0.0]], [[2.0, 0.0]]])
    tip = truth.gradients(moves, by=["EI[0]"])[1].positions_mm[-1]
    observed = [Observed(1, "tip", tip, SIGMA_MM)]
    found = endowire.fit(truth, moves, observed, ["EI[0]", "rest_u[0]"])
    assert found.not_shown == ["EI[0]"] and np.isinf(found.sigma[0]) and np.isfinite(found.sigma[1]), found
    assert "not shown" in str(found)
    # A prior shows it.
    known = endowire.fit(truth, moves, observed, ["EI[0]", "rest_u[0]"], prior={"EI[0]": (5.0, 0.5)})
    assert not known.not_shown and known.sigma[0] == pytest.approx(0.5, rel=1e-3)
    assert known.values[0] == pytest.approx(5.0, abs=1e-3)


def test_pixels_are_those_of_a_projection(vessel):
    truth = simulation(vessel, 6.0, 14.0, 0.0)
    camera = np.array([[1000.0, 0.0, 128.0, 5.0], [0.0, 1000.0, 128.0, 7.0], [0.0, 0.0, 1.0, 900.0]])
    gradient = truth.gradients(MOVES[:8], by=["advance", "rest_u[0]"])[7]
    seen = Observed(7, "pixels", np.zeros(2), 1.0, from_tip_mm=[0.0], camera=camera)
    pixels, slopes = seen.residual(gradient)
    image = camera @ [*gradient.positions_mm[-1], 1.0]
    np.testing.assert_allclose(pixels, image[:2] / image[2], rtol=1e-12)
    moved = gradient.positions_mm[-1] + 1e-6 * gradient.of("tip")[:, 1]
    image = camera @ [*moved, 1.0]
    np.testing.assert_allclose((image[:2] / image[2] - pixels) / 1e-6, slopes[:, 1], rtol=1e-4)


def test_wrong_input_is_named(vessel):
    truth = simulation(vessel, 6.0, 14.0, 0.0)
    tip = [Observed(0, "tip", np.zeros(3), 1.0)]
    for arguments, named in (
        ((MOVES, tip, ["advance"]), "belongs to a command"),
        ((MOVES, [Observed(99, "tip", np.zeros(3), 1.0)], ["EI[0]"]), "30 commands"),
        ((MOVES, [], ["EI[0]"]), "observed"),
        ((MOVES, [Observed(0, "tips", np.zeros(3), 1.0)], ["EI[0]"]), "must be one of"),
        ((MOVES, [Observed(0, "tip", np.zeros(2), 1.0)], ["EI[0]"]), "2 numbers"),
        ((MOVES, [Observed(0, "points", np.zeros(3), 1.0)], ["EI[0]"]), "from_tip_mm"),
        ((MOVES, [Observed(0, "tip", [0.0, np.nan, 0.0], 1.0)], ["EI[0]"]), "observed.value"),
        ((MOVES, [Observed(0, "tip", np.zeros(3), 0.0)], ["EI[0]"]), "observed.sigma = 0.0"),
        ((MOVES, tip, ["EI[0]", "EI[0]"]), "it occurs twice"),
        ((MOVES, [Observed(0, "points", np.zeros(3), 1.0, from_tip_mm=[9.0])], ["EI[0]"]), "inserted"),
        ((MOVES, [Observed(0, "pixels", np.zeros(2), 1.0, from_tip_mm=[0.0])], ["EI[0]"]), "3, 4"),
    ):
        with pytest.raises(endowire.InputError, match=named):
            endowire.fit(truth, *arguments)
    with pytest.raises(endowire.InputError, match="not free"):
        endowire.fit(truth, MOVES, tip, ["EI[0]"], prior={"EI[1]": (1.0, 1.0)})
    with pytest.raises(endowire.InputError, match="stands for several"):
        truth.changed({"rest[0]": 0.1})
    with pytest.raises(endowire.InputError, match="bending_stiffness"):
        truth.changed({"EI[0]": -1.0})
