"""Fits of a simulation's parameters to what was observed, by Gauss–Newton with its gradients.

With residuals r(p) = (computed − observed)/sigma, the simulation's gradients give J = ∂r/∂p, and each step solves

    (JᵀJ + P) δ = −(Jᵀr + P (p − p₀))

with P the inverse covariance of the prior, if there is one (Nocedal and Wright, Numerical Optimization, 2nd ed., section 10.3). A
step that does not lower the sum of squares is halved; one that promises to lower it by less than equilibria are exact is the last. At the end (JᵀJ + P)⁻¹ is the covariance of the parameters, as far as the model is
linear within it and the residuals are independent with the given sigma.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._endowire import Gradient, Recorded, Simulation
from .errors import ComputationError, InputError

__all__ = ["Fit", "Observed", "fit"]

#: Steps are halved at most so often.
HALVINGS = 12
#: A step that promises to lower the sum of squares by less, a tenth of a standard deviation squared, and does not, is the last: equilibria
#: with friction are no more exact than that.
PROMISED = 1e-2
#: A direction in which the data say less than this fraction of what they say in the clearest one, each parameter in units of its own
#: value, is not shown by them.
SHOWN = 1e-6
#: A value so small is nought but for rounding, and no unit.
ROUNDED = 1e-12
ENERGIES = ("bend", "twist", "wall", "field", "tail", "vessel")


def numbers(state: Gradient | Simulation | SimpleNamespace, of: str) -> NDArray[np.float64]:
    """What a gradient or a simulation has of a kind that ``Gradient.of`` knows, as one row of numbers: the values that have these
    derivatives.

    Raises InputError for another kind.
    """
    report = state.report
    values: dict[str, Callable[[], Any]] = {
        "tip": lambda: state.positions_mm[-1],
        "shape": lambda: state.positions_mm.ravel(),
        "push_force": lambda: report.push_force_n,
        "torque": lambda: report.torque_nmm,
        "energy": lambda: np.array([sum(getattr(report, f"{part}_energy_mj") for part in ENERGIES)]),
        "wall_force": lambda: report.contact_normal_forces_n,
    }
    if of not in values:
        raise InputError(f"of = {of!r}: must be one of {', '.join(repr(one) for one in values)}")
    return np.asarray(values[of](), dtype=float)


@dataclass
class Observed:
    """What was seen after a command.

    ``of`` is "tip", "shape", "push_force", "torque", "energy" or "wall_force", as in ``Gradient.of``; "points", places on the wire at
    ``from_tip_mm``; or "pixels", those places in a picture whose 3 × 4 projection matrix ``camera`` takes (x, y, z, 1) mm to homogeneous
    pixels.
    """

    #: Number of the command, 0 for the first.
    after: int
    of: str
    value: ArrayLike
    #: Standard deviation of each number, in its unit.
    sigma: float
    from_tip_mm: ArrayLike | None = None
    camera: ArrayLike | None = None

    def residual(self, gradient: Gradient) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Residuals, and their derivatives, shape (k, p)."""
        value = np.asarray(self.value, dtype=float).ravel()
        if not np.isfinite(value).all():
            raise InputError(f"observed.value = {value}: every number must be finite")
        if not 0.0 < self.sigma < np.inf:
            raise InputError(f"observed.sigma = {self.sigma}: must be a finite number above 0")
        computed, slopes = self._computed(gradient)
        if computed.shape != value.shape:
            raise InputError(f"observed.value has {value.size} numbers, and {self.of!r} {computed.size}")
        return (computed - value) / self.sigma, slopes / self.sigma

    def _computed(self, gradient: Gradient) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if self.of in ("points", "pixels"):
            places, slopes = self._places(gradient)
            if self.of == "points":
                return places.ravel(), slopes.reshape(places.size, -1)
            return self._seen(places, slopes)
        try:
            return numbers(gradient, self.of), gradient.of(self.of)
        except InputError as error:
            raise InputError(f"observed.{error}, 'points' or 'pixels'") from None

    def _places(self, gradient: Gradient) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if self.from_tip_mm is None:
            raise InputError(f"observed.from_tip_mm = None: {self.of!r} needs the places on the wire")
        wanted = np.atleast_1d(np.asarray(self.from_tip_mm, dtype=float))
        nodes = gradient.from_tip_mm
        if wanted.min() < 0.0 or wanted.max() > nodes[0]:
            raise InputError(f"observed.from_tip_mm from {wanted.min()} to {wanted.max()}: {nodes[0]:.3f} mm are inserted then")
        # Nodes come from the sheath to the tip. Between two of them the wire is a cubic curve (Hermite).
        e = np.clip(np.searchsorted(-nodes, -wanted, side="right") - 1, 0, len(nodes) - 2)
        length = (nodes[e] - nodes[e + 1])[:, None]
        s = (nodes[e] - wanted)[:, None] / length
        ends, tangents = gradient.positions_mm, gradient.tangents
        weights = [(1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s)]
        bows = [s * (1 - s) ** 2 * length, s**2 * (s - 1) * length]
        places = weights[0] * ends[e] + weights[1] * ends[e + 1] + bows[0] * tangents[e] + bows[1] * tangents[e + 1]
        slopes = gradient.of("shape").reshape(len(nodes), 3, -1)
        share = s[:, :, None]
        return places, (1 - share) * slopes[e] + share * slopes[e + 1]

    def _seen(
        self, places: NDArray[np.float64], slopes: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        camera = np.asarray(self.camera, dtype=float) if self.camera is not None else np.empty(0)
        if camera.shape != (3, 4):
            raise InputError(f"observed.camera of shape {camera.shape}: 'pixels' needs a projection matrix of shape (3, 4)")
        image = places @ camera[:, :3].T + camera[:, 3]
        moved = np.einsum("ab,nbp->nap", camera[:, :3], slopes)
        pixels = image[:, :2] / image[:, 2:]
        slope = (moved[:, :2] - pixels[:, :, None] * moved[:, 2:]) / image[:, 2:, None]
        return pixels.ravel(), slope.reshape(pixels.size, -1)


@dataclass
class Fit:
    """Parameters that explain what was observed best."""

    #: The parameters, in their order.
    free: list[str]
    #: Their values.
    values: NDArray[np.float64]
    #: Their covariance, shape (p, p).
    covariance: NDArray[np.float64]
    #: Parameters that the data and the prior do not show: they can change, together with others, without changing what is observed.
    not_shown: list[str]
    #: Sum of squares of the residuals, in units of sigma, and their number.
    chi2: float
    n_residuals: int
    #: Whether the last step changed almost nothing.
    converged: bool
    iterations: int
    #: The simulation where it began, with these values.
    simulation: Simulation = field(repr=False)

    @property
    def sigma(self) -> NDArray[np.float64]:
        """Standard deviations of the values."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, z: float = 1.96) -> NDArray[np.float64]:
        """From and to where the values lie, shape (p, 2): with z = 1.96 in 95 of 100 cases."""
        return np.stack([self.values - z * self.sigma, self.values + z * self.sigma], axis=1)

    def __str__(self) -> str:
        rows = [f"{name:24}{value:14.6g} ± {sigma:.2g}" for name, value, sigma in zip(self.free, self.values, self.sigma)]
        shown = f"not shown by the data: {', '.join(self.not_shown)}\n" if self.not_shown else ""
        end = "" if self.converged else ", not converged"
        return "\n".join(rows) + f"\n{shown}chi² {self.chi2:.4g} of {self.n_residuals} numbers, {self.iterations} iterations{end}"


def fit(
    simulation: Simulation,
    moves: ArrayLike,
    observed: Sequence[Observed],
    free: Sequence[str],
    *,
    prior: Mapping[str, tuple[float, float]] | None = None,
    most_iterations: int = 30,
    tolerance: float = 1e-6,
) -> Fit:
    """Finds values of ``free`` parameters of a simulation, words of ``Simulation.gradient`` such as "EI[0]" and "friction", by which the
    commands ``moves`` (as in ``Simulation.run``) lead to what was ``observed``.

    It begins with the values and the state that the simulation has. ``prior`` are means and standard deviations of some of the parameters.
    It ends when a step changes no value by more than ``tolerance`` of its standard deviation or of itself.

    Raises InputError for parameters of a command, and for what was observed after commands that are not there; ComputationError where no
    step can be made from the values at the beginning.
    """
    free, moves, prior = list(free), np.asarray(moves, dtype=float), dict(prior or {})
    values = np.array([simulation.value(name) for name in free])
    unknown = [name for name in prior if name not in free]
    if unknown:
        raise InputError(f"prior of {unknown[0]!r}: it is not free")
    if not free or not observed:
        raise InputError("fit: give parameters that are free, and something that was observed")
    wrong = [one.after for one in observed if not 0 <= one.after < len(moves)]
    if wrong:
        raise InputError(f"observed.after = {wrong[0]}: there are {len(moves)} commands, the first is 0")
    means = np.array([prior.get(name, (value, 0.0))[0] for name, value in zip(free, values)])
    weights = np.array([prior[name][1] ** -2 if name in prior else 0.0 for name in free])
    last = max(one.after for one in observed) + 1

    def led_to(values: NDArray[np.float64]) -> tuple[float, Recorded]:
        """The sum of squares with these values, and the commands to differentiate."""
        recorded = simulation.changed(dict(zip(free, values.tolist()))).recorded(moves[:last])
        states = recorded.gradients(by=[])
        residual = np.concatenate([one.residual(states[one.after])[0] for one in observed])
        return float(residual @ residual + weights @ (values - means) ** 2), recorded

    def slopes(recorded: Recorded) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        gradients = recorded.gradients(by=free)
        parts = [one.residual(gradients[one.after]) for one in observed]
        return np.concatenate([r for r, _ in parts]), np.concatenate([j for _, j in parts])

    cost, recorded = led_to(values)
    residual, jacobian = slopes(recorded)
    converged, iterations = False, 0
    # In units of the values themselves numbers of all kinds compare.
    units = np.where(np.abs(values) > ROUNDED, np.abs(values), 1.0)
    while not converged and iterations < most_iterations:
        iterations += 1
        normal = jacobian.T @ jacobian + np.diag(weights)
        right = -(jacobian.T @ residual + weights * (values - means))
        step = _solve(normal * np.outer(units, units), right * units) * units
        failed: Exception | None = None
        for halving in range(HALVINGS):
            part = 0.5**halving
            try:
                found = led_to(values + part * step)
                lower = found[0] <= cost * (1.0 + 1e-12)
                derived = slopes(found[1]) if lower else (residual, jacobian)
            except (ComputationError, InputError) as error:
                failed = error
                continue
            failed = None
            if lower:
                break
            if (2.0 - part) * part * float(step @ right) < PROMISED:
                converged = True
                break
        else:
            if failed is not None and iterations == 1:
                raise ComputationError(f"fit: no step from the values at the beginning: {failed}") from failed
            break
        if converged:
            break
        sigma = np.sqrt(np.diag(_inverse(normal * np.outer(units, units)))) * units
        most = tolerance * np.maximum(np.minimum(sigma, units), 1e-300)
        converged = bool(np.all(np.abs(part * step) <= most))
        values, cost, (residual, jacobian) = values + part * step, found[0], derived
    normal = (jacobian.T @ jacobian + np.diag(weights)) * np.outer(units, units)
    return Fit(
        free=free,
        values=values,
        covariance=_inverse(normal) * np.outer(units, units),
        not_shown=_not_shown(normal, free),
        chi2=float(residual @ residual),
        n_residuals=residual.size,
        converged=converged,
        iterations=iterations,
        simulation=simulation.changed(dict(zip(free, values.tolist()))),
    )


def _directions(normal: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Eigenvalues and eigenvectors, and which of them the data show."""
    sizes, directions = np.linalg.eigh(normal)
    return sizes, directions, sizes > SHOWN**2 * sizes.max(initial=0.0)


def _solve(normal: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """The step in the directions that the data show."""
    sizes, directions, shown = _directions(normal)
    parts = directions.T @ right
    return directions[:, shown] @ (parts[shown] / sizes[shown])


def _inverse(normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """The covariance; infinite variances where the data show nothing."""
    sizes, directions, shown = _directions(normal)
    inverse = (directions[:, shown] / sizes[shown]) @ directions[:, shown].T
    hidden = np.any(np.abs(directions[:, ~shown]) > 1e-3, axis=1)
    inverse[hidden, hidden] = np.inf
    return inverse


def _not_shown(normal: NDArray[np.float64], free: Sequence[str]) -> list[str]:
    _, directions, shown = _directions(normal)
    hidden = np.any(np.abs(directions[:, ~shown]) > 1e-3, axis=1)
    return [name for name, is_hidden in zip(free, hidden) if is_hidden]
