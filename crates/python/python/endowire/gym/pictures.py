"""Pictures for display."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .. import InputError
from .episodes import Episodes
from .task import Task


def check_mode(render_mode: str | None) -> None:
    """Raises InputError for an unknown render mode."""
    if render_mode not in (None, "rgb_array"):
        window = "; gymnasium.wrappers.HumanRendering shows its pictures in a window" * (render_mode == "human")
        raise InputError(f"render_mode = {render_mode!r}: give rgb_array, or none{window}")


def per_second(task: Task) -> int:
    """Pictures in a second of a film of a task: one for each step."""
    return max(1, round(1.0 / task.control_period_s))


def picture(episodes: Episodes, k: int) -> NDArray[np.uint8]:
    """Environment ``k`` in its task's view, shape (height, width, 3): in 3D if that is requested, otherwise
    fluoroscopy.

    Raises Gymnasium's ResetNeeded before the first reset.
    """
    episodes.check_begun("render")
    renderer = episodes.sites[k].renderer({**episodes.task.view, "bits": 8})
    frames = renderer.render(episodes.batch.simulation(k), int(episodes.frame[k]))
    if frames.three_d is not None:
        return np.ascontiguousarray(frames.three_d[..., :3])
    assert frames.fluoro is not None
    return np.repeat(frames.fluoro[..., None], 3, axis=2)
