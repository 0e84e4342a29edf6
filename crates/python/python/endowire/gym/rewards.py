"""Rewards: parts that are added up. All parts handle all environments of a vector at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from . import checks

if TYPE_CHECKING:
    from .episodes import Episodes


class Reward(Protocol):
    """One part of the reward."""

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        """The part for all environments, shape (n,)."""
        ...


class Reached:
    """A reward for reaching the target."""

    def __init__(self, worth: float = 1.0) -> None:
        self.worth = checks.finite("worth", worth)

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return self.worth * episodes.reached


class EachStep:
    """A reward for every step."""

    def __init__(self, worth: float = -0.005) -> None:
        self.worth = checks.finite("worth", worth)

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return np.full(len(episodes.sites), self.worth)


class Approach:
    """A reward for every millimetre by which the path length to the target along the centre line decreases."""

    def __init__(self, worth_per_mm: float = 0.001) -> None:
        self.worth_per_mm = checks.finite("worth_per_mm", worth_per_mm)

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return self.worth_per_mm * (episodes.way_before_mm - episodes.way_mm)


class Progress:
    """A reward for the whole path to the target, given in proportion as the remaining path gets shorter, and taken
    back as it gets longer.

    It is the difference of a potential, the remaining path length relative to that at the start (Ng, Harada and
    Russell, ICML 1999, without discount): the total of an episode depends only on its first and last state, and
    detours gain nothing.
    """

    def __init__(self, worth: float = 1.0) -> None:
        self.worth = checks.finite("worth", worth)

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        # Avoids a division by zero if the episode starts at the target.
        whole_mm = np.maximum(episodes.way_begun_mm, episodes.task.threshold_mm)
        return self.worth * (episodes.way_before_mm - episodes.way_mm) / whole_mm


class Distance:
    """A reward for every millimetre between tip and target."""

    def __init__(self, worth_per_mm: float = -0.001) -> None:
        self.worth_per_mm = checks.finite("worth_per_mm", worth_per_mm)

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return self.worth_per_mm * np.linalg.norm(episodes.tip_mm - episodes.target_mm, axis=1)


class ContactForce:
    """A reward for every newton by which the largest contact force exceeds a limit."""

    def __init__(self, worth_per_n: float = -0.1, limit_n: float = 1.0) -> None:
        self.worth_per_n = checks.finite("worth_per_n", worth_per_n)
        self.limit_n = checks.at_least("limit_n", limit_n, 0.0)

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        beyond = np.maximum(episodes.batch.largest_contact_force_n - self.limit_n, 0.0)
        return self.worth_per_n * beyond
