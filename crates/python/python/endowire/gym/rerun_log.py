"""Episodes as recordings of `Rerun <https://rerun.io>`_: the vessel, the instruments, the target and the data of each
step, to be viewed step by step.

It requires rerun-sdk: ``pip install "endowire[rerun]"``.
"""

from __future__ import annotations

from os import PathLike
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
import rerun
from numpy.typing import NDArray

from .logs import new_folder, watched


class RerunLog(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Writes each episode of an environment as ``episode_000000.rrd`` and so on in ``folder``, which must be new or
    empty; a file is complete after the next `reset` or `close`.

    Lengths are in mm. Data have a step and the time of the task, s. Raises InputError for a folder that is not empty,
    and for anything but a single endowire environment.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], folder: str | PathLike[str]) -> None:
        self._inner, self.folder = watched(env), new_folder(folder)
        super().__init__(env)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._number = -1
        self._recording: rerun.RecordingStream | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        result = self.env.reset(seed=seed, options=options)
        self._end()
        self._number += 1
        recording = rerun.RecordingStream("endowire", recording_id=f"episode {self._number}")
        recording.save(self.folder / f"episode_{self._number:06}.rrd")
        self._recording = recording
        episodes = self._inner.episodes
        vessel = episodes.sites[0].vessel
        wall = rerun.Mesh3D(
            vertex_positions=vessel.vertices_mm,
            triangle_indices=vessel.triangles,
            albedo_factor=[200, 110, 110, 70],
        )
        recording.log("vessel", wall, static=True)
        target = rerun.Points3D(episodes.target_mm, radii=self._inner.task.threshold_mm)
        recording.log("target", target, static=True)
        self._log({"way_mm": result[1]["way_mm"]})
        return result

    def step(self, action: NDArray[Any]) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        result = self.env.step(action)
        _, reward, _, _, info = result
        episodes = self._inner.episodes
        numbers = {"reward": float(reward), "way_mm": info["way_mm"]}
        numbers["largest_contact_force_n"] = episodes.batch.largest_contact_force_n[0]
        for k, (push, turn) in enumerate(episodes.action[0]):
            numbers[f"instrument_{k}/push_mm_s"], numbers[f"instrument_{k}/turn_rad_s"] = push, turn
            force_n = episodes.batch.push_force_n[0, k]
            numbers[f"instrument_{k}/push_force_n"] = force_n
        self._log(numbers)
        return result

    def close(self) -> None:
        self._end()
        super().close()

    def _end(self) -> None:
        if self._recording is not None:
            self._recording.flush()
            self._recording.disconnect()
            self._recording = None

    def _log(self, numbers: dict[str, float]) -> None:
        recording, episodes = self._recording, self._inner.episodes
        assert recording is not None, "reset comes before step"
        task, step = self._inner.task, int(episodes.steps[0])
        recording.set_time("step", sequence=step)
        recording.set_time("time", duration=step * task.control_period_s)
        simulation = episodes.batch.simulation(0)
        line_mm, from_tip_mm = simulation.positions_mm, simulation.from_tip_mm
        lengths_mm = simulation.inserted_mm
        for k, (instrument, mm) in enumerate(zip(task.instruments, lengths_mm, strict=True)):
            # An instrument covers its inserted length from the sheath; the line is that of the foremost one.
            own = line_mm[from_tip_mm >= lengths_mm.max() - mm - 1e-9]
            radius_mm = max(section["radius_mm"] for section in instrument.sections)
            strips = [own] if len(own) > 1 else []
            recording.log(f"instrument_{k}", rerun.LineStrips3D(strips, radii=radius_mm))
        recording.log("tip", rerun.Points3D(episodes.tip_mm, radii=1.0))
        for name, value in numbers.items():
            if np.isfinite(value):
                recording.log(f"numbers/{name}", rerun.Scalars(float(value)))
