"""Episodes as recordings of Rerun."""

import gymnasium
import numpy as np
import pytest

import endowire
from endowire.gym import InsertionEnv, InsertionVectorEnv, Task, ends, vessels

pytest.importorskip("rerun")


def rows(path):
    """Rows by entity and column, but for times."""
    from rerun.chunk import RrdReader

    told = {}
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for column, field in zip(batch.columns, batch.schema, strict=True):
            if not str(field.type).startswith(("timestamp", "duration")):
                told.setdefault((str(chunk.entity_path), field.name), []).extend(column.to_pylist())
    return told


def test_an_episode_is_a_recording(vessel, wire, tmp_path):
    from endowire.gym.rerun_log import RerunLog

    task = Task([wire], vessels.FixedVessel(vessel), ends=[ends.StepLimit(4)])
    env, twin = RerunLog(InsertionEnv(task), tmp_path), InsertionEnv(task)
    for episode in range(2):
        first, _ = env.reset(seed=episode)
        again, info = twin.reset(seed=episode)
        assert np.array_equal(first["tip"], again["tip"])
        rewards, ways, tips = [], [info["way_mm"]], [twin.episodes.tip_mm[0].copy()]
        for _ in range(4):
            *_, truncated, _ = env.step(np.array([[30.0, 1.0]]))
            _, reward, _, _, info = twin.step(np.array([[30.0, 1.0]]))
            rewards.append(reward)
            ways.append(info["way_mm"])
            tips.append(twin.episodes.tip_mm[0].copy())
        assert truncated
    env.close()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["episode_000000.rrd", "episode_000001.rrd"]
    told = rows(tmp_path / "episode_000001.rrd")
    assert np.ravel(told["/numbers/reward", "Scalars:scalars"]) == pytest.approx(rewards)
    assert np.ravel(told["/numbers/way_mm", "Scalars:scalars"]) == pytest.approx(ways)
    assert told["/tip", "step"] == [0, 1, 2, 3, 4]
    assert np.reshape(told["/tip", "Points3D:positions"], (-1, 3)) == pytest.approx(np.array(tips), abs=1e-4)
    assert np.reshape(told["/vessel", "Mesh3D:vertex_positions"], (-1, 3)).shape == vessel.vertices_mm.shape
    last = np.reshape(told["/instrument_0", "LineStrips3D:strips"][-1], (-1, 3))
    assert last[-1] == pytest.approx(tips[-1], abs=1e-4) and len(last) > 2


def test_what_cannot_be_recorded_is_refused(vessel, wire, tmp_path):
    from endowire.gym.rerun_log import RerunLog

    task = Task([wire], vessels.FixedVessel(vessel))
    for other in (gymnasium.make("CartPole-v1"), InsertionVectorEnv(task, 2)):
        with pytest.raises(endowire.InputError, match="env = .*: give an environment .*, not a vector"):
            RerunLog(other, tmp_path / "out")
    earlier = RerunLog(InsertionEnv(task), tmp_path / "out")
    earlier.reset(seed=1)
    earlier.close()
    kept = (tmp_path / "out" / "episode_000000.rrd").read_bytes()
    with pytest.raises(endowire.InputError, match="folder = .*out: is not empty: give a new one"):
        RerunLog(InsertionEnv(task), tmp_path / "out")
    assert (tmp_path / "out" / "episode_000000.rrd").read_bytes() == kept
