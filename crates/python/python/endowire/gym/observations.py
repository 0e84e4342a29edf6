"""Observations: parts of a dictionary, each with its space. All parts handle all environments of a vector at once.

Values are in mm, N and N·mm. A part with a ``unit`` can be scaled to numbers of about 1 (`scaling`); a task does this
unless ``observed="physical"``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from .. import InputError
from .._endowire import _check_view
from . import checks
from .vessels import FRONT

if TYPE_CHECKING:
    from .centreline import Path
    from .episodes import Episodes
    from .task import Task

#: Shortest length ahead of a roadmap, mm: positions are relative to it.
_LEAST_AHEAD_MM = 0.001


class Observation(Protocol):
    """One part of the observations."""

    def space(self, task: Task) -> spaces.Box:
        """The space of one environment."""
        ...

    def observe(self, episodes: Episodes) -> NDArray[Any]:
        """The part for all environments, shape (n, *space.shape)."""
        ...


def _place(task: Task, *shape: int) -> spaces.Box:
    """The space of positions within the bounding box of the vessels, mm."""
    low, high = (np.broadcast_to(corner, (*shape, 3)).astype(np.float32) for corner in task.vessels.bounds_mm)
    return spaces.Box(low, high, dtype=np.float32)


def _of_vessels(task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre and scale of positions: the centre of the vessels' bounding box, and half of its longest side, equal in
    all directions.
    """
    low, high = task.vessels.bounds_mm
    return (low + high) / 2.0, np.full(3, (high - low).max() / 2.0)


class Tip:
    """Position of the tip, mm, shape (3,)."""

    def space(self, task: Task) -> spaces.Box:
        return _place(task)

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return _of_vessels(task)

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        return episodes.tip_mm


class Target:
    """Position of the target, mm, shape (3,)."""

    def space(self, task: Task) -> spaces.Box:
        return _place(task)

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return _of_vessels(task)

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        return episodes.target_mm


class Shape:
    """Points of the centre line at arc lengths from the tip, mm, shape (len(from_tip_mm), 3)."""

    def __init__(self, from_tip_mm: tuple[float, ...] = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0)) -> None:
        self.from_tip_mm = checks.lengths_mm("from_tip_mm", from_tip_mm, 0.0)

    def space(self, task: Task) -> spaces.Box:
        return _place(task, len(self.from_tip_mm))

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return _of_vessels(task)

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        return episodes.batch.points_mm(self.from_tip_mm)


class Roadmap:
    """The path ahead as in a roadmap, seen from the tip of the device, shape (3 len(ahead_mm) + 6,), numbers of about
    1.

    For each length in ``ahead_mm``, it contains the point this far ahead of the nearest point on the path, relative
    to the tip and as fractions of that length. Coordinates are: towards the side to which the tip is bent, across
    that, and along the device behind its bend. These follow: the tip relative to the end of its bend, ``bend_mm``
    behind it (to the side, along); the remaining path length in 100 mm; the distance from the path in the vessel's
    radii; the vessel's radius in 10 mm; and the inserted length minus the progress along the path, in 50 mm. It
    refers to the innermost instrument.

    A policy with this observation knows the centre line to the target, as an operator does with a roadmap; without it
    a policy does not.
    """

    def __init__(self, ahead_mm: tuple[float, ...] = (5.0, 10.0, 20.0, 40.0), bend_mm: float = 16.0) -> None:
        self.ahead_mm = checks.lengths_mm("ahead_mm", ahead_mm, _LEAST_AHEAD_MM)
        self.bend_mm = checks.positive("bend_mm", bend_mm)

    def space(self, task: Task) -> spaces.Box:
        return spaces.Box(-5.0, 5.0, (3 * len(self.ahead_mm) + 6,), dtype=np.float32)

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        points_mm = episodes.batch.points_mm([0.0, self.bend_mm, self.bend_mm + 4.0])
        inserted_mm = episodes.batch.inserted_mm[:, 0]
        return np.stack(
            [self._of(*each) for each in zip(points_mm, inserted_mm, episodes.paths, strict=True)]
        )

    def _of(
        self, points_mm: NDArray[np.float64], inserted_mm: float, path: Path | None
    ) -> NDArray[np.float64]:
        assert path is not None
        tip, root, behind = points_mm
        at_mm, off_mm, radius_mm = path.nearest(tip)
        ahead = path.at_mm(at_mm + self.ahead_mm)
        along = root - behind
        if not along.any():
            # If the inserted length is still within the bend, the path gives the direction of the device.
            along = ahead[0] - path.at_mm(np.array([at_mm - 5.0]))[0]
        along = along / np.linalg.norm(along)
        bent = tip - root - (tip - root) @ along * along
        if np.linalg.norm(bent) < 1e-6:
            bent = np.cross(along, np.eye(3)[np.argmin(np.abs(along))])
        bent = bent / np.linalg.norm(bent)
        frame = np.stack([bent, np.cross(along, bent), along], axis=1)
        shown = (ahead - tip) @ frame / self.ahead_mm[:, None]
        own = (tip - root) @ frame / self.bend_mm
        left_mm = path.length_mm - at_mm
        more_mm = inserted_mm - at_mm
        numbers = [left_mm / 100.0, off_mm / radius_mm, radius_mm / 10.0, more_mm / 50.0]
        return np.concatenate([shown.ravel(), own[[0, 2]], numbers])


