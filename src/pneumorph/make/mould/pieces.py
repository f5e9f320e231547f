"""The pieces of a mould as solids in OpenCASCADE, at their places in the assembly."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeSphere,
)
from OCP.collections import List_TopoDS_Shape
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec
from OCP.TopoDS import TopoDS_Shape

from pneumorph.errors import ComputationError
from pneumorph.make.mould.plan import PLATE, RECESS, Plan
from pneumorph.make.mould.release import sectors
from pneumorph.make.mould.stems import INTO, Stem
from pneumorph.make.solid import filled, solid

Array = NDArray[np.float64]
Role = Literal["mould", "core", "product", "mount"]

ROD, SCREW = 4.5, 3.4
"""Diameters in mm of clearance holes for M4 rods that hold the mould together and for M3 screws of the clamp."""

_GATE, _FUNNEL, _VENT = 2.0, 6.0, 0.6  # radii
_KEY, _KEY_HEIGHT = 2.2, 0.7  # radius of the spheres that align the pieces, and how far they stand out
_PRY = (10.0, 2.0, 3.0)  # slots for a screwdriver: height, width, depth
_TIGHT = 1.0  # length next to the rubber on which stems have no clearance
_CLAMP = 4.0  # thickness of the clamp's parts
_SQUEEZE = 0.85  # of the flange's thickness, which the clamp leaves


@dataclass(frozen=True, eq=False)
class Piece:
    """One part: a solid with a name.

    Attributes
    ----------
    name : str
    role : "mould", "core", "product" or "mount"
        Parts of the mould, cores that are cast in, the rubber part itself, and what holds it in use.
    shape : TopoDS_Shape
        At its place in the mould; parts of the mount are placed about the finished body.
    """

    name: str
    role: Role
    shape: TopoDS_Shape


def pieces(plan: Plan) -> list[Piece]:
    """Build everything: the rubber part, the cores, the outer mould, base plate and lid, and the mount."""
    exterior = solid([plan.body.exterior])
    flange = _cylinder((0, 0, plan.bottom), (0, 0, 1), plan.flange, -plan.bottom)
    made = [Piece("body", "product", _product(plan, flange)), *_cores(plan)]
    block = _cylinder((0, 0, plan.bottom), (0, 0, 1), plan.outer, plan.length - plan.bottom)
    outside = [exterior, flange, *(_seat(plan, stem) for stem in plan.stems if stem.way == "side")]
    outside += [_vent(plan, top) for top in plan.vents]
    outside += [_pry(plan, angle) for angle in plan.angles]
    outer = _cut(block, outside)
    ranges = sectors(list(plan.angles))
    for number, (start, stop) in enumerate(ranges, start=1):
        piece = _common(outer, _wedge(start, stop, plan))
        piece = _fuse(piece, [_key(plan, stop, height, 0.0) for height in _key_heights(plan, stop)])
        gap = plan.spec.clearance
        piece = _cut(piece, [_key(plan, start, height, gap) for height in _key_heights(plan, start)])
        made.append(Piece(f"outer-{number}", "mould", piece))
    made += [Piece("base", "mould", _base(plan)), Piece("lid", "mould", _lid(plan))]
    return [*made, *_mount(plan)]


def _product(plan: Plan, flange: TopoDS_Shape) -> TopoDS_Shape:
    """The rubber part as it comes out of the mould: the body with its flange, and a hole for every stem."""
    holes = []
    for stem in plan.stems:
        reach = 4.0 * plan.outer if stem.way == "side" else 2.0 * plan.length
        holes.append(_cylinder(stem.start, stem.direction, plan.stem, reach))
    return _cut(_fuse(solid(plan.body.surfaces), [flange]), holes)


def _cores(plan: Plan) -> list[Piece]:
    """The chambers with their stems, whose ends are flattened so that a core cannot turn."""
    found = []
    for chamber, core in zip(plan.body.chambers, plan.cores, strict=True):
        shape = solid([filled(chamber)])
        for stem in core.stems:
            bar = _cylinder(stem.start, stem.direction, plan.stem, _reach(plan, stem))
            shape = _fuse(shape, [_cut(bar, [_flat(plan, stem, 0.0)])])
        found.append(Piece(f"core-{core.chamber}", "core", shape))
    return found


def _reach(plan: Plan, stem: Stem) -> float:
    """Length of a stem from its start to the outside of the mould."""
    if stem.way == "side":
        return plan.outer - float(stem.start @ stem.direction)
    end = plan.length + PLATE if stem.way == "tip" else plan.bottom - PLATE
    return abs(end - float(stem.start[2]))


def _flat(plan: Plan, stem: Stem, gap: float) -> TopoDS_Shape:
    """What is taken off the last `RECESS` mm of a stem: everything beyond a plane beside its axis."""
    aside = np.array([0.0, 0.0, 1.0]) if stem.way == "side" else np.array([1.0, 0.0, 0.0])
    end = stem.start + _reach(plan, stem) * stem.direction
    across = np.cross(stem.direction, aside)
    corner = end - RECESS * stem.direction + (0.55 * plan.stem + gap) * aside - 2.0 * plan.stem * across
    steps = [4.0 * plan.stem * across, 2.0 * plan.stem * aside]
    return _prism([corner, corner + steps[0], corner + steps[0] + steps[1], corner + steps[1]], 8.0 * stem.direction)


def _seat(plan: Plan, stem: Stem) -> TopoDS_Shape:
    """The hole for a stem in the mould, with its flat.

    Next to the rubber it is as narrow as the stem: rubber would run into a gap.
    """
    gap = plan.spec.clearance / 2.0
    # The hole begins in the rubber, which is cut out anyway.
    start = stem.start + (stem.wall * 0.5) * stem.direction
    length = _reach(plan, stem) - stem.wall * 0.5 + 1.0
    flange = -plan.bottom if stem.way == "base" else 0.0
    tight = INTO + stem.wall * 0.5 + flange + _TIGHT
    wide = _cylinder(start + tight * stem.direction, stem.direction, plan.stem + gap, length - tight)
    bar = _fuse(_cylinder(start, stem.direction, plan.stem, tight + 0.5 * _TIGHT), [wide])
    return _cut(bar, [_flat(plan, stem, gap)])


def _vent(plan: Plan, top: Array) -> TopoDS_Shape:
    outward = np.array([top[0], top[1], 0.0]) / max(float(np.hypot(top[0], top[1])), 1e-9)
    return _cylinder(top - [0.0, 0.0, 0.5 * _VENT] - 0.5 * outward, outward, _VENT, 2.0 * plan.outer)


def _pry(plan: Plan, angle: float) -> TopoDS_Shape:
    """A slot across a parting, half way up the outside."""
    height, width, depth = _PRY
    radial, across = _radial(angle), _across(angle)
    corner = (plan.outer - depth) * radial - 0.5 * width * across + [0.0, 0.0, plan.length / 2.0 - height / 2.0]
    far = 2.0 * depth * radial
    return _prism([corner, corner + far, corner + far + width * across, corner + width * across], (0, 0, height))


def _key_heights(plan: Plan, angle: float) -> list[float]:
    """Heights of the keys on a parting, away from stems and from the pry slot."""
    taken = [plan.length / 2.0]
    taken += [float(stem.start[2]) for stem in plan.stems if stem.way == "side" and _same(stem.angle, angle)]
    room = _PRY[0] / 2.0 + _KEY + 1.0
    free = [
        height
        for height in np.linspace(RECESS + _KEY, plan.length - RECESS - _KEY, 41)
        if min(abs(height - each) for each in taken) > room
    ]
    return [] if not free else [free[0], free[-1]]


def _key(plan: Plan, angle: float, height: float, gap: float) -> TopoDS_Shape:
    """A spherical cap on a parting, pointing in the direction of growing angles; a larger one with a gap."""
    centre = (plan.outer - plan.spec.mould_wall / 2.0) * _radial(angle) - (_KEY - _KEY_HEIGHT) * _across(angle)
    return BRepPrimAPI_MakeSphere(_point(centre + np.array([0.0, 0.0, height])), _KEY + gap).Shape()


def _base(plan: Plan) -> TopoDS_Shape:
    """The plate under the flange: it holds the cores' stems, and its rim holds the outer mould."""
    plate = _plate(plan, plan.bottom - PLATE, plan.bottom, plan.bottom + RECESS)
    return _cut(plate, [_seat(plan, stem) for stem in plan.stems if stem.way == "base"])


