"""Choice of targets."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .. import InputError, Simulation
from . import checks
from .reach import reached
from .vessels import Site


class TargetSampler(Protocol):
    """Chooses the target of each episode."""

    def sample(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        """A point in the vessel, mm, shape (3,); all random numbers come from ``rng``. In ``start`` nothing is
        inserted.
        """
        ...


class CentrelineTarget:
    """A random point of the centre line where the site allows targets, uniformly distributed, at least a given path
    length from the sheath, and within the reach of the instruments (`reach.reached`).
    """

    def __init__(self, least_mm: float = 50.0) -> None:
        self.least_mm = checks.at_least("least_mm", least_mm, 0.0)

    def sample(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        line = site.centreline
        ways_mm = site.ways_mm(start.tip_mm)
        far = np.minimum(ways_mm[line.begin_rows], ways_mm[line.end_rows]) >= self.least_mm
        if site.targets is not None:
            far &= site.targets
        if not far.any():
            raise InputError(
                f"least_mm = {self.least_mm}: no point of the centre line is so far from the sheath; "
                f"the farthest is {ways_mm.max():.1f} mm away"
            )
        can = reached(line, ways_mm, start.instruments)
        far &= can[line.begin_rows] & can[line.end_rows]
        if not far.any():
            raise InputError(
                f"least_mm = {self.least_mm}: no point of the centre line that is so far from the sheath is within the "
                f"reach of the instruments, {ways_mm[can].max(initial=0.0):.1f} mm: give longer or thinner ones, or a smaller least_mm"
            )
        segments = np.flatnonzero(far)
        ends_mm = np.cumsum(line.lengths_mm[segments])
        at_mm = rng.uniform(0.0, ends_mm[-1])
        k = min(int(np.searchsorted(ends_mm, at_mm, side="right")), len(segments) - 1)
        segment = int(segments[k])
        part = 1.0 - (ends_mm[k] - at_mm) / line.lengths_mm[segment]
        return line.point_mm(segment, float(np.clip(part, 0.0, 1.0)))


class FixedTarget:
    """The same point in every episode, mm."""

    def __init__(self, position_mm: tuple[float, float, float]) -> None:
        self.position_mm = checks.place_mm("position_mm", position_mm)

    def sample(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        return self.position_mm


#: The name that stands for the openings of a vessel.
ANY_OPENING = "any opening"


class NamedTarget:
    """A random one of these named points of a vessel. ``"any opening"`` stands for the middle of a random one of its
    openings, but for that at the sheath: every vessel has such, also one that names no targets.
    """

    def __init__(self, *names: str) -> None:
        if not names or not all(isinstance(name, str) for name in names):
            raise InputError(f"names = {names!r}: give the name of one target or more")
        self.names = names

    def sample(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        name, known = self.names[int(rng.integers(len(self.names)))], site.vessel.targets
        if name == ANY_OPENING and name not in known:
            return self._opening(rng, site, start)
        if name not in known:
            others = f"has {', '.join(sorted(known))}" if known else "names no targets"
            raise InputError(f"target = {name!r}: the vessel {others}; {ANY_OPENING!r} is a random opening")
        return np.asarray(known[name])

    def _opening(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        centres_mm = np.array([opening["centre_mm"] for opening in site.vessel.openings]).reshape(-1, 3)
        if len(centres_mm) < 2:
            raise InputError(f"target = {ANY_OPENING!r}: the vessel has none but that at the sheath: give a place")
        own = int(np.argmin(np.linalg.norm(centres_mm - start.tip_mm, axis=1)))
        opening: NDArray[np.float64] = np.delete(centres_mm, own, axis=0)[int(rng.integers(len(centres_mm) - 1))]
        return opening
