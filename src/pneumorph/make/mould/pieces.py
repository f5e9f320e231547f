"""The pieces of a mould as solids in OpenCASCADE, at their places in the assembly."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeSphere
from OCP.TopoDS import TopoDS_Shape

from pneumorph.make.checks import manifold
from pneumorph.make.mould.piece import Piece
from pneumorph.make.mould.plan import FUNNEL, GATE, PLATE, RECESS, VENT, Plan, SplitPlan
from pneumorph.make.mould.release import sectors
from pneumorph.make.mould.shapes import across, common, cone, cut, cylinder, fuse, point, prism, radial
from pneumorph.make.mould.split import Keys, room_for_key, split
from pneumorph.make.mould.stems import INTO, Stem, roomiest
from pneumorph.make.mould.tessellation import tessellated
from pneumorph.make.solid import fill_chamber, solid

Array = NDArray[np.float64]

ROD, SCREW = 4.5, 3.4
"""Diameters in mm of clearance holes for M4 rods that hold the mould together and for M3 screws of the clamp."""

PRY = (10.0, 2.0, 3.0)
"""Length, width and depth in mm of the slots for a screwdriver."""

_KEY, _KEY_HEIGHT = 2.2, 0.7  # radius of the spheres that align the pieces, and how far they stand out
_TIGHT = 1.0  # length next to the rubber on which stems have no clearance
_CLAMP = 4.0  # thickness of the clamp's parts
_SQUEEZE = 0.85  # of the flange's thickness, which the clamp leaves


def pieces(plan: SplitPlan) -> list[Piece]:
    """Build everything: the rubber part, the cores, the outer mould, base plate and lid, and the mount."""
    made = [Piece("body", "product", product(plan)), *_cores(plan)]
    block = _block(plan)
    outside = [
        solid([plan.body.exterior]),
        flange(plan),
        *(_seat(plan, stem) for stem in plan.stems if stem.way == "side"),
    ]
    outside += [_vent(plan, top) for top in plan.vents]
    outside += [_pry(plan, angle) for angle in plan.angles]
    outer = cut(block, outside)
    ranges = sectors(list(plan.angles))
    for number, (start, stop) in enumerate(ranges, start=1):
        piece = common(outer, _wedge(start, stop, plan))
        piece = fuse(piece, [_key(plan, stop, height, 0.0) for height in _key_heights(plan, stop)])
        gap = plan.spec.clearance
        piece = cut(piece, [_key(plan, start, height, gap) for height in _key_heights(plan, start)])
        made += split(Piece(f"outer-{number}", "mould", piece), plan, _taken(plan), _keys_across(plan, start, stop))
    for piece in (Piece("base", "mould", _base(plan)), Piece("lid", "mould", _lid(plan)), *mount(plan)):
        made += split(piece, plan, [], lambda height: [])  # not split, but refused if it is too large
    return made


def _block(plan: SplitPlan) -> TopoDS_Shape:
    """The outside of the mould: round, with a draft at both ends, over which the plates fit."""
    height, slope = plan.length - plan.bottom, plan.slope
    block = cylinder((0, 0, plan.bottom), (0, 0, 1), plan.outer, height)
    narrow = plan.outer - (RECESS + 1.0) * slope
    wide = narrow + (height + 2.0) * slope
    for start, way in ((plan.bottom - 1.0, 1), (plan.length + 1.0, -1)):
        block = common(block, cone((0, 0, start), (0, 0, way), narrow, wide, height + 2.0))
    return block


def flange(plan: Plan) -> TopoDS_Shape:
    """The rubber flange under the body."""
    return cylinder((0, 0, plan.bottom), (0, 0, 1), plan.flange, -plan.bottom)


def product(plan: Plan) -> TopoDS_Shape:
    """The rubber part as it comes out of the mould: the body with its flange, and a hole for every stem."""
    holes = []
    for stem in plan.stems:
        reach = 4.0 * plan.outer if stem.way == "side" else 2.0 * plan.length
        holes.append(cylinder(stem.start, stem.direction, plan.stem, reach))
    return cut(fuse(solid(plan.body.surfaces), [flange(plan)]), holes)


def _cores(plan: SplitPlan) -> list[Piece]:
    """The chambers with their stems, whose ends are flattened so that a core cannot turn."""
    cores = []
    for chamber, core in zip(plan.body.chambers, plan.cores, strict=True):
        shape = solid([fill_chamber(chamber)])
        for stem in core.stems:
            shape = fuse(shape, [cut(_bar(plan, stem), [_flat(plan, stem, 0.0)])])
        piece = Piece(f"core-{core.chamber}", "core", shape)
        sideways = [(float(stem.start[2]), plan.stem + 1.0) for stem in core.stems if stem.way == "side"]
        cores += split(piece, plan, sideways, _key_inside(shape))
    return cores


def _key_inside(core: TopoDS_Shape) -> Keys:
    """One key in the middle of the largest circle inside a section of a core."""
    solid_core = manifold(tessellated(core, 0.1).triangles)

    @cache
    def keys(height: float) -> list[tuple[Array, float]]:
        loops = [np.asarray(loop)[:, :2] for loop in solid_core.slice(height).to_polygons()]
        if len(loops) != 1:
            return []  # a fold
        place, room = roomiest(loops[0])
        radius = room_for_key(room, _KEY)
        return [] if radius is None else [(place, radius)]

    return keys


def _bar(plan: SplitPlan, stem: Stem) -> TopoDS_Shape:
    """A stem: round in the rubber and next to it, with a draft inside the plates, out of which it is pulled."""
    length, round_part, slope = _reach(plan, stem), _tight(plan, stem), _taper(plan, stem)
    bar = cylinder(stem.start, stem.direction, plan.stem, length)
    first = plan.stem + (round_part + 1.0) * slope
    return common(
        bar, cone(stem.start - stem.direction, stem.direction, first, first - (length + 2.0) * slope, length + 2.0)
    )


def _tight(plan: SplitPlan, stem: Stem) -> float:
    """Length of a stem on which the mould has no clearance around it: in the rubber, and a little farther."""
    return INTO + stem.wall + (-plan.bottom if stem.way == "base" else 0.0) + _TIGHT


def _taper(plan: SplitPlan, stem: Stem) -> float:
    """Slope of a stem inside a plate. Stems in a parting need none; a thin stem must not become much thinner."""
    return 0.0 if stem.way == "side" else min(plan.slope, 0.2 * plan.stem / (PLATE - _TIGHT))


def _reach(plan: SplitPlan, stem: Stem) -> float:
    """Length of a stem from its start to the outside of the mould."""
    if stem.way == "side":
        return plan.outer - float(stem.start @ stem.direction)
    end = plan.length + PLATE if stem.way == "tip" else plan.bottom - PLATE
    return abs(end - float(stem.start[2]))


def _flat(plan: SplitPlan, stem: Stem, gap: float) -> TopoDS_Shape:
    """What is taken off the last `RECESS` mm of a stem: everything beyond a plane beside its axis."""
    aside = np.array([0.0, 0.0, 1.0]) if stem.way == "side" else np.array([1.0, 0.0, 0.0])
    end = stem.start + _reach(plan, stem) * stem.direction
    across = np.cross(stem.direction, aside)
    corner = end - RECESS * stem.direction + (0.55 * plan.stem + gap) * aside - 2.0 * plan.stem * across
    steps = [4.0 * plan.stem * across, 2.0 * plan.stem * aside]
    return prism([corner, corner + steps[0], corner + steps[0] + steps[1], corner + steps[1]], 8.0 * stem.direction)


def _seat(plan: SplitPlan, stem: Stem) -> TopoDS_Shape:
    """The hole for a stem in the mould, with its flat.

    Next to the rubber it is as narrow as the stem: rubber would run into a gap.
    """
    gap = plan.spec.clearance / 2.0
    # The hole begins in the rubber, which is cut out anyway.
    start, tight, length = stem.wall * 0.5, _tight(plan, stem), _reach(plan, stem) + 1.0
    close = cylinder(stem.start + start * stem.direction, stem.direction, plan.stem, tight - start + 0.5 * _TIGHT)
    radius = plan.stem + gap
    last = radius - (length - tight) * _taper(plan, stem)
    wide = cone(stem.start + tight * stem.direction, stem.direction, radius, last, length - tight)
    return cut(fuse(close, [wide]), [_flat(plan, stem, gap)])


def _vent(plan: SplitPlan, top: Array) -> TopoDS_Shape:
    outward = np.array([top[0], top[1], 0.0]) / max(float(np.hypot(top[0], top[1])), 1e-9)
    return cylinder(top - [0.0, 0.0, 0.5 * VENT] - 0.5 * outward, outward, VENT, 2.0 * plan.outer)


def _pry(plan: SplitPlan, angle: float) -> TopoDS_Shape:
    """A slot across a parting, half way up the outside."""
    height, width, depth = PRY
    far, wide = 2.0 * depth * radial(angle), width * across(angle)
    corner = (plan.outer - depth) * radial(angle) - 0.5 * wide + [0.0, 0.0, plan.length / 2.0 - height / 2.0]
    return prism([corner, corner + far, corner + far + wide, corner + wide], (0, 0, height))


def _key_heights(plan: SplitPlan, angle: float) -> list[float]:
    """Heights of the keys on a parting, away from stems and from the pry slot."""
    taken = [plan.length / 2.0]
    taken += [float(stem.start[2]) for stem in plan.stems if stem.way == "side" and _same(stem.angle, angle)]
    room = PRY[0] / 2.0 + _KEY + 1.0
    free = [
        height
        for height in np.linspace(RECESS + _KEY, plan.length - RECESS - _KEY, 41)
        if min(abs(height - each) for each in taken) > room
    ]
    return [] if not free else [free[0], free[-1]]


def _key(plan: SplitPlan, angle: float, height: float, gap: float) -> TopoDS_Shape:
    """A spherical cap on a parting, pointing in the direction of growing angles; a larger one with a gap."""
    centre = (plan.outer - plan.spec.mould_wall / 2.0) * radial(angle) - (_KEY - _KEY_HEIGHT) * across(angle)
    return BRepPrimAPI_MakeSphere(point(centre + np.array([0.0, 0.0, height])), _KEY + gap).Shape()


def _taken(plan: SplitPlan) -> list[tuple[float, float]]:
    """Heights at which outer pieces must not be split, with distances: pry slots, keys, stems, vents and the plates."""
    heights = [(plan.length / 2.0, PRY[0] / 2.0 + 1.0), (plan.bottom, RECESS + 1.0), (plan.length, RECESS + 1.0)]
    heights += [(height, _KEY + 0.5) for angle in plan.angles for height in _key_heights(plan, angle)]
    heights += [(float(stem.start[2]), plan.stem + 1.0) for stem in plan.stems if stem.way == "side"]
    return heights + [(float(top[2]), VENT + 1.0) for top in plan.vents]


def _keys_across(plan: SplitPlan, start: float, stop: float) -> Keys:
    """Two keys in the outside wall of a sector, at every height."""
    radius = room_for_key(plan.spec.mould_wall / 2.0, _KEY)
    middle = plan.outer - plan.spec.mould_wall / 2.0
    places = [(middle * radial(start + share * (stop - start)))[:2] for share in (0.25, 0.75)]
    return lambda height: [] if radius is None else [(place, radius) for place in places]


def _base(plan: SplitPlan) -> TopoDS_Shape:
    """The plate under the flange: it holds the cores' stems, and its rim holds the outer mould."""
    plate = _plate(plan, plan.bottom - PLATE, plan.bottom, plan.bottom + RECESS)
    return cut(plate, [_seat(plan, stem) for stem in plan.stems if stem.way == "base"])


