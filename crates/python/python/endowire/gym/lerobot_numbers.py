"""Statistics of an episode and of all episodes in LeRobot's format, for normalisation: extremes, mean, standard
deviation, quantiles and count.

Over all episodes, extremes, mean and deviation are exact; quantiles are means weighted by lengths, as in LeRobot.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Statistics of one feature, by kind.
Numbers = dict[str, NDArray[Any]]

#: Number of levels of an 8-bit picture.
LEVELS = 256

_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


def of_rows(values: NDArray[Any]) -> Numbers:
    """Statistics of numbers with one row per frame."""
    rows = values.reshape(len(values), -1).astype(np.float64)
    quantiles = dict(zip(_QUANTILES, np.quantile(rows, list(_QUANTILES.values()), axis=0), strict=True))
    numbers = {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0)}
    return {**numbers, "std": rows.std(axis=0), "count": np.array([len(rows)]), **quantiles}


def of_levels(levels: NDArray[np.int64], frames: int) -> Numbers:
    """Statistics of grey pictures from a histogram of their levels; white is 1, and the three colour channels are
    equal.
    """
    brightness, total = np.arange(LEVELS) / (LEVELS - 1.0), levels.sum()
    mean = brightness @ levels / total
    up_to, found = np.cumsum(levels), np.flatnonzero(levels)
    numbers = {"min": brightness[found[0]], "max": brightness[found[-1]], "mean": mean}
    numbers["std"] = np.sqrt((brightness - mean) ** 2 @ levels / total)
    for name, part in _QUANTILES.items():
        numbers[name] = brightness[np.searchsorted(up_to, part * total)]
    colours = {name: np.full((3, 1, 1), number) for name, number in numbers.items()}
    return {**colours, "count": np.array([frames])}


def together(before: Numbers | None, own: Numbers) -> Numbers:
    """Combines the statistics of earlier episodes and of one more."""
    if before is None:
        return own
    counts = before["count"], own["count"]
    total = counts[0] + counts[1]

    def weighted(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
        mean: NDArray[Any] = (a * counts[0] + b * counts[1]) / total
        return mean

    mean = weighted(before["mean"], own["mean"])
    squares = [each["std"] ** 2 + (each["mean"] - mean) ** 2 for each in (before, own)]
    numbers = {"min": np.minimum(before["min"], own["min"]), "max": np.maximum(before["max"], own["max"])}
    numbers |= {"mean": mean, "std": np.sqrt(weighted(*squares)), "count": total}
    return {**numbers, **{name: weighted(before[name], own[name]) for name in _QUANTILES}}


def from_lists(numbers: dict[str, Any]) -> Numbers:
    """Statistics as they are written in JSON."""
    return {kind: np.array(values) for kind, values in numbers.items()}
