"""The limits that matter near a design, linearised: the worst place of every knot-span cell as a sparse row.

A limit on a surface holds at infinitely many points. Of each cell of a control net (or half of one) only the worst
sample of each limit is kept, and only where it is near its bound: hundreds or thousands of rows, each with the sixteen
control points that move it (those of both walls for a distance). Which samples these are changes from one linearisation
to the next: an exchange method for semi-infinite programs (Hettich & Kortanek 1993).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.constraint.distance import Target, nearest, nearest_fold, target
from pneumorph.constraint.frame import frame
from pneumorph.constraint.report import Places
from pneumorph.constraint.sampling import Fields, Grid, grid, heights, rim_share
from pneumorph.constraint.surface import MIN_AREA, Form, pointwise
from pneumorph.constraint.table import TABLE
from pneumorph.geometry import Body, TubeSurface
from pneumorph.geometry.local import at, local

if TYPE_CHECKING:
    from pneumorph.problem import Limits as LimitsSpec

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

SHAPE = ("curvature", "skew", "stretch", "area")
KINDS = (*SHAPE, *(limit.name for limit in TABLE if limit.name not in SHAPE))
"""Kinds of rows: the limits of the table, in the order in which they are numbered."""

_BLOCK = 4096
"""Places evaluated at a time: compiled code knows this size alone, whatever the body."""

FINE, COARSE = (4, 8), (2, 4)
"""Samples to each knot span in q and r: of what curvature and the like peak in, and of what distances start from."""

NEARBY, CLOSE = np.array([-0.5, 0.0, 0.5]), -0.03
"""Places between samples, in steps of them, that are looked at around the worst ones where c is above the latter."""


class Rows(NamedTuple):
    """Linearised limits, c + J dP ≤ 0.

    Attributes
    ----------
    kind : (m,) int, which of `KINDS`.
    cell : (m,) int, the knot-span cell, numbered through all surfaces.
    value : (m,) c relative to the bound: 0.01 is one per cent beyond it.
    jacobian : csr (m, 3·n_points), per mm of the control points' coordinates.
    """

    kind: Ints
    cell: Ints
    value: Floats
    jacobian: sparse.csr_array


class _Part(NamedTuple):
    """Some rows of one kind: cells and values (m,), columns and entries (m, k)."""

    kind: Ints
    cell: Ints
    value: Floats
    column: Ints
    entry: Floats


@dataclass(frozen=True, eq=False)
class Sampled:
    """The limits of a problem on samples from which rows are chosen; make it with `sampled`.

    Attributes
    ----------
    spec : problem.Limits
    length : float
        Of the body, mm: its end discs lie at z = 0 and z = length.
    fine, coarse : tuples of Grid
        Samples of each surface, see `FINE` and `COARSE`.
    spans : tuple of (int, int)
        Knot spans of each surface in q and in r.
    """

    spec: LimitsSpec
    length: float
    fine: tuple[Grid, ...]
    coarse: tuple[Grid, ...]
    spans: tuple[tuple[int, int], ...]

    @property
    def first(self) -> Ints:
        """Number of each surface's first cell, and last the number of all cells."""
        return np.concatenate([[0], np.cumsum([around * along for around, along in self.spans])])

    def rows(self, body: Body, reach: float, least: float, places: Places | None = None) -> Rows:
        """Linearise the limits of a body.

        Parameters
        ----------
        body : Body
            Of the net shapes that the samples are for.
        reach : float
            Distances in mm up to this much within their bound give a row.
        least : float
            Measures of the shape with c above this give a row.
        places : Places, optional
            Where a certificate has found limits broken between the samples: rows of their own.
        """
        parts = [*_shapes(self, body, least, places), *_distances(self, body, reach)]
        if places is not None:
            parts.extend(_gaps(self, body, name, places) for name in ("wall", "fold"))
        column = np.concatenate([part.column.ravel() for part in parts])
        entry = np.concatenate([part.entry.ravel() for part in parts])
        width = np.concatenate([np.full(len(part.cell), part.column.shape[1]) for part in parts])
        start = np.concatenate([[0], np.cumsum(width)])
        jacobian = sparse.csr_array((entry, column, start), shape=(len(width), 3 * body.n_points))
        jacobian.sum_duplicates()
        kind, cell, value = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("kind", "cell", "value")
        )
        return Rows(kind, cell, value, jacobian)


