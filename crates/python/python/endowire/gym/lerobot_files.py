"""Files of a data set that is there as a whole or not at all: each is written beside its place and then moved there, so
that a program that is killed leaves what was finished before, and a log can go on from it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pyarrow
import pyarrow.parquet

from .. import InputError

#: Begin and end of the names of unfinished files.
_HIDDEN, _PART = ".", ".part"
#: LeRobot's templates of file paths, and the largest number of files in a folder.
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}"
CHUNK = 1000

INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"


def part(path: Path) -> Path:
    """The name of a file until it is finished."""
    return path.with_name(f"{_HIDDEN}{path.name}{_PART}")


def begin(path: Path) -> Path:
    """The name of a file that begins; its folder is created, and what has this name is removed: no link is followed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part(path).unlink(missing_ok=True)
    return part(path)


def finish(path: Path) -> None:
    """Moves a file that was written as `part` to its place, synced to disk."""
    with part(path).open("r+b") as file:
        os.fsync(file.fileno())
    part(path).replace(path)


def write_json(path: Path, value: Any) -> None:
    """Writes a JSON file."""
    begin(path).write_text(json.dumps(value, indent=4), encoding="utf-8")
    finish(path)


def write_table(path: Path, table: pyarrow.Table) -> None:
    """Writes a Parquet file."""
    pyarrow.parquet.write_table(table, begin(path))
    finish(path)


def known(folder: Path) -> dict[str, Any] | None:
    """What `meta/info.json` tells about the log in a folder; None if the folder is new or empty.

    Raises InputError for a folder with anything else, whose files a log would mix with.
    """
    if not folder.exists() or not any(folder.iterdir()):
        return None
    try:
        info: dict[str, Any] = json.loads((folder / INFO).read_text(encoding="utf-8"))
        of_this = info["robot_type"] == "endowire" and info["codebase_version"] == "v3.0"
    except (OSError, ValueError, TypeError, KeyError):
        of_this = False
    if not of_this:
        raise InputError(f"folder = {folder}: is not empty, and no log of endowire: give a new one")
    return info


def drop_unfinished(folder: Path, episodes: int) -> None:
    """Removes what a killed program left: unfinished files, and files of episodes that are not counted yet."""
    for path in [*folder.rglob(f"{_HIDDEN}*{_PART}")]:
        path.unlink()
    for path in [*folder.glob("data/*/*"), *folder.glob("videos/*/*/*"), *folder.glob("meta/episodes/*/*")]:
        chunk, file = path.parent.name.removeprefix("chunk-"), path.stem.removeprefix("file-")
        if chunk.isdecimal() and file.isdecimal() and int(chunk) * CHUNK + int(file) >= episodes:
            path.unlink()
