import os
import signal
import threading
import time

import numpy as np
import pytest

import endowire


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
def test_an_interrupt_ends_long_work(simulation):
    for work in (
        lambda: endowire.Vessel.generate("hepatic", triangles=400_000).triangles,
        lambda: simulation.run(np.tile([[[0.5, 0.1]], [[-0.5, -0.1]]], (100_000, 1, 1))),
    ):
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        began = time.monotonic()
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            work()
        assert time.monotonic() - began < 10.0


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
@pytest.mark.parametrize("count", [1, 3])
def test_an_interrupt_of_a_batch_is_no_failure_of_a_simulation(vessel, count):
    # So soft a wire in so narrow elements takes seconds for one command.
    wire = endowire.Instrument.uniform(400.0, 0.2, 0.05)
    method = {"element_mm": 1.0, "tolerance": 1e-9}
    start = endowire.Simulation(vessel, wire, wall={"friction": 0.3}, method=method)
    batch = endowire.Batch([start] * count)
    moves = np.tile([[[390.0, 3.0]]], (count, 1, 1))
    timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        batch.step(moves)
    timer.join()
    assert (batch.inserted_mm == 0.0).all()
    # It goes on afterwards, and so does what comes out of it.
    assert batch.step(moves / 390.0) == {}
    assert batch.simulation(0).step(1.0).converged
