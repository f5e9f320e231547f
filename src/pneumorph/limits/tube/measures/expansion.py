"""Closest points of a sampled surface by Newton's method on second-order expansions at its samples.

`fields` are position and derivatives x, q, r, qq, qr, rr, each (n, 3), per mm of both parameters. Offsets are in mm
along q and r. `steps` are the distances to the next column, and by row those to the next and the previous row.
"""

from __future__ import annotations

import numba
import numpy as np

NEARBY = np.array([-0.5, -0.25, 0.0, 0.25, 0.5])
"""Places between samples, in units of the sample distance, that are tried around samples close to their bounds."""

ROUNDS = 4
"""Times that both points are moved on from the best of these places."""

ROOM = 0.75
"""Largest offset in cells. Beyond half a cell the neighbouring sample is closer."""


@numba.njit(cache=True, nogil=True, inline="always")
def _place(fields, sample, a, b, c):
    """Coordinate c of the expansion at a sample."""
    x, q, r, qq, qr, rr = fields
    rise = b * (r[sample, c] + 0.5 * b * rr[sample, c])
    return x[sample, c] + a * (q[sample, c] + 0.5 * a * qq[sample, c] + b * qr[sample, c]) + rise


@numba.njit(cache=True, nogil=True, inline="always")
def _point(fields, sample, a, b):
    """The point of the expansion at a sample."""
    return _place(fields, sample, a, b, 0), _place(fields, sample, a, b, 1), _place(fields, sample, a, b, 2)


@numba.njit(cache=True, nogil=True)
def _nearest(px, py, pz, fields, sample, across, ahead, behind):
    """Distance and offset of the point closest to p; zero offset if the sample itself is closest."""
    x, q, r, qq, qr, rr = fields
    point = (px, py, pz)
    a, b = 0.0, 0.0
    for _ in range(4):
        slope_a, slope_b, aa, ab, bb = 0.0, 0.0, 0.0, 0.0, 0.0
        for c in range(3):
            to_q = q[sample, c] + a * qq[sample, c] + b * qr[sample, c]
            to_r = r[sample, c] + a * qr[sample, c] + b * rr[sample, c]
            away = _place(fields, sample, a, b, c) - point[c]
            slope_a += away * to_q
            slope_b += away * to_r
            aa += to_q * to_q + away * qq[sample, c]
            ab += to_q * to_r + away * qr[sample, c]
            bb += to_r * to_r + away * rr[sample, c]
        # On a bound, such as the rim of a disc, only the other offset changes.
        if (a <= -ROOM * across and slope_a > 0.0) or (a >= ROOM * across and slope_a < 0.0):
            slope_a, ab = 0.0, 0.0
        if (b <= -ROOM * behind and slope_b > 0.0) or (b >= ROOM * ahead and slope_b < 0.0):
            slope_b, ab = 0.0, 0.0
        lowest = 0.5 * (aa + bb) - np.hypot(0.5 * (aa - bb), ab)
        shift = max(0.05 - lowest, 0.0)
        aa, bb = aa + shift, bb + shift
        determinant = aa * bb - ab * ab
        step_a, step_b = (bb * slope_a - ab * slope_b) / determinant, (aa * slope_b - ab * slope_a) / determinant
        a = min(max(a - step_a, -ROOM * across), ROOM * across)
        b = min(max(b - step_b, -ROOM * behind), ROOM * ahead)
    squared, at_sample = 0.0, 0.0
    for c in range(3):
        squared += (_place(fields, sample, a, b, c) - point[c]) ** 2
        at_sample += (x[sample, c] - point[c]) ** 2
    if not squared < at_sample:
        return np.sqrt(at_sample), 0.0, 0.0
    return np.sqrt(squared), a, b


@numba.njit(cache=True, nogil=True)
def closest(points, near, fields, columns, steps, distance, offset):
    """Fill distance (n,) and offset (n, 2) of the points closest to `points` (n, 3), near the samples `near` (n,).

    Parameters
    ----------
    points : (n, 3) array
        mm.
    near : (n,) array
        A sample near each.
    fields : six (m, 3) arrays
    columns : int
        Samples in each row.
    steps : (float, (rows,) array, (rows,) array)
        mm.
    distance, offset : (n,) and (n, 2) arrays
        Overwritten; mm.
    """
    across, ahead, behind = steps
    for k in range(len(points)):
        row = near[k] // columns
        distance[k], offset[k, 0], offset[k, 1] = _nearest(
            points[k, 0], points[k, 1], points[k, 2], fields, near[k], across, ahead[row], behind[row]
        )


@numba.njit(cache=True, nogil=True)
def positions(sample, offset, fields, x):
    """Fill the positions (n, 3) at offsets (n, 2) from samples (n,).

    Parameters
    ----------
    sample : (n,) array
    offset : (n, 2) array
        mm.
    fields : six (m, 3) arrays
    x : (n, 3) array
        Overwritten; mm.
    """
    for k in range(len(sample)):
        for c in range(3):
            x[k, c] = _place(fields, sample[k], offset[k, 0], offset[k, 1], c)


