"""Processes that are forked after a look, as those of vectors are on Linux."""

import subprocess
import sys

import pytest

#: One environment draws and a batch of several is stepped; then others are asked for in a process that is forked from it.
LOOK = """
import os, sys, numpy as np, endowire
vessel = endowire.Vessel.generate("curved_tube", edge_mm=2.5)
wire = endowire.Instrument.uniform(length_mm=300.0, radius_mm=0.45, bending_stiffness_nmm2=10.0)
simulation = endowire.Simulation(vessel, wire)
simulation.step(10.0)
view = {"views": ["3d", "fluoro"], "size_px": [48, 48], "backend": sys.argv[1]}
batch, moves = endowire.Batch([simulation] * 4), np.ones((4, 1, 2))
try:
    renderer = endowire.Renderer(vessel, view)
except endowire.InputError as error:
    print("no adapter", error)
    sys.exit(0)
seen = renderer.render(simulation, 1).fluoro
assert not batch.step(moves)
child = os.fork()
if child == 0:
    assert abs(renderer.render(simulation, 1).fluoro.astype(int) - seen).max() <= 2
    assert not batch.step(moves) and len(endowire.Vessel.generate("aortic_arch", edge_mm=5.0).triangles)
    endowire.Renderer(vessel, {**view, "backend": "auto"}).render(simulation, 1)
    if os.fork() == 0:
        assert not batch.step(moves)
        sys.exit(0)
    assert os.wait()[1] == 0
    sys.exit(0)
assert os.waitpid(child, 0)[1] == 0 and not batch.step(moves)
renderer.render(simulation, 2)
print("done")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="nothing is forked there")
@pytest.mark.parametrize("backend", ["cpu", "gpu"])
def test_a_process_that_is_forked_after_a_look_works(backend):
    # Where it does not, it hangs.
    told = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", LOOK, backend], capture_output=True, text=True, timeout=120
    )
    assert told.returncode == 0, told.stderr
    if "no adapter" in told.stdout:
        pytest.skip(told.stdout)
    assert "done" in told.stdout


VECTOR = """
import gymnasium, endowire.gym
from endowire.gym import observations

def make():
    seen = {"fluoro": observations.Fluoroscopy(size_px=(32, 32), view={"backend": "cpu"})}
    return gymnasium.make("endowire/CurvedTube-v0", observations=seen)

if __name__ == "__main__":
    make().reset(seed=0)
    vector = gymnasium.vector.AsyncVectorEnv([make] * 2, context="fork")
    print(vector.reset(seed=1)[0]["fluoro"].shape)
    vector.close()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="nothing is forked there")
def test_a_vector_of_processes_is_made_after_a_look(tmp_path):
    script = tmp_path / "vector.py"
    script.write_text(VECTOR)
    told = subprocess.run(
        [sys.executable, "-W", "ignore", str(script)], capture_output=True, text=True, timeout=120
    )
    assert told.stdout.strip() == "(2, 1, 32, 32)", told.stderr
