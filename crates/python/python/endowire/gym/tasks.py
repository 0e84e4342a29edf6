"""The tasks of the registered ids."""

from __future__ import annotations

import warnings
from os import PathLike
from typing import Any

import numpy as np

from .. import InputError, Instrument, Vessel
from . import ends, observations, originals, rewards, targets
from .arches import ArchVariety
from .autoreset import AutoresetMode
from .environment import InsertionEnv
from .targets import CentrelineTarget
from .task import Task
from .vector import InsertionVectorEnv
from .vessels import FixedVessel


def hooked_wire() -> Instrument:
    """A guidewire of 0.035" with a soft tip, bent by 72° with a radius of 12.1 mm."""
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
    """The hooked wire in a tube that bends by 180°, 200 steps: five times as many as a straight push to its end
    takes.

    Elements of 7.5 mm and contact points four radii apart are enough in a tube without crests: after 1700 random
    steps in 15 episodes, the tip differs by less than 0.002 mm from that with elements of 5 mm and points 1.5 radii
    apart, in two thirds of the time.
    """
    vessels = FixedVessel(Vessel.generate("curved_tube", edge_mm=1.5))
    method = {"name": "kirchhoff", "element_mm": 7.5, "contact_spacing_radii": 4.0}
    over = [ends.TargetReached(), ends.LeftVessel(), ends.StepLimit(200)]
    return Task(**{"instruments": [hooked_wire()], "vessels": vessels, "method": method, "ends": over, **parts})


def aortic_arch(**parts: Any) -> Task:
    """The hooked wire from the descending aorta into the branches of the arch."""
    vessels = FixedVessel(Vessel.generate("aortic_arch", edge_mm=3.0))
    target = CentrelineTarget(least_mm=100.0)
    return Task(**{"instruments": [hooked_wire()], "vessels": vessels, "target": target, **parts})


