"""Checks of the parameters of tasks and their parts, when these are made. Errors name the parameter, its value and the
remedy.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import InputError


def finite(name: str, value: Any) -> float:
    """A finite number."""
    return _number(name, value, -np.inf, "must be a finite number", is_open=True)


def positive(name: str, value: Any) -> float:
    """A finite number above 0."""
    return _number(name, value, 0.0, "must be a number above 0", is_open=True)


def at_least(name: str, value: Any, least: float) -> float:
    """A finite number of at least ``least``."""
    return _number(name, value, least, f"must be a number of at least {least:g}", is_open=False)


def _number(name: str, value: Any, least: float, mend: str, *, is_open: bool) -> float:
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    # NaN is not greater than anything.
    if not is_number or not (value > least if is_open else value >= least) or not value < np.inf:
        raise InputError(f"{name} = {value!r}: {mend}")
    return float(value)


def whole(name: str, value: Any, least: int) -> int:
    """A whole number of at least ``least``."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or value < least:
        raise InputError(f"{name} = {value!r}: must be a whole number of at least {least}")
    return int(value)


def truth(name: str, value: Any) -> bool:
    """True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} = {value!r}: give True or False")
    return bool(value)


def lengths_mm(name: str, values: Any, least: float) -> NDArray[np.float64]:
    """Lengths of at least ``least``, mm: one or more."""
    if not isinstance(values, (Sequence, np.ndarray)) or isinstance(values, str) or not len(values):
        raise InputError(f"{name} = {values!r}: give one length or more, mm")
    return np.array([at_least(f"{name}[{k}]", value, least) for k, value in enumerate(values)])


def hands(name: str, values: Any, n_instruments: int, *several: int) -> NDArray[np.float64]:
    """Two real numbers for each instrument, push and turn, as a vector or in rows: to shape (*several, n_instruments, 2)."""
    array = real(name, values)
    shape = (*several, 2 * n_instruments)
    if array.shape not in (shape, (*several, n_instruments, 2)):
        raise InputError(f"{name} = an array of shape {array.shape}: must have the shape {shape}")
    return array.reshape(*several, n_instruments, 2)


def place_mm(name: str, values: Any) -> NDArray[np.float64]:
    """A place: three finite numbers."""
    place = numbers(name, values, (3,))
    if not np.isfinite(place).all():
        raise InputError(f"{name} = {place.tolist()}: every number must be finite")
    return place


def numbers(name: str, values: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Real numbers of this shape."""
    array = real(name, values)
    if array.shape != shape:
        raise InputError(f"{name} = an array of shape {array.shape}: must have the shape {shape}")
    return array


def real(name: str, values: Any) -> NDArray[np.float64]:
    """Real numbers of any shape."""
    array = an_array(name, values)
    if array.dtype.kind not in "biuf":
        raise InputError(f"{name} = {values!r}: must be real numbers")
    return array.astype(np.float64)


def an_array(name: str, values: Any) -> NDArray[Any]:
    """Anything as an array."""
    try:
        return np.asarray(values)
    except ValueError:
        raise InputError(f"{name} = {values!r}: is no array: rows have the same number of items") from None


def of_each(name: str, part: object, values: Any, n: int) -> NDArray[Any]:
    """What a part of a task gives for ``n`` environments: an array of shape (n,), or one number for all."""
    array = an_array(name, values)
    if array.dtype.kind not in "biuf" or array.shape not in ((n,), ()):
        what = f"{array.dtype} of shape {array.shape}"
        raise InputError(f"{name} = {what} from {type(part).__name__}: must be numbers of the shape ({n},)")
    return array


def parts(name: str, values: Any, method: str) -> None:
    """Parts of a task, each of which has a method of this name; in a dictionary or another list."""
    named = values.items() if hasattr(values, "items") else None
    if named is None:
        if not isinstance(values, Sequence) or isinstance(values, str):
            raise InputError(f"{name} = {values!r}: give a list of parts")
        named = enumerate(values)
    for key, part in named:
        has(f"{name}[{key!r}]", part, method)


def has(name: str, part: Any, method: str) -> None:
    """A part of a task with a method of this name."""
    if isinstance(part, type):
        raise InputError(f"{name} = {part.__name__}: is a class: make one of it, {part.__name__}(…)")
    if not callable(getattr(part, method, None)):
        raise InputError(
            f"{name} = {part!r}: has no method {method}: give a part of endowire.gym, or one like it"
        )
