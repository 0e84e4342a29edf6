"""Tasks: the replaceable parts of environments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from .. import InputError, Instrument, Simulation
from .._endowire import _check_view
from . import checks, ends, observations, rewards
from .scaling import shown
from .targets import CentrelineTarget, TargetSampler
from .vessels import Site, VesselSource


def _observations() -> dict[str, observations.Observation]:
    return {
        "tip_mm": observations.Tip(),
        "points_mm": observations.Shape(),
        "target_mm": observations.Target(),
        "forces": observations.Forces(),
    }


def _rewards() -> list[rewards.Reward]:
    return [rewards.Reached(), rewards.EachStep(), rewards.Progress()]


def _ends() -> list[ends.End]:
    return [ends.TargetReached(), ends.LeftVessel(), ends.StepLimit()]


#: Keywords of `endowire.Simulation` for several instruments.
_COUPLING = ("names", "friction", "may_lead", "clearance")


@dataclass(eq=False)
class Task:
    """Instruments in a vessel, a target, observations, rewards and conditions of the end."""

    instruments: Sequence[Instrument]
    vessels: VesselSource
    target: TargetSampler = field(default_factory=CentrelineTarget)
    observations: Mapping[str, observations.Observation] = field(default_factory=_observations)
    rewards: Sequence[rewards.Reward] = field(default_factory=_rewards)
    ends: Sequence[ends.End] = field(default_factory=_ends)
    #: Distance from the target at which the tip has reached it, mm.
    threshold_mm: float = 5.0
    #: Contact force above which a step counts as unsafe, N.
    force_limit_n: float = 1.5
    #: Time between two actions, s.
    control_period_s: float = 1.0 / 7.5
    #: Limit of linear solves per step, so that no step takes long. The remaining motion is continued in the next step
    #: (``info["behind_mm"]``), and an instrument that is a full step behind its commands gets no further ones. None:
    #: each step continues to the equilibrium, however long that takes.
    solves: int | None = None
    #: Largest advance speed in mm/s and rotation speed in rad/s of an instrument.
    speed_limits: tuple[float, float] = (35.0, 3.14)
    #: Unit of actions: fractions of these limits, from -1 to 1, which are suitable for learning; or velocities, mm/s
    #: and rad/s.
    actions: Literal["scaled", "physical"] = "scaled"
    #: Unit of observations: scaled to numbers of about 1 (see `scaling`; names lose the unit at their end, ``tip_mm``
    #: becomes ``tip``), or in mm, N and N·mm.
    observed: Literal["scaled", "physical"] = "scaled"
    #: Keys of `[vessel.wall]` of a scene file.
    wall: Mapping[str, Any] = field(default_factory=dict)
    #: Keys of `[method]` of a scene file.
    method: Mapping[str, Any] = field(default_factory=lambda: {"name": "kirchhoff", "element_mm": 5.0})
    #: Keywords of `endowire.Simulation` for several instruments: names, friction, may_lead, clearance.
    coupling: Mapping[str, Any] = field(default_factory=dict)
    #: Keys of `[view]` of a scene file for `render()`.
    view: Mapping[str, Any] = field(default_factory=lambda: {"views": ["3d"], "size_px": [480, 480]})
    #: Whether ``info["assessment"]`` contains the measures of an episode that is over, as `endowire.assess` gives
    #: them for a recorded run.
    assessed: bool = False
    #: The original vessel that this one replaces, if it is a substitute; reported in ``info["stand_in"]``.
    stand_in: str = ""

    def __post_init__(self) -> None:
        if self.actions not in ("scaled", "physical"):
            raise InputError(f"actions = {self.actions!r}: give scaled or physical")
        if self.observed not in ("scaled", "physical"):
            raise InputError(f"observed = {self.observed!r}: give scaled or physical")
        self._check_parts()
        for name in ("threshold_mm", "control_period_s"):
            checks.positive(name, getattr(self, name))
        # No limit is one, too.
        if self.force_limit_n != np.inf:
            checks.at_least("force_limit_n", self.force_limit_n, 0.0)
        for k, limit in enumerate(checks.numbers("speed_limits", self.speed_limits, (2,))):
            checks.positive(f"speed_limits[{k}]", float(limit))
        if self.solves is not None:
            checks.whole("solves", self.solves, 1)
        checks.truth("assessed", self.assessed)

    def _check_parts(self) -> None:
        instruments = self.instruments
        is_list = isinstance(instruments, Sequence) and all(isinstance(one, Instrument) for one in instruments)
        if not is_list or not instruments:
            raise InputError(f"instruments = {instruments!r}: give a list of Instruments, the innermost first")
        checks.has("vessels", self.vessels, "sample")
        checks.has("target", self.target, "sample")
        if not isinstance(self.observations, Mapping):
            raise InputError(f"observations = {self.observations!r}: give a dictionary of names and parts")
        for name, method in (("observations", "observe"), ("rewards", "reward"), ("ends", "ended")):
            checks.parts(name, getattr(self, name), method)
        for name in ("wall", "method", "coupling", "view"):
            if not isinstance(getattr(self, name), Mapping):
                raise InputError(f"{name} = {getattr(self, name)!r}: give a dictionary of keys and values")
        unknown = sorted(set(self.coupling) - set(_COUPLING))
        if unknown:
            raise InputError(f"coupling = {unknown[0]!r}: is no key of it: {', '.join(_COUPLING)}")
        _check_view(self.view)

    def limits(self) -> NDArray[np.float64]:
        """Largest advance speed in mm/s and rotation speed in rad/s of each instrument, shape (n_instruments, 2)."""
        return np.tile(np.asarray(self.speed_limits, dtype=float), (len(self.instruments), 1))

    def action_unit(self) -> NDArray[np.float64]:
        """The velocities that a number of 1 in an action stands for, mm/s and rad/s, shape (n_instruments, 2)."""
        limits = self.limits()
        return limits if self.actions == "scaled" else np.ones_like(limits)

    def action_space(self) -> spaces.Box:
        """The space of actions: advance and rotation of the first instrument, then those of the next, shape (2
        n_instruments,), in the unit of `actions`. One vector is what policies of most libraries give.
        """
        high = (self.limits() / self.action_unit()).ravel().astype(np.float32)
        return spaces.Box(-high, high, dtype=np.float32)

    def observation_spaces(self) -> dict[str, spaces.Box]:
        """The space of each observation, in the unit of `observed`."""
        return {name: part.space(self) for name, part in shown(self).items()}

    def start(self, site: Site) -> Simulation:
        """The simulation of a site with nothing inserted. It is created once and cached: copy it."""
        if self not in site.starts:
            site.starts[self] = Simulation(
                site.vessel,
                list(self.instruments),
                wall=dict(self.wall),
                method=dict(self.method),
                **self.coupling,
                **site.sheath,
            )
        return site.starts[self]
