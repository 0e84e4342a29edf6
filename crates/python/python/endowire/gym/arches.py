"""Aortic arches of type I, a new one for each episode, with the variety of the task ArchVariety of stEVE_bench (MIT
licence).

This is a new implementation of its parameters: points, directions, lengths of tangents and diameters with their
standard deviations, and the scales. The sampling differs, so a seed gives a different arch than there. Arches without
a valid wall, because branches intersect or bend tighter than they are wide, are drawn again: nearly half of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import ComputationError, InputError, Vessel
from . import checks
from .centreline import Centreline
from .vessels import Site

Array = NDArray[np.float64]

#: Spacing of points of the centre line, mm.
_SPACING_MM = 4.0
#: Height at which the carotid arteries end, mm, and lateral position at which the subclavian arteries end, before
#: scaling.
_TOP_MM, _RIGHT_MM, _LEFT_MM = 230.0, -57.0, 59.0
#: Largest number of attempts to draw an arch.
_MOST_DRAWS = 20


class _Knot:
    """A control point of a course: position, tangent, diameter and its slope, mm."""

    def __init__(self, position_mm: Array, tangent: Array, diameter_mm: float, slope: float) -> None:
        self.position_mm, self.tangent, self.diameter_mm, self.slope = (
            position_mm,
            tangent,
            diameter_mm,
            slope,
        )


def _course(knots: list[_Knot]) -> Array:
    """The cubic Hermite curve through knots, parametrised by chord length, shape (n, 4): position and radius, mm."""
    pieces = []
    for begin, end in zip(knots, knots[1:], strict=False):
        chord = float(np.linalg.norm(end.position_mm - begin.position_mm))
        t = np.arange(max(2, round(chord / _SPACING_MM))) / max(2, round(chord / _SPACING_MM))
        pieces.append(_hermite(begin, end, chord, t))
    pieces.append(_hermite(knots[-2], knots[-1], chord, np.array([1.0])))
    return np.concatenate(pieces)


def _hermite(begin: _Knot, end: _Knot, chord: float, t: Array) -> Array:
    weights = [2 * t**3 - 3 * t**2 + 1, t**3 - 2 * t**2 + t, -2 * t**3 + 3 * t**2, t**3 - t**2]
    ends = [
        np.append(begin.position_mm, begin.diameter_mm / 2),
        np.append(begin.tangent, begin.slope / 2) * chord,
        np.append(end.position_mm, end.diameter_mm / 2),
        np.append(end.tangent, end.slope / 2) * chord,
    ]
    return sum((np.outer(w, e) for w, e in zip(weights, ends, strict=True)), np.zeros((len(t), 4)))


class _Draw:
    """Normally distributed numbers for one arch."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng

    def number(self, mean: float, sigma: float) -> float:
        return float(self.rng.normal(mean, sigma))

    def point(self, mean: tuple[float, ...], sigma: tuple[float, ...]) -> Array:
        return self.rng.normal(mean, sigma)

    def tangent(
        self, mean: tuple[float, ...], sigma: tuple[float, ...], length: tuple[float, float]
    ) -> Array:
        direction = self.point(mean, sigma)
        return direction / np.linalg.norm(direction) * self.number(*length)


def _aorta(draw: _Draw) -> Array:
    places: list[tuple[tuple[float, ...], tuple[float, ...]]] = [
        ((0, 0, 0), (0, 0, 0)),
        ((30, 0, 90), (2, 1, 3)),
        ((20, -40, 160), (1.5, 3, 2)),
        ((-5, -60, 100), (1, 2, 1)),
    ]
    tangents: list[tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]] = [
        ((0, 0, 1), (0.1, 0, 0.3), (1.0, 0.1)),
        ((1, 0, 2), (0.4, 0.3, 0.2), (1.2, 0.15)),
        ((-4, -6, -0.5), (0.8, 1, 0.7), (1.4, 0.15)),
        ((3, 4, -8), (0.3, 0.3, 0.5), (1.6, 0.15)),
    ]
    # Each diameter builds on the previous one.
    growth = [(17, 1), (3, 0.7), (4, 0.7), (5, 0.7)]
    slopes = [(0.02, 0.005), (0.02, 0.005), (0.07, 0.008), (0.0, 0.0)]
    diameters = np.cumsum([draw.number(*each) for each in growth])
    # The course runs from the descending aorta to the heart; a tangent of (3, 4, -8) points downwards there.
    knots = [
        _Knot(draw.point(*place), draw.tangent(*tangent), float(diameter), draw.number(*slope))
        for place, tangent, diameter, slope in zip(places, tangents, diameters, slopes, strict=True)
    ]
    return _course(knots)


