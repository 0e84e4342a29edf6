"""Simulations as functions of PyTorch, through which it differentiates.

It requires PyTorch: ``pip install torch``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Literal

from numpy.typing import ArrayLike

from ._endowire import Simulation
from .autodiff import Response

try:
    import torch
    from torch.autograd.function import once_differentiable
except ImportError as error:
    raise ImportError(f"endowire.torch needs PyTorch: pip install torch ({error})") from error

__all__ = ["function"]


class _Respond(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, values: Any, response: Response) -> tuple[Any, ...]:
        given = values.detach().cpu().double().numpy()
        like = {"dtype": values.dtype, "device": values.device}
        if not values.requires_grad:
            return tuple(torch.tensor(one, **like) for one in response.numbers(given))
        ctx.response, ctx.given, ctx.like = response, given.copy(), like
        return tuple(torch.tensor(one, **like) for one in response.recorded(given))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *weights: Any) -> tuple[Any, None]:
        pulled = ctx.response.pull(ctx.given, [one.detach().cpu().double().numpy() for one in weights])
        return torch.tensor(pulled, **ctx.like), None


def function(
    simulation: Simulation,
    moves: ArrayLike,
    by: Sequence[str],
    of: str | Sequence[str],
    across_jumps: Literal["raise", "nan"] = "raise",
) -> Callable[[Any], Any]:
    """The function from values of the parameters ``by``, a tensor of shape (p,), to what the commands ``moves`` lead to: a tensor of the
    kind ``of``, shape (k,), or a tuple of them if ``of`` are several. `endowire.autodiff.Response` says what parameters and kinds
    there are, and what happens across jumps.

    Tensors have the type and the device of the values; it is computed on the processor, in double precision. There are first derivatives
    only. The simulation does not move. Raises InputError as `Response`.
    """
    response = Response(simulation, moves, by, [of] if isinstance(of, str) else of, across_jumps)

    def respond(values: Any) -> Any:
        found = _Respond.apply(values, response)
        return found[0] if isinstance(of, str) else found

    return respond
