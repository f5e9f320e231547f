"""The nearest place on triangles, and where segments first meet them, by a tree of boxes around them."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

import pneumorph.kept  # noqa: F401
from pneumorph.interrupts import stop_if_asked

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_LEAF = 4
"""Triangles in a box that is not divided, at least."""

_AT_ONCE = 20_000
"""Places or segments between two looks at whether to stop."""

_PARALLEL = 1e-14
"""Relative to what they are made of, smaller numbers are rounding: a segment is parallel, a triangle has no area."""

_DEEPEST = 64
"""More boxes than can wait in a tree that halves at every level."""


class Boxes(NamedTuple):
    """A complete binary tree of boxes around triangles: those within box k are 2 k + 1 and 2 k + 2.

    Attributes
    ----------
    corners : (m, 3, 3) corners of the triangles, those of a leaf together.
    number : (m,) their numbers as given.
    starts : (leaves + 1,) where those of each leaf begin.
    low, high : (2 leaves − 1, 3) corners of the boxes, the leaves last.
    """

    corners: Floats
    number: Ints
    starts: Ints
    low: Floats
    high: Floats


class Nearest(NamedTuple):
    """For each of n places, the number (n,) of the nearest triangle and the place (n, 3) on it."""

    triangle: Ints
    place: Floats


class Hits(NamedTuple):
    """For each of n segments, the triangle (n,) that it meets first, −1 if it meets none, and where (n, 3)."""

    triangle: Ints
    place: Floats


def boxes_of(points: Floats, triangles: NDArray[np.integer]) -> Boxes:
    """The tree of the triangles (m, 3) of points (n, 3), m > 0: halved again and again across its longest side."""
    corners = np.asarray(points, dtype=float)[triangles]
    middles, count = corners.mean(axis=1), len(corners)
    number, starts = np.arange(count), np.array([0, count])
    for _ in range(int(np.log2(max(count / _LEAF, 1.0)))):
        there, leaves = middles[number], starts[:-1]
        size = np.maximum.reduceat(there, leaves) - np.minimum.reduceat(there, leaves)
        leaf = np.repeat(np.arange(len(leaves)), np.diff(starts))
        along = there[np.arange(count), size.argmax(axis=1)[leaf]]
        number = number[np.lexsort((along, leaf))]
        starts = np.append(np.stack([leaves, (leaves + starts[1:]) // 2], axis=1).ravel(), count)
    corners = np.ascontiguousarray(corners[number])
    low = [np.minimum.reduceat(corners.min(axis=1), starts[:-1])]
    high = [np.maximum.reduceat(corners.max(axis=1), starts[:-1])]
    while len(low[0]) > 1:
        low.insert(0, np.minimum(low[0][::2], low[0][1::2]))
        high.insert(0, np.maximum(high[0][::2], high[0][1::2]))
    return Boxes(corners, number, starts, np.concatenate(low), np.concatenate(high))


def nearest(boxes: Boxes, places: Floats) -> Nearest:
    """The nearest triangle to each of places (n, 3), and the place on it."""
    places = np.ascontiguousarray(places, dtype=float)
    found = Nearest(np.empty(len(places), np.int64), np.empty_like(places))
    for begin in range(0, len(places), _AT_ONCE):
        stop_if_asked()
        some = slice(begin, begin + _AT_ONCE)
        _nearest(boxes, places[some], found.triangle[some], found.place[some])
    return found


def first_hits(boxes: Boxes, starts: Floats, stops: Floats) -> Hits:
    """Where segments (n, 3) to (n, 3) first meet triangles; those that a segment lies in count as not met."""
    starts, stops = (np.ascontiguousarray(each, dtype=float) for each in (starts, stops))
    found = Hits(np.empty(len(starts), np.int64), np.full_like(starts, np.nan))
    for begin in range(0, len(starts), _AT_ONCE):
        stop_if_asked()
        some = slice(begin, begin + _AT_ONCE)
        _first_hits(boxes, starts[some], stops[some], found.triangle[some], found.place[some])
    return found


@numba.njit(cache=True, nogil=True)
def _nearest(boxes, places, triangle, on):
    corners, number, starts, low, high = boxes
    leaves, waiting, spot = len(starts) - 1, np.empty(_DEEPEST, np.int64), np.empty(3)
    for n in range(len(places)):
        place, best = places[n], np.inf
        waiting[0], count = 0, 1
        while count:
            count -= 1
            box = waiting[count]
            if _away(place, low[box], high[box]) >= best:
                continue
            if box < leaves - 1:
                one, other = 2 * box + 1, 2 * box + 2
                if _away(place, low[one], high[one]) < _away(place, low[other], high[other]):
                    one, other = other, one
                waiting[count], waiting[count + 1] = one, other
                count += 2
                continue
            leaf = box - leaves + 1
            for k in range(starts[leaf], starts[leaf + 1]):
                away = _from_triangle(place, corners[k], spot)
                if away < best:
                    best, triangle[n] = away, number[k]
                    on[n, :] = spot


@numba.njit(cache=True, nogil=True)
def _away(place, low, high):
    """The squared distance of a place from a box."""
    away = 0.0
    for k in range(3):
        away += max(low[k] - place[k], place[k] - high[k], 0.0) ** 2
    return away


@numba.njit(cache=True, nogil=True)
def _dot(a, b, c, d):
    """(b − a)·(d − c)."""
    return (b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1]) + (b[2] - a[2]) * (d[2] - c[2])


@numba.njit(cache=True, nogil=True)
def _from_triangle(place, triangle, spot):
    """The squared distance of a place from a triangle, and the nearest place on it: within it, else on an edge."""
    o, e, f = triangle[0], triangle[1], triangle[2]
    a, b, c = _dot(o, e, o, e), _dot(o, e, o, f), _dot(o, f, o, f)
    g, h = _dot(o, e, o, place), _dot(o, f, o, place)
    below = a * c - b * b
    x, y = c * g - b * h, a * h - b * g
    if below > _PARALLEL * a * c and x >= 0.0 and y >= 0.0 and x + y <= below:
        x, y, away = x / below, y / below, 0.0
        for k in range(3):
            spot[k] = o[k] + x * (e[k] - o[k]) + y * (f[k] - o[k])
            away += (place[k] - spot[k]) ** 2
        return away
    best = np.inf
    for k in range(3):
        start, stop = triangle[k], triangle[(k + 1) % 3]
        length = _dot(start, stop, start, stop)
        share = min(max(_dot(start, stop, start, place) / length, 0.0), 1.0) if length > 0.0 else 0.0
        away = 0.0
        for m in range(3):
            away += (place[m] - start[m] - share * (stop[m] - start[m])) ** 2
        if away < best:
            best = away
            for m in range(3):
                spot[m] = start[m] + share * (stop[m] - start[m])
    return best


@numba.njit(cache=True, nogil=True)
def _first_hits(boxes, begins, ends, triangle, at):
    corners, number, starts, low, high = boxes
    leaves, waiting = len(starts) - 1, np.empty(_DEEPEST, np.int64)
    for n in range(len(begins)):
        begin, end, best = begins[n], ends[n], np.inf
        triangle[n], waiting[0], count = -1, 0, 1
        while count:
            count -= 1
            box = waiting[count]
            if not _enters(begin, end, low[box], high[box], best):
                continue
            if box < leaves - 1:
                waiting[count], waiting[count + 1] = 2 * box + 1, 2 * box + 2
                count += 2
                continue
            leaf = box - leaves + 1
            for k in range(starts[leaf], starts[leaf + 1]):
                share = _met(begin, end, corners[k])
                if 0.0 <= share < best:
                    best, triangle[n] = share, number[k]
        if triangle[n] >= 0:
            for k in range(3):
                at[n, k] = begin[k] + best * (end[k] - begin[k])


@numba.njit(cache=True, nogil=True)
def _enters(begin, end, low, high, before):
    """Whether a segment enters a box before a share of its length."""
    first, last = 0.0, min(before, 1.0)
    for k in range(3):
        along = end[k] - begin[k]
        if along == 0.0:
            if begin[k] < low[k] or begin[k] > high[k]:
                return False
            continue
        one, other = (low[k] - begin[k]) / along, (high[k] - begin[k]) / along
        first, last = max(first, min(one, other)), min(last, max(one, other))
    # Boxes of triangles in a plane have no thickness.
    return first <= last + 1e-12


@numba.njit(cache=True, nogil=True)
def _met(begin, end, triangle):
    """The share of a segment at which it meets a triangle, −1 if it does not (Möller and Trumbore 1997)."""
    o, e, f = triangle[0], triangle[1], triangle[2]
    ax, ay, az = e[0] - o[0], e[1] - o[1], e[2] - o[2]
    bx, by, bz = f[0] - o[0], f[1] - o[1], f[2] - o[2]
    dx, dy, dz = end[0] - begin[0], end[1] - begin[1], end[2] - begin[2]
    px, py, pz = dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx
    below = ax * px + ay * py + az * pz
    size = (ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz) * (dx * dx + dy * dy + dz * dz)
    if abs(below) <= _PARALLEL * np.sqrt(size):
        return -1.0
    tx, ty, tz = begin[0] - o[0], begin[1] - o[1], begin[2] - o[2]
    x = (tx * px + ty * py + tz * pz) / below
    qx, qy, qz = ty * az - tz * ay, tz * ax - tx * az, tx * ay - ty * ax
    y = (dx * qx + dy * qy + dz * qz) / below
    share = (bx * qx + by * qy + bz * qz) / below
    if x < 0.0 or y < 0.0 or x + y > 1.0 or share > 1.0:
        return -1.0
    return share
