"""What commands lead to as a function of parameters, with its derivatives: what the functions of `endowire.torch` and `endowire.jax` compute."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._endowire import Recorded, Simulation
from .errors import ComputationError, InputError
from .fitting import numbers

__all__ = ["Response"]

#: Parameters of the hand: the places of their values in the first command.
HAND = {"advance": 0, "rotate": 1}


class Response:
    """What commands lead to, as numbers of a few kinds, for values of parameters.

    ``moves`` are the commands from the state of ``simulation``, shape (n, n_instruments, 2), as for ``Simulation.run``. ``by`` are words for
    one parameter each, as in ``Simulation.gradient``: "EI[0]", "friction", …, and "advance" and "rotate", which are the first command's,
    of the innermost instrument. ``of`` are kinds of numbers after the last command, as in ``Gradient.of``: "tip", "shape", "push_force", …

    Across a jump there is no derivative. With ``across_jumps="raise"`` asking for it raises ComputationError; with "nan" the
    derivatives are NaN, the numbers those behind the jump, and a RuntimeWarning says so. Where a derivative is that on one side only
    (``Gradient.one_sided``), a RuntimeWarning names its parameters.

    Raises InputError for a parameter that stands for two or occurs twice, for kinds that there are not, and for moves of another shape.
    """

    def __init__(
        self,
        simulation: Simulation,
        moves: ArrayLike,
        by: Sequence[str],
        of: Sequence[str],
        across_jumps: Literal["raise", "nan"] = "raise",
    ) -> None:
        self.simulation, self.by, self.of = simulation.copy(), list(by), list(of)
        self.moves = np.array(moves, dtype=float)
        if self.moves.ndim != 3 or self.moves.shape[1:] != (simulation.n_instruments, 2) or not len(self.moves):
            raise InputError(
                f"moves = an array of shape {self.moves.shape}: must have the shape (n, {simulation.n_instruments}, 2), one command or more"
            )
        if across_jumps not in ("raise", "nan"):
            raise InputError(f"across_jumps = {across_jumps!r}: give raise or nan")
        if not self.by or not self.of:
            raise InputError(f"by = {self.by}, of = {self.of}: give one or more of each")
        if len(set(self.by)) < len(self.by):
            raise InputError(f"by = {self.by}: each parameter once")
        if "hand" in self.by:
            raise InputError("by = 'hand': it stands for two: give 'advance' and 'rotate'")
        self.across_jumps = across_jumps
        self._last: tuple[bytes, Recorded] | None = None
        # Words and kinds are asked for once, so that a wrong one is reported here.
        self.start
        for one in self.of:
            numbers(simulation, one)

    @property
    def start(self) -> NDArray[np.float64]:
        """The values that the simulation and the commands have, shape (p,)."""
        own = [self.moves[0, 0, HAND[name]] if name in HAND else self.simulation.value(name) for name in self.by]
        return np.array(own)

    def _at(self, values: ArrayLike) -> tuple[Simulation, NDArray[np.float64]]:
        given = np.asarray(values, dtype=float)
        if given.shape != (len(self.by),):
            raise InputError(f"values = an array of shape {given.shape}: must have the shape ({len(self.by)},), one for each of {self.by}")
        moves, changes = self.moves.copy(), {}
        for name, value in zip(self.by, given.tolist(), strict=True):
            if name in HAND:
                moves[0, 0, HAND[name]] = value
            else:
                changes[name] = value
        return self.simulation.changed(changes) if changes else self.simulation.copy(), moves

    def numbers(self, values: ArrayLike) -> list[NDArray[np.float64]]:
        """The numbers of each kind, each of shape (k,).

        Raises what ``Simulation.run`` and ``Simulation.changed`` raise.
        """
        there, moves = self._at(values)
        there.run(moves)
        return [numbers(there, of) for of in self.of]

    def linear(self, values: ArrayLike) -> tuple[list[NDArray[np.float64]], list[NDArray[np.float64]]]:
        """The numbers of each kind and their derivatives in the parameters, each of shape (k, p).

        Raises what ``Simulation.gradients`` raises, and InputError for "wall_force" where a contact opens or closes.
        """
        there, moves = self._at(values)
        try:
            last = there.gradients(moves, by=self.by)[-1]
        except ComputationError as error:
            if self.across_jumps == "raise":
                raise
            warnings.warn(f"derivatives by {self.by} are NaN: {error}", RuntimeWarning, stacklevel=2)
            found = self.numbers(values)
            return found, [np.full((len(one), len(self.by)), np.nan) for one in found]
        self._warn(last.one_sided)
        return [numbers(last, of) for of in self.of], [last.of(of) for of in self.of]

    def _warn(self, one_sided: NDArray[np.bool_]) -> None:
        sided = [name for name, is_one in zip(self.by, one_sided, strict=True) if is_one]
        if sided:
            message = f"derivatives by {sided} hold on one side only: a contact opens or closes right there, or a node comes in"
            warnings.warn(message, RuntimeWarning, stacklevel=3)

    def _recorded(self, values: ArrayLike) -> Recorded:
        """The commands for these values, recorded; those of the last values are kept."""
        key = np.asarray(values, dtype=float).tobytes()
        last = self._last
        if last is None or last[0] != key:
            there, moves = self._at(values)
            last = self._last = (key, there.recorded(moves))
        return last[1]

    def recorded(self, values: ArrayLike) -> list[NDArray[np.float64]]:
        """As ``numbers``, of commands that are recorded for ``pull`` with the same values.

        Raises what ``Simulation.recorded`` raises.
        """
        try:
            recorded = self._recorded(values)
        except ComputationError:
            if self.across_jumps == "raise":
                raise
            return self.numbers(values)
        state = SimpleNamespace(report=recorded.report(), positions_mm=recorded.positions_mm())
        return [numbers(state, of) for of in self.of]

    def pull(self, values: ArrayLike, weights: Sequence[ArrayLike]) -> NDArray[np.float64]:
        """Derivatives in the parameters of the sum of the numbers of all kinds, each times its weight, shape (p,): by the reverse pass, whose
        cost does not grow with the number of parameters. ``weights`` are of each kind, as many as its numbers.

        Raises what ``Simulation.recorded`` and ``Recorded.vjp`` raise.
        """
        try:
            recorded = self._recorded(values)
        except ComputationError as error:
            if self.across_jumps == "raise":
                raise
            warnings.warn(f"derivatives by {self.by} are NaN: {error}", RuntimeWarning, stacklevel=2)
            return np.full(len(self.by), np.nan)
        of_last: dict[str, NDArray[np.float64]] = {}
        for of, weight in zip(self.of, weights, strict=True):
            of_last[of] = of_last.get(of, 0.0) + np.asarray(weight, dtype=float)
        pulled = recorded.vjp([*([{}] * (len(recorded) - 1)), of_last], by=self.by)
        self._warn(pulled.one_sided)
        return pulled.values