def arch_variety(**parts: Any) -> Task:
    """The wire of ArchVariety (see `arches`) from the descending aorta into the branches of one of fifty arches of
    type I; friction 0.1.

    Its wire has a soft tip: ratios of stiffness, sizes and the shape are those of the original, with stiffness in its
    units of kPa. Contact uses the exact surface of the arch's centre line; the mesh is for pictures. The method uses the accuracy "fast". Elements of 7.5 mm with contact points four radii apart, as in earlier
    versions, take the same time, because most of it is spent on steps in which the wire snaps.
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
            "points_mm": observations.Shape((0.0, 2.0, 4.0)),
            "target_mm": observations.Target(),
            "last_action": observations.LastAction(),
        },
        # As in the original.
        "rewards": [rewards.Reached(), rewards.EachStep(), rewards.Approach()],
        "wall": {"friction": 0.1, "deviation_mm": 0.0},
        "method": {"name": "kirchhoff", "accuracy": "fast"},
    }
    return Task(**{**defaults, **parts})


def arch_variety_as_evaluated(**parts: Any) -> Task:
    """`arch_variety` with the ends of its authors' evaluation: only at the target, or after 1000 steps.

    Leaving the vessel is no end: where its way ends the wire stays, until it is pulled back. Shares of arrivals here are
    not those of `arch_variety`, where an episode is lost as soon as the tip is outside.
    """
    return arch_variety(**{"ends": [ends.TargetReached(), ends.StepLimit(1000)], **parts})


def basic_wire_nav(data: str | PathLike[str] | None = None, **parts: Any) -> Task:
    """The wire of ArchVariety in the vessel of BasicWireNav, read from the folder ``data``; by default in the
    built-in arch instead.
    """
    if data is not None:
        return arch_variety(**{"vessels": originals.basic_wire_nav(data), **parts})
    return arch_variety(**_stand_in("BasicWireNav", "the model 0011_H_AO_H: give its folder as data", parts))


def dual_device_nav(data: str | PathLike[str] | None = None, **parts: Any) -> Task:
    """A microwire in a microcatheter in the vessel of DualDeviceNav, read from the folder ``data``
    (``data/dualdevicenav`` of stEVE_bench); by default in the built-in arch instead.

    Ratios of stiffness and sizes are those of the original. The wire is twice as long, otherwise its tail would slip
    into the catheter's. Elements of 7.5 mm are enough for such soft instruments: pushed into the built-in arch for
    180 mm, tips differ by less than 0.01 mm from those with elements of 1.25 mm.
    """

    def device(
        length_mm: float, tip: tuple[float, float], shaft: tuple[float, float], bore: Any
    ) -> Instrument:
        bent = {"length_mm": 15.205, "rest_curvature_per_mm": [1 / 12.1, 0.0]}
        sections = [bent, {"length_mm": length_mm - 15.205}]
        keys = ("radius_mm", "bending_stiffness_nmm2")
        return Instrument(
            [
                {**s, **dict(zip(keys, values, strict=True)), **bore}
                for s, values in zip(sections, (tip, shaft), strict=True)
            ]
        )

    wire = device(1800.0, (0.18, 8.2448e-4), (0.18, 8.2448e-4), {})
    catheter = device(900.0, (0.3, 6.362e-3), (0.35, 1.179e-2), {"inner_radius_mm": 0.285})
    defaults = {
        "instruments": [wire, catheter],
        "coupling": {"names": ["wire", "catheter"]},
        "wall": {"friction": 0.001},
        # A wire of 0.18 mm gets no more contact points than one twice as thick, which takes two thirds of the time.
        "method": {"name": "kirchhoff", "accuracy": "fast", "contact_spacing_radii": 4.0},
    }
    if data is not None:
        return arch_variety(**{**defaults, "vessels": originals.dual_device_nav(data), **parts})
    original = "the vessel of stEVE_bench: give its folder data/dualdevicenav as data"
    return arch_variety(**{**defaults, **_stand_in("DualDeviceNav", original, parts)})


def cath_sim(**parts: Any) -> Task:
    """Navigation in an arch as in CathSim: with its wire's size and tip, its reward and end, 300 steps and no
    friction, but in the built-in arch.
    """
    tip = {
        "length_mm": 8.0,
        "radius_mm": 0.5,
        "bending_stiffness_nmm2": 1.0,
        "rest_curvature_per_mm": [np.pi / 3 / 8.0, 0.0],
    }
    wire = Instrument([tip, {"length_mm": 492.0, "radius_mm": 0.5, "bending_stiffness_nmm2": 20.0}])
    defaults = {
        "instruments": [wire],
        "target": targets.NamedTarget("innominate", "left carotid"),
        "rewards": [rewards.Distance(-0.001), rewards.Reached(10.0)],
        "ends": [ends.TargetReached(), ends.LeftVessel(), ends.StepLimit(300)],
        "threshold_mm": 4.0,
        "control_period_s": 0.012,
        # The largest speed of its actuators without a load.
        "speed_limits": (714.0, 20.0),
    }
    return Task(**{**defaults, **_stand_in("CathSim", "its phantom, which is not free: give vessels", parts)})


def navigation(vessel: str = "aortic_arch", target: str | None = None, **parts: Any) -> Task:
    """A shaped wire to the named targets of a built-in vessel (``aortic_arch``, ``aortic_arch_ii``,
    ``aortic_arch_iii`` or ``hepatic``): to all of them, or to one. An episode ends if a contact force exceeds 1.5 N.
    ``info["safety"]`` is the fraction of safe steps.
    """
    is_fine = vessel == "hepatic"
    try:
        made = Vessel.generate(vessel, edge_mm=1.1 if is_fine else 3.0)
    except InputError as refused:
        raise InputError(f"vessel = {vessel!r}: {refused}") from None
    if not made.targets:
        raise InputError(f"vessel = {vessel!r}: names no targets: give aortic_arch or hepatic")
    if target is not None and target not in made.targets:
        raise InputError(f"target = {target!r}: {vessel} has {', '.join(sorted(made.targets))}")
    curvature, tip_mm, radius_mm = (0.07, 22.0, 0.25) if is_fine else (0.06, 25.0, 0.445)
    tip = {"length_mm": tip_mm, "radius_mm": radius_mm, "rest_curvature_per_mm": [curvature, 0.0]}
    wire = Instrument(
        [
            {**tip, "bending_stiffness_nmm2": 1.0},
            {"length_mm": 575.0 - tip_mm, "radius_mm": radius_mm, "bending_stiffness_nmm2": 12.0},
        ]
    )
    limit = ends.ForceLimit(1.5)
    defaults = {
        "instruments": [wire],
        "vessels": FixedVessel(made),
        "target": targets.NamedTarget(*([target] if target else sorted(made.targets))),
        "ends": [ends.TargetReached(), ends.LeftVessel(), limit, ends.StepLimit()],
        "force_limit_n": limit.limit_n,
        "threshold_mm": 6.0,
        "wall": {"friction": 0.05},
    }
    return Task(**{**defaults, **parts})


def _stand_in(task: str, original: str, parts: dict[str, Any]) -> dict[str, Any]:
    """The built-in arch instead of an original, unless ``parts`` contain vessels; warns about it."""
    if "vessels" in parts:
        return parts
    warnings.warn(f"{task}: the built-in aortic_arch stands in for {original}", stacklevel=2)
    vessels = FixedVessel(Vessel.generate("aortic_arch", edge_mm=3.0))
    return {"vessels": vessels, "stand_in": f"aortic_arch in place of {original.split(':')[0]}", **parts}


TASKS = {
    "CurvedTube": curved_tube,
    "AorticArch": aortic_arch,
    "ArchVariety": arch_variety,
    "ArchVarietyAsEvaluated": arch_variety_as_evaluated,
    "BasicWireNav": basic_wire_nav,
    "DualDeviceNav": dual_device_nav,
    "CathSim": cath_sim,
    "Navigation": navigation,
}


def _named(task: str, parts: dict[str, Any]) -> Task:
    if task not in TASKS:
        raise InputError(f"task = {task!r}: give one of {', '.join(TASKS)}")
    return TASKS[task](**parts)


def make_env(task: str, render_mode: str | None = None, **parts: Any) -> InsertionEnv:
    """The environment of a task of `TASKS`; keywords replace its parts."""
    return InsertionEnv(_named(task, parts), render_mode)


def make_vector_env(
    task: str,
    num_envs: int = 1,
    render_mode: str | None = None,
    max_episode_steps: int | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    **parts: Any,
) -> InsertionVectorEnv:
    """The vector environment of a task of `TASKS`; keywords replace its parts. An episode is truncated after
    ``max_episode_steps``, as by `gymnasium.make` for a single one.
    """
    made = _named(task, parts)
    if max_episode_steps is not None:
        made.ends = [*made.ends, ends.StepLimit(max_episode_steps)]
    return InsertionVectorEnv(made, num_envs, render_mode, autoreset_mode)
