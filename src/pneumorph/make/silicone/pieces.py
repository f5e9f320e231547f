"""The pieces of silicone moulds as solids in OpenCASCADE: masters, boxes, covers, negatives, and the parts of rubber.

A master is a plate with the outside of a part on one side. On the other side, as deep below the plate's other face as
they are in the part, are its chambers. Silicone is cast on both sides of the plate; without the plate both negatives
meet, and the part is the space that they leave.
"""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.path import Path as Outline
from numpy.typing import NDArray
from OCP.TopoDS import TopoDS_Shape
from scipy.spatial import KDTree

from pneumorph.make.checks import manifold
from pneumorph.make.mould.piece import Piece
from pneumorph.make.mould.pieces import PRY, ROD, flange, mount, product
from pneumorph.make.mould.plan import FUNNEL, GATE, VENT
from pneumorph.make.mould.shapes import common, cone, cut, cylinder, fuse
from pneumorph.make.mould.split import cap, room_for_key, split
from pneumorph.make.mould.stems import INTO, Stem
from pneumorph.make.mould.tessellation import tessellated
from pneumorph.make.silicone.frame import Frame, frame_of, moved, shifted
from pneumorph.make.silicone.plan import SiliconePlan, Slab, size_of
from pneumorph.make.solid import fill_chamber, solid

Array = NDArray[np.float64]

PLATE = 4.0
"""Thickness in mm of the masters' plates and of the covers."""

BOX = 8.0
"""Thickness in mm of the walls of the boxes, through which the rods pass."""

_KEY = 2.2  # largest radius of keys
_FAR = 1e3
"""mm: beyond every body that is cast."""
_INTO = 0.5  # mm by which things that are added reach into what they are added to


@dataclass(frozen=True, eq=False)
class Key:
    """A key on a bonding face: its place (3,) in mm, and its radius in the face."""

    place: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Pieces:
    """All pieces.

    Attributes
    ----------
    pieces : list of Piece
        Boxes and covers are used for all parts; they are at their place in the mould of part 1.
    assembly : {name: shape}
        The moulds of all parts, beside each other.
    """

    pieces: list[Piece]
    assembly: dict[str, TopoDS_Shape]


def pieces(plan: SiliconePlan) -> Pieces:
    """Build everything.

    Raises
    ------
    ComputationError
        If a piece is too large for the printer.
    """
    whole = product(plan)
    keys = _bonding_keys(plan, whole)
    made, assembly = [Piece("body", "product", whole)], {}
    pitch = 2.0 * (size_of(plan).half + BOX) + 20.0
    tools = _boxes(plan, plan.slabs[0])
    for slab in plan.slabs:
        part = _part(plan, slab, whole, keys)
        negatives = _negatives(plan, slab, part, keys)
        master = Piece(f"master-{slab.number}", "master", _master(plan, slab, part, keys))
        made += [Piece(f"part-{slab.number}", "part", part), *negatives, *_printed(plan, slab, master)]
        beside = (slab.number - 1) * pitch * frame_of(plan.slabs[0], plan).across
        assembly |= {piece.name: shifted(piece.shape, beside) for piece in negatives}
        own, first = frame_of(slab, plan), frame_of(plan.slabs[0], plan)
        boxes = {f"{piece.name} of part {slab.number}": moved(piece.shape, first, own) for piece in tools}
        assembly |= {name: shifted(shape, beside) for name, shape in boxes.items()}
    for piece in tools:
        made += _printed(plan, plan.slabs[0], piece)
    for piece in mount(plan):
        made += split(piece, plan, [], lambda height: [])  # not split, but refused if it is too large
    return Pieces(made, assembly)


def _part(plan: SiliconePlan, slab: Slab, whole: TopoDS_Shape, keys: Sequence[Sequence[Key]]) -> TopoDS_Shape:
    """A part of rubber: the body between its bonding faces, keys on the upper and sockets in the lower one."""
    n, far = plan.normal, _FAR
    low, high = max(slab.low, -far), min(slab.high, far)
    part = common(whole, Frame(np.zeros(3), n).box((-far, far), (low, high), (-far, far)))
    bumps, sunk = _key_shapes(plan, slab, keys)
    return cut(fuse(part, bumps), sunk)


