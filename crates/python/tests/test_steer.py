"""Instruments that are steered, and the twist of what is outside the body."""

import endowire
import numpy as np
import pytest


def _catheter() -> endowire.Instrument:
    shaft = {"length_mm": 200.0, "radius_mm": 0.9, "bending_stiffness_nmm2": 60.0}
    tip = shaft | {"length_mm": 40.0, "steer": {"plane_deg": 0.0, "curvature_per_mm_at_1": 0.02}}
    return endowire.Instrument([tip, shaft])


def _start() -> endowire.Simulation:
    vessel = endowire.Vessel.generate("straight_tube")
    return endowire.Simulation(vessel, [_catheter()], opening=0)


def test_steering_is_reported_and_goes_on() -> None:
    simulation = _start()
    simulation.step(30.0)
    report = simulation.step(steer=0.4)
    assert report.steer == pytest.approx([0.4])
    assert report.steer_mj.shape == (1,)
    # As a third column of moves.
    report = simulation.run(np.array([[[1.0, 0.0, 0.1]], [[0.0, 0.2, -0.2]]]))
    assert report.steer == pytest.approx([0.3])
    with pytest.raises(endowire.InputError, match="steer = 0.9"):
        simulation.step(steer=0.9)


def test_a_flat_wire_bends_more_easily_in_its_soft_plane() -> None:
    def bends(plane_deg: float, force: tuple[float, float, float]) -> float:
        wire = {"length_mm": 200.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 12.0}
        wire["soft_plane"] = {"plane_deg": plane_deg, "bending_stiffness_nmm2": 3.0}
        vessel = endowire.Vessel.generate("straight_tube")
        simulation = endowire.Simulation(vessel, [endowire.Instrument([wire])], opening=0)
        simulation.step(30.0)
        straight_mm = np.array(simulation.tip_mm)
        simulation.set_fields([{"kind": "weight", "force_n_per_mm": list(force)}])
        simulation.step(0.0)
        return float(np.linalg.norm(simulation.tip_mm - straight_mm))

    weights = [(1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0)]
    [[soft, stiff], [across, along]] = [[bends(plane, one) for one in weights] for plane in (0.0, 90.0)]
    assert max(soft / stiff, stiff / soft) == pytest.approx(4.0, rel=0.02)
    assert (soft, stiff) == pytest.approx((along, across), rel=1e-3)
    with pytest.raises(endowire.InputError, match="soft_plane.bending_stiffness_nmm2 = 20"):
        section = {"length_mm": 20.0, "radius_mm": 0.2, "bending_stiffness_nmm2": 12.0}
        endowire.Instrument([section | {"soft_plane": {"plane_deg": 0.0, "bending_stiffness_nmm2": 20.0}}])


def test_the_mouth_lags_behind_the_hand() -> None:
    simulation = _start()
    simulation.step(30.0)
    simulation.step(steer=1.0)
    report = simulation.step(rotate_rad=0.5)
    lag_rad = report.rotation_rad - report.mouth_rotation_rad
    # 210 mm are outside, of GJ = EI / 1.3.
    assert lag_rad == pytest.approx(report.torque_nmm * 210.0 / (60.0 / 1.3), abs=1e-9)
    assert report.tail_energy_mj == pytest.approx(0.5 * report.torque_nmm[0] * lag_rad[0], abs=1e-9)
