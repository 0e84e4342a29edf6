"""Sources of vessels: a fixed one, or a new one for each episode."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from .. import Renderer, Simulation, Vessel
from . import checks
from .centreline import Centreline

if TYPE_CHECKING:
    from .task import Task

#: Primary and secondary angle of the C-arm, degrees: a picture from the front, and from the side.
FRONT, SIDE = (0.0, 0.0), (90.0, 0.0)
#: Largest angle between a vessel's long axis and the line of sight at which the vessel is seen end on, rad.
_END_ON = np.pi / 6.0


class Site:
    """A vessel with its centre line and the sheath: the keywords ``opening``, ``depth_mm``, ``position_mm`` and
    ``direction`` of `endowire.Simulation`.

    It is immutable except for caches of derived objects, which copies share and pickles leave out.
    """

    def __init__(
        self,
        vessel: Vessel,
        centreline: Centreline,
        sheath: Mapping[str, Any],
        targets: NDArray[np.bool_] | None = None,
    ) -> None:
        self.vessel, self.centreline, self.sheath = vessel, centreline, dict(sheath)
        #: Whether targets may lie on each segment of the centre line; None allows all.
        self.targets = targets
        #: Cached simulations with nothing inserted, by task, to be copied for each episode.
        self.starts: WeakKeyDictionary[Task, Simulation] = WeakKeyDictionary()
        self._renderers: dict[str, Renderer] = {}
        self._side: tuple[float, float] | None = None
        #: The last place asked for, and the ways to it.
        self._ways: tuple[bytes, NDArray[np.float64]] | None = None

    def renderer(self, view: Mapping[str, Any]) -> Renderer:
        """The cached renderer of the vessel for a `[view]` table."""
        # Arrays and paths are taken as the lists and texts that they stand for.
        key = json.dumps(view, sort_keys=True, default=lambda value: getattr(value, "tolist", value.__str__)())
        if key not in self._renderers:
            self._renderers[key] = Renderer(self.vessel, dict(view))
        return self._renderers[key]

    def ways_mm(self, place_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Length of the way along the centre line from each row to a place, mm, shape (n,); that of the last place is
        cached, since each episode asks for that of the sheath.
        """
        key = place_mm.tobytes()
        if self._ways is None or self._ways[0] != key:
            self._ways = key, self.centreline.ways_mm(place_mm)
        return self._ways[1]

    @property
    def side(self) -> tuple[float, float]:
        """Angles of the C-arm at which a picture shows the vessel: `FRONT`, or `SIDE` where that would look along it."""
        if self._side is None:
            places_mm = self.vessel.vertices_mm
            # The long axis is the first of the principal ones; from the front one looks along y.
            axis = np.linalg.eigh(np.cov(places_mm.T))[1][:, -1]
            self._side = SIDE if abs(axis[1]) > np.cos(_END_ON) else FRONT
        return self._side

    def __deepcopy__(self, memo: dict[int, Any]) -> Site:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return Site, (self.vessel, self.centreline, self.sheath, self.targets)


class VesselSource(Protocol):
    """Chooses the vessel of each episode."""

    #: Bounding box of all its vessels, mm: smallest and largest coordinates, shape (2, 3).
    bounds_mm: NDArray[np.float64]

    def sample(self, rng: np.random.Generator) -> Site:
        """The site of an episode; all random numbers come from ``rng``."""
        ...


class FixedVessel:
    """The same vessel in every episode."""

    def __init__(self, vessel: Vessel, centreline: NDArray[np.float64] | None = None, **sheath: Any) -> None:
        """A vessel with the centre line it was made from, or another one (x, y, z, radius, parent; shape (n, 5)), which
        is a tree. Where branches of the vessel's own meet again, ways to a target are the shortest, by either arm. If
        the vessel is only a surface, the centre line is extracted from its lumen, starting at the sheath's
        ``opening`` if given.

        Raises InputError for a surface without an extractable centre line.
        """
        if centreline is None and vessel.centreline_found and "opening" in sheath:
            vessel = vessel.with_centreline(sheath["opening"])
        table = vessel.centreline if centreline is None else checks.real("centreline", centreline)
        links = vessel.links if centreline is None else []
        self.site = Site(vessel, Centreline(table, links), sheath)
        low, high = vessel.vertices_mm.min(axis=0), vessel.vertices_mm.max(axis=0)
        # Instruments may leave through an opening.
        self.bounds_mm = np.stack([low, high]) + np.outer([-0.1, 0.1], high - low)

    def sample(self, rng: np.random.Generator) -> Site:
        """Always the same site."""
        return self.site