def _lid(plan: Plan) -> TopoDS_Shape:
    """The plate over the tip, with the gate through which rubber is poured, and vents at the edge of the tip."""
    top = plan.length
    plate = _plate(plan, top, top + PLATE, top - RECESS)
    openings = [_seat(plan, stem) for stem in plan.stems if stem.way == "tip"]
    gate, vents = _openings(plan)
    axis = gp_Ax2(_point([*gate, top - 0.01]), gp_Dir(0, 0, 1))
    openings.append(BRepPrimAPI_MakeCone(axis, _GATE, _FUNNEL, PLATE + 0.02).Shape())
    openings += [_cylinder([*vent, top - 1.0], (0, 0, 1), _VENT, PLATE + 2.0) for vent in vents]
    return _cut(plate, openings)


def _openings(plan: Plan) -> tuple[Array, list[Array]]:
    """Places (x, y) on the tip of the gate, and of three vents near the rim, away from stems and from the gate."""
    rim = plan.body.exterior.sample(np.linspace(0.0, 1.0, 24, endpoint=False), [1.0])[0][:, :2]
    middle = rim.mean(axis=0)
    stems = [stem.start[:2] for stem in plan.stems if stem.way == "tip"]
    options = [middle, *(middle + 0.5 * (rim - middle))]
    gate = max(options, key=lambda p: min([10.0, *(float(np.hypot(*(p - stem))) for stem in stems)]))
    inside = middle + 0.85 * (rim - middle)
    vents = [
        place
        for place in inside[::8]
        if min(float(np.hypot(*(place - each))) for each in [*stems, gate]) > _GATE + plan.stem
    ]
    return gate, vents