def _lid(plan: SplitPlan) -> TopoDS_Shape:
    """The plate over the tip, with the gate through which rubber is poured, and vents at the edge of the tip."""
    top = plan.length
    plate = _plate(plan, top, top + PLATE, top - RECESS)
    openings = [_seat(plan, stem) for stem in plan.stems if stem.way == "tip"]
    gate, vents = _openings(plan)
    openings.append(cone([*gate, top - 0.01], (0, 0, 1), GATE, FUNNEL, PLATE + 0.02))
    openings += [cylinder([*vent, top - 1.0], (0, 0, 1), VENT, PLATE + 2.0) for vent in vents]
    return cut(plate, openings)


def _openings(plan: SplitPlan) -> tuple[Array, list[Array]]:
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
        if min(float(np.hypot(*(place - each))) for each in [*stems, gate]) > GATE + plan.stem
    ]
    return gate, vents


def _plate(plan: SplitPlan, low: float, high: float, rim: float) -> TopoDS_Shape:
    """A square plate with holes for four rods, and a rim around the outer mould, with its draft, up to z = `rim`."""
    inner = plan.outer + plan.spec.clearance
    wide = inner + plan.spec.mould_wall
    hole = (wide + ROD / 2.0 + 1.0) / np.sqrt(2.0)
    half = max(wide, hole + ROD / 2.0 + 4.0)
    plate = BRepPrimAPI_MakeBox(point([-half, -half, low]), point([half, half, high])).Shape()
    edge = high if rim > high else low
    start, height, way = min(edge, rim), abs(rim - edge), 1 if rim > high else -1
    # The rim begins inside the plate: faces that only touch are the hard case of a union.
    ring = cut(
        cylinder((0, 0, start - 1.0), (0, 0, 1), wide, height + 2.0),
        [
            cone(
                (0, 0, rim + way), (0, 0, -way), inner + plan.slope, inner - (height + 2.0) * plan.slope, height + 3.0
            ),
            cylinder((0, 0, rim if rim > high else rim - 2.0), (0, 0, 1), 2.0 * wide, 2.0),
        ],
    )
    rods = [
        cylinder((x * hole, y * hole, low - 1.0), (0, 0, 1), ROD / 2.0, high - low + 2.0)
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    return cut(fuse(plate, [ring]), rods)


def mount(plan: Plan) -> list[Piece]:
    """What holds the finished part: a plate with holes for tubes, two half rings that clamp the flange, a tip plate.

    The rings leave less room than the flange is thick and so seal it.
    """
    gap, thick = plan.spec.clearance, plan.spec.flange.thickness
    inner = plan.flange - plan.spec.flange.width + 2.0 * gap
    wide = plan.flange + 10.0
    low = -_SQUEEZE * thick
    ring = cut(
        cylinder((0, 0, low), (0, 0, 1), wide, _CLAMP - low),
        [
            cylinder((0, 0, -1.0), (0, 0, 1), inner, _CLAMP + 2.0),
            cylinder((0, 0, low - 1.0), (0, 0, 1), plan.flange + gap, 1.0 - low),
        ],
    )
    angles = np.radians(np.arange(30.0, 390.0, 60.0))
    middle = plan.flange + 5.0
    screws = [
        cylinder((middle * np.cos(a), middle * np.sin(a), low - 2.0 * PLATE), (0, 0, 1), SCREW / 2.0, 4.0 * PLATE)
        for a in angles
    ]
    ring = cut(ring, screws)
    halves = [common(ring, _wedge(start, start + np.pi, plan)) for start in (0.0, np.pi)]
    tubes = [
        cylinder([*stem.start[:2], low - 2.0 * PLATE], (0, 0, 1), plan.spec.tube / 2.0 + gap, 4.0 * PLATE)
        for stem in plan.stems
        if stem.way == "base"
    ]
    plate = cut(cylinder((0, 0, low - _CLAMP), (0, 0, 1), wide, _CLAMP), [*screws, *tubes])
    rim = plan.body.exterior.net[-1]
    centre = rim.mean(axis=0)
    radius = float(np.hypot(*(rim - centre)[:, :2].T).min())
    tip = cylinder(centre, (0, 0, 1), radius, 3.0)
    tip = cut(tip, [cylinder(centre - [0.0, 0.0, 1.0], (0, 0, 1), SCREW / 2.0, 5.0)])
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
    corners = [np.array([0.0, 0.0, low]), *(far * radial(angle) + [0.0, 0.0, low] for angle in angles)]
    return prism(corners, (0, 0, plan.length - low + 10.0 * PLATE))


def _same(one: float, other: float) -> bool:
    return abs((one - other + np.pi) % (2.0 * np.pi) - np.pi) < 1e-6
