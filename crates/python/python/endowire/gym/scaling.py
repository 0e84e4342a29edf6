"""Scaling of observations to numbers of about 1, suitable for learning."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from .observations import Observation

if TYPE_CHECKING:
    from .episodes import Episodes
    from .task import Task

#: Scaled values are clipped to this magnitude: a jammed wire can have any force.
_MOST = 10.0


@runtime_checkable
class HasUnit(Protocol):
    """An observation that can be scaled."""

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Offset and scale, for each number or for the last axis."""
        ...


class Scaled:
    """An observation of a task, scaled."""

    def __init__(self, part: Observation, middle: NDArray[np.float64], unit: NDArray[np.float64]) -> None:
        self.part, self.middle, self.unit = part, middle, unit

    def space(self, task: Task) -> spaces.Box:
        """The space of the scaled observation, clipped to ±10."""
        physical = self.part.space(task)
        ends = [(end - self.middle) / self.unit for end in (physical.low, physical.high)]
        low, high = (np.clip(end, -_MOST, _MOST).astype(np.float32) for end in ends)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self, episodes: Episodes) -> NDArray[Any]:
        """The scaled observation."""
        scaled: NDArray[Any] = (self.part.observe(episodes) - self.middle) / self.unit
        return scaled


def shown(task: Task) -> dict[str, Observation]:
    """The observations of a task as it shows them, by name. A scaled observation is not in mm, and its name has no
    unit.
    """
    if task.observed == "physical":
        return dict(task.observations)
    parts: dict[str, Observation] = {}
    for name, part in task.observations.items():
        is_scaled = isinstance(part, HasUnit)
        parts[name.removesuffix("_mm") if is_scaled else name] = Scaled(part, *part.unit(task)) if is_scaled else part
    return parts
