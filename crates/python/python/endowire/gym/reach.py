"""How far instruments can come in a vessel: by their length, and by the width of the lumen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .. import InputError, Instrument, Simulation
from .centreline import Centreline
from .vessels import Site


def _widths(instrument: Instrument) -> list[tuple[float, float]]:
    """Distances from the tip at which an instrument becomes thicker, mm, and its radius from there, mm."""
    widths: list[tuple[float, float]] = []
    from_tip_mm = 0.0
    for section in instrument.sections:
        if not widths or section["radius_mm"] > widths[-1][1]:
            widths.append((from_tip_mm, float(section["radius_mm"])))
        from_tip_mm += section["length_mm"]
    return widths


def reached(line: Centreline, ways_mm: NDArray[np.float64], instruments: Sequence[Instrument]) -> NDArray[np.bool_]:
    """Whether the tip of one of these instruments surely comes to each row of a centre line along it, shape (n,).

    ``ways_mm`` are the lengths of the way to each row, shape (n,). An instrument must be as long as the way, and nowhere
    on it from the root thicker than the lumen where it passes when the tip is there. One that cuts corners, or widens
    the vessel, may come farther.
    """
    thin_mm, longest_mm = line.radii_mm.min(), ways_mm.max()
    if any(_widths(one)[-1][1] <= thin_mm and longest_mm <= one.length_mm for one in instruments):
        return np.ones(len(ways_mm), dtype=bool)
    arcs_mm = np.zeros(len(ways_mm))
    for row in range(1, len(arcs_mm)):
        arcs_mm[row] = arcs_mm[line.parents[row]] + line.lengths_mm[row - 1]
    can = np.zeros(len(ways_mm), dtype=bool)
    for instrument in instruments:
        is_there = ways_mm <= instrument.length_mm
        for from_tip_mm, radius_mm in _widths(instrument):
            # The first place on the way from the root that is too narrow.
            narrow_mm = np.where(line.radii_mm < radius_mm, arcs_mm, np.inf)
            for row in range(1, len(arcs_mm)):
                narrow_mm[row] = min(narrow_mm[row], narrow_mm[line.parents[row]])
            is_there &= arcs_mm - narrow_mm < from_tip_mm
        can |= is_there
    return can


def why_not(site: Site, start: Simulation, target_mm: NDArray[np.float64], near_mm: float) -> str:
    """Why no instrument of a simulation with nothing inserted can come within ``near_mm`` of a target, mm; empty if one
    can, or if that cannot be told.
    """
    line, ways_mm, instruments = site.centreline, site.ways_mm(start.tip_mm), start.instruments
    segment, part, _ = line.nearest(target_mm)
    rows = [int(line.end_rows[segment]), int(line.begin_rows[segment])]
    if reached(line, ways_mm, instruments)[rows].all():
        return ""
    off_mm = np.array([1.0 - part, part]) * line.lengths_mm[segment]
    way_mm = float((ways_mm[rows] + off_mm).min())
    length_mm = max(instrument.length_mm for instrument in instruments)
    short = f"the way to it is {way_mm:.1f} mm long, the instruments {length_mm:.1f} mm: give a longer one, or a nearer target"
    if np.linalg.norm(target_mm - start.tip_mm) > length_mm + near_mm:
        return short
    if np.linalg.norm(line.positions_mm[0] - start.tip_mm) > 2.0 * line.radii_mm[0]:
        # The sheath is elsewhere than at the beginning of the centre line, from which passages are known.
        return ""
    try:
        found = [site.vessel.passable(instrument, target_mm.tolist()) for instrument in instruments]
    except InputError:
        return ""
    best = max(found, key=lambda one: one["reaches_mm"])
    if best["passage"] not in ("short", "blocked") or best["reaches_mm"] >= best["length_mm"] - near_mm:
        return ""
    if best["passage"] == "short":
        return short
    narrow = best["narrowest"]
    return (
        f"the lumen is {narrow['lumen_radius_mm']:.2f} mm in radius {narrow['arc_mm']:.0f} mm from the beginning, and the "
        f"instrument {narrow['device_radius_mm']:.2f} mm there: give a thinner one, or another target"
    )
