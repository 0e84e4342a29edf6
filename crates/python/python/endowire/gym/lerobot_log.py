"""Episodes as a data set of `LeRobot <https://github.com/huggingface/lerobot>`_, for imitation learning: numbers as
Parquet, fluoroscopic pictures as mp4, in the layout of LeRobotDataset v3.0.

It requires pyarrow and PyAV: ``pip install "endowire[lerobot]"``. Each episode has its own files, and is counted once
they are complete: whenever the program ends, or is killed, what was finished is a valid data set, and a log of the
same environment goes on with it.
"""

from __future__ import annotations

import json
from fractions import Fraction
from os import PathLike
from pathlib import Path
from typing import Any, SupportsFloat

import av
import gymnasium
import numpy as np
import pyarrow
import pyarrow.parquet
from numpy.typing import NDArray

from .. import InputError
from .lerobot_files import CHUNK, FILE, INFO, STATS, TASKS
from .lerobot_files import begin, drop_unfinished, finish, known, write_json, write_table
from .lerobot_numbers import LEVELS, Numbers, from_lists, of_levels, of_rows, together
from .logs import watched

#: Resolution of frame rates in mp4.
_FINEST_RATE = 10_000
#: Distance of key frames, small so that a single frame is read quickly; crf 18 preserves the noise of pictures.
_CODEC, _OPTIONS = "libx264", {"g": "2", "crf": "18", "threads": "1"}
#: Data recorded for each step besides observation and action.
_OF_STEP = {"next.reward": "float32", "next.done": "bool", "next.truncated": "bool", "next.success": "bool"}
#: Indices of each step.
_PLACE = {
    "timestamp": "float32",
    **dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64"),
}


