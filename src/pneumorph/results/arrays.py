"""Checks of arrays that were stored: once they have passed, those who use them need not doubt them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.units import LARGEST


def floats(arrays: Mapping[str, np.ndarray], name: str, *shape: int | None, most: float = LARGEST) -> np.ndarray:
    """An array of numbers, none of which is above `most`; None in the shape stands for any length.

    Raises
    ------
    KeyError, ValueError
        If there is no such array, or it is another.
    """
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "fiu":
        raise ValueError(f'"{name}" is not of real numbers')
    _has_shape(name, array, shape)
    # Written so that NaN fails.
    if array.size and not np.abs(array.astype(float)).max() <= most:
        raise ValueError(f'"{name}" has numbers that are not finite or too large')
    return array


def indices(arrays: Mapping[str, np.ndarray], name: str, *shape: int | None, below: int) -> np.ndarray:
    """An array of whole numbers from 0 to below `below`; see `floats`."""
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "iu":
        raise ValueError(f'"{name}" is not of whole numbers')
    _has_shape(name, array, shape)
    if array.size and not 0 <= int(array.min()) <= int(array.max()) < below:
        raise ValueError(f'"{name}" has numbers out of range')
    return array


def _has_shape(name: str, array: np.ndarray, shape: tuple[int | None, ...]) -> None:
    fits = array.ndim == len(shape) and all(
        wanted in (None, length) for wanted, length in zip(shape, array.shape, strict=True)
    )
    if not fits:
        wanted = " × ".join("any" if length is None else str(length) for length in shape)
        raise ValueError(f'"{name}" has the shape {" × ".join(map(str, array.shape)) or "of one number"}, not {wanted}')
