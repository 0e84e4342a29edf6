"""Vector environments: many environments stepped in one call on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from .. import InputError
from . import checks
from .autoreset import AutoresetMode, autoreset
from .episodes import Episodes
from .pictures import check_mode, per_second, picture
from .task import Task


class InsertionVectorEnv(VectorEnv[dict[str, NDArray[Any]], NDArray[np.float32], NDArray[Any]]):
    """``num_envs`` environments of a task. Environment k has the same bits as `InsertionEnv` with the same seed.

    What becomes of an environment whose episode has ended is ``autoreset_mode``, as Gymnasium defines it, one of its
    AutoresetMode or the name: with NEXT_STEP it begins a new one in the next step and ignores the action; with
    SAME_STEP at once, and ``info["final_obs"]`` and ``info["final_info"]`` are of its end; with DISABLED it waits for
    ``reset(options={"reset_mask": …})``. A failure of one environment is reported in ``info["failure"]`` and truncates
    its episode; the others continue.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 8, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        task: Task,
        num_envs: int = 1,
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ) -> None:
        super().__init__()
        check_mode(render_mode)
        #: What becomes of an environment whose episode has ended; other libraries ask for it here, or in `metadata`.
        self.autoreset_mode = autoreset(autoreset_mode)
        self.metadata = {**self.metadata, "render_fps": per_second(task), "autoreset_mode": self.autoreset_mode}
        num_envs = checks.whole("num_envs", num_envs, 1)
        self.task, self.num_envs, self.render_mode = task, num_envs, render_mode
        #: The episodes: what policies and parts of a task read.
        self.episodes = Episodes(task, num_envs)
        self._unit = task.action_unit()
        self.single_action_space = self.episodes.action_space
        self.single_observation_space = self.episodes.observation_space
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._generators = [seeding.np_random()[0] for _ in range(num_envs)]
        self._over = np.zeros(num_envs, dtype=bool)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Begins all episodes, or with Gymnasium's option ``reset_mask``, True or False for each environment, only
        these. Environment k has the seed ``seed + k``, or ``seed[k]``.

        Raises InputError for seeds or a mask of another length, and for other options.
        """
        mask = self._mask(options)
        if seed is not None:
            seeds = (
                [seed + k for k in range(self.num_envs)]
                if isinstance(seed, (int, np.integer))
                # One more than needed shows that there are too many, even for an infinite sequence.
                else list(islice(seed, self.num_envs + 1))
            )
            if len(seeds) != self.num_envs:
                count = f"{len(seeds)}{' and more' if len(seeds) > self.num_envs else ''}"
                raise InputError(
                    f"seed = {count} numbers: give one, or one for each of {self.num_envs} environments"
                )
            for k, own in enumerate(seeds):
                if own is not None and mask[k]:
                    self._generators[k] = seeding.np_random(int(own))[0]
            super().reset(seed=seeds[0])
        self.episodes.begin({int(k): self._generators[k] for k in np.flatnonzero(mask)})
        self._over[mask] = False
        return self.episodes.observe(), self._info()

    def _mask(self, options: dict[str, Any] | None) -> NDArray[np.bool_]:
        """The environments that `reset` is to reset."""
        unknown = sorted(map(str, set(options or {}) - {"reset_mask"}))
        if unknown:
            raise InputError(f"options = {unknown}: there is none but reset_mask")
        if not options:
            return np.ones(self.num_envs, dtype=bool)
        mask = checks.an_array("reset_mask", options["reset_mask"])
        if mask.shape != (self.num_envs,) or mask.dtype != bool:
            mend = f"must be True or False for each of {self.num_envs} environments"
            raise InputError(f"reset_mask = an array of shape {mask.shape} of {mask.dtype}: {mend}")
        if not mask.any():
            raise InputError("reset_mask = all False: name an environment that is to be reset")
        if not mask.all():
            self.episodes.check_begun("reset_mask")
        return mask

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[
        dict[str, NDArray[Any]], NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """Steps all environments like `InsertionEnv.step`; the actions have the shape (num_envs, 2 n_instruments), or in
        rows (num_envs, n_instruments, 2).

        Raises InputError for actions of another shape or that are not real, and Gymnasium's ResetNeeded before the first
        `reset`, and with DISABLED where an episode is over; then nothing has moved.
        """
        moved = checks.hands("actions", actions, len(self.task.instruments), self.num_envs)
        over = self._over
        if self.autoreset_mode == AutoresetMode.DISABLED and over.any():
            ended = np.flatnonzero(over).tolist()
            raise ResetNeeded(f"the episodes of environments {ended} are over: reset them, with the option reset_mask")
        self.episodes.step(moved * self._unit, ~over)
        rewards = np.where(over, 0.0, self.episodes.rewards())
        terminated, truncated = (ended & ~over for ended in self.episodes.ended())
        if over.any():
            self.episodes.begin({int(k): self._generators[k] for k in np.flatnonzero(over)})
        self._over = terminated | truncated
        observed, info = self.episodes.observe(), self._info()
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            observed, info = self._begin_at_once(observed, info)
        return observed, rewards, terminated, truncated, info

    def _begin_at_once(
        self, observed: dict[str, NDArray[Any]], info: dict[str, Any]
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Begins new episodes where they are over: observation and information, with the last ones of the old."""
        over = self._over.copy()
        last = np.full(self.num_envs, None, dtype=object)
        for k in np.flatnonzero(over):
            last[k] = {name: values[k] for name, values in observed.items()}
        told = {name: over if name.startswith("_") else values for name, values in info.items()}
        self.episodes.begin({int(k): self._generators[k] for k in np.flatnonzero(over)})
        self._over[:] = False
        final = {"final_obs": last, "_final_obs": over, "final_info": told, "_final_info": over}
        return self.episodes.observe(), self._info() | final

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """The pictures of all environments, if ``render_mode="rgb_array"``."""
        if self.render_mode != "rgb_array":
            return None
        return tuple(picture(self.episodes, k) for k in range(self.num_envs))

    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = {}
        for name, values in self.episodes.info().items():
            info[name], info[f"_{name}"] = values, np.ones(self.num_envs, dtype=bool)
        return info