@numba.njit(cache=True, nogil=True)
def closest_around(sample, near, here, there, around, digits, aside, offset):
    """Move pairs of points on two surfaces to the closest pair around them.

    Parameters
    ----------
    sample, near : (n,) int arrays
        Samples of the first and of the second surface.
    here, there : tuples (fields, columns, steps)
    around : (m,) array
        Places tried around each sample of the first surface along q and along r, in units of the sample distance.
    digits : int
        Of distances that are equal when rounded to these decimals the first is taken.
    aside, offset : (n, 2) arrays
        Offsets on both surfaces, overwritten where a closer pair is found; initially zero, and the closest point's.
    """
    fields, columns, (across, ahead, behind) = here
    others, other_columns, (other_across, other_ahead, other_behind) = there
    unit = 10.0**digits
    for k in range(len(sample)):
        row, other_row = sample[k] // columns, near[k] // other_columns
        room = other_ahead[other_row], other_behind[other_row]
        square = 0.0
        for c in range(3):
            gap = fields[0][sample[k], c] - _place(others, near[k], offset[k, 0], offset[k, 1], c)
            square += gap * gap
        best = np.rint(np.sqrt(square) * unit)
        for i in range(len(around)):
            a = around[i] * across
            for j in range(len(around)):
                b = around[j] * (behind[row] if around[j] < 0.0 else ahead[row])
                px, py, pz = _point(fields, sample[k], a, b)
                away, to_q, to_r = _nearest(px, py, pz, others, near[k], other_across, room[0], room[1])
                rounded = np.rint(away * unit)
                if rounded < best:
                    best = rounded
                    aside[k, 0], aside[k, 1], offset[k, 0], offset[k, 1] = a, b, to_q, to_r
        for _ in range(ROUNDS):
            # Of each surface in turn the point nearest to that of the other: soon there where an edge is near a wall.
            px, py, pz = _point(others, near[k], offset[k, 0], offset[k, 1])
            _, a, b = _nearest(px, py, pz, fields, sample[k], across, ahead[row], behind[row])
            px, py, pz = _point(fields, sample[k], a, b)
            away, to_q, to_r = _nearest(px, py, pz, others, near[k], other_across, room[0], room[1])
            rounded = np.rint(away * unit)
            if rounded >= best:
                break
            best = rounded
            aside[k, 0], aside[k, 1], offset[k, 0], offset[k, 1] = a, b, to_q, to_r


@numba.njit(cache=True, nogil=True)
def edge_around(source, near, offset, surface, neighbourhood, around, turns, digits, aside):
    """Move pairs of points on the edge of each other's neighbourhood to the closest such pair around them.

    Parameters
    ----------
    source : (n,) int array
        Samples of a surface.
    near, offset : (n,) int array and (n, 2) array
        The samples nearest to their partners, and the offsets from there; overwritten where a closer pair is found.
    surface : tuple (fields, columns, shrink, steps, diameter)
        With the (rows,) circumferences relative to the tube, the sample distances in mm, and the tube's diameter.
    neighbourhood : float
        mm.
    around : (m,) array
        Places tried around each sample along q and along r, in units of the sample distance.
    turns : (k,) array
        Angles by which the direction to the partner is turned.
    digits : int
        Of distances that are equal when rounded to these decimals the first is taken.
    aside : (n, 2) array
        Offsets from the samples, overwritten where a closer pair is found.
    """
    fields, columns, shrink, steps, diameter = surface
    unit, rows = 10.0**digits, len(shrink)
    for k in range(len(source)):
        here, row, column = source[k], source[k] // columns, source[k] % columns
        apart = (near[k] % columns - column + columns // 2) % columns - columns // 2
        wide, high = apart * steps[0] + offset[k, 0], (near[k] // columns - row) * steps[1] + offset[k, 1]
        chord, best, to = diameter * np.sin(wide / diameter), np.inf, near[k]
        to_q, to_r, from_q, from_r = offset[k, 0], offset[k, 1], 0.0, 0.0
        square = 0.0
        for c in range(3):
            square += (_place(fields, near[k], to_q, to_r, c) - _place(fields, here, 0.0, 0.0, c)) ** 2
        best = np.rint(np.sqrt(square) * unit)
        for turn in turns:
            across = chord * np.cos(turn) - high * np.sin(turn)
            along = chord * np.sin(turn) + high * np.cos(turn)
            if abs(across) > diameter:
                continue
            arc = wide if turn == 0.0 else diameter * np.arcsin(across / diameter)
            for i in range(len(around)):
                for j in range(len(around)):
                    a, b = around[i] * steps[0], around[j] * steps[1]
                    up, beyond = row + around[j], row + around[j] + along / steps[1]
                    if min(up, beyond) < 0.0 or max(up, beyond) > rows - 1:
                        continue
                    over, there = int(np.rint(around[i] + arc / steps[0])), int(np.rint(beyond))
                    # Near a pole steps around are shorter, and the point may be within the neighbourhood.
                    if np.hypot(across * min(shrink[row], shrink[there]), along) < neighbourhood - 1e-6:
                        continue
                    at = there * columns + (column + over) % columns
                    rest_q, rest_r = a + arc - over * steps[0], (beyond - there) * steps[1]
                    square = 0.0
                    for c in range(3):
                        square += (_place(fields, at, rest_q, rest_r, c) - _place(fields, here, a, b, c)) ** 2
                    away = np.rint(np.sqrt(square) * unit)
                    if away < best:
                        best, to, to_q, to_r, from_q, from_r = away, at, rest_q, rest_r, a, b
        near[k], offset[k, 0], offset[k, 1], aside[k, 0], aside[k, 1] = to, to_q, to_r, from_q, from_r
