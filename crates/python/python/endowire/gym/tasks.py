"""The tasks behind the registered ids."""

from __future__ import annotations

from typing import Any

from .. import Instrument, Vessel
from . import observations
from .arches import ArchVariety
from .environment import InsertionEnv
from .targets import CentrelineTarget
from .task import Task
from .vector import InsertionVectorEnv
from .vessels import FixedVessel


def hooked_wire() -> Instrument:
    """A guidewire of 0.035" with a soft tip bent by 72° about a radius of 12.1 mm."""
    return Instrument(
        [
            {
                "length_mm": 15.2,
                "radius_mm": 0.35,
                "bending_stiffness_nmm2": 1.0,
                "rest_curvature_per_mm": [1 / 12.1, 0.0],
            },
            {"length_mm": 434.8, "radius_mm": 0.445, "bending_stiffness_nmm2": 12.0},
        ]
    )


def curved_tube(**parts: Any) -> Task:
    """The hooked wire in a tube that bends by 180°."""
    vessels = FixedVessel(Vessel.generate("curved_tube", edge_mm=1.5))
    return Task(**{"instruments": [hooked_wire()], "vessels": vessels, **parts})


def aortic_arch(**parts: Any) -> Task:
    """The hooked wire from the descending aorta into the branches of the arch."""
    vessels = FixedVessel(Vessel.generate("aortic_arch", edge_mm=3.0))
    target = CentrelineTarget(least_mm=100.0)
    return Task(**{"instruments": [hooked_wire()], "vessels": vessels, "target": target, **parts})


def arch_variety(**parts: Any) -> Task:
    """The wire of ArchVariety (see `arches`) from the descending aorta into the branches of one of fifty arches of type I; friction 0.1.

    Its wire has a soft tip: ratios of stiffness, sizes and the shape are those of the original, stiffness in its units of kPa. The wall is
    felt as it is meshed: half of it within 0.02 mm of the arch that was drawn, 99 of 100 places within 0.2 mm.
    """
    tip = {
        "length_mm": 15.205,
        "radius_mm": 0.35,
        "bending_stiffness_nmm2": 0.2004,
        "rest_curvature_per_mm": [1 / 12.1, 0.0],
    }
    wire = Instrument([tip, {"length_mm": 434.795, "radius_mm": 0.445, "bending_stiffness_nmm2": 2.4639}])
    defaults = {
        "instruments": [wire],
        "vessels": ArchVariety(count=50),
        "target": CentrelineTarget(least_mm=0.0),
        "observations": {
            "tip_mm": observations.Tip(),
            "shape_mm": observations.Shape((0.0, 2.0, 4.0)),
            "target_mm": observations.Target(),
            "last_action": observations.LastAction(),
        },
        "wall": {"friction": 0.1, "deviation_mm": 0.0},
    }
    return Task(**{**defaults, **parts})


TASKS = {"CurvedTube": curved_tube, "AorticArch": aortic_arch, "ArchVariety": arch_variety}


def make_env(task: str, render_mode: str | None = None, **parts: Any) -> InsertionEnv:
    """The environment of a task of `TASKS`; keywords replace its parts."""
    return InsertionEnv(TASKS[task](**parts), render_mode)


def make_vector_env(
    task: str, num_envs: int = 1, render_mode: str | None = None, **parts: Any
) -> InsertionVectorEnv:
    """The vector environment of a task of `TASKS`; keywords replace its parts."""
    return InsertionVectorEnv(TASKS[task](**parts), num_envs, render_mode)
