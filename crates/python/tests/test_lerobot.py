"""Episodes as a data set of LeRobot."""

import json

import gymnasium
import numpy as np
import pytest

import endowire
from endowire.gym import InsertionEnv, Task, ends, observations, vessels

pytest.importorskip("pyarrow", reason="pyarrow is not installed: no data set can be written")
av = pytest.importorskip("av", reason="PyAV is not installed: no film can be written")

LENGTHS = [5, 3, 5]


@pytest.fixture(scope="module")
def task(vessel, wire):
    seen = {
        "tip_mm": observations.Tip(),
        "hands": observations.Hands(),
        "fluoro": observations.Fluoroscopy(planes=((0.0, 0.0), (90.0, 0.0)), size_px=(64, 48)),
    }
    return Task([wire], vessels.FixedVessel(vessel), observations=seen, ends=[ends.StepLimit(5)], actions="physical", observed="physical")


def actions(length, seed):
    return np.random.default_rng(seed).uniform([5.0, -4.0], [40.0, 4.0], (length, 1, 2))


@pytest.fixture(scope="module")
def written(task, tmp_path_factory):
    """A data set of three episodes, the second of which is broken off."""
    from endowire.gym.lerobot_log import LeRobotLog

    folder = tmp_path_factory.mktemp("lerobot") / "set"
    env = LeRobotLog(InsertionEnv(task), folder, task="into the tube")
    for episode, length in enumerate(LENGTHS):
        env.reset(seed=episode)
        for action in actions(length, episode):
            env.step(action)
    # Nothing is done in an episode that is begun alone.
    env.reset(seed=9)
    env.close()
    return folder


@pytest.fixture(scope="module")
def twin(task):
    """What the same environment tells without a log: a list of frames for each episode."""
    env, told = InsertionEnv(task), []
    for episode, length in enumerate(LENGTHS):
        observed, _ = env.reset(seed=episode)
        frames = []
        for action in actions(length, episode):
            after, reward, terminated, truncated, info = env.step(action)
            frames.append((observed, action, reward, terminated or truncated, bool(info["reached"])))
            observed = after
        told.append(frames)
    return told


def frames_of(path):
    with av.open(path) as film:
        stream = film.streams.video[0]
        return [
            (float(frame.pts * stream.time_base), frame.to_ndarray(format="rgb24"))
            for frame in film.decode(stream)
        ]


