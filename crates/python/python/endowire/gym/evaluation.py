"""Evaluation of policies: episodes with given seeds, and the confidence interval of the success rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from itertools import islice
from math import sqrt
from statistics import fmean
from typing import Any

import numpy as np
from gymnasium.utils import seeding

from .. import InputError
from . import checks
from .episodes import Episodes
from .policies import Policy
from .task import Task


@dataclass(frozen=True)
class Outcome:
    """Result of an episode."""

    seed: int
    reached: bool
    steps: int
    #: Remaining path length to the target, mm.
    way_mm: float
    #: Fraction of the steps after which no contact force exceeded the task's limit.
    safety: float
    #: Error message of a failure, if there was one.
    failure: str
    #: Distance that the tip travelled, mm: summed over the steps.
    path_length_mm: float
    #: The largest wall force at a contact, and the largest sum of those at the tip, N.
    largest_wall_force_n: float
    largest_tip_force_n: float
    #: Whether it arrived, and none of these forces exceeded the task's limit.
    safe_success: bool
    #: Run time of the episode on this machine, s; parallel environments share it.
    wall_time_s: float = field(compare=False)


def evaluate(task: Task, policy: Policy, seeds: Sequence[int], num_envs: int = 8) -> list[Outcome]:
    """Runs one episode for each seed, in order of the seeds. Each equals that of an environment reset with the seed, if
    what the policy does in an episode depends on that episode alone: one that draws for all environments at once, as
    `policies.Uniform`, gives other episodes with another ``num_envs``.

    Raises InputError for ``num_envs`` below 1.
    """
    checks.whole("num_envs", num_envs, 1)
    if not len(seeds):
        return []
    episodes = Episodes(task, min(num_envs, len(seeds)))
    waiting = iter(enumerate(seeds))
    current = dict(enumerate(islice(waiting, len(episodes.target_mm))))
    episodes.begin({k: seeding.np_random(seed)[0] for k, (_, seed) in current.items()})
    outcomes: dict[int, Outcome] = {}
    while current:
        moving = np.isin(np.arange(len(episodes.sites)), list(current))
        episodes.step(policy.act(episodes), moving)
        over = np.logical_or(*episodes.ended()) & moving
        info = episodes.info()
        begun = {}
        for k in np.flatnonzero(over).tolist():
            place, seed = current.pop(k)
            outcomes[place] = Outcome(
                seed,
                bool(info["reached"][k]),
                int(episodes.steps[k]),
                float(info["way_mm"][k]),
                float(info["safety"][k]),
                str(info["failure"][k]),
                float(info["path_length_mm"][k]),
                float(info["largest_wall_force_n"][k]),
                float(info["largest_tip_force_n"][k]),
                bool(info["safe_success"][k]),
                float(info["wall_time_s"][k]),
            )
            following = next(waiting, None)
            if following is not None:
                current[k] = following
                begun[k] = seeding.np_random(following[1])[0]
        if begun:
            episodes.begin(begun)
    return [outcomes[place] for place in range(len(seeds))]


def table(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """A summary of episodes for JSON: rates with their confidence intervals (`interval`), means, and a row for each
    episode.

    Contrast medium is a usual column of such tables; it is 0 ml here, since no action injects any. Raises InputError
    if there is no episode.
    """
    n = len(outcomes)
    shares = {
        "success_rate": sum(o.reached for o in outcomes),
        "safe_success_rate": sum(o.safe_success for o in outcomes),
        "failure_rate": sum(bool(o.failure) for o in outcomes),
    }
    of_all: dict[str, Any] = {"episodes": n}
    for name, count in shares.items():
        of_all[f"{name}_interval"] = list(interval(count, n))
        of_all[name] = count / n
    for name in ("steps", "path_length_mm", "safety", "wall_time_s"):
        of_all[f"mean_{name}"] = fmean(getattr(o, name) for o in outcomes)
    for name in ("largest_wall_force_n", "largest_tip_force_n"):
        of_all[name] = max(getattr(o, name) for o in outcomes)
    steps, time_s = sum(o.steps for o in outcomes), sum(o.wall_time_s for o in outcomes)
    of_all["steps_per_s"] = steps / time_s if time_s > 0.0 else 0.0
    return {"summary": of_all, "episodes": [asdict(o) | {"contrast_ml": 0.0} for o in outcomes]}


def interval(successes: int, episodes: int, z: float = 1.959964) -> tuple[float, float]:
    """The confidence interval of Wilson (1927) for a success rate, 95 % by default; it is valid near 0 and 1, too.

    Raises InputError if there is no episode, and for an invalid number of successes.
    """
    if episodes < 1:
        raise InputError(f"episodes = {episodes}: must be 1 or more, a share of none is not known")
    if not 0 <= successes <= episodes:
        raise InputError(f"successes = {successes}: must be 0 to {episodes}, the number of episodes")
    share, square = successes / episodes, z * z / episodes
    middle = (share + square / 2) / (1 + square)
    half = z * sqrt(share * (1 - share) / episodes + square / (4 * episodes)) / (1 + square)
    return max(0.0, middle - half), min(1.0, middle + half)
