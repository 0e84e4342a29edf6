"""Paths along the centre line of a vessel."""

from __future__ import annotations

import heapq
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


class Centreline:
    """A tree of points, each connected to its parent, whose branches may meet again.

    ``table`` has the shape (n, 5): x, y, z and radius in mm, and the row of the parent, which precedes its children;
    -1 for the root. ``links`` are pairs of rows that are connected as well, as in `endowire.Vessel.links`: an arm's last
    row and the row that it joins. Lengths to a point are those of the shortest way, by whichever arm.
    """

    def __init__(self, table: NDArray[np.float64], links: Sequence[tuple[int, int]] = ()) -> None:
        self.positions_mm = np.ascontiguousarray(table[:, :3])
        self.radii_mm = table[:, 3].copy()
        self.parents = table[:, 4].astype(int)
        self.links = [(int(row), int(joins)) for row, joins in links]
        #: The rows at which each segment begins and ends: segment k < n - 1 leads from the parent of row k + 1 to that
        #: row, and those behind are the links.
        joined = np.array(self.links, dtype=int).reshape(-1, 2)
        self.begin_rows = np.append(self.parents[1:], joined[:, 0])
        self.end_rows = np.append(np.arange(1, len(self.parents)), joined[:, 1])
        self.begin_mm = self.positions_mm[self.begin_rows]
        self.along_mm = self.positions_mm[self.end_rows] - self.begin_mm
        self.lengths_mm = np.linalg.norm(self.along_mm, axis=1)
        self._squares = self.lengths_mm**2
        # Where branches meet again: the way from the root to each row, mm, and the row before it.
        self._from_root = self._shortest() if self.links else None

    def nearest(self, point_mm: NDArray[np.float64]) -> tuple[int, float, float]:
        """The point on the line nearest to a point: segment, position on it (0 where it begins, 1 where it ends),
        distance in mm.
        """
        to_point = point_mm - self.begin_mm
        part = np.clip(np.einsum("ij,ij->i", to_point, self.along_mm) / self._squares, 0.0, 1.0)
        off = to_point - part[:, None] * self.along_mm
        squared = np.einsum("ij,ij->i", off, off)
        segment = int(np.argmin(squared))
        return segment, float(part[segment]), float(np.sqrt(squared[segment]))

    def point_mm(self, segment: int, part: float) -> NDArray[np.float64]:
        """A point on the line."""
        point: NDArray[np.float64] = self.begin_mm[segment] + part * self.along_mm[segment]
        return point

    def ways_mm(self, point_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Path length along the line from each row to the point nearest to ``point_mm``, mm, shape (n,)."""
        segment, part, _ = self.nearest(point_mm)
        ways = np.full(len(self.parents), np.inf)
        ways[self.end_rows[segment]] = (1.0 - part) * self.lengths_mm[segment]
        ways[self.begin_rows[segment]] = part * self.lengths_mm[segment]
        self._along_tree(ways)
        # Each link may shorten ways on its other side, and by them those over another link.
        for _ in self.links:
            before = ways.copy()
            for (row, joins), length_mm in zip(self.links, self._link_lengths_mm(), strict=True):
                ways[row] = min(ways[row], ways[joins] + length_mm)
                ways[joins] = min(ways[joins], ways[row] + length_mm)
            self._along_tree(ways)
            if np.array_equal(ways, before):
                break
        return ways

    def _along_tree(self, ways: NDArray[np.float64]) -> None:
        """Shortens ways by those of parents and children."""
        # First towards the root, then away from it: parents precede their children.
        for row in range(len(ways) - 1, 0, -1):
            parent = self.parents[row]
            ways[parent] = min(ways[parent], ways[row] + self.lengths_mm[row - 1])
        for row in range(1, len(ways)):
            ways[row] = min(ways[row], ways[self.parents[row]] + self.lengths_mm[row - 1])

    def _link_lengths_mm(self) -> NDArray[np.float64]:
        return self.lengths_mm[len(self.parents) - 1 :]

    def _shortest(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """The shortest way from the root to each row, mm, and the row before it on that way."""
        near: list[list[tuple[int, float]]] = [[] for _ in self.parents]
        for begin, end, length_mm in zip(self.begin_rows, self.end_rows, self.lengths_mm, strict=True):
            near[begin].append((int(end), float(length_mm)))
            near[end].append((int(begin), float(length_mm)))
        ways, before = np.full(len(self.parents), np.inf), np.full(len(self.parents), -1)
        ways[0] = 0.0
        queue = [(0.0, 0)]
        while queue:
            way_mm, row = heapq.heappop(queue)
            if way_mm > ways[row]:
                continue
            for other, length_mm in near[row]:
                if way_mm + length_mm < ways[other]:
                    ways[other], before[other] = way_mm + length_mm, row
                    heapq.heappush(queue, (way_mm + length_mm, other))
        return ways, before

    def path(self, point_mm: NDArray[np.float64]) -> Path:
        """The shortest path along the line from its root to the point nearest to ``point_mm``."""
        segment, part, _ = self.nearest(point_mm)
        near, far = int(self.begin_rows[segment]), int(self.end_rows[segment])
        before = self.parents
        if self._from_root is not None:
            ways, before = self._from_root
            length_mm = self.lengths_mm[segment]
            if ways[far] + (1.0 - part) * length_mm < ways[near] + part * length_mm:
                near, far, part = far, near, 1.0 - part
        rows = [near]
        while before[rows[-1]] >= 0:
            rows.append(int(before[rows[-1]]))
        table = np.column_stack([self.positions_mm, self.radii_mm])[[*rows[::-1], far]]
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
        self._from_begin_mm, self._from_end_mm = np.zeros((n, 0)), np.zeros((n, 0))
        # The target's segment, and the place on it.
        self._segment, self._part = np.zeros(n, dtype=int), np.zeros(n)
        self._rows = np.arange(n)

    def put(self, k: int, line: Centreline, target_mm: NDArray[np.float64]) -> None:
        """Sets the line and the target of environment k."""
        ways_mm = line.ways_mm(target_mm)
        self._segment[k], self._part[k], _ = line.nearest(target_mm)
        more = len(line.lengths_mm) - self._squares.shape[1]
        if more > 0:
            for name, fill in (
                ("_begin_mm", 1e9),
                ("_along_mm", 1.0),
                ("_squares", 3.0),
                ("_lengths_mm", 0.0),
                ("_from_begin_mm", 0.0),
                ("_from_end_mm", 0.0),
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
        self._from_begin_mm[k, :count] = ways_mm[line.begin_rows]
        self._from_end_mm[k, :count] = ways_mm[line.end_rows]

    def left_mm(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Path length from the point on the line nearest to each given point to the target, mm: shape (n, 3) to (n,)."""
        x, y, z = points_mm.T[:, :, None] - self._begin_mm
        u, v, w = self._along_mm
        part = np.clip((x * u + y * v + z * w) / self._squares, 0.0, 1.0)
        squared = (x - part * u) ** 2 + (y - part * v) ** 2 + (z - part * w) ** 2
        at = self._rows, np.argmin(squared, axis=1)
        length, part = self._lengths_mm[at], part[at]
        near: NDArray[np.float64] = np.minimum(
            self._from_end_mm[at] + (1.0 - part) * length, self._from_begin_mm[at] + part * length
        )
        return np.where(at[1] == self._segment, np.abs(part - self._part) * length, near)
