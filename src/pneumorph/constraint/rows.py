"""The limits that matter near a design, linearised: the worst place of every knot-span cell as a sparse row.

A limit on a surface holds at infinitely many points. Of each cell of a control net only the worst sample of each limit
is kept, and only where it is near its bound: hundreds or thousands of rows, each with the sixteen control points that
move it (those of both walls for a distance). Which samples these are changes from one linearisation to the next: an
exchange method for semi-infinite programs (Hettich & Kortanek 1993).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.constraint.distance import Target, nearest, nearest_fold, target
from pneumorph.constraint.sampling import Fields, Grid, grid, heights, rim_share
from pneumorph.constraint.surface import MIN_AREA, Form, _pointwise, measures_of_net
from pneumorph.geometry import Body, TubeSurface
from pneumorph.geometry.local import at, local

if TYPE_CHECKING:
    from pneumorph.problem import Limits as LimitsSpec

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHAPE = ("curvature", "skew", "stretch", "area")
KINDS = (*SHAPE, "wall", "fold", "rim", "ends", "envelope")
"""Kinds of rows, in the order in which they are numbered."""

FINE, COARSE = (4, 8), (2, 4)
"""Samples to each knot span in q and r: of what curvature and the like peak in, and of what distances start from."""

NEARBY, CLOSE = np.array([-0.5, 0.0, 0.5]), -0.1
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

    def rows(self, body: Body, reach: float, least: float) -> Rows:
        """Linearise the limits of a body.

        Parameters
        ----------
        body : Body
            Of the net shapes that the samples are for.
        reach : float
            Distances in mm up to this much within their bound give a row.
        least : float
            Measures of the shape with c above this give a row.
        """
        parts = [*_shapes(self, body, least), *_distances(self, body, reach)]
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


def _shapes(limits: Sampled, body: Body, least: float) -> Iterator[_Part]:
    spec = limits.spec
    scale = np.array([1 / spec.curvature, 1 / spec.skew, 1 / spec.stretch.limit, -1 / MIN_AREA])
    shift = np.array([-1.0, -1.0, -1.0, 1.0])
    for number, (surface, samples) in enumerate(zip(body.surfaces, limits.fine, strict=True)):
        found = _measured(jnp.asarray(surface.net), samples, spec.stretch.form)
        chosen = []
        for kind, measure in enumerate(found):
            c = scale[kind] * np.asarray(measure) + shift[kind]
            first_row = samples.measured.start or 0
            row, column, cell = _worst_samples(c, first_row, FINE, limits.spans[number], least)
            chosen.append((np.full(len(cell), kind), cell, row, column, c[row - first_row, column]))
        kind, cell, row, column, worst = (np.concatenate(parts) for parts in zip(*chosen, strict=True))
        if not len(kind):
            continue
        q, r = samples.q[column], samples.r[row]
        close = np.flatnonzero(worst > CLOSE)
        if len(close):
            q[close], r[close] = _worst_nearby(
                surface, samples, kind[close], row[close], column[close], spec.stretch.form, scale
            )
        value, entry, points = _gradient(surface, samples, kind, q, r, spec.stretch.form)
        yield _Part(
            kind,
            limits.first[number] + cell,
            scale[kind] * value + shift[kind],
            (3 * (body.slices[number].start + points)[..., None] + np.arange(3)).reshape(len(kind), 48),
            scale[kind][:, None] * entry,
        )


_measured = jax.jit(measures_of_net, static_argnums=(1, 2))


def _worst_samples(
    c: Floats, first_row: int, per_span: tuple[int, int], spans: tuple[int, int], least: float
) -> tuple[Ints, Ints, Ints]:
    """Row, column and cell of the worst sample of each cell, of values (rows, columns) above `least`."""
    row, column = np.nonzero(c > least)
    cell = np.minimum((row + first_row) // per_span[1], spans[1] - 1) * spans[0] + column // per_span[0]
    pick = _worst_of_cells(c[row, column], cell)
    return row[pick] + first_row, column[pick], cell[pick]


def _worst_of_cells(c: Floats, cell: Ints) -> Ints:
    """Which of some values is the largest of its cell, a number for each cell."""
    order = np.lexsort((-c, cell))
    return order[np.flatnonzero(np.diff(cell[order], prepend=-1))]


def _worst_nearby(
    surface: TubeSurface, samples: Grid, kind: Ints, row: Ints, column: Ints, form: Form, scale: Floats
) -> tuple[Floats, Floats]:
    """The worst of nine places around each chosen sample: what is limited peaks between samples."""
    rise, aside = (part.ravel() for part in np.meshgrid(NEARBY, NEARBY, indexing="ij"))
    q = (samples.q[column][:, None] + aside / len(samples.q)).ravel() % 1.0
    low, high = samples.r[samples.measured][[0, -1]]
    r = np.clip((samples.r[row][:, None] + rise / (len(samples.r) - 1)).ravel(), low, high)
    kinds = np.repeat(kind, len(rise))
    found = _at_places(*_padded(_arguments(surface, samples, q, r)), samples.size[1] / samples.size[0], form)
    c = (np.sign(scale)[kinds] * np.asarray(found)[kinds, np.arange(len(q))]).reshape(len(kind), -1)
    pick = np.arange(len(kind)) * len(rise) + c.argmax(axis=1)
    return q[pick], r[pick]


def _gradient(
    surface: TubeSurface, samples: Grid, kind: Ints, q: Floats, r: Floats, form: Form
) -> tuple[Floats, Floats, Ints]:
    """Measures (m,) at places, derivatives (m, 48) by the control points (m, 16) that they depend on."""
    arguments = _padded(_arguments(surface, samples, q, r))
    wanted = np.zeros((len(SHAPE), len(arguments[0])))
    wanted[kind, np.arange(len(kind))] = 1.0
    value, entry = _differentiated(*arguments, samples.size[1] / samples.size[0], wanted, form)
    points, _ = at(surface, q, r)
    return (
        np.asarray(value)[kind, np.arange(len(kind))],
        np.asarray(entry)[: len(kind)].reshape(len(kind), 48),
        points,
    )


def _arguments(surface: TubeSurface, samples: Grid, q: Floats, r: Floats) -> tuple[Floats, ...]:
    """Local nets (m, 4, 4, 3), basis functions with two derivatives per mm (m, 3, 4) in q and r, shrink and polar."""
    around, along = surface.size
    by_q = np.stack([local(surface.basis_q, q, order)[1] / around**order for order in range(3)], axis=1)
    by_r = np.stack([local(surface.basis_r, r, order)[1] / along**order for order in range(3)], axis=1)
    in_q, in_r = local(surface.basis_q, q)[0], local(surface.basis_r, r)[0]
    net = surface.net[in_r[:, :, None], in_q[:, None, :]]
    shrink, polar = (np.interp(r, samples.r, part[:, 0])[:, None] for part in (samples.shrink, samples.polar))
    return net, by_q, by_r, shrink, polar


def _padded(arrays: tuple[Floats, ...]) -> tuple[Floats, ...]:
    """The arrays filled up to one of few lengths, so that compiled code fits the next ones too."""
    count = len(arrays[0])
    length = 1 << max(9, int(np.ceil(np.log2(count))))
    return tuple(np.concatenate([array, np.repeat(array[-1:], length - count, axis=0)]) for array in arrays)


def _measures(net, by_q, by_r, shrink, polar, aspect, form: Form):
    along = jnp.einsum("mdj,mjic->mdic", by_r, net)
    fields = jnp.einsum("mei,mdic->decm", by_q, along)
    orders = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    found = _pointwise(tuple(fields[dr, dq][:, :, None] for dq, dr in orders), shrink, polar, aspect, form)
    return jnp.stack([part[:, 0] for part in found])


_at_places = jax.jit(_measures, static_argnames="form")


@partial(jax.jit, static_argnames="form")
def _differentiated(net, by_q, by_r, shrink, polar, aspect, wanted, form: Form):
    value, back = jax.vjp(lambda net: _measures(net, by_q, by_r, shrink, polar, aspect, form), net)
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
    fold = nearest_fold(tube, spec.neighbourhood, spec.distance + reach, np.arange(len(tube.x)))
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
    points = body.control_points()
    (column_a, weight_a), (column_b, weight_b) = _combination(body, one), _combination(body, other)
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
        limits.first[one.number] + cell,
        1.0 - distance / bound,
        (3 * column[..., None] + np.arange(3)).reshape(len(cell), 3 * column.shape[1]),
        (weight[..., None] * direction[:, None, :]).reshape(len(cell), 3 * column.shape[1]),
    )


def _combination(body: Body, place: _Place) -> tuple[Ints, Floats]:
    """Control points (m, k) of the body, and their weights, that make up places on a tube or its end discs."""
    surface, first = body.surfaces[place.number], body.slices[place.number].start
    samples, rings = place.surface.grid, place.surface.rings
    row, column = np.divmod(place.sample, place.surface.columns)
    on_tube = np.clip(row - rings, 0, len(samples.r) - 1)
    around = samples.q[column] + place.offset[:, 0] / surface.size[0]
    along = samples.r[on_tube] + place.offset[:, 1] / surface.size[1]
    base, tip = row < rings, row >= rings + len(samples.r)
    along = np.where(base, 0.0, np.where(tip, 1.0, along))
    numbers, weights = at(surface, around, along)
    if not rings:
        return first + numbers, weights
    # On a disc, (1 - s)·centre + s·rim with the centre the mean of the end row.
    nearest_ring = np.where(tip, len(samples.r) + 2 * rings - 1 - row, row)
    outward = np.where(tip, -1.0, 1.0) * place.offset[:, 1] * 2.0 * np.pi / surface.size[0]
    s = np.where(base | tip, samples.rings[np.minimum(nearest_ring, rings - 1)] + outward, 1.0)
    rows, columns = surface.net.shape[:2]
    end_row = np.where(tip, rows - 1, 0)[:, None] * columns + np.arange(columns)
    centre = np.repeat((1.0 - s)[:, None] / columns, columns, axis=1)
    return first + np.concatenate([numbers, end_row], axis=1), np.concatenate([s[:, None] * weights, centre], axis=1)


def _cell(limits: Sampled, number: int, surface: Target, sample: Ints) -> Ints:
    """Cells of samples; those on an end disc belong to the cells at its rim."""
    row, column = np.divmod(sample, surface.columns)
    row = np.clip(row - surface.rings, 0, len(surface.grid.r) - 1)
    around, along = limits.spans[number]
    return np.minimum(row // COARSE[1], along - 1) * around + column // COARSE[0]


def _heights(limits: Sampled, body: Body, number: int, kind: str, c: Floats, slope: Floats, reach: float) -> _Part:
    """Rows of limits c (rows, columns) on the height z, with dc/dz (rows, 1)."""
    samples, surface = limits.coarse[number], body.surfaces[number]
    row, column, cell = _worst_samples(c, 0, COARSE, limits.spans[number], -reach * float(np.abs(slope).max()))
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
        row, column, cell = _worst_samples(c, 0, COARSE, limits.spans[number], -reach / spec.distance)
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
        yield _heights(limits, body, number, "ends", c, slope, reach)


def _envelope(limits: Sampled, body: Body, field: Fields, radius: float, reach: float) -> _Part:
    samples, surface, wall = limits.coarse[0], body.exterior, limits.spec.wall
    away = np.hypot(field.x[0], field.x[1])
    row, column, cell = _worst_samples((away - radius) / wall, 0, COARSE, limits.spans[0], -reach / wall)
    numbers, weights = at(surface, samples.q[column], samples.r[row])
    direction = (field.x[:2, row, column] / away[row, column]).T
    return _Part(
        np.full(len(cell), KINDS.index("envelope")),
        limits.first[0] + cell,
        (away[row, column] - radius) / wall,
        (3 * numbers[..., None] + np.arange(2)).reshape(len(cell), 32),
        (weights[..., None] * direction[:, None, :] / wall).reshape(len(cell), 32),
    )
