"""Tubes: cubic B-spline surfaces over the unit square, periodic in q and clamped in r (equations (1) and (2))."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumorph.geometry.body import Body
from pneumorph.geometry.bspline import Basis, clamped, periodic
from pneumorph.geometry.regions import HalfSpace, Intersection, Region
from pneumorph.geometry.tube.smoothing import NetAverage, net_average

End = Literal["flat", "pole"]
Ends = tuple[End, End]
Vector = tuple[float, float, float]

UPWARDS: Vector = (0.0, 0.0, 1.0)

DENSITY = 3
"""Points of a shell per control point, around and along."""


@dataclass(frozen=True, eq=False)
class TubeSurface:
    """One boundary surface of the body.

    Flat ends are discs whose points (1 - s)·centre + s·rim(q) are linear in the end row's control points
    (`cap_points`).

    r runs from base to tip. q runs so that r_q × r_r points from solid to void: counter-clockwise seen from the tip on
    the exterior, clockwise on a chamber.

    Attributes
    ----------
    name : str
        "exterior" or the chamber's name.
    net : (n_r, n_q, 3) array
        Control points in mm.
    ends : two of "flat" and "pole"
        Whether base and tip are closed by discs, or their end rows are single points.
    size : (float, float)
        Circumference and length in mm of the starting surface: τ_q and τ_r of (29).
    cavity : bool
        Whether the surface bounds a chamber (void) rather than the outside of the body.
    directions : (Vector, Vector)
        Unit vectors from base to tip at base and tip: flat ends are across them, and so are surfaces at their poles.
    bonded : float
        r beyond which the surface belongs to the tip, which is bonded to the plate; 1 unless it is an exterior's pole.
    """

    name: str
    net: NDArray[np.float64]
    ends: Ends
    size: tuple[float, float]
    cavity: bool
    directions: tuple[Vector, Vector] = (UPWARDS, UPWARDS)
    bonded: float = 1.0

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether base and tip are poles."""
        base, tip = self.ends
        return base == "pole", tip == "pole"

    @property
    def n_points(self) -> int:
        """Number of control points."""
        return self.net.shape[0] * self.net.shape[1]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of the net."""
        return self.net.shape[0], self.net.shape[1]

    def control_points(self) -> NDArray[np.float64]:
        """The net row by row (r, then q), (n_points, 3) in mm."""
        return self.net.reshape(-1, 3)

    def with_control_points(self, points: NDArray[np.float64]) -> TubeSurface:
        """The same tube with other control points, (n_points, 3) in mm."""
        return replace(self, net=points.reshape(self.net.shape))

    def shell(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """A grid of points (rows, columns) and a centre of each end, and their triangles, see `Surface.shell`."""
        rows, columns = (DENSITY * count for count in self.net.shape[:2])
        q, r = np.linspace(0.0, 1.0, columns, endpoint=False), np.linspace(0.0, 1.0, rows)
        grid = self.sample(q, r)
        at_base, at_tip = self.poles
        grid = grid[int(at_base) : rows - int(at_tip)]
        number = np.arange(len(grid) * columns).reshape(-1, columns)
        beside = np.roll(number, -1, axis=1)
        a, b, c, d = number[:-1], beside[:-1], beside[1:], number[1:]
        base, tip = number.size, number.size + 1
        ends = [np.stack([beside[0], number[0], np.full(columns, base)], axis=1)]
        ends.append(np.stack([number[-1], beside[-1], np.full(columns, tip)], axis=1))
        sides = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
        return np.concatenate([grid.reshape(-1, 3), self.end_centres]), np.concatenate([*sides, *ends])

    def average(self, strength: float) -> NetAverage:
        """The average along and around the net, see `Surface.average`."""
        rows, columns = self.net.shape[:2]
        return net_average(rows, columns, strength)

    @cached_property
    def basis_q(self) -> Basis:
        """Basis around the tube."""
        return periodic(self.net.shape[1])

    @cached_property
    def basis_r(self) -> Basis:
        """Basis along the tube."""
        return clamped(self.net.shape[0] - 3)

    @cached_property
    def parallels(self) -> NDArray[np.float64]:
        """Control values (n_r,) of S(r), the circumference of the starting surface relative to τ_q; 1 without poles.

        With poles S is the spline that a tube closed by hemispheres has for its radius, so |r_q / S| = 1 on one.
        """
        if not any(self.poles):
            return np.ones(len(self.net))
        return dome_fit(self.basis_r, dome(self.basis_r, *self.size, self.poles), self.poles)

    def points(self, q: ArrayLike, r: ArrayLike, dq: int = 0, dr: int = 0) -> NDArray[np.float64]:
        """Positions in mm, or derivatives of order (dq, dr), at parameter pairs q, r (n,); shape (n, 3).

        Parameters
        ----------
        q, r : (n,) array
            Parameters of the points, in pairs.
        dq, dr : int
            Order of the derivative by q and by r.
        """
        values_r, values_q = self.basis_r.matrix(r, dr), self.basis_q.matrix(q, dq)
        return np.einsum("nj,nji->ni", values_r, np.einsum("nk,jki->nji", values_q, self.net, optimize=True))

    def sample(self, q: ArrayLike, r: ArrayLike, dq: int = 0, dr: int = 0) -> NDArray[np.float64]:
        """Positions in mm, or derivatives of order (dq, dr), on the grid of all r and q; shape (len(r), len(q), 3).

        Parameters
        ----------
        q, r : 1-D arrays
            Parameters of the grid's lines; q may have any length, r any other.
        dq, dr : int
            Order of the derivative by q and by r.
        """
        return np.einsum(
            "rj,jki,qk->rqi", self.basis_r.matrix(r, dr), self.net, self.basis_q.matrix(q, dq), optimize=True
        )

    @property
    def end_rows(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Control points (n_q, 3) of the rims at base and tip; each rim depends on its own row only."""
        return self.net[0], self.net[-1]

    @property
    def end_centres(self) -> NDArray[np.float64]:
        """Centres (2, 3) of the end discs: ∮ rim dq, which is the mean of the end row's control points."""
        return self.net[[0, -1]].mean(axis=1)