def _bonding_keys(plan: SiliconePlan, whole: TopoDS_Shape) -> list[list[Key]]:
    """Keys for every plane: one in each quarter of the bonding face that has room for it."""
    solid_body = manifold(tessellated(whole, 0.1).triangles)
    angle = float(np.degrees(np.arctan2(plan.normal[1], plan.normal[0])))
    keys = []
    for offset in plan.offsets:
        frame = Frame(offset * plan.normal, plan.normal)
        # The plane becomes z = 0: normal along x first, then along z.
        level = solid_body.translate((-frame.origin).tolist()).rotate((0.0, 0.0, -angle)).rotate((0.0, -90.0, 0.0))
        loops = [np.asarray(loop)[:, :2] for loop in level.slice(0.0).to_polygons()]
        places, room = _rooms(loops)
        # A rotation by −90° about y has turned x to z and z to −x; y stays, and is opposite to `across`.
        across, z = -places[:, 1], -places[:, 0]
        own = []
        for quarter in ((across > 0.0) * 2 + (z > plan.length / 2.0) == number for number in range(4)):
            best = int(np.argmax(np.where(quarter, room, -1.0)))
            radius = room_for_key(float(room[best]), _KEY)
            if radius is not None:
                own.append(Key(frame.at(across[best], 0.0, z[best]), radius))
        keys.append(own)
    return keys


def _rooms(loops: Sequence[Array]) -> tuple[Array, Array]:
    """Places (n, 2) all over a region with holes, and their distances (n,) from its edges."""
    corners = np.concatenate(loops)
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = np.stack(np.meshgrid(*np.linspace(low, high, 120).T), axis=-1).reshape(-1, 2)
    inside = np.sum([Outline(loop).contains_points(places) for loop in loops], axis=0) % 2 == 1
    shares = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None, None]
    edges = np.concatenate([(loop + shares * (np.roll(loop, -1, axis=0) - loop)).reshape(-1, 2) for loop in loops])
    places = places[inside]
    return places, KDTree(edges).query(places)[0]


def _silicone_keys(plan: SiliconePlan) -> list[tuple[float, float]]:
    """Places across and along z of the keys between two negatives, in the silicone beside the part."""
    size = size_of(plan)
    away = size.half - plan.spec.mould_wall / 2.0
    taken = [float(stem.start[2]) for stem in plan.stems if stem.way == "side"]
    room = plan.stem + _KEY + 1.0
    free = [z for z in np.linspace(size.low + 8.0, size.high - 8.0, 41) if all(abs(z - each) > room for each in taken)]
    return [(side * away, float(z)) for side in (-1.0, 1.0) for z in free[:1] + free[1:][-1:]]


def _key_radius(plan: SiliconePlan) -> float:
    return room_for_key(plan.spec.mould_wall / 2.0, _KEY) or 0.0


def _keyed(plan: SiliconePlan, frame: Frame, down: float = 0.0) -> list[TopoDS_Shape]:
    """The keys that stand on negative b, or on a master's plate, `down` mm below the plane where negatives meet."""
    radius = _key_radius(plan)
    return [cap(frame.at(u, -down, z), frame.up, radius, 0.0) for u, z in _silicone_keys(plan)] if radius else []


def _bars(plan: SiliconePlan, slab: Slab) -> list[TopoDS_Shape]:
    """The ports that lie in the parting plane of an outer part, into the silicone beside it, where they are held."""
    print_length = plan.spec.mould_wall / 2.0
    bars = []
    for stem in _own_stems(plan, slab):
        outside = -plan.bottom if stem.way == "base" else 0.0
        bars.append(cylinder(stem.start, stem.direction, plan.stem, _through(stem) + outside + print_length))
    return bars


def _through(stem: Stem) -> float:
    return INTO + stem.wall


def _own_stems(plan: SiliconePlan, slab: Slab) -> list[Stem]:
    return [stem for stem in plan.stems if plan.offsets[plan.opened[stem.chamber]] == slab.parting]


def _cores(plan: SiliconePlan, slab: Slab) -> list[TopoDS_Shape]:
    """The chambers that an outer part opens, with their ports."""
    bars = dict(zip((stem.chamber for stem in _own_stems(plan, slab)), _bars(plan, slab), strict=True))
    chambers = {chamber.name: chamber for chamber in plan.body.chambers}
    return [fuse(solid([fill_chamber(chambers[name])]), [bar]) for name, bar in bars.items()]


def _openings(plan: SiliconePlan, slab: Slab, gap: float = 0.0) -> list[TopoDS_Shape]:
    """The gate, vents at the edges of the tip, and vents at high points of the exterior, as solids."""
    frame, size = frame_of(slab, plan), size_of(plan)
    high, start = size.high + BOX + 1.0, plan.length - _INTO
    slope = (FUNNEL - GATE) / (size.high + BOX - plan.length)
    gate = cone(frame.at(0.0, 0.0, start), (0, 0, 1), GATE + gap, GATE + gap + slope * (high - start), high - start)
    edges = [cylinder(frame.at(u, 0.0, start), (0, 0, 1), VENT + gap, high - start) for u in plan.tip_vents]
    return [gate, *edges, *_pins(plan, slab, gap)]


