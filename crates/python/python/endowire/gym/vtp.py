"""Surfaces of VTK's XML format (``.vtp``), as SimVascular writes them."""

from __future__ import annotations

import base64
import zlib
from os import PathLike
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from .. import InputError

_TYPES = {
    "Float32": "f4", "Float64": "f8", "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2",
    "Int32": "i4", "UInt32": "u4", "Int64": "i8", "UInt64": "u8",
}  # fmt: skip


def read_vtp(path: str | PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points, shape (n, 3), and triangles, shape (m, 3), of a file of polygons, all its pieces together.

    Raises InputError for a file that is none, that has anything but triangles (strips, lines, lone points, other polygons), or that is
    compressed otherwise than by zlib.
    """
    try:
        return _read(Path(path).read_bytes())
    except (ElementTree.ParseError, zlib.error, ValueError, LookupError, AttributeError) as error:
        raise InputError(f"{path}: no surface of triangles in VTK's XML format ({error})") from error
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error


def _read(data: bytes) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    # What is appended raw is no XML.
    head, begin, tail = data.partition(b"<AppendedData")
    root = ElementTree.fromstring(head + b"</VTKFile>" if begin else head)
    attributes, _, appended = tail.partition(b">")
    if b"base64" in attributes:
        appended = appended.partition(b"</AppendedData")[0]
    reader = _Reader(root.attrib, appended.partition(b"_")[2], b"base64" in attributes)
    pieces = [_piece(piece, reader) for piece in root.findall("PolyData/Piece")]
    if not pieces:
        raise ValueError("it has no piece")
    # Each piece numbers its own points from 0.
    firsts = np.cumsum([0, *(len(points) for points, _ in pieces)])
    triangles = [corners + first for (_, corners), first in zip(pieces, firsts, strict=False)]
    return np.concatenate([points for points, _ in pieces]), np.concatenate(triangles)


def _piece(piece: ElementTree.Element, reader: _Reader) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and triangles of a piece."""
    for kind in ("Verts", "Lines", "Strips"):
        count = int(piece.get(f"NumberOf{kind}", 0))
        if count:
            raise ValueError(f"{count} {kind}: write it as triangles, vtkTriangleFilter makes them")
    points = reader.numbers(piece.find("Points/DataArray")).reshape(-1, 3).astype(float)
    polygons = {array.get("Name"): array for array in piece.findall("Polys/DataArray")}
    corners = reader.numbers(polygons["connectivity"]).astype(np.int64)
    offsets = reader.numbers(polygons["offsets"]).astype(np.int64)
    if not np.array_equal(offsets, 3 * np.arange(1, len(offsets) + 1)):
        raise ValueError("not all polygons are triangles")
    if corners.size and not 0 <= corners.min() <= corners.max() < len(points):
        raise ValueError(f"a triangle has a corner that is none of the {len(points)} points of its piece")
    return points, corners.reshape(-1, 3)


class _Reader:
    """Arrays of a file, however they are kept."""

    def __init__(self, attributes: dict[str, str], appended: bytes, is_text: bool) -> None:
        self.order = ">" if attributes.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(self.order + _TYPES[attributes.get("header_type", "UInt32")])
        compressor = attributes.get("compressor", "")
        if compressor not in ("", "vtkZLibDataCompressor"):
            raise ValueError(f"compressed by {compressor}")
        self.compressed = bool(compressor)
        self.appended, self.is_text = appended, is_text

    def numbers(self, array: Any) -> NDArray[Any]:
        kind = np.dtype(self.order + _TYPES[array.get("type")])
        match array.get("format"):
            case "ascii":
                return np.array((array.text or "").split(), dtype=kind)
            case "appended":
                return np.frombuffer(
                    self._block(self.appended[int(array.get("offset")) :], self.is_text), kind
                )
            case _:
                return np.frombuffer(self._block("".join(array.text.split()).encode(), True), kind)

    def _block(self, data: bytes, is_text: bool) -> bytes:
        """The bytes of an array that begins here."""

        def part(begin: int, length: int) -> bytes:
            if not is_text:
                return data[begin : begin + length]
            # Header and numbers are texts of their own where they are compressed, and one text where not.
            return base64.b64decode(data[begin : begin + 4 * -(-length // 3)])[:length]

        size = self.header.itemsize
        count = int(np.frombuffer(part(0, size), self.header)[0])
        if not self.compressed:
            return part(0, size + count)[size:]
        lengths = np.frombuffer(part(0, (3 + count) * size), self.header)[3:].astype(int)
        begin = 4 * -(-(3 + count) * size // 3) if is_text else (3 + count) * size
        blocks = part(begin, int(lengths.sum()))
        ends = np.cumsum(lengths)
        return b"".join(zlib.decompress(blocks[end - n : end]) for n, end in zip(lengths, ends, strict=True))
