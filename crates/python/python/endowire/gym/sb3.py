"""Vector environments for `stable-baselines3 <https://stable-baselines3.readthedocs.io>`_, and its models as
policies.

It requires stable-baselines3: ``pip install "endowire[learn]"``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from .. import InputError
from . import checks
from .episodes import Episodes
from .pictures import check_mode, per_second, picture
from .task import Task


class SB3VecEnv(VecEnv):
    """``num_envs`` environments of a task, stepped in one call.

    Actions are fractions of the task's limits, from -1 to 1, shape (num_envs, 2 n_instruments), or in rows (num_envs,
    n_instruments, 2). As stable-baselines3 requires, an environment whose episode ends is reset at once: it returns the
    first observation of the new episode, and the last one of the old episode is ``infos[k]["terminal_observation"]``.
    Environment k has the seed ``seed + k``, with the same episodes as `InsertionEnv`. Pictures are drawn when they are
    asked for, as by VecVideoRecorder; with ``render_mode=None`` there are none.
    """

    #: Environments have no registered id.
    spec = None

    def __init__(
        self, task: Task, num_envs: int, seed: int | None = None, render_mode: str | None = "rgb_array"
    ) -> None:
        check_mode(render_mode)
        self.task = task
        #: The episodes, for parts of a task and policies.
        self.episodes = Episodes(task, num_envs)
        self._limits = task.limits()
        self.render_mode = render_mode
        self.metadata = {"render_modes": ["rgb_array"], "render_fps": per_second(task)}
        actions = spaces.Box(-1.0, 1.0, (self._limits.size,), dtype=np.float32)
        super().__init__(num_envs, self.episodes.observation_space, actions)
        self._generators = [seeding.np_random(None if seed is None else seed + k)[0] for k in range(num_envs)]
        self._velocities = np.zeros((num_envs, *self._limits.shape))

    def reset(self) -> dict[str, NDArray[Any]]:
        """Begins all episodes."""
        for k, own in enumerate(self._seeds):
            if own is not None:
                self._generators[k] = seeding.np_random(int(own))[0]
        self._reset_seeds()
        self._reset_options()
        self.episodes.begin(dict(enumerate(self._generators)))
        self.reset_infos = self._infos()
        return self.episodes.observe()

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Stores the actions for the next `step_wait`.

        Raises InputError for actions of another shape, or that are not real.
        """
        self._velocities = checks.hands("actions", actions, len(self._limits), self.num_envs) * self._limits

    def step_wait(
        self,
    ) -> tuple[dict[str, NDArray[Any]], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Steps all environments."""
        self.episodes.step(self._velocities, np.ones(self.num_envs, dtype=bool))
        rewards = self.episodes.rewards().astype(np.float32)
        terminated, truncated = self.episodes.ended()
        over = terminated | truncated
        observed, infos = self.episodes.observe(), self._infos()
        if over.any():
            ended = [int(k) for k in np.flatnonzero(over)]
            for k in ended:
                infos[k]["terminal_observation"] = {name: values[k] for name, values in observed.items()}
                infos[k]["TimeLimit.truncated"] = bool(truncated[k] and not terminated[k])
                infos[k]["steps"] = int(self.episodes.steps[k])
            self.episodes.begin({k: self._generators[k] for k in ended})
            observed = self.episodes.observe()
        return observed, rewards, over, infos

    def close(self) -> None:
        """Does nothing, because no resources are held."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The attribute, the same for all environments."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """The pictures of all environments, each of shape (height, width, 3), with ``render_mode="rgb_array"``."""
        if self.render_mode is None:
            return [None] * self.num_envs
        return [picture(self.episodes, k) for k in range(self.num_envs)]

    def set_options(self, options: list[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """There are no options for `reset`: raises InputError for any."""
        if options and (isinstance(options, dict) or any(options)):
            raise InputError(f"options = {options!r}: there are none for reset: leave them out")

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raises InputError: what environments share is their task."""
        raise InputError(f"attr_name = {attr_name!r}: environments have none that is set: replace the task's part instead")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """What `get_images` has for ``render``; raises InputError for any other, since environments have no methods."""
        if method_name == "render" and not method_args and not method_kwargs:
            images = self.get_images()
            return [images[k] for k in self._get_indices(indices)]
        raise InputError(f"method_name = {method_name!r}: environments have no methods of their own but render()")

    def env_is_wrapped(self, wrapper_class: type, indices: VecEnvIndices = None) -> list[bool]:
        """False for all environments."""
        return [False for _ in self._get_indices(indices)]

    def _infos(self) -> list[dict[str, Any]]:
        info = self.episodes.info()
        return [{name: values[k] for name, values in info.items()} for k in range(self.num_envs)]


class Learned:
    """A model of stable-baselines3 as a `Policy`; ``normalize`` is the normalisation of its observations.

    It takes the mean of its actions or, given a ``seed``, draws them as it did in learning: a tip that is stuck where
    the mean action leads nowhere then comes free. Actions that are drawn depend on all environments that act
    together, so episodes repeat one by one.
    """

    def __init__(
        self, model: BaseAlgorithm, normalize: VecNormalize | None = None, seed: int | None = None
    ) -> None:
        assert isinstance(model.action_space, spaces.Box)
        self.model, self.normalize, self._high = model, normalize, model.action_space.high
        self._drawn = None if seed is None else torch.Generator().manual_seed(seed).get_state()

    def act(self, episodes: Episodes) -> NDArray[np.float64]:
        observed: Any = episodes.observe()
        if self.normalize is not None:
            observed = self.normalize.normalize_obs(observed)
        parts = self._actions(observed) / self._high
        return parts.reshape(len(parts), -1, 2) * episodes.task.limits()

    def _actions(self, observed: Any) -> NDArray[np.float64]:
        if self._drawn is None:
            actions, _ = self.model.predict(observed, deterministic=True)
            return np.asarray(actions, dtype=float)
        # The model draws from the generator of all of torch, which is lent to it.
        with torch.random.fork_rng(devices=[]):
            torch.random.set_rng_state(self._drawn)
            actions, _ = self.model.predict(observed, deterministic=False)
            self._drawn = torch.random.get_rng_state()
        return np.asarray(actions, dtype=float)
