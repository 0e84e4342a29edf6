"""Catheters and guidewires in blood vessels: insertions stepped, drawn and learned from.

Units everywhere: millimetre, newton, second, radian; names carry them. ``endowire.gym`` has environments for Gymnasium.
"""

from ._endowire import (
    Batch,
    Controller,
    Frames,
    Instrument,
    Renderer,
    Scene,
    Simulation,
    State,
    StepReport,
    Vessel,
    check_vessel,
    merge_sweeps,
    solve_rod,
    sweep,
)
from .errors import ComputationError, EndOfWay, EndowireError, InputError

__all__ = [
    "Batch",
    "ComputationError",
    "Controller",
    "EndOfWay",
    "EndowireError",
    "Frames",
    "InputError",
    "Instrument",
    "Renderer",
    "Scene",
    "Simulation",
    "State",
    "StepReport",
    "Vessel",
    "check_vessel",
    "merge_sweeps",
    "solve_rod",
    "sweep",
]