def sampled(body: Body, spec: LimitsSpec) -> Sampled:
    """Samples for a body, of which only what never changes in a run is taken: net shapes, starting sizes, length."""
    return Sampled(
        spec=spec,
        length=float(body.exterior.net[-1, 0, 2]),
        fine=tuple(grid(surface, FINE) for surface in body.surfaces),
        coarse=tuple(grid(surface, COARSE) for surface in body.surfaces),
        spans=tuple((surface.basis_q.spans, surface.basis_r.spans) for surface in body.surfaces),
    )


# Measures of the shape.


def _shapes(limits: Sampled, body: Body, least: float, places: Places | None) -> Iterator[_Part]:
    spec = limits.spec
    scale = np.array([1 / spec.curvature, 1 / spec.skew, 1 / spec.stretch.limit, -1 / MIN_AREA])
    shift = np.array([-1.0, -1.0, -1.0, 1.0])
    for number, (surface, samples) in enumerate(zip(body.surfaces, limits.fine, strict=True)):
        c = scale[:, None, None] * _measured(surface, samples, spec.stretch.form) + shift[:, None, None]
        chosen = [_added(limits, number, places)]
        for kind, values in enumerate(c):
            row, column, cell = _worst_samples(values, FINE, limits.spans[number], least)
            q, r, worst = samples.q[column], samples.r[row], values[row, column]
            close = np.flatnonzero(worst > CLOSE)
            q[close], r[close] = _worst_nearby(surface, samples, kind, q[close], r[close], spec.stretch.form)
            chosen.append((np.full(len(cell), kind), cell, q, r))
        kind, cell, q, r = (np.concatenate(parts) for parts in zip(*chosen, strict=True))
        value, entry, points = _gradient(surface, samples, kind, q, r, spec.stretch.form)
        yield _Part(
            kind,
            limits.first[number] + cell,
            scale[kind] * value + shift[kind],
            (3 * (body.slices[number].start + points)[..., None] + np.arange(3)).reshape(len(kind), 48),
            scale[kind][:, None] * entry,
        )


def _added(limits: Sampled, number: int, places: Places | None) -> tuple[Ints, Ints, Floats, Floats]:
    """Kind, cell, q and r of the places on a surface where a certificate has found measures beyond their limits."""
    none = np.zeros(0, dtype=np.int64)
    if places is None:
        return none, none, np.zeros(0), np.zeros(0)
    parts = []
    for kind, name in enumerate(SHAPE):
        found = places.points[name]
        here = found.surface == number
        q, r = found.q[here], found.r[here]
        parts.append((np.full(len(q), kind), _cell_of(limits, number, q, r), q, r))
    kind, cell, q, r = (np.concatenate(part) for part in zip(*parts, strict=True))
    return kind, cell, q, r


def _cell_of(limits: Sampled, number: int, q: Floats, r: Floats) -> Ints:
    """Cells of places given by their parameters."""
    around, along = limits.spans[number]
    return np.minimum((r * along).astype(np.int64), along - 1) * around + (q % 1.0 * around).astype(np.int64)