def _brachiocephalic(draw: _Draw, start: Array) -> tuple[Array, _Knot]:
    d = draw.number(17, 1)
    begin = _Knot(start, draw.tangent((0, -0.3, 1), (0.05, 0.05, 0), (2, 0.1)), d, 0.0)
    end = _Knot(
        start + draw.point((-20, 5, 45), (3, 2, 3)),
        draw.tangent((-0.3, 0.3, 0.7), (0.1, 0.1, 0.2), (0.8, 0.1)),
        d + draw.number(-7, 0.7),
        draw.number(-0.1, 0.033),
    )
    return _course([begin, end]), end


def _right_subclavian(draw: _Draw, trunk: _Knot) -> Array:
    tangent = trunk.tangent / np.linalg.norm(trunk.tangent) * draw.number(1.5, 0.2)
    end_mm = np.array(
        [_RIGHT_MM, trunk.position_mm[1] + draw.number(35, 2), trunk.position_mm[2] + draw.number(25, 1)]
    )
    end_tangent = draw.tangent((-1.2, 0, 0), (0.3, 0.2, 0.1), (1.5, 0.2))
    return _course(
        [
            _Knot(trunk.position_mm, tangent, trunk.diameter_mm, trunk.slope),
            _Knot(end_mm, end_tangent, trunk.diameter_mm, 0.0),
        ]
    )


def _right_carotid(draw: _Draw, start: Array) -> Array:
    begin = _Knot(start, draw.tangent((0.2, 0, 1), (0.2, 0.2, 0.3), (1.5, 0.2)), draw.number(10, 0.33), 0.0)
    end_mm = np.array([start[0] + draw.number(0, 2), start[1] + draw.number(0, 2), _TOP_MM])
    tangent = draw.tangent((0, 0, 1), (0.1, 0.1, 0), (1.5, 0.2))
    return _course([begin, _Knot(end_mm, tangent, begin.diameter_mm + draw.number(-1, 0.33), 0.0)])


def _left_carotid(draw: _Draw, start: Array) -> Array:
    begin = _Knot(start, draw.tangent((0.3, 0, 1), (0.2, 0.2, 0), (1.5, 0.2)), draw.number(10, 0.33), 0.0)
    end_mm = np.array([start[0] + draw.number(2, 1), start[1] + draw.number(8, 3), _TOP_MM])
    tangent = draw.tangent((0, 0, 1), (0.2, 0.3, 0), (1.5, 0.2))
    return _course([begin, _Knot(end_mm, tangent, begin.diameter_mm + draw.number(-0.5, 0.2), 0.0)])


def _left_subclavian(draw: _Draw, start: Array) -> Array:
    begin = _Knot(start, draw.tangent((0.1, 0.1, 2), (0.1, 0.1, 0.3), (2, 0.4)), draw.number(10, 0.33), 0.0)
    end_mm = np.array([_LEFT_MM, start[1] + draw.number(5, 2), start[2] + draw.number(50, 2)])
    end = _Knot(
        end_mm,
        draw.tangent((1, 0.3, 0), (0.2, 0.07, 0.15), (1.7, 0.4)),
        begin.diameter_mm + draw.number(-1, 0.33),
        draw.number(-0.1, 0.03),
    )
    return _course([begin, end])


