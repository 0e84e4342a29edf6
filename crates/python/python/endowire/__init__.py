"""Simulation of catheters and guidewires in blood vessels: insertions, pictures and learning environments.

Units everywhere: millimetre, newton, second, radian; they are part of the names. ``endowire.gym`` has environments
for Gymnasium.
"""

from pathlib import Path as _Path

from ._endowire import (
    Batch,
    Controller,
    Frames,
    Gradient,
    Instrument,
    Record,
    Renderer,
    Scene,
    Simulation,
    State,
    StepReport,
    Vessel,
    __version__,
    assess,
    check_vessel,
    course,
    merge_sweeps,
    score,
    solve_rod,
    sweep,
)
from .fitting import Fit, Observed, fit
from .planning import Plan, Planner, plan
from .errors import ComputationError, EndOfWay, EndowireError, InputError

__all__ = [
    "Batch",
    "ComputationError",
    "Controller",
    "EndOfWay",
    "EndowireError",
    "Fit",
    "Frames",
    "Gradient",
    "InputError",
    "Instrument",
    "Observed",
    "Plan",
    "Planner",
    "Record",
    "Renderer",
    "Scene",
    "Simulation",
    "State",
    "StepReport",
    "Vessel",
    "__version__",
    "assess",
    "assets_path",
    "check_vessel",
    "course",
    "fit",
    "merge_sweeps",
    "plan",
    "score",
    "solve_rod",
    "sweep",
]


def assets_path() -> _Path:
    """The folder of the assets in the package: ``scenes``, ``devices`` (the catalogue), ``vessels``, ``subjects`` and ``ct``.

    For example, ``endowire.Scene(endowire.assets_path() / "scenes" / "arch_carotid.toml")`` reads a scene.
    """
    return _Path(__file__).parent / "assets"
