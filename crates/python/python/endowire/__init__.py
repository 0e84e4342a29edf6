"""Simulation of catheters and guidewires in blood vessels: insertions, pictures and learning environments.

Units everywhere: millimetre, newton, second, radian; they are part of the names. ``endowire.gym`` has environments
for Gymnasium.
"""

from importlib import import_module as _import_module
from pathlib import Path as _Path
from typing import TYPE_CHECKING
from typing import Any as _Any

from ._endowire import (
    Batch,
    Controller,
    Frames,
    Gradient,
    Instrument,
    Pulled,
    Record,
    Recorded,
    Recorder,
    Recording,
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
from .errors import ComputationError, EndOfWay, EndowireError, InputError

if TYPE_CHECKING:
    from .fitting import Fit, Observed, fit
    from .planning import Plan, Planner, plan

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
    "Pulled",
    "Record",
    "Recorded",
    "Recorder",
    "Recording",
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

#: Loaded when they are first used: with them comes NumPy, which takes most of the time of an import.
_LATER = {"Fit": "fitting", "Observed": "fitting", "fit": "fitting", "Plan": "planning", "Planner": "planning", "plan": "planning"}


def __getattr__(name: str) -> _Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(_import_module(f".{_LATER[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_LATER})


def assets_path() -> _Path:
    """The folder of the assets in the package: ``scenes``, ``devices`` (the catalogue), ``vessels``, ``subjects`` and ``ct``.

    For example, ``endowire.Scene(endowire.assets_path() / "scenes" / "arch_carotid.toml")`` reads a scene.
    """
    return _Path(__file__).parent / "assets"