def _worst_samples(
    c: Floats, per_span: tuple[int, int], spans: tuple[int, int], least: float
) -> tuple[Ints, Ints, Ints]:
    """Row, column and cell of the worst samples of each cell, of values (rows, columns) above `least`."""
    row, column = np.nonzero(c > least)
    cell = np.minimum(row // per_span[1], spans[1] - 1) * spans[0] + column // per_span[0]
    # Of both halves along r: where one alone is kept, motions that mend it spoil the other by turns.
    half = 2 * cell + 2 * row // per_span[1] % 2
    pick = _worst_of_cells(c[row, column], half)
    return row[pick], column[pick], cell[pick]


def _worst_of_cells(c: Floats, cell: Ints) -> Ints:
    """Which of some values is the largest of its cell, a number for each cell."""
    order = np.lexsort((-c, cell))
    return order[np.flatnonzero(np.diff(cell[order], prepend=-1))]


def _worst_nearby(
    surface: TubeSurface, samples: Grid, kind: int, q: Floats, r: Floats, form: Form
) -> tuple[Floats, Floats]:
    """The worst of nine places around each chosen sample: what is limited peaks between samples."""
    rise, aside = (part.ravel() for part in np.meshgrid(NEARBY, NEARBY, indexing="ij"))
    q = (q[:, None] + aside / len(samples.q)) % 1.0
    r = np.clip(r[:, None] + rise / (len(samples.r) - 1), 0.0, 1.0)
    found = _evaluated(*_tangents(surface, q.ravel(), r.ravel())[0], samples, form)[kind].reshape(q.shape)
    pick = np.arange(len(q)), (found * (-1.0 if SHAPE[kind] == "area" else 1.0)).argmax(axis=1)
    return q[pick], r[pick]


_ORDERS = ((0, 1), (1, 0), (0, 2), (2, 1), (3, 0))
"""Which functions of r (see `Frame`) and which derivative by q make U, r_r, U_q, U_r and r_rr."""


def _measured(surface: TubeSurface, samples: Grid, form: Form) -> Floats:
    """All measures (4, rows, columns) on a grid."""
    parts = samples.frame
    along = [np.stack([part[c] @ surface.net[..., c] for c in range(3)]) for part in parts[:4]]
    fields = np.stack([along[of] @ samples.values_q[order].T for of, order in _ORDERS])
    shape = fields.shape[2:]
    shrink, slope = (np.broadcast_to(part, shape).ravel() for part in (parts.shrink, parts.slope))
    return _evaluated(fields.reshape(5, 3, -1), shrink, slope, samples, form).reshape(4, *shape)


def _tangents(surface: TubeSurface, q: Floats, r: Floats) -> tuple[tuple[Floats, Floats, Floats], Floats, Floats]:
    """At places (m,): (U … r_rr (5, 3, m), S, dS/dr), and the functions of r (4, 3, m, 4) and q (3, m, 4) behind."""
    in_q, in_r = local(surface.basis_q, q)[0], local(surface.basis_r, r)[0]
    by_q = np.stack([local(surface.basis_q, q, order)[1] / surface.size[0] ** order for order in range(3)])
    rows, back = np.unique(r, return_inverse=True)
    parts = frame(surface, rows)
    by_r = np.take_along_axis(np.stack(parts[:4])[:, :, back], in_r[None, None], axis=3)
    net = surface.net[in_r[:, :, None], in_q[:, None, :]]
    fields = np.stack(
        [np.einsum("cmj,mjic,mi->cm", by_r[of], net, by_q[order], optimize=True) for of, order in _ORDERS]
    )
    return (fields, parts.shrink[back, 0], parts.slope[back, 0]), by_r, by_q


def _gradient(
    surface: TubeSurface, samples: Grid, kind: Ints, q: Floats, r: Floats, form: Form
) -> tuple[Floats, Floats, Ints]:
    """Measures (m,) at places, derivatives (m, 48) by the control points (m, 16) that they depend on."""
    arguments, by_r, by_q = _tangents(surface, q, r)
    wanted = np.zeros((len(SHAPE), len(kind)))
    wanted[kind, np.arange(len(kind))] = 1.0
    aspect = samples.size[1] / samples.size[0]
    value, slopes = _in_blocks(lambda *block: _differentiated(*block, aspect, form), (*arguments, wanted))
    entry = sum(
        np.einsum("cm,cmj,mi->mjic", slopes[k], by_r[of], by_q[order], optimize=True)
        for k, (of, order) in enumerate(_ORDERS)
    )
    points, _ = at(surface, q, r)
    return value[kind, np.arange(len(kind))], np.asarray(entry).reshape(len(kind), 48), points


def _evaluated(fields: Floats, shrink: Floats, slope: Floats, samples: Grid, form: Form) -> Floats:
    """Measures (4, m) from tangents (5, 3, m) and so on."""
    aspect = samples.size[1] / samples.size[0]
    (found,) = _in_blocks(lambda *block: (_at_places(*block, aspect, form),), (fields, shrink, slope))
    return found


def _in_blocks(function: Callable[..., tuple[Array, ...]], arrays: tuple[Floats, ...]) -> tuple[Floats, ...]:
    """A function of arrays (..., m) that works on `_BLOCK` of their last entries at a time."""
    count = arrays[0].shape[-1]
    answers = []
    for start in range(0, max(count, 1), _BLOCK):
        stop = min(start + _BLOCK, count)
        filled = [
            np.concatenate(
                [part := array[..., start:stop], np.ones((*part.shape[:-1], start + _BLOCK - stop))], axis=-1
            )
            for array in arrays
        ]
        answers.append([np.asarray(answer)[..., : stop - start] for answer in function(*filled)])
    return tuple(np.concatenate(parts, axis=-1) for parts in zip(*answers, strict=True))


def _measures(fields, shrink, slope, aspect, form: Form):
    return jnp.stack(pointwise(tuple(fields), shrink, slope, aspect, form))


_at_places = jax.jit(_measures, static_argnames="form")


@partial(jax.jit, static_argnames="form")
def _differentiated(fields, shrink, slope, wanted, aspect, form: Form):
    value, back = jax.vjp(lambda fields: _measures(fields, shrink, slope, aspect, form), fields)
    return value, back(wanted)[0]


# Distances, heights and radii.


def _distances(limits: Sampled, body: Body, reach: float) -> Iterator[_Part]:
    fields = [_fields(surface, samples) for surface, samples in zip(body.surfaces, limits.coarse, strict=True)]
    closed = [
        target(field, samples, discs=samples.cavity) for field, samples in zip(fields, limits.coarse, strict=True)
    ]
    for a in range(len(closed)):
        for b in range(a + 1, len(closed)):
            yield _walls(limits, body, (a, closed[a]), (b, closed[b]), reach)
    for number, (field, samples) in enumerate(zip(fields, limits.coarse, strict=True)):
        yield _folds(limits, body, number, target(field, samples, discs=False), reach)
        if len(samples.rings):
            yield from _rims(limits, body, number, field, reach)
        yield from _ends(limits, body, number, field, reach)
    if limits.spec.envelope is not None:
        yield _envelope(limits, body, fields[0], limits.spec.envelope.radius, reach)


def _fields(surface: TubeSurface, samples: Grid) -> Fields:
    along = [np.tensordot(values, surface.net, axes=1).transpose(2, 0, 1) for values in samples.values_r]
    orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    return Fields(*(along[dr] @ samples.values_q[dq].T for dq, dr in orders))


def _walls(limits: Sampled, body: Body, asking: tuple[int, Target], asked: tuple[int, Target], reach: float) -> _Part:
    """Distances from one surface to another, both with their end discs where they are chambers."""
    (a, here), (b, there) = asking, asked
    bound = limits.spec.wall + reach
    # The nearest sample is farther than the foot, by less than a cell's diagonal.
    within, near = nearest(here.x, there, bound + 0.5 * float(np.hypot(there.across, there.grid.step[1])))
    some = np.flatnonzero(within)
    distance, _, offset = there.closest(here.x[some], near[some])
    keep = distance < bound
    some, near, offset, distance = some[keep], near[some[keep]], offset[keep], distance[keep]
    cell = _cell(limits, a, here, some)
    pick = _worst_of_cells(-distance, cell)
    one, other = _Place(a, here, some[pick], np.zeros((len(pick), 2))), _Place(b, there, near[pick], offset[pick])
    outward = there.normals()[near[pick]]
    return _between(limits, body, "wall", one, other, cell[pick], limits.spec.wall, outward)


def _folds(limits: Sampled, body: Body, number: int, tube: Target, reach: float) -> _Part:
    """Distances within one surface, outside the neighbourhood."""
    spec = limits.spec.fold
    # Walls farther apart than the neighbourhood are no folds.
    bound = min(spec.distance + reach, spec.neighbourhood)
    fold = nearest_fold(tube, spec.neighbourhood, bound, np.arange(len(tube.x)))
    some = np.flatnonzero(np.isfinite(fold.distance))
    near, offset, facing = fold.near[some], fold.offset[some].copy(), fold.facing[some]
    _, _, offset[facing] = tube.closest(tube.x[some[facing]], near[facing])
    cell = _cell(limits, number, tube, some)
    pick = _worst_of_cells(-fold.distance[some], cell)
    one = _Place(number, tube, some[pick], np.zeros((len(pick), 2)))
    other = _Place(number, tube, near[pick], offset[pick])
    return _between(limits, body, "fold", one, other, cell[pick], spec.distance)


class _Place(NamedTuple):
    """Places on a surface: samples (m,) and offsets (m, 2) in mm of the two parameters."""

    number: int
    surface: Target
    sample: Ints
    offset: Floats


def _between(
    limits: Sampled,
    body: Body,
    kind: str,
    one: _Place,
    other: _Place,
    cell: Ints,
    bound: float,
    outward: Floats | None = None,
) -> _Part:
    """Rows of distances between places, which at feet depend on the surfaces alone and not on where the feet are.

    With normals of the other surface into its void, a place that has passed through it has a negative distance.
    """
    ends = _combination(body, one), _combination(body, other)
    return _separation(kind, body.control_points(), *ends, limits.first[one.number] + cell, bound, outward)


def _separation(
    kind: str,
    points: Floats,
    one: tuple[Ints, Floats],
    other: tuple[Ints, Floats],
    cell: Ints,
    bound: float,
    outward: Floats | None = None,
) -> _Part:
    """Rows of the distances between two sets of places that are combinations of control points."""
    (column_a, weight_a), (column_b, weight_b) = one, other
    gap = np.einsum("mk,mkc->mc", weight_a, points[column_a]) - np.einsum("mk,mkc->mc", weight_b, points[column_b])
    distance = np.linalg.norm(gap, axis=1)
    direction = gap / np.maximum(distance, 1e-9)[:, None]
    if outward is not None:
        passed = np.where(np.einsum("mc,mc->m", direction, outward) > 0.7, -1.0, 1.0)
        direction, distance = direction * passed[:, None], distance * passed
    column = np.concatenate([column_a, column_b], axis=1)
    weight = np.concatenate([-weight_a, weight_b], axis=1) / bound
    return _Part(
        np.full(len(cell), KINDS.index(kind)),
        cell,
        1.0 - distance / bound,
        (3 * column[..., None] + np.arange(3)).reshape(len(cell), 3 * column.shape[1]),
        (weight[..., None] * direction[:, None, :]).reshape(len(cell), 3 * column.shape[1]),
    )


def _combination(body: Body, place: _Place) -> tuple[Ints, Floats]:
    """Control points (m, k) of the body, and their weights, that make up places on a tube or its end discs."""
    surface, samples, rings = body.surfaces[place.number], place.surface.grid, place.surface.rings
    row, column = np.divmod(place.sample, place.surface.columns)
    around = samples.q[column] + place.offset[:, 0] / surface.size[0]
    along = samples.r[np.clip(row - rings, 0, len(samples.r) - 1)] + place.offset[:, 1] / surface.size[1]
    if not rings:
        return _weights(body, place.number, around, along)
    base, tip = row < rings, row >= rings + len(samples.r)
    nearest_ring = np.where(tip, len(samples.r) + 2 * rings - 1 - row, row)
    outward = np.where(tip, -1.0, 1.0) * place.offset[:, 1] * 2.0 * np.pi / surface.size[0]
    s = np.where(base | tip, samples.rings[np.minimum(nearest_ring, rings - 1)] + outward, 1.0)
    return _weights(body, place.number, around, np.where(base, 0.0, np.where(tip, 1.0, along)), s)


def _weights(body: Body, number: int, q: Floats, r: Floats, s: Floats | None = None) -> tuple[Ints, Floats]:
    """The same of places (q, r); with s, of (1 - s)·centre + s·place, the centre being the mean of the end row."""
    surface, first = body.surfaces[number], body.slices[number].start
    numbers, weights = at(surface, q, r)
    if s is None:
        return first + numbers, weights
    rows, columns = surface.net.shape[:2]
    end_row = np.where(r > 0.5, rows - 1, 0)[:, None] * columns + np.arange(columns)
    centre = np.repeat((1.0 - s)[:, None] / columns, columns, axis=1)
    return first + np.concatenate([numbers, end_row], axis=1), np.concatenate([s[:, None] * weights, centre], axis=1)


def _gaps(limits: Sampled, body: Body, name: str, places: Places) -> _Part:
    """Distances between pairs of places that a certificate has found too close."""
    found, bound = places.pairs[name], limits.spec.wall if name == "wall" else limits.spec.fold.distance
    points = body.control_points()
    parts = []
    for a, b in sorted(set(zip(found.surface_a.tolist(), found.surface_b.tolist(), strict=True))):
        some = (found.surface_a == a) & (found.surface_b == b)
        one, other = found.a[some], found.b[some]
        cell = limits.first[a] + _cell_of(limits, a, one[:, 0], one[:, 1])
        ends = _weights(body, a, *one.T), _weights(body, b, *other.T)
        parts.append(_separation(name, points, *ends, cell, bound))
    return _joined(parts, KINDS.index(name))


def _joined(parts: list[_Part], kind: int) -> _Part:
    """Parts of different widths as one, filled up with zeros."""
    width = max((part.column.shape[1] for part in parts), default=0)

    def filled(array: NDArray) -> NDArray:
        return np.pad(array, ((0, 0), (0, width - array.shape[1])))

    if not parts:
        none = np.zeros(0, dtype=np.int64)
        return _Part(none, none, np.zeros(0), np.zeros((0, 0), dtype=np.int64), np.zeros((0, 0)))
    return _Part(
        np.concatenate([part.kind for part in parts]),
        np.concatenate([part.cell for part in parts]),
        np.concatenate([part.value for part in parts]),
        np.concatenate([filled(part.column) for part in parts]),
        np.concatenate([filled(part.entry) for part in parts]),
    )


def _cell(limits: Sampled, number: int, surface: Target, sample: Ints) -> Ints:
    """Cells of samples; those on an end disc belong to the cells at its rim."""
    row, column = np.divmod(sample, surface.columns)
    row = np.clip(row - surface.rings, 0, len(surface.grid.r) - 1)
    around, along = limits.spans[number]
    return np.minimum(row // COARSE[1], along - 1) * around + column // COARSE[0]


def _heights(limits: Sampled, body: Body, number: int, kind: str, c: Floats, slope: Floats, reach: float) -> _Part:
    """Rows of limits c (rows, columns) on the height z, with dc/dz (rows, 1)."""
    samples, surface = limits.coarse[number], body.surfaces[number]
    row, column, cell = _worst_samples(c, COARSE, limits.spans[number], -reach * float(np.abs(slope).max()))
    numbers, weights = at(surface, samples.q[column], samples.r[row])
    return _Part(
        np.full(len(cell), KINDS.index(kind)),
        limits.first[number] + cell,
        c[row, column],
        3 * (body.slices[number].start + numbers) + 2,
        slope[row] * weights,
    )


def _rims(limits: Sampled, body: Body, number: int, field: Fields, reach: float) -> Iterator[_Part]:
    """A tube beside the planes of its own flat ends; see `rim_share`."""
    samples, spec, surface = limits.coarse[number], limits.spec.fold, body.surfaces[number]
    shares = rim_share(samples, spec.neighbourhood)
    for tip, (share, height) in enumerate(zip(shares, heights(field.x, samples), strict=True)):
        kept = share > 0.0
        slope = np.where(kept, (1.0 if tip else -1.0) / (spec.distance * np.where(kept, share, 1.0)), 0.0)
        c = np.where(kept, 1.0 - height * np.abs(slope), -np.inf)
        row, column, cell = _worst_samples(c, COARSE, limits.spans[number], -reach / spec.distance)
        numbers, weights = at(surface, samples.q[column], samples.r[row])
        # The plane goes with the end row; all of its points share one z.
        end, whole = at(surface, samples.q[column], np.full(len(row), float(tip)))
        yield _Part(
            np.full(len(cell), KINDS.index("rim")),
            limits.first[number] + cell,
            c[row, column],
            3 * (body.slices[number].start + np.concatenate([numbers, end], axis=1)) + 2,
            slope[row] * np.concatenate([weights, -whole], axis=1),
        )


def _ends(limits: Sampled, body: Body, number: int, field: Fields, reach: float) -> Iterator[_Part]:
    """Chambers before the planes of the body's ends, and the exterior, which must not pass them."""
    wall, cavity, z = limits.spec.wall, limits.coarse[number].cavity, field.x[2]
    for height, direction in ((z, -1.0), (limits.length - z, 1.0)):
        c = (1.0 if cavity else 0.0) - height / wall
        slope = np.full((len(z), 1), direction / wall)
        if not cavity:
            c[[0, -1]], slope[[0, -1]] = -np.inf, 0.0
        yield _heights(limits, body, number, "planes" if cavity else "ends", c, slope, reach)


def _envelope(limits: Sampled, body: Body, field: Fields, radius: float, reach: float) -> _Part:
    samples, surface, wall = limits.coarse[0], body.exterior, limits.spec.wall
    away = np.hypot(field.x[0], field.x[1])
    row, column, cell = _worst_samples((away - radius) / wall, COARSE, limits.spans[0], -reach / wall)
    numbers, weights = at(surface, samples.q[column], samples.r[row])
    direction = (field.x[:2, row, column] / away[row, column]).T
    return _Part(
        np.full(len(cell), KINDS.index("envelope")),
        limits.first[0] + cell,
        (away[row, column] - radius) / wall,
        (3 * numbers[..., None] + np.arange(2)).reshape(len(cell), 32),
        (weights[..., None] * direction[:, None, :] / wall).reshape(len(cell), 32),
    )
