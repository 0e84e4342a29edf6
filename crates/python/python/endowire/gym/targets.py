"""Choice of targets."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .. import InputError, Simulation
from . import checks
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
    length from the sheath.
    """

    def __init__(self, least_mm: float = 50.0) -> None:
        self.least_mm = checks.at_least("least_mm", least_mm, 0.0)

    def sample(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        line = site.centreline
        ways_mm = line.ways_mm(start.tip_mm)
        far = np.minimum(ways_mm[line.begin_rows], ways_mm[line.end_rows]) >= self.least_mm
        if site.targets is not None:
            far &= site.targets
        if not far.any():
            raise InputError(
                f"least_mm = {self.least_mm}: no point of the centre line is so far from the sheath; "
                f"the farthest is {ways_mm.max():.1f} mm away"
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


class NamedTarget:
    """A random one of these named points of a generated vessel."""

    def __init__(self, *names: str) -> None:
        if not names or not all(isinstance(name, str) for name in names):
            raise InputError(f"names = {names!r}: give the name of one target or more")
        self.names = names

    def sample(self, rng: np.random.Generator, site: Site, start: Simulation) -> NDArray[np.float64]:
        name, known = self.names[int(rng.integers(len(self.names)))], site.vessel.targets
        if name not in known:
            others = f"has {', '.join(sorted(known))}" if known else "names no targets"
            raise InputError(f"target = {name!r}: the vessel {others}")
        return np.asarray(known[name])
