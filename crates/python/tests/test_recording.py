"""Recordings written by a program, and read."""

import json
import subprocess
import sys

import numpy as np
import pytest

import endowire


@pytest.fixture
def simulation():
    wire = endowire.Instrument.uniform(200.0, 0.4, 10.0)
    return endowire.Simulation(endowire.Vessel.generate("curved_tube", triangles=2000), wire)


def record(simulation, folder, steps=5, **more):
    with endowire.Recorder(simulation, folder, **more) as recorder:
        for step in range(steps):
            simulation.step(8.0, 0.1)
            recorder.note(simulation, 0.5 * (step + 1), 8.0, 0.1)


def test_what_is_noted_is_read_again(simulation, tmp_path):
    record(simulation, tmp_path / "out")
    recording = endowire.Recording(tmp_path / "out")
    assert len(recording) == 5 and recording.folder == tmp_path / "out"
    assert np.array_equal(recording.positions_mm(), simulation.positions_mm)
    steps = recording.steps
    assert np.allclose(steps["inserted_mm"], [8, 16, 24, 32, 40]) and np.allclose(steps["advance_mm"], 8.0)
    assert np.allclose(steps["time_s"], [0.5, 1, 1.5, 2, 2.5]) and steps["jumped"].dtype == bool
    assert steps["push_force_n"][-1] == simulation.report.push_force_n and np.isnan(steps["left_through"]).all()
    assert recording.positions_mm(-1).shape == (len(recording.from_tip_mm(4)), 3)
    assert recording.from_tip_mm(0)[0] == pytest.approx(8.0) and recording.from_tip_mm()[-1] == 0.0
    places, forces = recording.contacts()
    assert places.shape == forces.shape and len(places) == steps["contacts"][-1]
    assert recording.table("instruments.csv")["instrument"] == ["device"] * 5
    assert len(recording.table("injections.csv")["time_s"]) == 0
    summary = recording.summary
    assert summary["complete"] and summary["ended_by"] == "closed" and summary["steps"] == 5
    # The format is described by what describes it in the repository.
    schema = endowire.Recording.schema()
    assert set(summary) <= set(schema["properties"])
    assert list(schema["$defs"]["steps.csv"]["properties"]) and schema["$defs"]["steps.csv"]["properties"]["torque_nmm"]["unit"] == "N·mm"


def test_what_is_refused(simulation, tmp_path):
    record(simulation, tmp_path / "out", steps=2)
    recording = endowire.Recording(tmp_path / "out")
    for step in (2, -3):
        with pytest.raises(endowire.InputError, match=rf"step = {step}: must be from -2 to 1"):
            recording.positions_mm(step)
    with pytest.raises(endowire.InputError, match="give one of steps.csv, instruments.csv"):
        recording.table("steps")
    with pytest.raises(endowire.InputError, match=r"summary.json.*recorded run"):
        endowire.Recording(tmp_path)
    recorder = endowire.Recorder(simulation, tmp_path / "more")
    simulation.step(1.0)
    with pytest.raises(endowire.InputError, match="another run is recording"):
        endowire.Recorder(simulation, tmp_path / "more")
    recorder.note(simulation, 1.0, 1.0)
    with pytest.raises(endowire.InputError, match="time_s = 0.5: must be a time from that of the last step, 1 s"):
        recorder.note(simulation, 0.5, 1.0)
    with pytest.raises(endowire.InputError, match="advance_mm = NaN"):
        recorder.note(simulation, 2.0, float("nan"))
    recorder.close()
    recorder.close()
    with pytest.raises(endowire.InputError, match="is closed"):
        recorder.note(simulation, 2.0, 1.0)
    assert len(endowire.Recording(tmp_path / "more")) == 1
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "a.txt").write_text("mine")
    with pytest.raises(endowire.InputError, match="would mix with its files"):
        endowire.Recorder(simulation, tmp_path / "mine")


def test_a_step_is_noted_once_and_in_turn(simulation, tmp_path):
    recorder = endowire.Recorder(simulation, tmp_path / "out")
    simulation.step(8.0, 0.1)
    recorder.note(simulation, 1.0, 8.0, 0.1)
    with pytest.raises(endowire.InputError, match=r"step 2 is not the next one.*16 mm.*and it is at 8 mm"):
        recorder.note(simulation, 2.0, 8.0, 0.1)
    gone_on = simulation.copy()
    gone_on.run([[[8.0, 0.1]], [[8.0, 0.1]]])
    with pytest.raises(endowire.InputError, match=r"16 mm.*and it is at 24 mm.*record each step once, right after it"):
        recorder.note(gone_on, 2.0, 8.0, 0.1)
    other = endowire.Simulation(endowire.Vessel.generate("straight_tube", triangles=2000), simulation.instruments)
    other.run([[[8.0, 0.1]], [[8.0, 0.1]]])
    with pytest.raises(endowire.InputError, match="has another vessel"):
        recorder.note(other, 2.0, 8.0, 0.1)
    simulation.step(8.0, 0.1)
    recorder.note(simulation, 2.0, 8.0, 0.1)
    recorder.close()
    assert len(endowire.Recording(tmp_path / "out")) == 2


