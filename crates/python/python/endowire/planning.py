"""Plans: commands that bring a tip to the end of a way, found on copies of a simulation.

A plan pushes straight on as long as the tip comes farther along the way. Where it does not, it goes back to states that it has kept
from before – copies cost microseconds, where pulling back costs steps – turns the instrument there and pushes again. The first turn
that brings the tip clearly farther is taken, or the best of all turns at that place; then the plan pushes on from there. Where no turn
helps, the hand of `Controller.follow_path`, which turns at every push, is tried from the beginning and from states on the way, until it
would pull back. A plan contains neither what failed nor any pull.

Turns are tried, not computed by gradients: at a branch, which is where a plan has to choose, most trials pass a jump, across which there
is no derivative (`crates/python/benches/plans.py gradients` counts them).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import ceil, inf, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._endowire import Controller, Simulation
from .errors import EndowireError, InputError

__all__ = ["Plan", "Planner", "plan"]

#: Push of a command, mm; close to the end of the way, where a longer one may pass it, and how close that is.
STEP_MM, FINE_MM, CLOSE_MM = 4.0, 2.0, 12.0
#: Largest turn of a command, rad.
TURN_RAD = 0.35
#: Turns that are tried, rad: around the circle, both directions, small ones first. None is what has failed already. Those in between
#: cost as much again where these fail, and arrived nowhere else.
TURNS_RAD: tuple[float, ...] = (pi / 3, -pi / 3, 2 * pi / 3, -2 * pi / 3, pi)
#: They are tried so far before the place where a push came no farther, mm.
BACKS_MM = (12.0, 24.0, 0.0, 48.0, 80.0)
#: So far before it the hand that follows the way begins; first of all at the beginning.
FOLLOWED_MM = (inf, 80.0, 24.0)
#: Largest distance of a kept state from such a place, mm.
OFF_MM = 6.0
#: Length pushed without coming farther before a push ends, and beyond the place of the last failure, mm.
PATIENCE_MM, BEYOND_MM = 12.0, 24.0
#: What counts as coming farther within a push, as clearly farther, at which no other turn is tried, and as farther at all, mm.
FARTHER_MM, CLEARLY_MM, LEAST_MM = 0.5, 8.0, 1.0
#: Cost of a millimetre beyond the wall of the way's vessel, mm of progress.
ASTRAY_COST = 2.0
#: A tip farther than this from where the plan has it makes a new plan, mm.
ELSEWHERE_MM = 1.0


@dataclass
class Plan:
    """Commands that bring a tip along a way."""

    #: Advance and rotation of each instrument for each command, mm and rad, shape (n, n_instruments, 2).
    moves: NDArray[np.float64]
    #: Whether they reach the end of the way; otherwise they come as far as was found.
    reached: bool
    #: Length of the way that is left at their end, mm.
    left_mm: float
    #: Turns and hands that were tried, and commands that were carried out on copies.
    trials: int
    steps: int
    #: Where the tip is after each command, mm, shape (n, 3).
    tips_mm: NDArray[np.float64]
    #: The simulation at their end.
    simulation: Simulation = field(repr=False)


@dataclass
class _Mark:
    """A state on the way, with the commands that lead there."""

    simulation: Simulation
    #: Progress along the way, less what the tip is astray, mm.
    worth_mm: float
    inserted_mm: float
    #: The state before, and the command.
    before: _Mark | None
    moves: NDArray[np.float64]
    tip_mm: NDArray[np.float64]

    def back(self) -> Iterator[_Mark]:
        """This state and those before it."""
        mark: _Mark | None = self
        while mark is not None:
            yield mark
            mark = mark.before


class _Search:
    """The search for a plan."""

    def __init__(self, planner: Planner, simulation: Simulation) -> None:
        self.planner, self.trials, self.steps = planner, 0, 0
        self.best = self.mark(simulation.copy(), None, np.zeros((simulation.n_instruments, 2)))

    def mark(self, simulation: Simulation, before: _Mark | None, moves: NDArray[np.float64]) -> _Mark:
        lead = self.planner.lead
        tip_mm = simulation.tips_mm[lead]
        arc_mm, off_mm, radius_mm = self.planner.on_path(tip_mm)
        worth_mm = arc_mm - ASTRAY_COST * max(0.0, off_mm - radius_mm)
        return _Mark(simulation, worth_mm, float(simulation.inserted_mm[lead]), before, moves, tip_mm)

    def command(self, mark: _Mark, advance_mm: float, rotate_rad: float) -> _Mark | None:
        """The state after a command of the leading instrument, with those that follow it; none where it fails."""
        return self.carry_out(mark, self.planner.moves(mark.simulation, advance_mm, rotate_rad))

    def carry_out(self, mark: _Mark, moves: NDArray[np.float64]) -> _Mark | None:
        """The state after a command; none where it fails, as at the end of the way or of the instrument."""
        simulation = mark.simulation.copy()
        self.steps += 1
        try:
            simulation.step(moves[:, 0], moves[:, 1])
        except EndowireError:
            return None
        return self.mark(simulation, mark, moves)

    def push(self, begin: _Mark, most_mm: float) -> _Mark:
        """Pushes on from a state as long as that leads farther: the best state that it comes to."""
        best, last, idle_mm, pushed_mm = begin, begin, 0.0, 0.0
        gained_mm = begin.worth_mm
        while pushed_mm < most_mm and idle_mm <= PATIENCE_MM and not self.planner.has_arrived(best.tip_mm):
            step_mm = STEP_MM if self.planner.left_mm(last.tip_mm) > CLOSE_MM else FINE_MM
            following = self.command(last, step_mm, 0.0)
            if following is None:
                break
            last, pushed_mm = following, pushed_mm + step_mm
            is_farther = last.worth_mm > gained_mm + FARTHER_MM
            gained_mm, idle_mm = (last.worth_mm, 0.0) if is_farther else (gained_mm, idle_mm + step_mm)
            # An end that is reached is better than a tip that is a little nearer to it, but beyond the wall.
            if last.worth_mm > best.worth_mm or self.planner.has_arrived(last.tip_mm):
                best = last
        return best

    def turned(self, base: _Mark, turn_rad: float) -> _Mark | None:
        """The state after a turn, in parts of at most `TURN_RAD`."""
        parts, mark = ceil(abs(turn_rad) / TURN_RAD), base
        for _ in range(parts):
            following = self.command(mark, 0.0, turn_rad / parts)
            if following is None:
                return None
            mark = following
        return mark

    def try_turns(self, base: _Mark, most_mm: float) -> _Mark | None:
        """The state to which a turn and a push lead from a state, if that is farther than the best one."""
        best = None
        for turn_rad in TURNS_RAD:
            self.trials += 1
            turned = self.turned(base, turn_rad)
            if turned is None:
                continue
            end = self.push(turned, most_mm)
            gain_mm = end.worth_mm - self.best.worth_mm
            if self.planner.has_arrived(end.tip_mm) or gain_mm > CLEARLY_MM:
                return end
            if gain_mm > LEAST_MM and (best is None or end.worth_mm > best.worth_mm):
                best = end
        return best

    def follow(self, begin: _Mark) -> _Mark:
        """Follows the way from a state, turning at every push, until the hand would pull back: the best state that it comes to."""
        planner, best, last = self.planner, begin, begin
        hand = planner.hand()
        while not planner.has_arrived(best.tip_mm):
            move = hand.next(last.simulation)
            if move is None or hand.retries > 0:
                break
            following = self.carry_out(last, move)
            if following is None:
                break
            last = following
            if last.worth_mm > best.worth_mm or planner.has_arrived(last.tip_mm):
                best = last
        return best

    def run(self) -> Plan:
        self.best = self.push(self.best, inf)
        while not self.planner.has_arrived(self.best.tip_mm):
            farther = self.farther()
            if farther is None:
                break
            self.best = self.push(farther, inf)
        marks = list(self.best.back())[:-1][::-1]
        moves = np.zeros((len(marks), self.best.simulation.n_instruments, 2))
        for k, mark in enumerate(marks):
            moves[k] = mark.moves
        return Plan(
            moves=moves,
            reached=self.planner.has_arrived(self.best.tip_mm),
            left_mm=self.planner.left_mm(self.best.tip_mm),
            trials=self.trials,
            steps=self.steps,
            tips_mm=np.array([mark.tip_mm for mark in marks]).reshape(-1, 3),
            simulation=self.best.simulation,
        )

    def farther(self) -> _Mark | None:
        """A state farther on than the best one, from one of those before it."""
        top_mm = self.best.inserted_mm
        for back_mm in BACKS_MM:
            base = min(self.best.back(), key=lambda mark: abs(mark.inserted_mm - (top_mm - back_mm)))
            if abs(base.inserted_mm - (top_mm - back_mm)) > OFF_MM:
                continue
            found = self.try_turns(base, top_mm - base.inserted_mm + BEYOND_MM)
            if found is not None:
                return found
        for back_mm in FOLLOWED_MM:
            self.trials += 1
            base = min(self.best.back(), key=lambda mark: abs(mark.inserted_mm - max(0.0, top_mm - back_mm)))
            found = self.follow(base)
            if self.planner.has_arrived(found.tip_mm) or found.worth_mm > self.best.worth_mm + LEAST_MM:
                return found
        return None


class Planner:
    """Plans the whole way on copies of the simulation before the first command, and carries the plan out: used as a
    `Controller`, by `next`. It makes a new plan where the tip is not where its plan has it.

    ``path_mm`` is the way, shape (n, 4): x, y, z and the vessel's radius, mm. ``lead`` is the instrument that is led; ``followers`` follow
    behind its tip, as pairs of an instrument and a distance, mm, and others stay. It has arrived when the tip is in the vessel and at most ``arrived_mm`` before the end of the way. Commands are pushes of at
    most 4 mm and turns of at most 0.35 rad. The same simulation gives the same plan, to the bit.

    Raises InputError for an invalid path, a distance below 0 and an instrument that is no whole number of at least 0.
    """

    def __init__(
        self,
        path_mm: ArrayLike,
        *,
        arrived_mm: float = 5.0,
        lead: int = 0,
        followers: Sequence[tuple[int, float]] = (),
    ) -> None:
        # It checks what all controllers check, with the same messages.
        Controller.search_ahead(path_mm, arrived_mm=arrived_mm, lead=lead, followers=list(followers))
        self.followers = [(int(instrument), float(behind_mm)) for instrument, behind_mm in followers]
        self.path_mm = table = np.array(path_mm, dtype=float)
        self.lead, self.arrived_mm = int(lead), float(arrived_mm)
        self._begin_mm, self._along_mm = table[:-1, :3], np.diff(table[:, :3], axis=0)
        self._lengths_mm = np.linalg.norm(self._along_mm, axis=1)
        self._arcs_mm = np.append(0.0, np.cumsum(self._lengths_mm))
        self._radii_mm = table[:, 3]
        #: The plan that is carried out.
        self.plan: Plan | None = None
        #: "arrived" or "given up" if the last result of `next` was None.
        self.ended: str | None = None
        #: Number of plans that were made after the first, since the tip was elsewhere.
        self.retries = 0
        self._done = 0

    def hand(self) -> Controller:
        """The hand that follows the way, with the same instruments."""
        return Controller.follow_path(self.path_mm, arrived_mm=self.arrived_mm, lead=self.lead, followers=self.followers)

    def moves(self, simulation: Simulation, advance_mm: float, rotate_rad: float) -> NDArray[np.float64]:
        """The command in which the leading instrument does this, and the others move to their places behind it, by at most as much."""
        moves, inserted_mm = np.zeros((simulation.n_instruments, 2)), simulation.inserted_mm
        moves[self.lead] = advance_mm, rotate_rad
        for instrument, behind_mm in self.followers:
            place_mm = max(0.0, inserted_mm[self.lead] + advance_mm - behind_mm)
            moves[instrument, 0] = np.clip(place_mm - inserted_mm[instrument], -advance_mm, advance_mm)
        return moves

    def on_path(self, place_mm: NDArray[np.float64]) -> tuple[float, float, float]:
        """The point on the way nearest to a place: length from the beginning, distance, and the vessel's radius there, mm."""
        to_place = place_mm - self._begin_mm
        part = np.clip(np.einsum("ij,ij->i", to_place, self._along_mm) / self._lengths_mm**2, 0.0, 1.0)
        off_mm = np.linalg.norm(to_place - part[:, None] * self._along_mm, axis=1)
        k = int(np.argmin(off_mm))
        arc_mm = float(self._arcs_mm[k] + part[k] * self._lengths_mm[k])
        return arc_mm, float(off_mm[k]), float(np.interp(arc_mm, self._arcs_mm, self._radii_mm))

    def left_mm(self, place_mm: NDArray[np.float64]) -> float:
        """Length of the way from a place to its end, mm."""
        return float(self._arcs_mm[-1] - self.on_path(place_mm)[0])

    def has_arrived(self, place_mm: NDArray[np.float64]) -> bool:
        """Whether a tip there has arrived."""
        arc_mm, off_mm, radius_mm = self.on_path(place_mm)
        return bool(arc_mm >= self._arcs_mm[-1] - self.arrived_mm and off_mm < radius_mm)

    def find(self, simulation: Simulation) -> Plan:
        """A plan from the state of a simulation, which does not move.

        Raises InputError for instruments that it does not have, or that are both led and follow.
        """
        if self.lead >= simulation.n_instruments:
            raise InputError(f"lead = {self.lead}: there are {simulation.n_instruments}, the innermost is 0")
        # It checks the others.
        self.hand().next(simulation)
        return _Search(self, simulation).run()

    def next(self, simulation: Simulation) -> NDArray[np.float64] | None:
        """The next command, advance_mm and rotate_rad of each instrument, shape (n_instruments, 2); None at the end, whose reason
        is `ended`. Call it once before every step, and carry the command out.

        Raises InputError as `find`.
        """
        self.ended = None
        if self.plan is not None and 0 < self._done:
            off_mm = np.linalg.norm(simulation.tips_mm[self.lead] - self.plan.tips_mm[self._done - 1])
            if off_mm > ELSEWHERE_MM:
                self.plan, self.retries = None, self.retries + 1
        if self.plan is None:
            self.plan, self._done = self.find(simulation), 0
        if self._done < len(self.plan.moves):
            self._done += 1
            move: NDArray[np.float64] = self.plan.moves[self._done - 1]
            return move
        self.ended = "arrived" if self.plan.reached else "given up"
        return None


def plan(
    simulation: Simulation,
    path_mm: ArrayLike,
    *,
    arrived_mm: float = 5.0,
    lead: int = 0,
    followers: Sequence[tuple[int, float]] = (),
) -> Plan:
    """Commands that bring the tip of an instrument along a way to its end (`Planner`, which carries them out as well). The simulation does
    not move: ``simulation.run(plan.moves)`` does that.

    Raises InputError as `Planner` and `Planner.find`.
    """
    return Planner(path_mm, arrived_mm=arrived_mm, lead=lead, followers=followers).find(simulation)
