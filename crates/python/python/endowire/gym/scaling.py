"""Observations as numbers of about 1, which policies learn from as they are."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from .observations import Observation

if TYPE_CHECKING:
    from .episodes import Episodes
    from .task import Task

#: What is beyond so many units is shown as so many: a wire in a jam presses with any force.
_MOST = 10.0


@runtime_checkable
class HasUnit(Protocol):
    """A part of the observations that can be scaled."""

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What is shown as 0, and how far from it what is shown as 1, for each number or for the last axis."""
        ...


class Scaled:
    """A part of the observations of a task in its units."""

    def __init__(self, part: Observation, middle: NDArray[np.float64], unit: NDArray[np.float64]) -> None:
        self.part, self.middle, self.unit = part, middle, unit

    def space(self, task: Task) -> spaces.Box:
        """That of the part in its units, at most ten of them."""
        physical = self.part.space(task)
        ends = [(end - self.middle) / self.unit for end in (physical.low, physical.high)]
        low, high = (np.clip(end, -_MOST, _MOST).astype(np.float32) for end in ends)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self, episodes: Episodes) -> NDArray[Any]:
        """The part in its units."""
        scaled: NDArray[Any] = (self.part.observe(episodes) - self.middle) / self.unit
        return scaled


def shown(task: Task) -> dict[str, Observation]:
    """The parts of a task's observations as it shows them, by the names that they have then: a part that is scaled is not in mm, and its name does not say so."""
    if task.observed == "physical":
        return dict(task.observations)
    parts: dict[str, Observation] = {}
    for name, part in task.observations.items():
        is_scaled = isinstance(part, HasUnit)
        parts[name.removesuffix("_mm") if is_scaled else name] = Scaled(part, *part.unit(task)) if is_scaled else part
    return parts
