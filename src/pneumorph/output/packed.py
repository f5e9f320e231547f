"""Numbers packed for a page: JSON and arrays of multiples of a step, in one compressed block.

A block is gzip of: the length of the JSON as four bytes (little-endian), the JSON, then the bytes of the arrays. In the
JSON, ``facts`` is whatever the page shows and ``arrays`` says of every array where it begins, its shape, its step and
how many bytes each number has. Bytes of equal significance are stored together, and arrays that change little along
their first axis as differences along it: both compress better. `web/src/packed.js` reads it.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

MICROMETRE = 1e-3
"""Step of lengths, in mm."""


@dataclass(frozen=True, eq=False)
class Steps:
    """An array as whole multiples of a step.

    Attributes
    ----------
    values : ndarray of int, any shape
    step : float
    differences : bool
        Whether the differences along the first axis are stored instead.
    """

    values: np.ndarray
    step: float = 1.0
    differences: bool = False


def in_steps(values: np.ndarray, step: float, differences: bool = False) -> Steps:
    """Numbers rounded to multiples of a step."""
    return Steps(np.rint(np.asarray(values, float) / step).astype(np.int64), step, differences)


def in_parts(values: np.ndarray) -> Steps:
    """Numbers rounded to so many parts of the largest as two bytes hold."""
    largest = float(np.abs(values).max(initial=0.0))
    return in_steps(values, largest / 32767 if largest > 0.0 else 1.0)


def pack(facts: Mapping[str, Any], arrays: Mapping[str, Steps], level: int = 9) -> bytes:
    """Pack facts and arrays into a block; a lower level of compression makes it larger, but in less time."""
    described, blocks, place = {}, [], 0
    for name, array in arrays.items():
        block, width = _bytes(array)
        described[name] = {
            "at": place,
            "shape": list(array.values.shape),
            "step": array.step,
            "width": width,
            "differences": array.differences,
        }
        blocks.append(block)
        place += len(block)
    head = json.dumps({"facts": facts, "arrays": described}, ensure_ascii=False, allow_nan=False).encode()
    return gzip.compress(b"".join([len(head).to_bytes(4, "little"), head, *blocks]), compresslevel=level, mtime=0)


def unpack(block: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Facts and arrays of a block, as the page sees them."""
    content = gzip.decompress(block)
    begin = 4 + int.from_bytes(content[:4], "little")
    head = json.loads(content[4:begin])
    arrays = {}
    for name, told in head["arrays"].items():
        count, width = int(np.prod(told["shape"])), told["width"]
        planes = np.frombuffer(content, np.uint8, count * width, begin + told["at"]).reshape(width, count)
        values = np.ascontiguousarray(planes.T).view(f"<i{width}").astype(np.int64).reshape(told["shape"])
        arrays[name] = told["step"] * (np.cumsum(values, axis=0) if told["differences"] else values)
    return head["facts"], arrays


def as_text(block: bytes) -> str:
    """The block in Base64, whose characters have no meaning in HTML."""
    return base64.b64encode(block).decode("ascii")


def _bytes(array: Steps) -> tuple[bytes, int]:
    """The bytes of an array, ordered by significance, and the number of bytes per value."""
    values = array.values
    if array.differences:
        values = np.diff(values, axis=0, prepend=np.zeros_like(values[:1]))
    largest = int(np.abs(values).max(initial=0))
    width = next(width for width in (1, 2, 4) if largest < 2 ** (8 * width - 1))
    planes = np.ascontiguousarray(values.astype(f"<i{width}")).view(np.uint8).reshape(-1, width).T
    return planes.tobytes(), width
