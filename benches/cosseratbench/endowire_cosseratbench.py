"""endowire as a solver of cosseratbench: equilibria of rods, without time.

A scenario that asks for equilibria (`quasi_static`) is answered with them: frame 0 is the shape it starts with, every other
frame the equilibrium under what holds at its time. Whatever else a scenario asks for is reported as unsupported.

All of it is one file, since cosseratbench compares the adapter's file to tell whether a saved run still stands.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import endowire
import numpy as np
from cosseratbench.metrics import segment_distance
from cosseratbench.scenario import End, EndCondition, Rod, Scenario, rotation_matrix
from cosseratbench.solver import Capability, Diverged
from cosseratbench.trajectory import Trajectory
from scipy.optimize import brentq, root

#: Unbalanced force of an equilibrium, over the largest in the rod. A rope that another holds up swings nearly freely, and
#: would be off by 1e-5 of its length with what suffices for the others, 1e-10.
TOLERANCE = 1e-13
#: A point of contact is found when it moves by less than this part of the rod, in a few rounds.
SAME_PLACE = 1e-10
ROUNDS = 50
#: Largest error of a contact: gap and places over the length, slope of the normal.
MET = 1e-7
#: Square of the differences from which its derivatives are taken.
DIFFERENCE = 1e-10
#: First guess of its force, over the weight of both rods. It doubles until they are apart, up to a thousand times the weight.
FIRST_FORCE = 0.02
DOUBLINGS = 16
#: Along a path of equilibria, the next is found within this many iterations, and moves by less than this part of the length.
NEAR = 60
JUMP = 0.05
#: Sine of the angle below which rods that touch lie along each other, not at one point.
CROSSES = 0.1


@dataclass(frozen=True)
class Shape:
    """An equilibrium, as a curve over the unstretched length."""

    arcs: np.ndarray  # [n + 1] m, of the nodes
    nodes: np.ndarray  # [n + 1, 3] m
    slopes: np.ndarray  # [n, 2, 3] derivatives at both ends of the elements
    normals: np.ndarray  # [n + 1, 3] material directions
    touches: bool  # whether the rod touches itself

    def at(self, places: np.ndarray) -> np.ndarray:
        """Positions at these arc lengths: elements are cubics."""
        k, h, x = self._local(places)
        d0, d1 = self.slopes[k, 0] * h, self.slopes[k, 1] * h
        r0, r1 = self.nodes[k], self.nodes[k + 1]
        return r0 + x * d0 + x**2 * (3.0 * (r1 - r0) - 2.0 * d0 - d1) + x**3 * (d0 + d1 - 2.0 * (r1 - r0))

    def tangent(self, place: float) -> np.ndarray:
        """Direction at an arc length."""
        k, h, x = self._local(np.array([place]))
        d0, d1 = self.slopes[k, 0] * h, self.slopes[k, 1] * h
        rise = self.nodes[k + 1] - self.nodes[k]
        slope = (d0 + 2.0 * x * (3.0 * rise - 2.0 * d0 - d1) + 3.0 * x**2 * (d0 + d1 - 2.0 * rise))[0]
        return slope / np.linalg.norm(slope)

    def _local(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        k = np.clip(np.searchsorted(self.arcs, places, side="right") - 1, 0, len(self.arcs) - 2)
        h = (self.arcs[k + 1] - self.arcs[k])[:, None]
        return k, h, (places - self.arcs[k])[:, None] / h

    def sampled(self, n_elements: int) -> tuple[np.ndarray, np.ndarray]:
        """Positions of evenly spaced nodes, and the material direction of each element between them."""
        places = np.linspace(0.0, self.arcs[-1], n_elements + 1)
        positions = self.at(places)
        normals = np.stack([np.interp(places, self.arcs, self.normals[:, i]) for i in range(3)], axis=1)
        chords = np.diff(positions, axis=0)
        chords /= np.linalg.norm(chords, axis=1, keepdims=True)
        middle = normals[1:] + normals[:-1]
        middle -= (middle * chords).sum(1, keepdims=True) * chords
        return positions, middle / np.linalg.norm(middle, axis=1, keepdims=True)


def _end_tangent(points: np.ndarray) -> np.ndarray:
    """Direction in which a polyline begins, of second order: its first chord is half a chord too far along."""
    first = np.diff(points[:3], axis=0)
    if len(first) == 1:
        return first[0] / np.linalg.norm(first[0])
    a, b = np.linalg.norm(first, axis=1)
    chords = first / np.array([[a], [b]])
    tangent = chords[0] + (chords[0] - chords[1]) * a / (a + b)
    return tangent / np.linalg.norm(tangent)


def case(
    rod: Rod,
    gravity: np.ndarray,
    n_elements: int,
    *,
    time: float = 0.0,
    self_contact: bool = False,
    contact: tuple[float, int, np.ndarray] | None = None,
    begin: np.ndarray | None = None,
    max_iterations: int = 500,
) -> dict:
    """The case of `endowire rod` of a rod at a time, sought from a shape.

    `contact` is a place, the number of elements before it, and the force of another rod there. Elements are given one by one: if
    their number on either side changed as the place moves, so would the shape, by a jump.
    """
    if rod.start is EndCondition.FREE:
        raise NotImplementedError("a rod with a free start: endowire holds the start of every rod")
    if rod.start_motion is not None:
        raise NotImplementedError("a start that is driven: endowire holds it still")
    material, area, moment = rod.material, rod.area, rod.second_moment_of_area
    points = np.asarray(rod.centerline, dtype=float)
    tangent, last = _end_tangent(points), -_end_tangent(points[::-1])
    place, before = (rod.length, n_elements) if contact is None else contact[:2]
    arcs = np.append(np.linspace(0.0, place, before + 1), np.linspace(place, rod.length, n_elements - before + 1)[1:])
    stiffness = {
        "EI": material.youngs_modulus * moment,
        "GJ": 2.0 * material.shear_modulus * moment,
        "EA": material.youngs_modulus * area,
    }
    start = {"type": rod.start.value, "position": points[0], "tangent": tangent, "normal": np.asarray(rod.normal)}
    end: dict = {"type": rod.end.value}
    if rod.end is not EndCondition.FREE:
        end["position"] = points[-1]
    if rod.end is EndCondition.CLAMPED:
        normal = rod.directors(n_elements)[-1]
        end |= {"tangent": last, "normal": normal}
    if (motion := rod.end_motion) is not None:
        moved, turned = (
            np.array([np.interp(time, motion.times, column) for column in np.asarray(values, dtype=float).T])
            for values in (motion.displacement, motion.rotation)
        )
        # A rotation vector is turns about the rod, any number of them, and what tilts its end after them.
        turns = float(turned @ last)
        tilt = rotation_matrix(turned) @ rotation_matrix(-turns * last)
        end |= {"position": points[-1] + moved, "turns": turns}
        end |= {"tangent": tilt @ last, "normal": tilt @ normal}
        if motion.slides_along is not None:
            end["slide"] = motion.axis
    loads = [
        {"kind": "force", "at": 0.0 if load.at is End.START else rod.length, "value": np.asarray(load.force)}
        for load in rod.loads
    ]
    if np.any(gravity):
        loads.append({"kind": "distributed", "value": material.density * area * gravity})
    if contact is not None:
        loads.append({"kind": "force", "at": place, "value": contact[2]})
    sections = [{"until": arc} | stiffness for arc in arcs[1:]]
    told = {
        "rod": {"length": rod.length, "elements": n_elements, "section": sections},
        "start": start,
        "end": end,
        "load": loads,
        "initial": {"points": points if begin is None else begin},
        "solver": {"tolerance": TOLERANCE, "max_iterations": max_iterations},
    }
    if self_contact:
        told["self_contact"] = {"radius": rod.radius}
    return _plain(told)


def _plain(value):
    """Arrays as lists."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_plain(part) for part in value]
    return value.tolist() if isinstance(value, np.ndarray) else value


