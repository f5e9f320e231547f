"""Coordinates of one mould: across, up from where its negatives meet, and along the body's axis."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepPrimAPI import BRepPrimAPI_MakeWedge
from OCP.gp import gp_Ax2, gp_Ax3, gp_Dir, gp_Trsf, gp_Vec
from OCP.TopoDS import TopoDS_Shape

from pneumorph.make.mould.shapes import point, prism
from pneumorph.make.silicone.plan import SiliconePlan, Slab

Array = NDArray[np.float64]
Range = tuple[float, float]

Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Frame:
    """The frame of a mould.

    Attributes
    ----------
    origin : (3,) array
        The point of the parting plane nearest to the base's centre, mm.
    up : (3,) array
        Unit vector from negative b to negative a.
    """

    origin: Array
    up: Array

    @property
    def across(self) -> Array:
        """Unit vector that completes up and z."""
        return np.cross(self.up, Z)

    def at(self, across: float, up: float, z: float) -> Array:
        """A point (3,)."""
        return self.origin + across * self.across + up * self.up + z * Z

    def of(self, points: Array) -> Array:
        """Coordinates (n, 3) across, up and along z of points (n, 3)."""
        return (points - self.origin) @ np.stack([self.across, self.up, Z], axis=1)

    def box(self, across: Range, up: Range, z: Range) -> TopoDS_Shape:
        """A box."""
        corners = [self.at(a, up[0], b) for a, b in ((across[0], z[0]), (across[1], z[0]), (across[1], z[1]))]
        return prism([*corners, self.at(across[0], up[0], z[1])], (up[1] - up[0]) * self.up)

    def block(self, across: Range, z: Range, height: float, slope: float) -> TopoDS_Shape:
        """A block on the parting plane, whose sides draw in with the height.

        Parameters
        ----------
        across, z : (2,)
            Ranges along `Frame.across` and along z, mm.
        height : float
            Above the plane, mm; negative on side b.
        slope : float
            By how much its sides draw in per height.
        """
        size, side = (across[1] - across[0], abs(height), z[1] - z[0]), np.sign(height)
        # Its local axes are x, y = z × x upwards, and z: on side b both others are reversed.
        ahead = self.across * side
        start = self.at(across[0] if side > 0 else across[1], 0.0, z[0])
        draw = slope * abs(height)
        axes = gp_Ax2(point(start), gp_Dir(0.0, 0.0, 1.0), gp_Dir(*map(float, ahead)))
        return BRepPrimAPI_MakeWedge(axes, *size, draw, draw, size[0] - draw, size[2] - draw).Shape()


def frame_of(slab: Slab, plan: SiliconePlan) -> Frame:
    """The frame of a part's mould."""
    return Frame(slab.parting * plan.normal, slab.up)


def shifted(shape: TopoDS_Shape, by: Array) -> TopoDS_Shape:
    """A shape at another place."""
    move = gp_Trsf()
    move.SetTranslation(gp_Vec(*map(float, by)))
    # A copy: booleans and triangulations must not depend on locations inside of shapes.
    return BRepBuilderAPI_Transform(shape, move, True).Shape()


def moved(shape: TopoDS_Shape, start: Frame, stop: Frame) -> TopoDS_Shape:
    """A shape at the same coordinates of another frame."""
    move = gp_Trsf()
    axes = (
        gp_Ax3(point(each.origin), gp_Dir(0.0, 0.0, 1.0), gp_Dir(*map(float, each.across))) for each in (start, stop)
    )
    move.SetDisplacement(*axes)
    return BRepBuilderAPI_Transform(shape, move, True).Shape()
