"""When an episode ends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .episodes import Episodes


class End(Protocol):
    """One reason for an episode to end. A simulation that fails ends it too."""

    #: Whether the task itself ends (terminated), or only the watching (truncated).
    terminates: bool

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        """Whether it holds, for all environments, shape (n,)."""
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
    """So many steps were made."""

    terminates = False

    def __init__(self, steps: int = 1000) -> None:
        self.steps = steps

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.steps >= self.steps


class ForceLimit:
    """A contact presses harder than it may."""

    terminates = True

    def __init__(self, limit_n: float = 1.5) -> None:
        self.limit_n = limit_n

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.batch.largest_contact_force_n > self.limit_n


class Laborious:
    """The last step took more iterations of the method than so many: one of the few states whose steps take seconds, in place of a thousandth.

    For learning alone: the others of a vector wait for such an environment. A wire that snaps takes some hundreds of iterations, and a limit as low ends
    most episodes just before they arrive: of seventeen of a hand that follows the way in ArchVariety, eleven arrive, and with a limit of 200 less than half.
    """

    terminates = False

    def __init__(self, iterations: int = 2000) -> None:
        self.iterations = iterations

    def ended(self, episodes: Episodes) -> NDArray[np.bool_]:
        return episodes.batch.iterations > self.iterations
