"""Conditions that end an episode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from . import checks

if TYPE_CHECKING:
    from .episodes import Episodes


class End(Protocol):
    """A condition that ends an episode. A failure of the simulation ends it too."""

    #: Whether the condition is an outcome of the task (terminated) or only a limit (truncated).
    terminates: bool

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        """Whether the condition holds, for all environments, shape (n,)."""
        ...


class TargetReached:
    """The tip is at the target."""

    terminates = True

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.reached


class LeftVessel:
    """The tip has left the vessel through an opening."""

    terminates = False

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.batch.left_through >= 0


class StepLimit:
    """The number of steps has reached its limit."""

    terminates = False

    def __init__(self, steps: int = 1000) -> None:
        self.steps = checks.whole("steps", steps, 1)

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.steps >= self.steps


class ForceLimit:
    """The force of a contact exceeds its limit."""

    terminates = True

    def __init__(self, limit_n: float = 1.5) -> None:
        self.limit_n = checks.at_least("limit_n", limit_n, 0.0)

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.batch.largest_contact_force_n > self.limit_n


class Laborious:
    """The last step took more iterations of the method than the limit. This happens in rare states whose steps take
    seconds instead of a millisecond.

    Use it only for learning, where all environments of a vector wait for the slowest. A wire that snaps takes some
    hundreds of iterations: a limit that low ends most episodes just before they arrive. Of seventeen episodes of
    `policies.Steered("follow_path")` in ArchVariety eleven arrive, and fewer than half with a limit of 200.
    """

    terminates = False

    def __init__(self, iterations: int = 2000) -> None:
        self.iterations = checks.whole("iterations", iterations, 1)

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.batch.iterations > self.iterations
