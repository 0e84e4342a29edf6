"""What becomes of an environment of a vector whose episode has ended, in the words of Gymnasium.

Gymnasium 1.0 has no words for it, and knows only what later versions call NEXT_STEP.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Any

import gymnasium.vector

from .. import InputError

if TYPE_CHECKING or hasattr(gymnasium.vector, "AutoresetMode"):
    from gymnasium.vector import AutoresetMode as AutoresetMode
else:

    class AutoresetMode(Enum):
        """As in Gymnasium 1.1."""

        NEXT_STEP = "NextStep"
        SAME_STEP = "SameStep"
        DISABLED = "Disabled"


def autoreset(mode: Any) -> AutoresetMode:
    """The mode of a name, that of the member or its value (``SAME_STEP`` or ``SameStep``).

    Raises InputError for another.
    """
    for one in AutoresetMode:
        if mode in (one, one.value, one.name):
            return one
    raise InputError(f"autoreset_mode = {mode!r}: give {', '.join(one.name for one in AutoresetMode)}")
