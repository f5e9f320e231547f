"""Tensor grids of samples on the surfaces, at which the limited quantities are evaluated.

Derivatives are taken per millimetre of the starting tube: with respect to q·τ_q and r·τ_r, so that E = G = 1 on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray

from pneumorph.geometry.tube.local import nonzero_functions
from pneumorph.geometry.tube.surface import TubeSurface, Vector
from pneumorph.limits.tube.measures.pole_frame import Frame, frame
from pneumorph.limits.tube.measures.spline_fields import combined

Orders = tuple[tuple[int, int], ...]


class SampledFields(NamedTuple):
    """Position and its derivatives on a grid, each (3, rows, columns): components first, then r, then q."""

    x: Any
    q: Any
    r: Any
    qq: Any
    qr: Any
    rr: Any


@dataclass(frozen=True, eq=False)
class Grid:
    """Samples of one surface at equal steps in q and r, knots and ends included.

    Attributes
    ----------
    name, cavity, size, directions
        See `TubeSurface`.
    net_shape : (int, int)
        Rows and columns of the control net.
    q, r : (columns,) and (rows,) arrays
        Parameters of the samples; q = 1 is left out because it is q = 0.
    values_q, values_r : three arrays each
        Basis functions and their first two derivatives per mm, (columns, n_q) and (rows, n_r).
    frame : Frame
        Functions of r for tangents that are finite up to the poles.
    rings : (m,) array
        Fractions s of the rings of samples on an end disc, from the centre (s = 0) outwards, excluding the rim.
    flat : (bool, bool)
        Whether base and tip are closed by such discs, not by poles.
    support_q, support_r : (columns, 4) and (rows, 4) arrays
        Indices of the control net's columns and rows on which each sample depends.
    """

    name: str
    cavity: bool
    size: tuple[float, float]
    directions: tuple[Vector, Vector]
    net_shape: tuple[int, int]
    q: NDArray[np.float64]
    r: NDArray[np.float64]
    values_q: tuple[NDArray[np.float64], ...]
    values_r: tuple[NDArray[np.float64], ...]
    frame: Frame
    rings: NDArray[np.float64]
    flat: tuple[bool, bool]
    support_q: NDArray[np.integer]
    support_r: NDArray[np.integer]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of samples on the tube."""
        return len(self.r), len(self.q)

    @property
    def on_discs(self) -> tuple[int, int]:
        """Numbers of rings of samples on the end discs at base and tip."""
        base, tip = (len(self.rings) if flat else 0 for flat in self.flat)
        return base, tip

    @property
    def step(self) -> tuple[float, float]:
        """Distances in mm between neighbouring samples along q and r on the starting tube."""
        return self.size[0] / len(self.q), self.size[1] / (len(self.r) - 1)

    def combine(self, net: NDArray[np.float64], functions: NDArray[np.float64], orders: Orders) -> NDArray[np.float64]:
        """Fields (m, 3, rows, columns) of the control net (n_r, n_q, 3), by the rows and columns that affect a sample.

        Parameters
        ----------
        functions : (k, 3, rows, 4) array
            Functions of r for each component, see `restricted`.
        orders : m pairs (int, int)
            Index of the function of r, and order of the derivative in q, for each field.
        """
        net = np.ascontiguousarray(np.moveaxis(net, 2, 0))
        return combined(net, self.support_r, functions, self.support_q, self.local_q, np.array(orders))

    def restricted(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Functions of r (..., rows, n_r) restricted to the net's rows that affect each sample, (..., rows, 4)."""
        return np.take_along_axis(values, np.broadcast_to(self.support_r, (*values.shape[:-1], 4)), axis=-1)

    @cached_property
    def local_q(self) -> NDArray[np.float64]:
        """The nonzero basis functions in q and their first two derivatives per mm, (3, columns, 4)."""
        return np.stack([np.take_along_axis(values, self.support_q, axis=1) for values in self.values_q])

    @cached_property
    def local_r(self) -> NDArray[np.float64]:
        """The same in r, repeated for each component: (3, 3, rows, 4)."""
        return np.repeat(self.restricted(np.stack(self.values_r))[:, None], 3, axis=1)

    @cached_property
    def local_frame(self) -> NDArray[np.float64]:
        """The first four functions of the frame, (4, 3, rows, 4): `across`, `along`, `across_r`, `along_r`."""
        return self.restricted(np.stack(self.frame[:4]))

    def positions(self, net: Array) -> Array:
        """Positions (3, rows, columns) on the tube for the control net (n_r, n_q, 3)."""
        return jnp.matmul(jnp.einsum("Rr,rqc->cRq", self.values_r[0], net), self.values_q[0].T)

    def fields(self, net: Array) -> SampledFields:
        """Position and derivatives on the tube for the control net (n_r, n_q, 3)."""
        along = [jnp.einsum("Rr,rqc->cRq", values, net) for values in self.values_r]
        orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        return SampledFields(*(jnp.matmul(along[dr], self.values_q[dq].T) for dq, dr in orders))


def grid(surface: TubeSurface, per_span: tuple[int, int]) -> Grid:
    """Build the samples of a surface with the given numbers of steps per knot span in q and r."""
    n_r, n_q = surface.net.shape[:2]
    tau_q, tau_r = surface.size
    q = np.arange(per_span[0] * n_q) / (per_span[0] * n_q)
    r = np.linspace(0.0, 1.0, per_span[1] * surface.basis_r.spans + 1)
    base, tip = surface.poles
    count = max(2, round(tau_q / (2.0 * np.pi) / (tau_r / (len(r) - 1))))
    return Grid(
        name=surface.name,
        cavity=surface.cavity,
        size=surface.size,
        directions=surface.directions,
        net_shape=(n_r, n_q),
        q=q,
        r=r,
        values_q=tuple(surface.basis_q.matrix(q, order) / tau_q**order for order in range(3)),
        values_r=tuple(surface.basis_r.matrix(r, order) / tau_r**order for order in range(3)),
        frame=frame(surface, r),
        rings=np.arange(count) / count,
        flat=(not base, not tip),
        support_q=nonzero_functions(surface.basis_q, q)[0],
        support_r=nonzero_functions(surface.basis_r, r)[0],
    )


def sampled_fields(surface: TubeSurface, grid: Grid) -> SampledFields:
    """Position and derivatives to second order at the samples of a tube, each (3, rows, columns)."""
    orders = ((0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (2, 0))
    return SampledFields(*grid.combine(surface.net, grid.local_r, orders))


def with_discs(fields: SampledFields, grid: Grid) -> SampledFields:
    """The fields of a chamber with its end discs: rings of the base disc, the tube, rings of the tip disc.

    Points of the discs are (1 - s)·centre + s·rim(q), with s times the starting radius as second parameter. Ends that
    are poles are closed already.
    """
    radius = grid.size[0] / (2.0 * np.pi)

    def disc(row: int, rings: NDArray[np.float64], outward: float) -> SampledFields:
        s = rings[:, None]
        rim, rim_q, rim_qq = (field[:, row, None] for field in (fields.x, fields.q, fields.qq))
        centre = rim.mean(axis=2, keepdims=True)
        ray = outward * (rim - centre) / radius
        whole = (3, len(rings), rim.shape[2])
        return SampledFields(
            x=centre + s * (rim - centre),
            q=s * rim_q,
            r=np.broadcast_to(ray, whole),
            qq=s * rim_qq,
            qr=np.broadcast_to(outward * rim_q / radius, whole),
            rr=np.zeros(whole),
        )

    base, tip = grid.flat
    parts = [disc(0, grid.rings, 1.0)] if base else []
    parts += [fields, disc(-1, grid.rings[::-1], -1.0)] if tip else [fields]
    return SampledFields(*(np.concatenate(each, axis=1) for each in zip(*parts, strict=True)))


def closed_positions(x: Array, grid: Grid) -> Array:
    """The positions of `with_discs` alone, (3, rows with discs, columns) from (3, rows, columns)."""
    s = grid.rings[:, None]

    def disc(rim: Array, s: NDArray[np.float64]) -> Array:
        centre = rim.mean(axis=2, keepdims=True)
        return centre + s * (rim - centre)

    base, tip = grid.flat
    parts = [disc(x[:, :1], s)] if base else []
    parts += [x, disc(x[:, -1:], s[::-1])] if tip else [x]
    return jnp.concatenate(parts, axis=1)


def every_second(grid: Grid) -> NDArray[np.int64]:
    """Indices of every second sample of a tube in both directions."""
    rows, columns = grid.shape
    return np.arange(rows * columns).reshape(rows, columns)[::2, ::2].ravel()