def equilibrium(rod: Rod, gravity: np.ndarray, n_elements: int, **at) -> Shape:
    """The equilibrium of a rod; arguments as those of `case`."""
    solution = endowire.solve_rod(case(rod, gravity, n_elements, **at))
    if not solution["converged"] or not solution["stable"]:
        reason = "it is unstable" if solution["converged"] else solution["stop"]
        raise Diverged(f"no equilibrium: {reason}", time=at.get("time"))
    arcs, tangents = np.asarray(solution["arc_lengths"]), np.asarray(solution["tangents"])
    stretch = 1.0 + np.asarray(solution["tensions"])[:, None] / (rod.material.youngs_modulus * rod.area)
    return Shape(
        arcs=arcs,
        nodes=np.asarray(solution["nodes"]),
        slopes=np.stack([tangents[:-1] * stretch, tangents[1:] * stretch], axis=1),
        normals=np.asarray(solution["normals"]),
        touches=bool(solution.get("touching")),
    )


class Crossing:
    """Two rods that touch at one point, without friction: the force and the place are searched for.

    Both rods are solved with the force as a load. It is right if the surfaces touch at its places, these are where the centre
    lines are nearest, and it is along the normal of both tangents there.
    """

    def __init__(self, rods: tuple[Rod, Rod], gravity: np.ndarray, n_elements: int, self_contact: bool) -> None:
        self.rods, self.gravity, self.n_elements, self.self_contact = rods, gravity, n_elements, self_contact
        self.apart = rods[0].radius + rods[1].radius
        self.lengths = np.array([rod.length for rod in rods])
        self.weight = sum(rod.material.density * rod.area * rod.length for rod in rods) * np.linalg.norm(gravity)
        self.begin = [rod.nodes(n_elements) for rod in rods]
        a, b = self.begin
        distances = segment_distance(a[:-1, None], a[1:, None], b[None, :-1], b[None, 1:])
        i, j = np.unravel_index(np.argmin(distances), distances.shape)
        places = (np.array([i, j]) + 0.5) / n_elements
        self.elements_before = np.clip([i, j], 1, n_elements - 1)
        #: Directions of the two rods where they are nearest at first, and their normal from the first rod to the second.
        self.axes = np.stack([_unit(a[i + 1] - a[i]), _unit(b[j + 1] - b[j])])
        self.side = _across(*self.axes)
        self.side *= np.sign(self.side @ (b[j] + b[j + 1] - a[i] - a[i + 1]))
        #: Force over the weight, places over the lengths, slopes of the normal along the two directions.
        self.found = np.array([0.0, *places, 0.0, 0.0])

    def shapes(self, at: np.ndarray, time: float) -> list[Shape]:
        """Both rods with this contact, from the shapes before."""
        force = at[0] * self.weight * _unit(self.side + at[3:] @ self.axes)
        made = [
            equilibrium(
                rod,
                self.gravity,
                self.n_elements,
                time=time,
                self_contact=self.self_contact,
                begin=begin,
                contact=(float(place * rod.length), int(before), sign * force),
            )
            for rod, begin, place, before, sign in zip(
                self.rods, self.begin, at[1:3], self.elements_before, (-1.0, 1.0), strict=True
            )
        ]
        self.begin = [shape.nodes for shape in made]
        return made

    def gap(self, at: np.ndarray, shapes: list[Shape]) -> float:
        """Distance of the surfaces at the places, over the length."""
        first, second = (shape.at(np.array([s]))[0] for shape, s in zip(shapes, at[1:3] * self.lengths, strict=True))
        return float((second - first) @ _unit(self.side + at[3:] @ self.axes) - self.apart) / self.lengths[0]

    def missed(self, at: np.ndarray, time: float) -> np.ndarray:
        """How far a contact is from being right: gap, places, normal."""
        shapes = self.shapes(at, time)
        places, normal = self.nearest(at[1:3] * self.lengths, shapes)
        # The normal as slopes: what it has along the two directions, for one along the side.
        slopes = np.linalg.solve(np.vstack([self.axes, self.side]).T, normal)
        return np.array([self.gap(at, shapes), *(places / self.lengths - at[1:3]), *(slopes[:2] / slopes[2] - at[3:])])

    def nearest(self, places: np.ndarray, shapes: list[Shape]) -> tuple[np.ndarray, np.ndarray]:
        """Where the centre lines are nearest, sought from these places, and the normal of both there."""
        for _ in range(ROUNDS):
            tangents = np.stack([shape.tangent(s) for shape, s in zip(shapes, places, strict=True)])
            first, second = (shape.at(np.array([s]))[0] for shape, s in zip(shapes, places, strict=True))
            normal = _across(*tangents)
            step = np.linalg.lstsq(np.stack([tangents[0], -tangents[1]], axis=1), second - first, rcond=None)[0]
            places = np.clip(places + step, 0.0, self.lengths)
            if np.abs(step).max() < SAME_PLACE * self.lengths[0]:
                break
        return places, normal * np.sign(normal @ self.side)

    def solve(self, time: float) -> list[Shape]:
        """Both rods at a time: free if they do not touch there, else touching."""
        free = self.found * [0.0, 1.0, 1.0, 1.0, 1.0]
        begin = self.begin
        shapes = self.shapes(free, time)
        places, _ = self.nearest(free[1:3] * self.lengths, shapes)
        if self.gap(np.array([0.0, *(places / self.lengths), *free[3:]]), shapes) >= 0.0:
            return shapes
        if any(rod.friction for rod in self.rods):
            raise NotImplementedError("friction between rods")
        if self.weight == 0.0:
            raise NotImplementedError("rods without weight that touch: their force has no scale to be sought in")
        self.begin = begin
        right = root(self.missed, self._pressed(time), args=(time,), options={"eps": DIFFERENCE, "xtol": SAME_PLACE})
        if np.abs(right.fun).max() > MET:
            raise Diverged(f"the contact of two rods is not found: off by {np.abs(right.fun).max():.1e}", time=time)
        self.found = right.x
        return self.shapes(right.x, time)

    def _pressed(self, time: float) -> np.ndarray:
        """The contact found last with the force that closes its gap, which grows with it."""
        at = lambda force: np.array([force, *self.found[1:]])
        gap = lambda force: self.gap(at(force), self.shapes(at(force), time))
        low, high = 0.0, self.found[0] or FIRST_FORCE
        for _ in range(DOUBLINGS):
            if gap(high) >= 0.0:
                return at(brentq(gap, low, high, xtol=1e-3))
            low, high = high, 2.0 * high
        raise Diverged(f"two rods are not apart at {low:.0f} times their weight", time=time)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _across(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The unit normal of two directions."""
    normal = np.cross(a, b)
    sine = float(np.linalg.norm(normal) / (np.linalg.norm(a) * np.linalg.norm(b)))
    if sine < CROSSES:
        raise NotImplementedError(f"rods that touch along each other, at an angle of {np.degrees(np.arcsin(sine)):.1f}°")
    return normal / np.linalg.norm(normal)


class Rods:
    """The rods of a scenario, from one equilibrium to the next."""

    def __init__(self, scenario: Scenario, n_elements: int) -> None:
        self.rods, self.n_elements, self.self_contact = scenario.rods, n_elements, scenario.self_contact
        self.gravity = np.asarray(scenario.gravity, dtype=float)
        self.begin = [rod.nodes(n_elements) for rod in self.rods]
        self.boxes = [_box(nodes, rod.radius) for nodes, rod in zip(self.begin, self.rods, strict=True)]
        self.crossing: Crossing | None = None
        self.last: float | None = None

    def at(self, time: float) -> list[Shape]:
        """All of them at a time."""
        shapes = [self._alone(i, time) for i in range(len(self.rods))]
        if self.crossing or self._may_touch(shapes):
            if len(self.rods) != 2:
                raise NotImplementedError("several rods that may touch: endowire finds the contact of two")
            first, second = self.rods
            self.crossing = self.crossing or Crossing(
                (first, second), self.gravity, self.n_elements, self.self_contact
            )
            shapes = self.crossing.solve(time)
        if any(shape.touches and rod.friction for shape, rod in zip(shapes, self.rods, strict=True)):
            raise NotImplementedError("friction between rods")
        self.begin, self.last = [shape.nodes for shape in shapes], time
        return shapes

    def _alone(self, index: int, time: float) -> Shape:
        """One rod, near its shape before."""
        rod, begin = self.rods[index], self.begin[index]
        at = {"time": time, "self_contact": self.self_contact, "begin": begin}
        if self.last is None:
            return equilibrium(rod, self.gravity, self.n_elements, **at)
        try:
            shape = equilibrium(rod, self.gravity, self.n_elements, **at, max_iterations=NEAR)
            if np.abs(shape.nodes - begin).max() < JUMP * rod.length:
                return shape
        except Diverged:
            pass
        raise NotImplementedError(
            f"motion in time: rod {index} leaves its equilibrium between {self.last:.3f} and {time:.3f} s"
        )

    def _may_touch(self, shapes: list[Shape]) -> bool:
        """Whether the boxes around what two rods have been through overlap."""
        for i, (shape, rod) in enumerate(zip(shapes, self.rods, strict=True)):
            low, high = _box(shape.nodes, rod.radius)
            self.boxes[i] = (np.minimum(self.boxes[i][0], low), np.maximum(self.boxes[i][1], high))
        return any(
            np.all(a[0] <= b[1]) and np.all(b[0] <= a[1]) for a, b in itertools.combinations(self.boxes, 2)
        )


def _box(nodes: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    return nodes.min(axis=0) - radius, nodes.max(axis=0) + radius


class EndowireSolver:
    """The entry point. Rods stretch, bend and twist, without shear; they touch themselves, and another one at one point."""

    name = "endowire"
    backend_version = endowire.__version__
    capabilities = frozenset({Capability.STRETCH, Capability.ROD_CONTACT})

    def __init__(self, time_step_scale: float = 1.0) -> None:
        self.time_step_scale = time_step_scale

    def settings(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> dict:
        """The numerical choices of a run."""
        return {"method": "equilibria by Newton's method, cubic elements", "tolerance": TOLERANCE}

    def run(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> Trajectory:
        """Frame 0 is the shape at the start, every other frame the equilibrium under what holds at its time."""
        if self.time_step_scale != 1.0:
            raise NotImplementedError("a time step: equilibria have none")
        if not scenario.quasi_static:
            raise NotImplementedError("motion in time: endowire solves for equilibria")
        if scenario.obstacles:
            raise NotImplementedError("obstacles: rods on their own touch only each other")
        times = np.linspace(0.0, scenario.duration, n_frames)
        rods = Rods(scenario, n_elements)
        frames = [[(rod.nodes(n_elements), rod.directors(n_elements)) for rod in scenario.rods]]
        # Loads are constant: without an end that is driven, nothing changes any more.
        still = max((rod.end_motion.times[-1] for rod in scenario.rods if rod.end_motion), default=0.0)
        for last, time in itertools.pairwise(times):
            if last == 0.0 or last < still:
                frame = [shape.sampled(n_elements) for shape in rods.at(float(time))]
            frames.append(frame)
        positions, directors = (
            tuple(np.stack([frame[i][part] for frame in frames]) for i in range(len(scenario.rods))) for part in (0, 1)
        )
        return Trajectory(times, positions, directors)
