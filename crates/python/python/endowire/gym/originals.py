"""Vessels of the tasks of stEVE_bench, read from its own files if the user has them, and substitutes otherwise.

DualDeviceNav is a surface (OBJ) with centre lines of 3D Slicer (``*.mrk.json``). BasicWireNav is the model
0011_H_AO_H of the Vascular Model Repository: a surface (``Meshes/*.vtp``) with paths of SimVascular
(``Paths/*.pth``). Neither is part of this package.
"""

from __future__ import annotations

import json
import re
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import InputError, Vessel
from .centreline import Centreline
from .vessels import Site

Array = NDArray[np.float64]

#: Assumed radius of a SimVascular path, which contains none, mm.
_PATH_RADIUS_MM = 5.0


class OriginalVessel:
    """A fixed vessel that was read from the files of a task."""

    def __init__(self, site: Site) -> None:
        self.site = site
        low, high = site.vessel.vertices_mm.min(axis=0), site.vessel.vertices_mm.max(axis=0)
        # Instruments may leave through an opening.
        self.bounds_mm = np.stack([low, high]) + np.outer([-0.1, 0.1], high - low)

    def sample(self, rng: np.random.Generator) -> Site:
        """Always the same site."""
        return self.site


def dual_device_nav(folder: str | PathLike[str]) -> OriginalVessel:
    """The vessel of DualDeviceNav from the folder ``data/dualdevicenav`` of stEVE_bench.

    Raises InputError for missing or invalid files.
    """
    root = Path(folder)
    # Rotated by 90° about y, then by −90° about z, as in the original.
    turn = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    surface = Vessel.read(root / "vessel_architecture_collision.obj")
    vessel = Vessel.from_arrays(surface.vertices_mm @ turn.T, surface.triangles)
    curves = {}
    for path in _files(root / "Centrelines_comb", "*.mrk.json"):
        curve = _slicer_curve(path)
        curves[path.name.removesuffix(".mrk.json")] = np.column_stack([curve[:, :3] @ turn.T, curve[:, 3]])
    named = [name for name in curves if name.endswith(("LCCA", "LVA", "RCCA", "RVA"))]
    position_mm = np.array([65.0, -5.0, 35.0])
    sheath = {"position_mm": position_mm.tolist(), "direction": [-1.0, 0.0, 1.0]}
    return OriginalVessel(_site(vessel, curves, named, position_mm, sheath))


def basic_wire_nav(folder: str | PathLike[str]) -> OriginalVessel:
    """The vessel of BasicWireNav from the folder of the model 0011_H_AO_H of the Vascular Model Repository.

    Raises InputError for missing or invalid files.
    """
    root = Path(folder)
    angle = np.deg2rad(133.0)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    # The files are in centimetres.
    surface = Vessel.read(_files(root / "Meshes", "*.vtp")[0], unit_mm=10.0)
    vessel = Vessel.from_arrays(surface.vertices_mm @ turn.T, surface.triangles)
    turn *= 10.0
    curves = {}
    for path in _files(root / "Paths", "*.pth"):
        points_mm = _simvascular_path(path) @ turn.T
        # Paths begin and end outside the vessel.
        points_mm = points_mm[vessel.contains(points_mm)]
        if len(points_mm) > 1:
            curves[path.stem] = np.column_stack([points_mm, np.full(len(points_mm), _PATH_RADIUS_MM)])
    if "aorta" not in curves:
        raise InputError(
            f"{root / 'Paths'}: no path aorta.pth inside the surface: give the folder of 0011_H_AO_H"
        )
    aorta = curves["aorta"]
    named = [name for name in curves if name in ("btrunk", "carotid", "rt_carotid", "subclavian")]
    direction = aorta[-3, :3] - aorta[-1, :3]
    sheath = {"position_mm": aorta[-1, :3].tolist(), "direction": direction.tolist()}
    return OriginalVessel(_site(vessel, curves, named, aorta[-1, :3], sheath))


def _files(folder: Path, pattern: str) -> list[Path]:
    found = sorted(folder.glob(pattern))
    if not found:
        raise InputError(f"{folder}: no file {pattern}: give the folder of the original data")
    return found


def _slicer_curve(path: Path) -> Array:
    """Points and radii of a 3D Slicer curve, shape (n, 4)."""
    try:
        markup = json.loads(path.read_text())["markups"][0]
        points = np.array([point["position"] for point in markup["controlPoints"]], dtype=float)
        radii = next(m["controlPointValues"] for m in markup["measurements"] if m["name"] == "Radius")
        return np.column_stack([points, np.asarray(radii, dtype=float)])
    except (ValueError, LookupError, TypeError, StopIteration) as error:
        raise InputError(f"{path}: no curve of 3D Slicer with radii ({error!r})") from error


def _simvascular_path(path: Path) -> Array:
    """Points of a SimVascular path, shape (n, 3), in its own unit."""
    _, _, points = path.read_text().partition("<path_points>")
    number = r'"\s*([-+.\deE]+)\s*"'
    found = re.findall(rf"<pos\s+x={number}\s+y={number}\s+z={number}", points)
    if len(found) < 2:
        raise InputError(f"{path}: no path of SimVascular: it has {len(found)} points")
    return np.array(found, dtype=float)


def joined(curves: list[Array], start_mm: Array) -> tuple[Array, list[int]]:
    """Joins curves to one tree, shape (n, 5), that starts at the end nearest to a point; also returns the curve of
    each row.

    In each step, the curve whose end is nearest to the tree so far is attached there.
    """
    left = dict(enumerate(curves))
    rows, owners = np.zeros((0, 5)), []
    while left:
        there = rows[:, :3] if len(rows) else start_mm[None]
        ends = [(k, end) for k in left for end in (0, -1)]
        off = [np.linalg.norm(there - left[k][end, :3], axis=1) for k, end in ends]
        best = int(np.argmin([distances.min() for distances in off]))
        k, end = ends[best]
        parent = int(np.argmin(off[best])) if len(rows) else -1
        curve = left.pop(k)[:: 1 if end == 0 else -1]
        # A repeated point would be a segment of length zero.
        if parent >= 0 and np.allclose(curve[0, :3], rows[parent, :3]):
            curve = curve[1:]
        keep = np.append(True, np.linalg.norm(np.diff(curve[:, :3], axis=0), axis=1) > 1e-9)[: len(curve)]
        curve = curve[keep]
        parents = np.append(parent, np.arange(len(rows), len(rows) + len(curve) - 1))[: len(curve)]
        rows = np.concatenate([rows, np.column_stack([curve, parents])])
        owners += [k] * len(curve)
    return rows, owners


def _site(
    vessel: Vessel,
    curves: dict[str, Array],
    named: list[str],
    start_mm: Array,
    sheath: dict[str, list[float]],
) -> Site:
    """A site with targets in the named curves, outside of all others."""
    table, owners = joined(list(curves.values()), start_mm)
    names = list(curves)
    target = np.array([names[owner] in named for owner in owners])
    others = table[~target]
    off = np.linalg.norm(table[:, None, :3] - others[None, :, :3], axis=2)
    target &= (off > others[:, 3]).all(axis=1)
    parents = table[1:, 4].astype(int)
    return Site(vessel, Centreline(table), sheath, target[1:] & target[parents])
