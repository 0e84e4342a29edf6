"""Policies without learning, as baselines and experts, and what any policy does in any environment of Gymnasium."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import Controller, InputError, Planner
from . import checks

if TYPE_CHECKING:
    from .episodes import Episodes


class Policy(Protocol):
    """Chooses actions."""

    def act(self, episodes: Episodes) -> NDArray[np.float64]:
        """Velocities for all environments, shape (n, n_instruments, 2): mm/s and rad/s. ``episodes.steps`` is 0 at
        the start of an episode.
        """
        ...


def action(policy: Policy, env: Any) -> NDArray[np.float32]:
    """What a policy does next in an environment of Gymnasium, in the unit and the shape of its action space: that of
    `gymnasium.make` or `make_vec`, with or without wrappers (`LeRobotLog` is one).

    Raises InputError for an environment of another package, or a vector that is not endowire's own, whose simulations
    cannot be seen, and where a wrapper changes actions; Gymnasium's ResetNeeded before the first `reset`.
    """
    from .environment import InsertionEnv
    from .vector import InsertionVectorEnv

    inner = getattr(env, "unwrapped", env)
    if not isinstance(inner, (InsertionEnv, InsertionVectorEnv)):
        raise InputError(f"env = {env}: give an environment of endowire, from gymnasium.make or make_vec")
    if env.action_space != inner.action_space:
        raise InputError(f"env = {env}: a wrapper changes its actions: take the policy's from inside it")
    inner.episodes.check_begun("action")
    velocities = policy.act(inner.episodes)
    space = inner.action_space
    assert space.shape is not None
    actions = np.asarray(velocities / inner.task.action_unit(), dtype=np.float32)
    return actions.reshape(space.shape)


class Straight:
    """Pushes at the largest speed and never rotates."""

    def act(self, episodes: Episodes) -> NDArray[np.float64]:
        action = np.zeros_like(episodes.action)
        action[..., 0] = episodes.task.speed_limits[0]
        return action


class Uniform:
    """Random velocities, uniform from ``slowest_mm_s`` to the push limit and within the rotation limits."""

    def __init__(self, seed: int = 0, slowest_mm_s: float = -10.0) -> None:
        self.rng = np.random.default_rng(seed)
        self.slowest_mm_s = checks.finite("slowest_mm_s", slowest_mm_s)

    def act(self, episodes: Episodes) -> NDArray[np.float64]:
        push, turn = episodes.task.speed_limits
        return self.rng.uniform((self.slowest_mm_s, -turn), (push, turn), episodes.action.shape)


class Steered:
    """The library's controllers, which know the centre line to the target: ``follow_path`` or ``search_ahead`` of
    `Controller`, or ``plan``, a `Planner`; on copies of the simulations. If a controller gives up, its instruments stay.

    Their commands of at most 4 mm and 0.35 rad are within a step's limits at 7.5 Hz and 35 mm/s; where limits cut them
    a plan is made anew, from where the tip is. Raises InputError for another ``kind``.
    """

    def __init__(self, kind: str = "search_ahead") -> None:
        hands: dict[str, Callable[..., Controller | Planner]] = {
            "follow_path": Controller.follow_path,
            "search_ahead": Controller.search_ahead,
            "plan": Planner,
        }
        if kind not in hands:
            raise InputError(f"kind = {kind!r}: give {', '.join(hands)}")
        self.make = hands[kind]
        self._hands: dict[int, Controller | Planner] = {}

    def act(self, episodes: Episodes) -> NDArray[np.float64]:
        action = np.zeros_like(episodes.action)
        for k in range(len(episodes.sites)):
            if episodes.steps[k] == 0:
                path = episodes.paths[k]
                assert path is not None
                # The task decides when an episode ends, so the controller continues to the end of its path.
                self._hands[k] = self.make(path.table_mm, arrived_mm=0.0)
            move = self._hands[k].next(episodes.batch.simulation(k))
            if move is not None:
                action[k] = move / episodes.task.control_period_s
        return action
