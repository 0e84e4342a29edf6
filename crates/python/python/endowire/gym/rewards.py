"""What a step is worth: parts that add up. All work on all environments of a vector at once."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .episodes import Episodes


class Reward(Protocol):
    """One part of the reward."""

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        """The part for all environments, shape (n,)."""
        ...


class Reached:
    """So much when the target is reached."""

    def __init__(self, worth: float = 1.0) -> None:
        self.worth = worth

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return self.worth * episodes.reached


class EachStep:
    """So much for every step."""

    def __init__(self, worth: float = -0.005) -> None:
        self.worth = worth

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return np.full(len(episodes.sites), self.worth)


class Approach:
    """So much for every millimetre by which the way to the target along the centre line has become shorter."""

    def __init__(self, worth_per_mm: float = 0.001) -> None:
        self.worth_per_mm = worth_per_mm

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return self.worth_per_mm * (episodes.way_before_mm - episodes.way_mm)


class Progress:
    """So much for the whole way to the target, and for each part of it as it becomes shorter; taken back where it becomes longer.

    It is the difference of a potential, the way that is left over that at the episode's beginning (Ng, Harada and Russell, ICML 1999, without discount):
    what an episode has in all hangs on where it begins and ends alone, and no detour is worth anything.
    """

    def __init__(self, worth: float = 1.0) -> None:
        self.worth = worth

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        # A way that begins at the target has no parts.
        whole_mm = np.maximum(episodes.way_begun_mm, episodes.task.threshold_mm)
        return self.worth * (episodes.way_before_mm - episodes.way_mm) / whole_mm


class Distance:
    """So much for every millimetre between tip and target."""

    def __init__(self, worth_per_mm: float = -0.001) -> None:
        self.worth_per_mm = worth_per_mm

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        return self.worth_per_mm * np.linalg.norm(episodes.tip_mm - episodes.target_mm, axis=1)


class ContactForce:
    """So much for every newton by which the largest force of a contact is beyond a limit."""

    def __init__(self, worth_per_n: float = -0.1, limit_n: float = 1.0) -> None:
        self.worth_per_n, self.limit_n = worth_per_n, limit_n

    def reward(self, episodes: Episodes) -> NDArray[np.float64]:
        beyond = np.maximum(episodes.batch.largest_contact_force_n - self.limit_n, 0.0)
        return self.worth_per_n * beyond
