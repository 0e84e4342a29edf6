"""Paths along the centre line of a vessel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Centreline:
    """A tree of points, each connected to its parent.

    ``table`` has the shape (n, 5): x, y, z and radius in mm, and the row of the parent, which precedes its children;
    -1 for the root.
    """

    def __init__(self, table: NDArray[np.float64]) -> None:
        self.positions_mm = np.ascontiguousarray(table[:, :3])
        self.radii_mm = table[:, 3].copy()
        self.parents = table[:, 4].astype(int)
        # Segment k connects row k + 1 to its parent.
        self.begin_mm = self.positions_mm[self.parents[1:]]
        self.along_mm = self.positions_mm[1:] - self.begin_mm
        self.lengths_mm = np.linalg.norm(self.along_mm, axis=1)
        self._squares = self.lengths_mm**2

    def nearest(self, point_mm: NDArray[np.float64]) -> tuple[int, float, float]:
        """The point on the tree nearest to a point: segment, position on it (0 at the parent, 1 at the row), distance
        in mm.
        """
        to_point = point_mm - self.begin_mm
        part = np.clip(np.einsum("ij,ij->i", to_point, self.along_mm) / self._squares, 0.0, 1.0)
        off = to_point - part[:, None] * self.along_mm
        squared = np.einsum("ij,ij->i", off, off)
        segment = int(np.argmin(squared))
        return segment, float(part[segment]), float(np.sqrt(squared[segment]))

    def point_mm(self, segment: int, part: float) -> NDArray[np.float64]:
        """A point on the tree."""
        point: NDArray[np.float64] = self.begin_mm[segment] + part * self.along_mm[segment]
        return point

    def ways_mm(self, point_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Path length along the tree from each row to the point nearest to ``point_mm``, mm, shape (n,)."""
        segment, part, _ = self.nearest(point_mm)
        ways = np.full(len(self.parents), np.inf)
        ways[segment + 1] = (1.0 - part) * self.lengths_mm[segment]
        ways[self.parents[segment + 1]] = part * self.lengths_mm[segment]
        # First towards the root, then away from it: parents precede their children.
        for row in range(len(ways) - 1, 0, -1):
            parent = self.parents[row]
            ways[parent] = min(ways[parent], ways[row] + self.lengths_mm[row - 1])
        for row in range(1, len(ways)):
            ways[row] = min(ways[row], ways[self.parents[row]] + self.lengths_mm[row - 1])
        return ways

    def path(self, point_mm: NDArray[np.float64]) -> Path:
        """The path along the tree from its root to the point nearest to ``point_mm``."""
        segment, part, _ = self.nearest(point_mm)
        rows = [int(self.parents[segment + 1])]
        while self.parents[rows[-1]] >= 0:
            rows.append(int(self.parents[rows[-1]]))
        table = np.column_stack([self.positions_mm, self.radii_mm])[[*rows[::-1], segment + 1]]
        if part > 0.0 or len(table) == 2:
            # The last segment ends at this point, but at least at a hundredth of its length, so that no path has
            # length zero.
            table[-1] = table[-2] + max(part, 0.01) * (table[-1] - table[-2])
            return Path(table)
        return Path(table[:-1])


class Path:
    """A path from the sheath to a target: ``table_mm`` has the shape (n, 4), positions and radii of the vessel in mm.
    """

    def __init__(self, table_mm: NDArray[np.float64]) -> None:
        self.table_mm = table_mm
        pieces = np.diff(table_mm[:, :3], axis=0)
        self._arcs_mm = np.append(0.0, np.cumsum(np.linalg.norm(pieces, axis=1)))
        self._line = Centreline(np.column_stack([table_mm, np.arange(-1, len(table_mm) - 1)]))

    @property
    def length_mm(self) -> float:
        """Length of the path, mm."""
        return float(self._arcs_mm[-1])

    def nearest(self, point_mm: NDArray[np.float64]) -> tuple[float, float, float]:
        """The point on the path nearest to ``point_mm``: arc length from the beginning, distance, and the vessel's
        radius there, mm.
        """
        segment, part, distance_mm = self._line.nearest(point_mm)
        at_mm = self._arcs_mm[segment] + part * self._line.lengths_mm[segment]
        return float(at_mm), distance_mm, float(np.interp(at_mm, self._arcs_mm, self.table_mm[:, 3]))

    def at_mm(self, arcs_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points at arc lengths, shape (m,) to (m, 3); the last point beyond the end."""
        return np.stack([np.interp(arcs_mm, self._arcs_mm, self.table_mm[:, k]) for k in range(3)], axis=-1)


class Ways:
    """The paths of ``n`` environments to their targets, computed for all at once."""

    def __init__(self, n: int) -> None:
        # The coordinate axis comes first; rows of environments are padded with segments far away.
        self._begin_mm, self._along_mm = np.zeros((3, n, 0)), np.zeros((3, n, 0))
        self._squares, self._lengths_mm = np.zeros((n, 0)), np.zeros((n, 0))
        self._from_parent_mm, self._from_child_mm = np.zeros((n, 0)), np.zeros((n, 0))
        # The target's segment, and the place on it.
        self._segment, self._part = np.zeros(n, dtype=int), np.zeros(n)
        self._rows = np.arange(n)

    def put(self, k: int, line: Centreline, target_mm: NDArray[np.float64]) -> None:
        """Sets the tree and the target of environment k."""
        ways_mm = line.ways_mm(target_mm)
        self._segment[k], self._part[k], _ = line.nearest(target_mm)
        more = len(line.lengths_mm) - self._squares.shape[1]
        if more > 0:
            for name, fill in (
                ("_begin_mm", 1e9),
                ("_along_mm", 1.0),
                ("_squares", 3.0),
                ("_lengths_mm", 0.0),
                ("_from_parent_mm", 0.0),
                ("_from_child_mm", 0.0),
            ):
                old = getattr(self, name)
                setattr(
                    self, name, np.pad(old, [(0, 0)] * (old.ndim - 1) + [(0, more)], constant_values=fill)
                )
        count = len(line.lengths_mm)
        self._begin_mm[:, k] = 1e9
        self._begin_mm[:, k, :count] = line.begin_mm.T
        self._along_mm[:, k, :count] = line.along_mm.T
        self._squares[k, :count] = line.lengths_mm**2
        self._lengths_mm[k, :count] = line.lengths_mm
        self._from_parent_mm[k, :count] = ways_mm[line.parents[1:]]
        self._from_child_mm[k, :count] = ways_mm[1:]

    def left_mm(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Path length from the point on the tree nearest to each given point to the target, mm: shape (n, 3) to (n,)."""
        x, y, z = points_mm.T[:, :, None] - self._begin_mm
        u, v, w = self._along_mm
        part = np.clip((x * u + y * v + z * w) / self._squares, 0.0, 1.0)
        squared = (x - part * u) ** 2 + (y - part * v) ** 2 + (z - part * w) ** 2
        at = self._rows, np.argmin(squared, axis=1)
        length, part = self._lengths_mm[at], part[at]
        near: NDArray[np.float64] = np.minimum(
            self._from_child_mm[at] + (1.0 - part) * length, self._from_parent_mm[at] + part * length
        )
        return np.where(at[1] == self._segment, np.abs(part - self._part) * length, near)
