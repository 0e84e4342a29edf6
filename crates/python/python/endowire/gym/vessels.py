"""Where vessels come from: one that stays, or a new one for each episode."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from .. import Renderer, Simulation, Vessel
from .centreline import Centreline

if TYPE_CHECKING:
    from .task import Task


class Site:
    """A vessel with its centre line and the sheath through which instruments come: the keywords ``opening``, ``depth_mm``,
    ``position_mm`` and ``direction`` of `endowire.Simulation`.

    It never changes, but keeps what is made for it: copies share it, and pickles leave it behind.
    """

    def __init__(
        self,
        vessel: Vessel,
        centreline: Centreline,
        sheath: Mapping[str, Any],
        targets: NDArray[np.bool_] | None = None,
    ) -> None:
        self.vessel, self.centreline, self.sheath = vessel, centreline, dict(sheath)
        #: Whether targets may lie on each segment of the centre line; anywhere if None.
        self.targets = targets
        #: Simulations with nothing inserted, by task: made once and copied for each episode.
        self.starts: WeakKeyDictionary[Task, Simulation] = WeakKeyDictionary()
        self._renderers: dict[str, Renderer] = {}

    def renderer(self, view: Mapping[str, Any]) -> Renderer:
        """What draws the vessel as a table `[view]` says, made once."""
        key = json.dumps(view, sort_keys=True)
        if key not in self._renderers:
            self._renderers[key] = Renderer(self.vessel, dict(view))
        return self._renderers[key]

    def __deepcopy__(self, memo: dict[int, Any]) -> Site:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Site, (self.vessel, self.centreline, self.sheath, self.targets)


class VesselSource(Protocol):
    """Gives each episode its vessel."""

    #: Box around all vessels it gives, mm: least and largest coordinates, shape (2, 3).
    bounds_mm: NDArray[np.float64]

    def sample(self, rng: np.random.Generator) -> Site:
        """The site of an episode; all that is random in it comes from ``rng``."""
        ...


class FixedVessel:
    """The same vessel in every episode."""

    def __init__(self, vessel: Vessel, centreline: NDArray[np.float64] | None = None, **sheath: Any) -> None:
        """A vessel with the centre line it was made from, or another one (x, y, z, radius, parent; shape (n, 5)). In one of a surface alone it is found
        in the lumen, from the sheath's ``opening`` if that is given.

        Raises InputError for a surface in which none is found.
        """
        if centreline is None and vessel.centreline_found and "opening" in sheath:
            vessel = vessel.with_centreline(sheath["opening"])
        table = vessel.centreline if centreline is None else np.asarray(centreline, dtype=float)
        self.site = Site(vessel, Centreline(table), sheath)
        low, high = vessel.vertices_mm.min(axis=0), vessel.vertices_mm.max(axis=0)
        # Instruments may leave through an opening.
        self.bounds_mm = np.stack([low, high]) + np.outer([-0.1, 0.1], high - low)

    def sample(self, rng: np.random.Generator) -> Site:
        """Always the same site."""
        return self.site
