"""Common code of episode logs: the environment that they watch and the folder that they write to."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any

from .. import InputError
from .environment import InsertionEnv


def watched(env: Any) -> InsertionEnv:
    """The endowire environment inside its wrappers.

    Raises InputError for a vector, and for an environment of another package.
    """
    inner = getattr(env, "unwrapped", env)
    if not isinstance(inner, InsertionEnv):
        raise InputError(f"env = {inner}: give an environment of endowire, not a vector")
    return inner


def new_folder(folder: str | PathLike[str]) -> Path:
    """The folder of a log; it may be missing.

    Raises InputError for a folder that is not empty, whose files a log would replace.
    """
    path = Path(folder)
    if path.exists() and any(path.iterdir()):
        raise InputError(f"folder = {path}: is not empty: give a new one")
    return path