# Samples per knot span at which a starting capsule is fitted.
_FITTED = 16


def dome(basis: Basis, circumference: float, length: float, poles: tuple[bool, bool]) -> NDArray[np.float64]:
    """Radius of a tube closed by hemispheres relative to that of its cylinder, at fractions of its arc length.

    Parameters
    ----------
    basis : Basis
        Along the tube.
    circumference, length : float
        Of the cylinder, and arc length from end to end, mm.
    poles : (bool, bool)
        Whether base and tip are closed by hemispheres.
    """
    t = np.linspace(0.0, 1.0, _FITTED * basis.spans + 1)
    away = np.min([way for way, pole in zip((t, 1.0 - t), poles, strict=True) if pole], axis=0)
    # A meridian too short for its quarter circles is stretched to their length.
    angle = away * max(2.0 * np.pi * length / circumference, sum(poles) * np.pi / 2.0)
    return np.sin(np.minimum(angle, np.pi / 2.0))


def dome_fit(basis: Basis, radius: NDArray[np.float64], poles: tuple[bool, bool]) -> NDArray[np.float64]:
    """Least-squares control values (n_r, ...) for radii (n, ...) at equidistant parameters.

    They are zero at poles, and exact at flat ends.
    """
    values = basis.matrix(np.linspace(0.0, 1.0, len(radius)))
    fitted = np.zeros((basis.count, *radius.shape[1:]))
    for row, pole in zip((0, -1), poles, strict=True):
        fitted[row] = 0.0 if pole else radius[row]
    rest = radius - values[:, [0, -1]] @ fitted[[0, -1]]
    fitted[1:-1] = np.linalg.lstsq(values[:, 1:-1], rest, rcond=None)[0]
    return fitted


def between_ends(body: Body[TubeSurface]) -> Region:
    """What is between the planes of the ends of a body, which its flat ends are in."""
    (base, tip), (upwards, onwards) = body.exterior.end_rows, body.exterior.directions
    x, y, z = upwards
    return Intersection(
        (HalfSpace((-x, -y, -z), -float(base[0] @ upwards)), HalfSpace(onwards, float(tip[0] @ onwards)))
    )


def cap_points(surface: TubeSurface, tip: bool, q: ArrayLike, s: ArrayLike) -> NDArray[np.float64]:
    """Points (n, 3) in mm of an end disc, on rays from its centre (s = 0) to its rim (s = 1); linear in the net.

    Parameters
    ----------
    surface : TubeSurface
        With a flat end there.
    tip : bool
        Whether the disc is that at the tip, not at the base.
    q : (n,) array
        Parameter around.
    s : (n,) array
        Distance from the centre over that of the rim, from 0 to 1.
    """
    s = np.atleast_1d(np.asarray(s, dtype=float))[:, None]
    row = surface.end_rows[int(tip)]
    return (1.0 - s) * row.mean(axis=0) + s * (surface.basis_q.matrix(q) @ row)


def turn_to(direction: Vector) -> NDArray[np.float64]:
    """The rotation (3, 3) from z to a direction by the smallest angle."""
    x, y, z = direction
    if z < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    turned = np.array([[x * x, x * y], [x * y, y * y], [x * (1.0 + z), y * (1.0 + z)]]) / (1.0 + z)
    return np.column_stack([np.eye(3)[:, :2] - turned, direction])


def enclosed_volume(surface: TubeSurface) -> float:
    """Volume in mm³ inside the surface and its ends, which are poles or planes across its directions.

    The divergence theorem is used with the field x/3; the quadrature is exact.
    """
    q, weights_q = _gauss(surface.basis_q.breaks)
    r, weights_r = _gauss(surface.basis_r.breaks)
    normal = np.cross(surface.sample(q, r, dq=1), surface.sample(q, r, dr=1))
    flux = np.einsum("rqi,rqi->rq", surface.sample(q, r), normal)
    total = float(weights_r @ flux @ weights_q)
    for pole, direction, row, sign in zip(
        surface.poles, surface.directions, surface.end_rows, (-1.0, 1.0), strict=True
    ):
        if pole:
            continue
        rim, along = surface.basis_q.matrix(q) @ row, surface.basis_q.matrix(q, 1) @ row
        # The flux through a plane is its distance times its area.
        total += sign * float(row[0] @ direction) * 0.5 * float(weights_q @ np.cross(rim, along) @ direction)
    return (-1.0 if surface.cavity else 1.0) * total / 3.0


def _gauss(breaks: NDArray[np.float64], order: int = 5) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss points and weights on every span; five points are exact for a product of three cubics."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    half = np.diff(breaks)[:, None] / 2.0
    return (breaks[:-1, None] + half * (1.0 + nodes)).ravel(), (half * weights).ravel()
