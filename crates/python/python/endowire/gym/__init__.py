"""Environments for Gymnasium 1.0 and later, composed of replaceable parts.

``import endowire.gym`` registers ``endowire/CurvedTube-v0``, ``AorticArch``, ``ArchVariety``,
``ArchVarietyAsEvaluated``, ``BasicWireNav``, ``DualDeviceNav``, ``CathSim`` and ``Navigation``; ``gymnasium.make`` and ``gymnasium.make_vec`` accept every part of
a `Task` as a keyword.
"""

from gymnasium import register as _register

from . import arches, ends, evaluation, observations, originals, policies, rewards, targets, vessels
from .centreline import Centreline, Path
from .environment import InsertionEnv
from .episodes import Episodes
from .task import Task
from .tasks import TASKS as _TASKS
from .vector import InsertionVectorEnv

__all__ = [
    "Centreline",
    "Episodes",
    "InsertionEnv",
    "InsertionVectorEnv",
    "Path",
    "Task",
    "arches",
    "ends",
    "evaluation",
    "observations",
    "originals",
    "policies",
    "rewards",
    "targets",
    "vessels",
]

for _task in _TASKS:
    _register(
        id=f"endowire/{_task}-v0",
        entry_point="endowire.gym.tasks:make_env",
        vector_entry_point="endowire.gym.tasks:make_vector_env",
        kwargs={"task": _task},
    )