def _pins(plan: SiliconePlan, slab: Slab, gap: float = 0.0) -> list[TopoDS_Shape]:
    """Vents at high points of the exterior, through the silicone to the cover."""
    frame, pins = frame_of(slab, plan), []
    for top in plan.vents:
        if not slab.low < top @ plan.normal < slab.high:
            continue
        _, up, _ = frame.of(top[None])[0]
        way = frame.up if up >= 0.0 else -frame.up
        length = plan.deep[int(up < 0.0)] - abs(up)
        start = top - 0.5 * VENT * np.array([0.0, 0.0, 1.0]) - _INTO * way
        pins.append(cylinder(start, way, VENT + gap, length + _INTO))
    return pins


def _negatives(
    plan: SiliconePlan, slab: Slab, part: TopoDS_Shape, keys: Sequence[Sequence[Key]]
) -> tuple[Piece, Piece]:
    """What is cast around a master."""
    frame, size = frame_of(slab, plan), size_of(plan)
    across, z = (-size.half, size.half), (size.low, size.high)
    above, below = (
        frame.block(across, z, side * deep, plan.slope) for side, deep in zip((1, -1), plan.deep, strict=True)
    )
    sockets = _keyed(plan, frame)
    openings = _openings(plan, slab)
    if slab.inner:
        above, below = cut(above, [part, *sockets, *openings]), fuse(cut(below, [part, *_pins(plan, slab)]), sockets)
    else:
        outside = [solid([plan.body.exterior]), flange(plan), *_bars(plan, slab)]
        above = cut(above, [*outside, *sockets, *openings])
        ridges = [_half(frame, core, -1.0) for core in _cores(plan, slab)]
        bumps, sunk = _key_shapes(plan, slab, keys)
        below = fuse(cut(below, bumps), [*ridges, *sockets, *sunk])
    return Piece(f"negative-{slab.number}-a", "negative", above), Piece(f"negative-{slab.number}-b", "negative", below)


def _key_shapes(
    plan: SiliconePlan, slab: Slab, keys: Sequence[Sequence[Key]]
) -> tuple[list[TopoDS_Shape], list[TopoDS_Shape]]:
    """What keys add to the upper bonding face of a part, and take from its lower one; soft keys need no clearance."""
    faces = [[], *keys, []]
    below, above = (
        [cap(key.place, plan.normal, key.radius, 0.0) for key in face] for face in faces[slab.number - 1 :][:2]
    )
    return above, below


def _half(frame: Frame, shape: TopoDS_Shape, above: float) -> TopoDS_Shape:
    """What of a shape is more than `above` mm over the parting plane."""
    return common(shape, frame.box((-_FAR, _FAR), (above, _FAR), (-_FAR, _FAR)))


def _master(plan: SiliconePlan, slab: Slab, part: TopoDS_Shape, keys: Sequence[Sequence[Key]]) -> TopoDS_Shape:
    """The plate with a part on it, its gate and vents; see the module for its other side."""
    frame, size = frame_of(slab, plan), size_of(plan)
    down = -PLATE * frame.up
    plate = frame.box((-size.half - BOX, size.half + BOX), (-PLATE, 0.0), (size.low - BOX, size.high + BOX))
    if slab.inner:
        shape, on_top = part, _openings(plan, slab)
    else:
        shape = fuse(solid([plan.body.exterior]), [flange(plan)])
        on_top = [*_bars(plan, slab), *_openings(plan, slab)]
    # What stands on the plate begins in its middle: faces that only touch are the hard case of a union.
    top = [_half(frame, each, -PLATE / 2.0) for each in (shape, *on_top)]
    inner = frame.box((-size.half - BOX, size.half + BOX), (-PLATE, plan.deep[0]), (size.low - BOX, size.high + BOX))
    plate = common(fuse(plate, [*top, *_keyed(plan, frame)]), inner)
    if slab.inner:
        lower = frame.box((-_FAR, _FAR), (-_FAR, PLATE / 2.0), (-_FAR, _FAR))
        plate = fuse(plate, [shifted(common(each, lower), down) for each in (part, *_pins(plan, slab))])
        taken: list[TopoDS_Shape] = []
    else:
        bumps, sunk = _key_shapes(plan, slab, keys)
        plate = fuse(plate, [shifted(bump, down) for bump in bumps])
        taken = [shifted(each, down) for each in (*_cores(plan, slab), *sunk)]
    return cut(plate, [*taken, *_keyed(plan, frame, PLATE), *_rods(plan, frame)])


