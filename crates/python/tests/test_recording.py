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
