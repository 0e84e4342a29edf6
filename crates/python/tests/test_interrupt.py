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