class Hands:
    """Inserted length in mm, and rotation of the tail as cosine and sine, shape (n_instruments, 3)."""

    def space(self, task: Task) -> spaces.Box:
        lengths = [[instrument.length_mm, 1.0, 1.0] for instrument in task.instruments]
        high = np.asarray(lengths, dtype=np.float32)
        low = high * np.array([0.0, -1.0, -1.0], dtype=np.float32)
        return spaces.Box(low, high, dtype=np.float32)

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lengths are scaled to fractions of the instrument's length."""
        lengths = np.array([[instrument.length_mm, 1.0, 1.0] for instrument in task.instruments])
        return np.zeros_like(lengths), lengths

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        turn = episodes.batch.rotation_rad
        return np.stack([episodes.batch.inserted_mm, np.cos(turn), np.sin(turn)], axis=-1)


class Forces:
    """Push force in N and torque in N·mm of each instrument, and the largest force of a contact in N: shape (2
    n_instruments + 1,).

    Values are clipped to ``largest``, and a push force that jumps is shown as 0.
    """

    def __init__(self, largest: float = 100.0) -> None:
        self.largest = checks.positive("largest", largest)

    def space(self, task: Task) -> spaces.Box:
        return spaces.Box(-self.largest, self.largest, (2 * len(task.instruments) + 1,), dtype=np.float32)

    def unit(self, task: Task) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Newtons and newton millimetres are about 1 without scaling."""
        return np.zeros(1), np.ones(1)

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        batch = episodes.batch
        contact = batch.largest_contact_force_n[:, None]
        push_force_n = np.nan_to_num(batch.push_force_n, nan=0.0)
        return np.concatenate([push_force_n, batch.torque_nmm, contact], axis=1)


class LastAction:
    """The previous action, clipped to its limits and in the task's unit of actions, shape (n_instruments, 2)."""

    def space(self, task: Task) -> spaces.Box:
        high = (task.limits() / task.action_unit()).astype(np.float32)
        return spaces.Box(-high, high, dtype=np.float32)

    def observe(self, episodes: Episodes) -> NDArray[np.float64]:
        return episodes.action / episodes.task.action_unit()


class Fluoroscopy:
    """The fluoroscopic picture of one or more planes, 8 bits, shape (planes, height, width).

    ``planes`` are the primary and secondary angles of the C-arm in degrees. By default it is one from the front (0, 0),
    and from the side (90, 0) for a vessel whose long axis is within 30° of the line of sight from the front, which
    would hide its course. ``view`` has further keys of `[view]` of a scene file. The detector has no lag, because
    environments share it.
    """

    def __init__(
        self,
        planes: tuple[tuple[float, float], ...] | None = None,
        size_px: tuple[int, int] = (128, 128),
        view: dict[str, Any] | None = None,
    ) -> None:
        #: The given planes, or None where each vessel has its own.
        self.planes = None if planes is None else self._checked(planes)
        checks.numbers("size_px", size_px, (2,))
        width, height = (checks.whole(f"size_px[{k}]", side, 1) for k, side in enumerate(size_px))
        self.size_px = (width, height)
        self.view = dict(view or {})
        for plane in self.planes or (FRONT,):
            _check_view(self._view(*plane))

    @staticmethod
    def _checked(planes: Any) -> tuple[tuple[float, float], ...]:
        angles = checks.an_array("planes", planes)
        if angles.ndim != 2 or angles.shape[1] != 2 or not len(angles):
            raise InputError(f"planes = {planes!r}: give primary and secondary angle of one plane or more, deg")
        return tuple((float(primary), float(secondary)) for primary, secondary in angles)

    def space(self, task: Task) -> spaces.Box:
        width, height = self.size_px
        return spaces.Box(0, 255, (len(self.planes or (FRONT,)), height, width), dtype=np.uint8)

    def observe(self, episodes: Episodes) -> NDArray[np.uint8]:
        width, height = self.size_px
        pictures = np.empty((len(episodes.sites), len(self.planes or (FRONT,)), height, width), dtype=np.uint8)
        for k, site in enumerate(episodes.sites):
            simulation, frame = episodes.batch.simulation(k), int(episodes.frame[k])
            for p, angles in enumerate(self.planes or (site.side,)):
                picture = site.renderer(self._view(*angles)).render(simulation, frame).fluoro
                assert picture is not None
                pictures[k, p] = picture
        return pictures

    def _view(self, primary_deg: float, secondary_deg: float) -> dict[str, Any]:
        view = {**self.view, "views": ["fluoro"], "size_px": list(self.size_px), "bits": 8}
        view["detector"] = {**view.get("detector", {}), "lag": 0.0}
        view["xray"] = {**view.get("xray", {}), "brightness_s": 0.0}
        view["c_arm"] = {**view.get("c_arm", {}), "primary_deg": primary_deg, "secondary_deg": secondary_deg}
        return view
