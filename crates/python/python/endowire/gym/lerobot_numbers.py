"""What LeRobot keeps of the numbers of an episode and of all, to normalise by: extremes, mean, standard deviation, quantiles, and of how many.

Of all episodes together extremes, mean and deviation are exact, quantiles means weighted by lengths, as LeRobot has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Numbers of one feature by their kind.
Numbers = dict[str, NDArray[Any]]

#: Levels of a picture of 8 bits.
LEVELS = 256

_QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}


def of_rows(values: NDArray[Any]) -> Numbers:
    """Of numbers with a row for each frame."""
    rows = values.reshape(len(values), -1).astype(np.float64)
    quantiles = dict(zip(_QUANTILES, np.quantile(rows, list(_QUANTILES.values()), axis=0), strict=True))
    numbers = {"min": rows.min(axis=0), "max": rows.max(axis=0), "mean": rows.mean(axis=0)}
    return {**numbers, "std": rows.std(axis=0), "count": np.array([len(rows)]), **quantiles}


def of_levels(levels: NDArray[np.int64], frames: int) -> Numbers:
    """Of grey pictures in which each level came so often; white is 1, and each of three colours is alike."""
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
    """Of earlier episodes and one more."""
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
