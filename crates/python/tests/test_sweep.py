"""Sweeps from Python: the same rows as in one piece, in shards and by workers of Ray."""

import json
import os
import signal
import threading
from pathlib import Path

import pytest

import endowire

SCENE = Path(__file__).parents[3] / "assets" / "scenes" / "curved_tube_exact.toml"

SWEEP = f"""
scene = {json.dumps(str(SCENE))}
samples = 4
[set]
"method.element_mm" = 4.0
"script" = [{{ advance_mm = 40.0, step_mm = 2.0 }}]
[[axis]]
key = "device.section[0].radius_mm"
list = [0.4, 40.0]
[[axis]]
key = "device.section[0].bending_stiffness_nmm2"
random = {{ from = 1.0, to = 20.0 }}
"""


@pytest.fixture
def path(tmp_path):
    (tmp_path / "sweep.toml").write_text(SWEEP)
    return tmp_path / "sweep.toml"


def test_shards_give_the_table_of_one_piece(path, tmp_path):
    told = endowire.sweep(path, tmp_path / "whole", jobs=2)
    assert told == {"runs": 8, "earlier": 0, "failed": 4, "unconverged": 0, "table": tmp_path / "whole" / "runs.parquet"}
    assert endowire.sweep(path, tmp_path / "whole")["earlier"] == 8
    for shard in ("2/2", "1/2"):
        assert endowire.sweep(path, tmp_path / "parts", shard=shard)["runs"] == 4
    assert endowire.merge_sweeps([tmp_path / "parts"], tmp_path / "merged.parquet") == 8
    assert (tmp_path / "merged.parquet").read_bytes() == told["table"].read_bytes()


def test_sweep_refuses_wrong_shards_keys_and_records(path, tmp_path):
    with pytest.raises(endowire.InputError, match='shard = "3/2"'):
        endowire.sweep(path, tmp_path / "out", shard="3/2")
    with pytest.raises(endowire.InputError, match="8 of 8 runs|no rows"):
        endowire.merge_sweeps([tmp_path], tmp_path / "merged.parquet")
    path.write_text(SWEEP.replace("radius_mm", "radios_mm"))
    with pytest.raises(endowire.InputError, match="did you mean `radius_mm`"):
        endowire.sweep(path, tmp_path / "out")
    path.write_text('record = "shapes"\n' + SWEEP)
    with pytest.raises(endowire.InputError, match="record = given"):
        endowire.sweep(path, tmp_path / "out")


@pytest.mark.skipif(os.name == "nt", reason="signals are sent otherwise there")
def test_an_interrupt_stops_it_and_the_same_call_goes_on(path, tmp_path):
    path.write_text(SWEEP.replace("[0.4, 40.0]", "[0.4, 0.41]").replace("samples = 4", "samples = 30"))
    whole = endowire.sweep(path, tmp_path / "whole")["table"].read_bytes()
    timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        while True:
            (tmp_path / "out" / "runs.jsonl").unlink(missing_ok=True)
            endowire.sweep(path, tmp_path / "out")
    assert endowire.sweep(path, tmp_path / "out")["table"].read_bytes() == whole


def test_workers_of_ray_give_the_table_of_one_piece(path, tmp_path):
    ray = pytest.importorskip("ray")
    whole = endowire.sweep(path, tmp_path / "whole")["table"]
    ray.init(num_cpus=2, include_dashboard=False, logging_level="ERROR")
    try:

        @ray.remote(max_retries=-1)
        def work(shard):
            return endowire.sweep(path, tmp_path / "ray", jobs=1, shard=shard)["runs"]

        assert ray.get([work.remote(f"{k}/4") for k in range(1, 5)]) == [2] * 4
    finally:
        ray.shutdown()
    endowire.merge_sweeps([tmp_path / "ray"], tmp_path / "ray.parquet")
    assert (tmp_path / "ray.parquet").read_bytes() == whole.read_bytes()