def test_frames_are_what_was_seen_and_done(written, twin):
    import pyarrow.parquet

    info = json.loads((written / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"], info["total_episodes"], info["total_frames"]) == (
        "v3.0",
        7.5,
        3,
        13,
    )
    assert info["features"]["observation.state"]["names"][:4] == [
        "tip_mm[0]",
        "tip_mm[1]",
        "tip_mm[2]",
        "hands[0][0]",
    ]
    assert info["features"]["action"]["names"] == ["instrument_0.push_mm_s", "instrument_0.turn_rad_s"]
    begin = 0
    for episode, frames in enumerate(twin):
        path = written / info["data_path"].format(chunk_index=0, file_index=episode)
        table = pyarrow.parquet.read_table(path)
        assert set(table.column_names) == {
            name for name, feature in info["features"].items() if feature["dtype"] != "video"
        }
        rows = table.to_pylist()
        assert len(rows) == len(frames)
        for k, (row, (observed, action, reward, done, reached)) in enumerate(zip(rows, frames, strict=True)):
            state = np.concatenate([observed["tip_mm"], observed["hands"].ravel()])
            assert np.array_equal(np.float32(row["observation.state"]), state)
            # Velocities within their limits: some of these are beyond.
            carried_out = np.clip(action.ravel(), -np.array([35.0, 3.14]), np.array([35.0, 3.14]))
            assert np.float32(row["action"]) == pytest.approx(carried_out)
            assert row["next.reward"] == pytest.approx(reward)
            assert (row["next.done"], row["next.success"]) == (done, reached)
            assert row["timestamp"] == pytest.approx(k / 7.5)
            assert (row["frame_index"], row["index"], row["episode_index"]) == (k, begin + k, episode)
        begin += len(rows)
    # The second was broken off: it has an end and is not done.
    assert [frames[-1][3] for frames in twin] == [True, False, True]


def test_films_show_what_was_seen_at_the_time_of_their_row(written, twin):
    for episode, frames in enumerate(twin):
        for plane in range(2):
            path = written / f"videos/observation.images.fluoro_{plane}/chunk-000/file-{episode:03}.mp4"
            film = frames_of(path)
            assert [time for time, _ in film] == pytest.approx(np.arange(len(frames)) / 7.5, abs=1e-4)
            off = np.array(
                [
                    [
                        np.abs(shown - observed["fluoro"][plane][..., None].astype(float)).mean()
                        for observed, *_ in frames
                    ]
                    for _, shown in film
                ]
            )
            # Less than three levels of 256 are lost, and its own frame is the nearest.
            assert np.diag(off).max() < 3.0, off
            assert (off.argmin(axis=1) == np.arange(len(frames))).all(), off


def test_episodes_and_numbers_of_all(written, twin):
    import pyarrow.parquet

    rows = [
        pyarrow.parquet.read_table(written / f"meta/episodes/chunk-000/file-{k:03}.parquet").to_pylist()[0]
        for k in range(3)
    ]
    assert [(row["dataset_from_index"], row["dataset_to_index"]) for row in rows] == [(0, 5), (5, 8), (8, 13)]
    assert [row["tasks"] for row in rows] == [["into the tube"]] * 3
    assert rows[1]["videos/observation.images.fluoro_0/to_timestamp"] == pytest.approx(3 / 7.5)
    tasks = pyarrow.parquet.read_table(written / "meta/tasks.parquet")
    assert tasks.to_pydict() == {"task_index": [0], "task": ["into the tube"]}
    stats = json.loads((written / "meta/stats.json").read_text())
    tips = np.array([observed["tip_mm"] for frames in twin for observed, *_ in frames], dtype=float)
    own = {
        kind: np.array(values)[:3] for kind, values in stats["observation.state"].items() if kind != "count"
    }
    for kind, expected in (
        ("min", tips.min(0)),
        ("max", tips.max(0)),
        ("mean", tips.mean(0)),
        ("std", tips.std(0)),
    ):
        assert own[kind] == pytest.approx(expected, rel=1e-5), kind
    assert stats["observation.state"]["count"] == [13]
    pictures = np.array([observed["fluoro"][0] for frames in twin for observed, *_ in frames]) / 255.0
    grey = {kind: np.array(values) for kind, values in stats["observation.images.fluoro_0"].items()}
    assert grey["mean"].shape == (3, 1, 1)
    assert grey["mean"].ravel() == pytest.approx(pictures.mean()) and grey["std"].ravel() == pytest.approx(
        pictures.std()
    )
    assert grey["min"].ravel() == pytest.approx(pictures.min()) and grey["max"].ravel() == pytest.approx(
        pictures.max()
    )
    first = np.quantile(pictures[: LENGTHS[0]], 0.5, method="inverted_cdf")
    assert np.ravel(rows[0]["stats/observation.images.fluoro_0/q50"]) == pytest.approx(first)


def test_lerobot_opens_it(written):
    pytest.importorskip("lerobot", reason="lerobot is not installed: it is not asked to open the data set")
    from lerobot.datasets.lerobot_dataset import LeRobotDatasetMetadata

    meta = LeRobotDatasetMetadata("endowire/test", root=written)
    assert (meta.total_episodes, meta.total_frames, meta.tasks.index.tolist()) == (3, 13, ["into the tube"])
    assert meta.video_keys == ["observation.images.fluoro_0", "observation.images.fluoro_1"]
    assert (written / meta.get_video_file_path(2, "observation.images.fluoro_1")).exists()


def test_what_cannot_be_written_is_refused(written, vessel, wire, tmp_path):
    from endowire.gym.lerobot_log import LeRobotLog

    def env(**seen):
        return InsertionEnv(Task([wire], vessels.FixedVessel(vessel), observations=seen))

    with pytest.raises(endowire.InputError, match="not a vector"):
        LeRobotLog(gymnasium.make("CartPole-v1"), tmp_path)
    with pytest.raises(endowire.InputError, match="its log has other features"):
        LeRobotLog(env(tip_mm=observations.Tip()), written)
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "a.txt").write_text("mine")
    with pytest.raises(endowire.InputError, match="is not empty, and no log of endowire"):
        LeRobotLog(env(tip_mm=observations.Tip()), tmp_path / "own")
    (tmp_path / "own" / "a.txt").unlink()
    (tmp_path / "own").rmdir()
    with pytest.raises(endowire.InputError, match="63 × 48 pixels: a film needs even numbers"):
        LeRobotLog(env(fluoro=observations.Fluoroscopy(size_px=(63, 48))), tmp_path)
    with pytest.raises(endowire.InputError, match="must have no /"):
        LeRobotLog(env(**{"a/b": observations.Tip()}), tmp_path)
    # Numbers alone make a data set too.
    log = LeRobotLog(env(tip_mm=observations.Tip()), tmp_path)
    log.reset(seed=0)
    log.step(np.array([[30.0, 1.0]]))
    log.close()
    assert json.loads((tmp_path / "meta/info.json").read_text())["video_path"] is None
    assert not (tmp_path / "videos").exists()


def test_a_log_that_is_killed_is_whole_and_goes_on(written, task, tmp_path):
    from endowire.gym.lerobot_log import LeRobotLog

    def episode(env, number, length):
        env.reset(seed=number)
        for action in actions(LENGTHS[number], number)[:length]:
            env.step(action)

    folder = tmp_path / "set"
    killed = LeRobotLog(InsertionEnv(task), folder, task="into the tube")
    episode(killed, 0, LENGTHS[0])
    episode(killed, 1, 2)
    # It is killed here: the first episode is counted, and of the second there may be parts.
    info = json.loads((folder / "meta/info.json").read_text())
    assert (info["total_episodes"], info["total_frames"]) == (1, LENGTHS[0])
    # And one file of it, if it was killed between two.
    (folder / "data/chunk-000/file-001.parquet").write_bytes(b"torn")
    (folder / "meta/.info.json.part").write_text("{")
    with pytest.raises(endowire.InputError, match="the log in .* is of 'into the tube'"):
        LeRobotLog(InsertionEnv(task), folder, task="out of it")
    env = LeRobotLog(InsertionEnv(task), folder, task="into the tube")
    for number in (1, 2):
        episode(env, number, LENGTHS[number])
    env.close()
    files = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
    assert files == {path.relative_to(written) for path in written.rglob("*") if path.is_file()}
    for file in files:
        assert (folder / file).read_bytes() == (written / file).read_bytes(), file
