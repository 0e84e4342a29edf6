"""Simulations as functions of JAX, through which it differentiates.

It requires JAX: ``pip install jax``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ._endowire import Simulation
from .autodiff import Response

try:
    import jax
except ImportError as error:
    raise ImportError(f"endowire.jax needs JAX: pip install jax ({error})") from error

__all__ = ["function"]


def _called(compute: Callable[..., list[np.ndarray[Any, Any]]], given: Sequence[Any], shapes: list[tuple[int, ...]]) -> list[Any]:
    """What a function of numpy gives: at once, or, while JAX traces, when the program runs, whose arrays have these shapes and the type of
    the first that is given."""

    def cast(*arrays: Any) -> list[np.ndarray[Any, Any]]:
        return [np.asarray(one, dtype=given[0].dtype) for one in compute(*(np.asarray(one, dtype=float) for one in arrays))]

    if not any(isinstance(one, jax.core.Tracer) for one in given):
        return [jax.numpy.asarray(one) for one in cast(*given)]
    told = [jax.ShapeDtypeStruct(shape, given[0].dtype) for shape in shapes]
    return list(jax.pure_callback(cast, told, *given, vmap_method="sequential"))


def function(
    simulation: Simulation,
    moves: ArrayLike,
    by: Sequence[str],
    of: str | Sequence[str],
    across_jumps: Literal["raise", "nan"] = "raise",
) -> Callable[[Any], Any]:
    """The function from values of the parameters ``by``, an array of shape (p,), to what the commands ``moves`` lead to: an array of the
    kind ``of``, shape (k,), or a tuple of them if ``of`` are several. `endowire.autodiff.Response` says what parameters and kinds
    there are, and what happens across jumps.

    Arrays have the type of the values; it is computed by the processor in double precision. Within `jax.jit` and `jax.vmap` it is called
    back, the numbers of a kind are as many as for the values at the beginning, and exceptions are JAX's. There are first derivatives
    only, backwards (`jax.grad`, `jax.jacrev`). The simulation does not move. Raises InputError as `Response`.
    """
    response = Response(simulation, moves, by, [of] if isinstance(of, str) else of, across_jumps)
    shapes: list[tuple[int, ...]] = [one.shape for one in response.numbers(response.start)]

    @jax.custom_vjp
    def respond(values: Any) -> tuple[Any, ...]:
        return tuple(_called(response.numbers, [values], shapes))

    def forward(values: Any) -> tuple[tuple[Any, ...], Any]:
        return tuple(_called(response.recorded, [values], shapes)), values

    def backward(values: Any, weights: tuple[Any, ...]) -> tuple[Any]:
        pulled = _called(lambda given, *all: [response.pull(given, all)], [values, *weights], [(len(response.by),)])
        return (pulled[0],)

    respond.defvjp(forward, backward)

    def of_values(values: Any) -> Any:
        given = jax.numpy.asarray(values, dtype=float)
        told = respond(given)
        return told[0] if isinstance(of, str) else told

    return of_values