class LeRobotLog(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Writes each episode of an environment to the data set ``folder``, which must be new, empty, or a log of such an
    environment, which then goes on; an episode is complete after the next `reset` or `close`.

    A frame contains an observation and the action that followed: ``observation.state``, all numbers of the
    observation concatenated; ``observation.images.NAME`` for its pictures (``NAME_0`` and so on for several planes);
    ``action``, velocities clipped to their limits; and the results ``next.reward``, ``next.done``, ``next.truncated``
    and ``next.success``. ``task`` describes the task in words.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        folder: str | PathLike[str],
        task: str = "steer the tip to the target",
    ) -> None:
        inner = watched(env)
        self._inner, self._task, self.folder = inner, task, Path(folder)
        before = known(self.folder)
        super().__init__(env)
        self._fps = Fraction(1.0 / inner.task.control_period_s).limit_denominator(_FINEST_RATE)
        spaces: dict[str, Any] = inner.task.observation_spaces()
        wrong = [name for name in spaces if "/" in name]
        if wrong:
            raise InputError(f"observations = {wrong[0]!r}: a name of a part must have no /")
        self._vectors = [name for name, space in spaces.items() if space.dtype != np.uint8]
        #: Observation part and plane of each film.
        self._films: dict[str, tuple[str, int]] = {}
        for name in (name for name in spaces if name not in self._vectors):
            planes, *size = spaces[name].shape
            if any(length % 2 for length in size):
                raise InputError(
                    f"{name} = {size[1]} × {size[0]} pixels: a film needs even numbers of pixels"
                )
            for plane in range(planes):
                self._films[f"observation.images.{name}" + (f"_{plane}" if planes > 1 else "")] = name, plane
        self._features = self._described(spaces)
        self._observed: dict[str, NDArray[Any]] = {}
        self._rows: list[dict[str, Any]] = []
        self._writers: dict[str, tuple[av.container.OutputContainer, Any, Path]] = {}
        self._levels: dict[str, NDArray[np.int64]] = {}
        self._episodes, self._frames = 0, 0
        self._stats: dict[str, Numbers] = {}
        self._told = before is not None
        if before is not None:
            self._go_on(before)

    def _go_on(self, before: dict[str, Any]) -> None:
        """Continues the log that is in the folder."""
        described = json.loads(json.dumps(self._about()))
        for key in ("fps", "features"):
            if before.get(key) != described[key]:
                raise InputError(f"folder = {self.folder}: its log has other {key}: give a new one")
        tasks = pyarrow.parquet.read_table(self.folder / TASKS)["task"].to_pylist()
        if tasks != [self._task]:
            raise InputError(f"task = {self._task!r}: the log in {self.folder} is of {tasks[0]!r}")
        self._episodes, self._frames = before["total_episodes"], before["total_frames"]
        stats = json.loads((self.folder / STATS).read_text(encoding="utf-8"))
        self._stats = {name: from_lists(numbers) for name, numbers in stats.items()}
        drop_unfinished(self.folder, self._episodes)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        result = self.env.reset(seed=seed, options=options)
        self._end()
        self._observed = result[0]
        return result

    def step(self, action: NDArray[Any]) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        if not self._told:
            # From here on the folder is that of a log.
            self._tell_all()
            self._told = True
        result = self.env.step(action)
        observed, reward, terminated, truncated, info = result
        row: dict[str, Any] = {"action": self._inner.episodes.action[0].ravel().astype(np.float32)}
        if self._vectors:
            parts = [np.ravel(self._observed[name]) for name in self._vectors]
            row["observation.state"] = np.concatenate(parts).astype(np.float32)
        row["next.reward"] = float(reward)
        row["next.done"], row["next.truncated"] = terminated or truncated, truncated
        row["next.success"] = bool(info["reached"])
        for key, (name, plane) in self._films.items():
            self._shoot(key, self._observed[name][plane])
        self._rows.append(row)
        self._observed = observed
        return result

    def close(self) -> None:
        self._end()
        super().close()

    def _described(self, spaces: dict[str, Any]) -> dict[str, dict[str, Any]]:
        """The features of `info.json`."""

        def numbers(dtype: str, names: list[str]) -> dict[str, Any]:
            return {"dtype": dtype, "shape": [len(names)], "names": names}

        def named(name: str, shape: tuple[int, ...]) -> list[str]:
            return [name + "".join(f"[{k}]" for k in at) for at in np.ndindex(*shape)]

        features: dict[str, dict[str, Any]] = {}
        if self._vectors:
            names = [each for name in self._vectors for each in named(name, spaces[name].shape)]
            features["observation.state"] = numbers("float32", names)
        hands = range(len(self._inner.task.instruments))
        moves = [f"instrument_{k}.{move}" for k in hands for move in ("push_mm_s", "turn_rad_s")]
        features["action"] = numbers("float32", moves)
        for key, (name, _) in self._films.items():
            _, height, width = spaces[name].shape
            info = {
                "video.height": height,
                "video.width": width,
                "video.codec": "h264",
                "video.pix_fmt": "yuv420p",
                "video.is_depth_map": False,
                "video.fps": self._rate(),
                "video.channels": 3,
                "has_audio": False,
            }
            shape, names = [height, width, 3], ["height", "width", "channels"]
            features[key] = {"dtype": "video", "shape": shape, "names": names, "info": info}
        for name, dtype in {**_OF_STEP, **_PLACE}.items():
            features[name] = {"dtype": dtype, "shape": [1], "names": None}
        return features

    def _rate(self) -> float:
        """Frames per second, as an integer if possible."""
        return self._fps.numerator if self._fps.denominator == 1 else float(self._fps)

    def _file(self, template: str, **names: str) -> Path:
        """Path of a file of the current episode."""
        chunk, file = divmod(self._episodes, CHUNK)
        return self.folder / template.format(chunk_index=chunk, file_index=file, **names)

    def _shoot(self, key: str, picture: NDArray[np.uint8]) -> None:
        """Adds a picture to a film."""
        if key not in self._writers:
            path = self._file(f"videos/{{video_key}}/{FILE}.mp4", video_key=key)
            film = av.open(begin(path), "w", format="mp4")
            stream = film.add_stream(_CODEC, rate=self._fps, options=_OPTIONS)
            stream.height, stream.width = picture.shape
            stream.pix_fmt = "yuv420p"
            self._writers[key] = film, stream, path
            self._levels[key] = np.zeros(LEVELS, dtype=np.int64)
        film, stream, _ = self._writers[key]
        self._levels[key] += np.bincount(picture.ravel(), minlength=LEVELS)
        colours = np.repeat(picture[..., None], 3, axis=2)
        film.mux(stream.encode(av.VideoFrame.from_ndarray(colours, format="rgb24")))

    def _end(self) -> None:
        """Writes the current episode, unless it has no steps."""
        if not self._rows:
            return
        count = len(self._rows)
        for film, stream, path in self._writers.values():
            film.mux(stream.encode())
            film.close()
            finish(path)
        steps = np.arange(count)
        columns: dict[str, NDArray[Any]] = {
            name: np.array([row[name] for row in self._rows]) for name in self._rows[0]
        }
        columns["timestamp"] = steps / float(self._fps)
        columns |= {"frame_index": steps, "index": self._frames + steps}
        columns |= dict.fromkeys(("episode_index", "task_index"), np.zeros(count, dtype=np.int64))
        columns["episode_index"] = np.full(count, self._episodes)
        table = {
            name: _column(columns[name], feature["dtype"], feature["shape"][0])
            for name, feature in self._features.items()
            if name not in self._films
        }
        write_table(self._file(f"data/{FILE}.parquet"), pyarrow.table(table))
        stats = {name: of_rows(columns[name]) for name in table}
        stats |= {key: of_levels(levels, count) for key, levels in self._levels.items()}
        self._tell_episode(count, stats)
        self._stats = {name: together(self._stats.get(name), own) for name, own in stats.items()}
        self._episodes, self._frames = self._episodes + 1, self._frames + count
        self._tell_all()
        self._rows, self._writers, self._levels = [], {}, {}

    def _tell_episode(self, count: int, stats: dict[str, Numbers]) -> None:
        """Writes the row of an episode in `meta/episodes`."""
        chunk, file = divmod(self._episodes, CHUNK)
        row: dict[str, Any] = {"episode_index": self._episodes, "tasks": [self._task], "length": count}
        row |= {"data/chunk_index": chunk, "data/file_index": file}
        row |= {"dataset_from_index": self._frames, "dataset_to_index": self._frames + count}
        for key in self._films:
            row |= {f"videos/{key}/chunk_index": chunk, f"videos/{key}/file_index": file}
            row[f"videos/{key}/from_timestamp"] = 0.0
            row[f"videos/{key}/to_timestamp"] = count / float(self._fps)
        for name, numbers in stats.items():
            row |= {f"stats/{name}/{kind}": values.tolist() for kind, values in numbers.items()}
        row |= {"meta/episodes/chunk_index": chunk, "meta/episodes/file_index": file}
        table = pyarrow.table({name: [value] for name, value in row.items()})
        write_table(self._file(f"meta/episodes/{FILE}.parquet"), table)

    def _tell_all(self) -> None:
        """Writes the data about all episodes so far."""
        # LeRobot looks up tasks by the index of a pandas table.
        column = {"name": "task", "field_name": "task", "pandas_type": "unicode", "numpy_type": "object"}
        index = {"index_columns": ["task"], "columns": [{**column, "metadata": None}], "column_indexes": []}
        tasks = pyarrow.table({"task_index": [0], "task": [self._task]})
        tasks = tasks.replace_schema_metadata({"pandas": json.dumps(index)})
        write_table(self.folder / TASKS, tasks)
        stats = {
            name: {kind: values.tolist() for kind, values in own.items()} for name, own in self._stats.items()
        }
        write_json(self.folder / STATS, stats)
        # Last: an episode counts once all its files are there.
        write_json(self.folder / INFO, self._about())

    def _about(self) -> dict[str, Any]:
        """`info.json`."""
        return {
            "codebase_version": "v3.0",
            "robot_type": "endowire",
            "total_episodes": self._episodes,
            "total_frames": self._frames,
            "total_tasks": 1,
            "chunks_size": CHUNK,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self._rate(),
            "splits": {"train": f"0:{self._episodes}"},
            "data_path": f"data/{FILE}.parquet",
            "video_path": f"videos/{{video_key}}/{FILE}.mp4" if self._films else None,
            "features": self._features,
        }


def _column(values: NDArray[Any], dtype: str, length: int) -> pyarrow.Array:
    """Numbers of all frames; lists if a frame has several."""
    flat = pyarrow.array(values.astype(dtype).ravel())
    return flat if length == 1 else pyarrow.FixedSizeListArray.from_arrays(flat, length)