def _rods(plan: SiliconePlan, frame: Frame) -> list[TopoDS_Shape]:
    """Holes for six rods through everything."""
    deep = max(plan.deep) + 3.0 * PLATE
    return [cylinder(frame.at(u, -deep, z), frame.up, ROD / 2.0, 2.0 * deep) for u, z in rods(plan)]


def rods(plan: SiliconePlan) -> list[tuple[float, float]]:
    """Places across and along z of the rods, in the walls of the boxes."""
    size = size_of(plan)
    heights = (size.low - BOX / 2.0, (size.low + size.high) / 2.0, size.high + BOX / 2.0)
    return [(side * (size.half + BOX / 2.0), z) for side in (-1.0, 1.0) for z in heights]


def _boxes(plan: SiliconePlan, slab: Slab) -> list[Piece]:
    """The boxes around both negatives, and the covers on their backs, in the mould of a part."""
    frame, size = frame_of(slab, plan), size_of(plan)
    across, z = (-size.half - BOX, size.half + BOX), (size.low - BOX, size.high + BOX)
    holes, made = _rods(plan, frame), []
    for name, side, deep in (("a", 1.0, plan.deep[0]), ("b", -1.0, plan.deep[1])):
        span = (0.0, deep) if side > 0 else (-deep, 0.0)
        inside = frame.block((-size.half, size.half), (size.low, size.high), side * deep, plan.slope)
        openings = _openings(plan, slab, plan.spec.clearance) if side > 0 else []
        slots = [
            frame.box((u - PRY[2], u + PRY[2]), (-PRY[1], PRY[1]), (height - PRY[0] / 2.0, height + PRY[0] / 2.0))
            for u in across
            for height in pry_heights(plan)
        ]
        made.append(Piece(f"box-{name}", "mould", cut(frame.box(across, span, z), [inside, *openings, *slots, *holes])))
        back = (deep, deep + PLATE) if side > 0 else (-deep - PLATE, -deep)
        vents = [shape for each in plan.slabs for shape in _vents_in_cover(plan, frame, each, side)]
        made.append(Piece(f"cover-{name}", "mould", cut(frame.box(across, back, z), [*vents, *holes])))
    return made


def _vents_in_cover(plan: SiliconePlan, frame: Frame, slab: Slab, side: float) -> list[TopoDS_Shape]:
    """Holes of a cover for the vents of a part: covers are used for all parts."""
    vents = []
    for top in plan.vents:
        if slab.low < top @ plan.normal < slab.high:
            across, up, z = frame_of(slab, plan).of(top[None])[0]
            if (up >= 0.0) == (side > 0.0):
                start = frame.at(across, side * (plan.deep[int(side < 0)] - 1.0), z - 0.5 * VENT)
                vents.append(cylinder(start, side * frame.up, VENT, PLATE + 2.0))
    return vents


def pry_heights(plan: SiliconePlan) -> tuple[float, float]:
    """Heights of the slots for a screwdriver, between the rods."""
    size = size_of(plan)
    return size.low + 0.3 * (size.high - size.low), size.low + 0.7 * (size.high - size.low)


def _printed(plan: SiliconePlan, slab: Slab, piece: Piece) -> list[Piece]:
    """A piece that is printed, split if it does not fit the printer, with keys in the walls beside the silicone."""
    size, frame = size_of(plan), frame_of(slab, plan)
    radius = room_for_key(PLATE / 2.0, _KEY)
    middle = {
        "a": plan.deep[0] / 2.0, "b": -plan.deep[1] / 2.0,
        "cover-a": plan.deep[0] + PLATE / 2.0, "cover-b": -plan.deep[1] - PLATE / 2.0,
    }.get(piece.name.removeprefix("box-"), -PLATE / 2.0)  # fmt: skip
    places = [frame.at(side * (size.half + BOX / 2.0), middle, 0.0)[:2] for side in (-1.0, 1.0)]
    taken = [(z, ROD / 2.0 + _KEY + 1.0) for _, z in rods(plan)[:3]]
    taken += [(height, PRY[0] / 2.0 + _KEY) for height in pry_heights(plan)]
    taken += [(z, _KEY + 0.5) for _, z in _silicone_keys(plan)]
    taken += [(float(stem.start[2]), plan.stem + 1.0) for stem in plan.stems if stem.way == "side"]
    taken += [(float(top[2]), VENT + 1.0) for top in plan.vents]
    return split(piece, plan, taken, lambda height: [] if radius is None else [(place, radius) for place in places])