@pytest.mark.parametrize(
    ("raised", "ended_by"),
    [(ValueError("mine"), "failed"), (KeyboardInterrupt(), "interrupted"), (None, "closed")],
)
def test_what_ended_a_recording_is_told(simulation, tmp_path, raised, ended_by):
    def work():
        with endowire.Recorder(simulation, tmp_path / "out") as recorder:
            simulation.step(8.0)
            recorder.note(simulation, 1.0, 8.0)
            if raised is not None:
                raise raised

    if raised is None:
        work()
    else:
        with pytest.raises(type(raised)):
            work()
    summary = endowire.Recording(tmp_path / "out").summary
    assert (summary["complete"], summary["ended_by"], summary["converged"]) == (True, ended_by, raised is None)
    if raised is not None:
        assert summary["failure"]["step"] == 2 and summary["failure"]["reason"].startswith(type(raised).__name__)


def test_the_end_of_the_way_is_told(tmp_path):
    wire = endowire.Instrument.uniform(600.0, 0.4, 10.0)
    simulation = endowire.Simulation(endowire.Vessel.generate("curved_tube", triangles=2000), wire)
    with pytest.raises(endowire.EndOfWay) as raised, endowire.Recorder(simulation, tmp_path / "out") as recorder:
        for step in range(60):
            simulation.step(10.0)
            recorder.note(simulation, step + 1.0, 10.0)
    assert raised.value.ended_by == "left"
    assert endowire.Recording(tmp_path / "out").summary["ended_by"] == "left"


def test_tables_that_are_not_of_the_same_steps_are_refused(simulation, tmp_path):
    record(simulation, tmp_path / "out")
    table = tmp_path / "out" / "steps.csv"
    lines = table.read_text().splitlines(keepends=True)
    table.write_text("".join(lines[:2] + lines[3:]))
    with pytest.raises(endowire.InputError, match=r"steps\.csv: line 3: step = 3: comes after step 1: rows are missing"):
        endowire.Recording(tmp_path / "out")
    table.write_text("".join(lines)[:-9])
    with pytest.raises(endowire.InputError, match=r"steps\.csv: step = 4: is the last one"):
        endowire.Recording(tmp_path / "out")
    # The same is what a kill leaves.
    summary = tmp_path / "out" / "summary.json"
    whole = json.loads(summary.read_text())
    summary.write_text(json.dumps({**whole, "complete": False, "steps": 3}))
    with pytest.warns(RuntimeWarning, match=r"line 6 of steps\.csv is cut: read up to the last whole step"):
        recording = endowire.Recording(tmp_path / "out")
    assert len(recording) == 4 and recording.left_out.startswith("the row of line 6")
    assert len(recording.steps["step"]) == len(recording.table("instruments.csv")["step"]) == 4
    for text in ("[]", "{}"):
        summary.write_text(text)
        with pytest.raises(endowire.InputError, match=r"summary\.json: schema: .*recorded run"):
            endowire.Recording(tmp_path / "out")


KILLED = """
import os, sys, endowire
wire = endowire.Instrument.uniform(200.0, 0.4, 10.0)
simulation = endowire.Simulation(endowire.Vessel.generate("curved_tube", triangles=2000), wire)
recorder = endowire.Recorder(simulation, sys.argv[1])
for step in range(4):
    simulation.step(8.0)
    recorder.note(simulation, step + 1.0, 8.0)
os._exit(9)
"""


def test_a_program_that_is_killed_leaves_its_steps(tmp_path):
    done = subprocess.run([sys.executable, "-c", KILLED, tmp_path / "out"], check=False)
    assert done.returncode == 9
    recording = endowire.Recording(tmp_path / "out")
    assert len(recording) == 4 and not recording.summary["complete"]
    assert np.allclose(recording.steps["inserted_mm"], [8, 16, 24, 32])


def test_a_recording_of_a_scene_names_it(tmp_path):
    scene = endowire.assets_path() / "scenes" / "curved_tube_exact.toml"
    simulation = endowire.Scene(scene).simulation()
    record(simulation, tmp_path / "out", steps=3, scene=scene)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["scene_file"] == str(scene.absolute()) and len(summary["scene_hash"]) == 64
    assert {metric["name"] for metric in endowire.assess(tmp_path / "out")} >= {"tip_path_mm"}