def arch(rng: np.random.Generator) -> tuple[Array, int]:
    """The centre line of an arch of type I: a table of shape (n, 5) for `Vessel.generate`, with its root in the
    descending aorta, and the number of its first rows that belong to the aorta.
    """
    draw = _Draw(rng)
    width, height = rng.choice(np.linspace(0.7, 1.3, 61), size=2)
    aorta = _aorta(draw)
    rows = [np.column_stack([aorta, np.arange(-1, len(aorta) - 1)])]
    count = len(aorta)

    def add(course: Array, parent: int) -> int:
        # The first point belongs to the parent.
        nonlocal count
        parents = np.append(parent, np.arange(count, count + len(course) - 2))
        rows.append(np.column_stack([course[1:], parents]))
        count += len(course) - 1
        return count - 1

    # Positions of the branches, as lengths from the end at the heart.
    from_heart_mm = np.cumsum([draw.number(36, 5), draw.number(16, 4), draw.number(28, 3)])
    along_mm = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(aorta[:, :3], axis=0), axis=1)))
    trunk_row, carotid_row, subclavian_row = (
        int(np.argmin(np.abs(along_mm[-1] - mm - along_mm))) for mm in from_heart_mm
    )
    trunk, end = _brachiocephalic(draw, aorta[trunk_row, :3])
    fork = add(trunk, trunk_row)
    add(_right_subclavian(draw, end), fork)
    add(_right_carotid(draw, end.position_mm), fork)
    add(_left_carotid(draw, aorta[carotid_row, :3]), carotid_row)
    add(_left_subclavian(draw, aorta[subclavian_row, :3]), subclavian_row)
    table = np.concatenate(rows)
    table[:, :3] *= [width, width, height]
    table[:, 3] *= 0.85
    return table, len(aorta)


class ArchVariety:
    """An arch of type I for each episode, drawn with triangle edges of about ``edge_mm``; devices touch the exact
    surface of the centre line.

    With ``count``, there are that many arches, generated from ``seed`` when first needed, and kept; each is equally
    likely. With None, each episode has a new one. Contact needs no mesh of it; about one in twenty cannot be meshed,
    and a picture of such an arch raises InputError or ComputationError.
    """

    #: Bounds of the widest and highest arches.
    bounds_mm = np.array([[-110.0, -120.0, -10.0], [110.0, 110.0, 320.0]])

    def __init__(self, count: int | None = None, edge_mm: float = 4.0, seed: int = 0) -> None:
        self.count = None if count is None else checks.whole("count", count, 1)
        self.edge_mm = checks.positive("edge_mm", edge_mm)
        self.seed = checks.whole("seed", seed, 0)
        self._kept: dict[int, Site] = {}

    def __deepcopy__(self, memo: dict[int, Any]) -> ArchVariety:
        # The cached arches are immutable, and environments of one task share them.
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return ArchVariety, (self.count, self.edge_mm, self.seed)

    def sample(self, rng: np.random.Generator) -> Site:
        """A new arch from ``rng``, or one of those generated from ``seed``."""
        if self.count is None:
            return self._make(rng)
        number = int(rng.integers(self.count))
        if number not in self._kept:
            self._kept[number] = self._make(np.random.default_rng([self.seed, number]))
        return self._kept[number]

    def _make(self, rng: np.random.Generator) -> Site:
        for _ in range(_MOST_DRAWS):
            table, aorta = arch(rng)
            try:
                vessel = Vessel.generate(table, edge_mm=self.edge_mm)
                if self.count is not None:
                    _ = vessel.triangles
            except (InputError, ComputationError) as refused:
                last = refused
                continue
            line = Centreline(table)
            # Targets are in branches, outside the lumen of the aorta.
            within = np.linalg.norm(line.positions_mm[:, None] - line.positions_mm[None, :aorta], axis=2)
            beyond = (within > line.radii_mm[:aorta]).all(axis=1)
            targets = beyond[1:] & beyond[line.parents[1:]]
            return Site(vessel, line, {}, targets)
        raise last
