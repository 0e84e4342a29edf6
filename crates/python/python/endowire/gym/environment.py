"""A single environment."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from .. import InputError, Simulation
from . import checks
from .episodes import Episodes
from .pictures import check_mode, per_second, picture
from .task import Task


class InsertionEnv(gymnasium.Env[dict[str, NDArray[Any]], NDArray[np.float32]]):
    """A task as a Gymnasium environment."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 8}

    def __init__(self, task: Task, render_mode: str | None = None) -> None:
        check_mode(render_mode)
        self.task, self.render_mode = task, render_mode
        self.metadata = {**self.metadata, "render_fps": per_second(task)}
        #: The episode as a vector of one: what policies and parts of a task read.
        self.episodes = Episodes(task, 1)
        self._unit = task.action_unit()
        self.action_space = self.episodes.action_space
        self.observation_space = self.episodes.observation_space

    @property
    def simulation(self) -> Simulation:
        """A copy of the simulation as it is now: to look at, to ask a `Controller`, to try commands on. The environment
        does not move with it.

        Raises Gymnasium's ResetNeeded before the first `reset`.
        """
        self.episodes.check_begun("simulation")
        return self.episodes.batch.simulation(0)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Begins an episode. It has no options.

        Raises InputError for any.
        """
        if options:
            raise InputError(f"options = {sorted(map(str, options))}: there are none for reset: leave them out")
        super().reset(seed=seed)
        self.episodes.begin({0: self.np_random})
        return self._observation(), self._info()

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[dict[str, NDArray[Any]], float, bool, bool, dict[str, Any]]:
        """Advances and rotates each instrument by an action of shape (2 n_instruments,): advance and rotation of the
        first, then of the next; or the same in rows, (n_instruments, 2). Depending on ``task.actions``, its values are
        fractions of the task's limits, from -1 to 1, or velocities, mm/s and rad/s; they are clipped to the limits.

        Raises InputError for an action of another shape or with values that are not real and finite, and Gymnasium's
        ResetNeeded before the first `reset`; then nothing has moved.
        """
        moved = checks.hands("action", action, len(self.task.instruments))
        if not np.isfinite(moved).all():
            raise InputError(f"action = {moved.tolist()}: every number must be finite")
        self.episodes.step((moved * self._unit)[None], np.array([True]))
        terminated, truncated = self.episodes.ended()
        reward = float(self.episodes.rewards()[0])
        return self._observation(), reward, bool(terminated[0]), bool(truncated[0]), self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """The picture of the task's view, shape (height, width, 3), if ``render_mode="rgb_array"``."""
        return picture(self.episodes, 0) if self.render_mode == "rgb_array" else None

    def _observation(self) -> dict[str, NDArray[Any]]:
        return {name: values[0] for name, values in self.episodes.observe().items()}

    def _info(self) -> dict[str, Any]:
        return {name: values[0] for name, values in self.episodes.info().items()}
