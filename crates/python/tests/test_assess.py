"""Measures of a recorded run, and what is refused."""

import json

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


def run_in(folder, scene, *, set=(), steps=STEPS):
    """The folder of a run in a scene of the assets."""
    folder.mkdir(exist_ok=True)
    (folder / "steps.csv").write_text(steps)
    scene = endowire.assets_path() / "scenes" / scene
    (folder / "summary.json").write_text(json.dumps({"schema": 1, "scene_file": str(scene), "set": list(set)}))
    return folder


def test_a_run_is_scored_by_a_subject(tmp_path):
    run_in(tmp_path, "arch_carotid.toml")
    assets = endowire.assets_path()
    subject = assets / "subjects" / "left_carotid.toml"
    arch = assets / "vessels" / "aortic_arch.csv"
    score = endowire.score(tmp_path, subject)
    assert score == endowire.score(tmp_path, subject, centreline=arch)
    assert (score["subject"], score["passed"]) == ("left_carotid", False)
    assert 0.0 < score["score"] < 5.0, "a part of the way, of the least score of its band"
    assert score["ended"] == {"by": "wall_force", "time_s": 2.0}
    metrics = {metric["name"]: metric for metric in score["metrics"]}
    assert metrics["total_s"]["passed"] is True and metrics["total_s"]["threshold"]["at_most"] == 240.0
    assert metrics["wall_force_n"]["passed"] is False, "0.4 N"
    assert metrics["beam_on_s"]["passed"] is None and "no beam was recorded" in metrics["beam_on_s"]["unjudged"]
    assert "beam_on_s" in [one["what"] for one in score["unjudged"]]
    assert metrics["turns"]["passed"] is None and metrics["turns"]["threshold"] is None
    with pytest.raises(endowire.InputError, match="hepatic.csv: is not the centre line of .*arch_carotid.toml"):
        endowire.score(tmp_path, subject, centreline=assets / "vessels" / "hepatic.csv")


def test_a_session_of_another_scene_is_refused(tmp_path):
    subject = endowire.assets_path() / "subjects" / "left_carotid.toml"
    for folder, words in [
        (run_in(tmp_path / "other", "arch_vertebral.toml"), "was recorded in .*arch_vertebral.toml"),
        (run_in(tmp_path / "rough", "arch_carotid.toml", set=["vessel.wall.friction=0.5"]), "friction=0.5"),
        (
            run_in(tmp_path / "long", "arch_carotid.toml", steps=STEPS.replace(",20.0,3", ",1e9,3")),
            r"samples\[1\].hands\[0\].inserted_mm = 1e9",
        ),
    ]:
        with pytest.raises(endowire.InputError, match=words):
            endowire.score(folder, subject)
        with pytest.raises(endowire.InputError, match=words):
            endowire.course([folder], subject=subject)
    drawn = run_in(tmp_path / "drawn", "arch_carotid.toml", set=["view.every=1000"])
    assert endowire.score(drawn, subject)["ended"]["by"] == "wall_force"
    nothing = tmp_path / "nothing.session.json"
    record = {"samples": [], "injections": [], "beam": []}
    scene = str(endowire.assets_path() / "scenes" / "arch_carotid.toml")
    nothing.write_text(json.dumps({"scene_file": scene, "set": [], "record": record}))
    for refused in (lambda: endowire.score(nothing, subject), lambda: endowire.assess(nothing)):
        with pytest.raises(endowire.InputError, match="nothing was done"):
            refused()


def test_a_course_of_attempts(tmp_path):
    folders = []
    for number, end_s in enumerate([8.0, 6.0, 5.0, 4.0]):
        steps = STEPS.replace(",2.0\n", f",{end_s}\n")
        folders.append(run_in(tmp_path / str(number), "arch_carotid.toml", steps=steps))
    course = endowire.course(folders)
    lines = {line["name"]: line for line in course["metrics"]}
    assert lines["total_s"]["values"] == [8.0, 6.0, 5.0, 4.0]
    assert (lines["total_s"]["trend"], lines["total_s"]["best"]) == ("better", 4.0)
    assert lines["wall_force_n"]["trend"] == "none" and lines["beam_on_s"]["first"] is None
    assert course["score"] is None and course["passed"] is None
    assets = endowire.assets_path()
    task = {"subject": assets / "subjects" / "left_carotid.toml"}
    scored = endowire.course(folders[:2], **task)
    assert scored["passed"] == [False, False] and all(0.0 < score < 5.0 for score in scored["score"]["values"])
    with pytest.raises(endowire.InputError, match="target"):
        endowire.course(folders, target="left carotid", **task)
    with pytest.raises(endowire.InputError, match=r"paths\[2\] = .*: is paths\[0\] again"):
        endowire.course([folders[0], folders[1], folders[1] / ".." / "0"])


def test_a_sac_needs_no_centreline(tmp_path):
    run_in(tmp_path, "coil.toml")
    subject = endowire.assets_path() / "subjects" / "first_loops.toml"
    with pytest.raises(endowire.InputError, match="goal.packing_density"):
        endowire.score(tmp_path, subject)
    packing = "step,coils_mm3,packing,neck_coverage,outside_mm,herniated,dome_force_n\n1,0,0.0,0,0,false,0\n2,2,0.012,0,0.5,false,0\n"
    (tmp_path / "packing.csv").write_text(packing)
    score = endowire.score(tmp_path, subject)
    assert score["ended"]["by"] == "wall_force", "0.4 N is more than is allowed"
    metrics = {metric["name"]: metric for metric in score["metrics"]}
    assert (metrics["packing_density"]["value"], metrics["coil_outside_mm"]["passed"]) == (0.012, True)