def _plate(plan: Plan, low: float, high: float, rim: float) -> TopoDS_Shape:
    """A square plate with a rim that embraces the outer mould up to the height `rim`, and holes for four rods."""
    inner = plan.outer + plan.spec.clearance
    wide = inner + plan.spec.mould_wall
    hole = (wide + ROD / 2.0 + 1.0) / np.sqrt(2.0)
    half = max(wide, hole + ROD / 2.0 + 4.0)
    plate = BRepPrimAPI_MakeBox(_point([-half, -half, low]), _point([half, half, high])).Shape()
    edge = high if rim > high else low
    start, height = min(edge, rim), abs(rim - edge)
    # The rim begins inside the plate: faces that only touch are the hard case of a union.
    ring = _cut(
        _cylinder((0, 0, start - 1.0), (0, 0, 1), wide, height + 2.0),
        [
            _cylinder((0, 0, start - 2.0), (0, 0, 1), inner, height + 4.0),
            _cylinder((0, 0, rim if rim > high else rim - 2.0), (0, 0, 1), 2.0 * wide, 2.0),
        ],
    )
    rods = [
        _cylinder((x * hole, y * hole, low - 1.0), (0, 0, 1), ROD / 2.0, high - low + 2.0)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    return _cut(_fuse(plate, [ring]), rods)


def _mount(plan: Plan) -> list[Piece]:
    """What holds the finished part: a plate with holes for tubes, two half rings that clamp the flange, a tip plate.

    The rings leave less room than the flange is thick and so seal it.
    """
    gap, thick = plan.spec.clearance, plan.spec.flange.thickness
    inner = plan.flange - plan.spec.flange.width + 2.0 * gap
    wide = plan.flange + 10.0
    low = -_SQUEEZE * thick
    ring = _cut(
        _cylinder((0, 0, low), (0, 0, 1), wide, _CLAMP - low),
        [
            _cylinder((0, 0, -1.0), (0, 0, 1), inner, _CLAMP + 2.0),
            _cylinder((0, 0, low - 1.0), (0, 0, 1), plan.flange + gap, 1.0 - low),
        ],
    )
    angles = np.radians(np.arange(30.0, 390.0, 60.0))
    middle = plan.flange + 5.0
    screws = [
        _cylinder((middle * np.cos(a), middle * np.sin(a), low - 2.0 * PLATE), (0, 0, 1), SCREW / 2.0, 4.0 * PLATE)
        for a in angles
    ]
    ring = _cut(ring, screws)
    halves = [_common(ring, _wedge(start, start + np.pi, plan)) for start in (0.0, np.pi)]
    tubes = [
        _cylinder([*stem.start[:2], low - 2.0 * PLATE], (0, 0, 1), plan.spec.tube / 2.0 + gap, 4.0 * PLATE)
        for stem in plan.stems
        if stem.way == "base"
    ]
    plate = _cut(_cylinder((0, 0, low - _CLAMP), (0, 0, 1), wide, _CLAMP), [*screws, *tubes])
    rim = plan.body.exterior.net[-1]
    centre = rim.mean(axis=0)
    radius = float(np.hypot(*(rim - centre)[:, :2].T).min())
    tip = _cylinder(centre, (0, 0, 1), radius, 3.0)
    tip = _cut(tip, [_cylinder(centre - [0.0, 0.0, 1.0], (0, 0, 1), SCREW / 2.0, 5.0)])
    return [
        Piece("clamp-1", "mount", halves[0]),
        Piece("clamp-2", "mount", halves[1]),
        Piece("mount", "mount", plate),
        Piece("tip-plate", "mount", tip),
    ]


def _wedge(start: float, stop: float, plan: Plan) -> TopoDS_Shape:
    """A sector about z, wider and higher than everything."""
    far, low = 8.0 * plan.outer, plan.bottom - 10.0 * PLATE
    angles = np.linspace(start, stop, 5)
    corners = [np.array([0.0, 0.0, low]), *(far * _radial(angle) + [0.0, 0.0, low] for angle in angles)]
    return _prism(corners, (0, 0, plan.length - low + 10.0 * PLATE))


def _radial(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def _across(angle: float) -> Array:
    return np.array([-np.sin(angle), np.cos(angle), 0.0])


def _same(one: float, other: float) -> bool:
    return abs((one - other + np.pi) % (2.0 * np.pi) - np.pi) < 1e-6


def _point(coordinates: Sequence[float] | Array) -> gp_Pnt:
    return gp_Pnt(*map(float, coordinates))


def _cylinder(start: Sequence[float] | Array, direction: Sequence[float] | Array, radius: float, height: float):
    axis = gp_Ax2(_point(start), gp_Dir(*map(float, direction)))
    return BRepPrimAPI_MakeCylinder(axis, float(radius), float(height)).Shape()


def _prism(corners: Sequence[Array], along: Sequence[float] | Array) -> TopoDS_Shape:
    polygon = BRepBuilderAPI_MakePolygon()
    for corner in corners:
        polygon.Add(_point(corner))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(*map(float, along))).Shape()


def _fuse(shape: TopoDS_Shape, others: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    return _boolean(BRepAlgoAPI_Fuse(), shape, others)


def _cut(shape: TopoDS_Shape, others: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    return _boolean(BRepAlgoAPI_Cut(), shape, others)


def _common(shape: TopoDS_Shape, other: TopoDS_Shape) -> TopoDS_Shape:
    return _boolean(BRepAlgoAPI_Common(), shape, [other])


def _boolean(operation, shape: TopoDS_Shape, others: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    if not others:
        return shape
    arguments, tools = List_TopoDS_Shape(), List_TopoDS_Shape()
    arguments.Append(shape)
    for other in others:
        tools.Append(other)
    operation.SetArguments(arguments)
    operation.SetTools(tools)
    operation.Build()
    if not operation.IsDone():
        raise ComputationError("OpenCASCADE could not combine two solids of the mould; try another make.mould_wall")
    return operation.Shape()
