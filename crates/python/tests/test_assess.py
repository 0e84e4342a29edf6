"""Measures of a recorded run, and what is refused."""

import endowire
import pytest

STEPS = """step,advance_mm,rotate_rad,inserted_mm,nodes,tip_x_mm,tip_y_mm,tip_z_mm,push_force_n,torque_nmm,jumped,wall_force_sum_n,wall_force_tip_n,time_s
1,10.0,0.0,10.0,3,0.0,0.0,10.0,0.1,0.0,false,0.2,0.0,1.0
2,10.0,0.0,20.0,3,0.0,0.0,20.0,0.3,0.0,true,0.4,0.1,2.0
"""


def test_measures_of_a_run(tmp_path):
    (tmp_path / "steps.csv").write_text(STEPS)
    metrics = {metric["name"]: metric for metric in endowire.assess(tmp_path)}
    assert metrics["total_s"]["value"] == 2.0 and metrics["tip_path_mm"]["value"] == 10.0
    assert metrics["wall_force_n"]["value"] == 0.4 and metrics["jumps"]["value"] == 1.0
    assert metrics["beam_on_s"]["value"] is None and metrics["wrong_branches"]["value"] is None
    assert all(metric["better"] in ("lower", "higher") and metric["definition"] for metric in metrics.values())


def test_what_is_refused(tmp_path):
    with pytest.raises(endowire.InputError, match="steps.csv"):
        endowire.assess(tmp_path)
    with pytest.raises(endowire.InputError, match="centreline"):
        endowire.assess(tmp_path, target="left carotid")
