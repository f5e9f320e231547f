"""The sheet for the workshop: sections with dimensions, numbered pieces, the steps, and the bill."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from scipy.spatial import KDTree

from pneumorph.make.mould.bill import Item
from pneumorph.make.mould.plan import PLATE, Plan, SplitPlan
from pneumorph.make.mould.proof import Part
from pneumorph.problem import Problem, reinforcements
from pneumorph.problem.reinforcement import EXTERIOR

_COLOURS = {"mould": ("#c7cdd4", "#b3bcc6"), "core": ("#e8b75e", "#e8b75e"), "product": ("#8fc1a9", "#8fc1a9")}
_COLOURS |= {"part": _COLOURS["product"], "master": _COLOURS["core"], "negative": ("#d9a3a3", "#e2b8b8")}
LEAK = 20.0
"""Pressure in kPa of the first test for leaks: below what designs are made for."""

AIR = " Tilt it to all sides and tap it, so that air under level faces leaves too."
"""What takes air from below faces that have no highest point, such as the flat ends of chambers."""

PAGE = (8.27, 11.69)  # A4 upright, inches

FOOT = 0.05
"""Lowest line on a page, as a part of its height."""

LINE = 0.045
"""Least distance of two names beside a section, as a part of its height."""

GRID = 48
"""Points along the sides of a section, one of which is marked with the piece's name."""

OFF = float(np.radians(1.0))
"""How far sections keep from partings, so that these are seen from the side."""

ON_AXIS = 0.1
"""Distance in mm from the axis within which a port is in every section."""

Places = dict[str, tuple[float, float]]
"""Points in the sections of pieces by their names, mm."""


def write_sheet(
    plan: SplitPlan, parts: Sequence[Part], items: Sequence[Item], told: Sequence[str], title: str, path: Path
) -> None:
    """Write the sheet as PDF.

    Parameters
    ----------
    told : sequence of str
        Remarks below the steps.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_pages(path, title, [_sections(plan, parts, title)], steps(plan, items), told, items)


def write_pages(
    path: Path, title: str, drawings: Sequence[Figure], to_do: Sequence[str], told: Sequence[str], items: Sequence[Item]
) -> None:
    """Write drawings, the steps with remarks below, and the bill of materials as PDF.

    Parameters
    ----------
    path : Path
        The file.
    title : str
        In its properties.
    drawings : sequence of Figure
        The first pages.
    to_do : sequence of str
        Steps in their order.
    told : sequence of str
        Remarks below them.
    items : sequence of Item
        The bill.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with PdfPages(path, metadata={"Title": title, "CreationDate": None}) as pages:
        for drawing in drawings:
            pages.savefig(drawing)
        numbered = [*(f"{n}. {step}" for n, step in enumerate(to_do, start=1)), *told]
        rows = [f"{item.quantity:10.4g}  {item.unit:9s} {item.item}" + note_of(item) for item in items]
        for page in text_pages({"Steps": numbered, "Bill of materials": rows}):
            pages.savefig(page)


def steps(plan: SplitPlan, items: Sequence[Item]) -> list[str]:
    """What to do, in order."""
    side = [stem for stem in plan.stems if stem.way == "side"]
    closed = [stem for stem in plan.stems if stem.closed]
    angles = ", ".join(f"{np.degrees(angle):.0f}°" for angle in plan.angles)
    # The whole first, then its parts if it is mixed.
    whole, *mixed = [f"{item.quantity:.4g} g of {item.item}" for item in items if item.unit == "g"]
    lying, plugged, vents = "", [], "."
    if len(plan.vents):
        vents = f" ({len(plan.vents)} of them in the outer pieces: close each as soon as rubber leaves it)."
    if side:
        lain = ", ".join(dict.fromkeys(stem.chamber for stem in side))
        lying = f" Lay the stems of the cores of {lain} into the partings."
    if closed:
        names = ", ".join(stem.chamber for stem in closed)
        plugged = [f"Close the holes of the second stems (of chambers {names}) with plugs of the same rubber."]
    return [
        "Print all pieces of the folder mould in any rigid plastic, except for the cores that the bill does not call "
        "rigid: these in soluble filament (such as PVA), or as brittle shells of one perimeter. Seal resin prints: "
        "some stop platinum silicone from curing.",
        *_joining(plan, items),
        "Brush release agent on all faces that rubber touches.",
        "Put the cores' stems into the base, flats against flats." + lying,
        f"Close the outer pieces around them (partings at {angles}), put on the lid, and tighten the four rods.",
        f"Weigh {' and '.join(mixed or [whole])}; mix, and degas until the foam has collapsed.",
        "Stand the mould upright, base down. Inject slowly through the gate in the lid until rubber leaves all vents"
        + vents
        + AIR,
        "Let it cure as the data sheet says, at a temperature that the cores can bear.",
        "Loosen the rods, lift off the lid, open the outer pieces with a screwdriver in the slots, pull each straight "
        f"away from the axis; the rubber is stretched by up to {max(each.stretch for each in plan.releases):.2f}.",
        " ".join([*_leaving(plan), "Trim the gate."]),
        *plugged,
        *last_steps(plan),
    ]


def reinforcing(problem: Problem) -> list[str]:
    """When the sheets and fibres of a problem are put on its surfaces, if it has any."""
    sentences = []
    for each in reinforcements(problem):
        chambers = [name for name in each.surfaces if name != EXTERIOR]
        if chambers:
            sentences.append(
                f"Before casting, lay {each.words} on the cores of {', '.join(chambers)}: the rubber bonds to it. "
                "The cores must be broken or dissolved inside it."
            )
        if EXTERIOR in each.surfaces:
            sentences.append(f"Bond {each.words} to the finished body with the thinnest possible film of its rubber.")
    return sentences


def last_steps(plan: Plan) -> list[str]:
    """What to do with the finished body."""
    return [
        f"Press tubes of {plan.spec.tube:g} mm into the ports with silicone adhesive; clamp the flange between the "
        "mount and the clamp's halves; glue the tip plate to the tip.",
        f"Test for leaks under water at {LEAK:g} kPa, then at the largest pressure of the problem file.",
    ]


def _joining(plan: SplitPlan, items: Sequence[Item]) -> list[str]:
    """The step that puts split pieces together, if there are any."""
    printed = {item.item.removeprefix("print ") for item in items}
    planned = [f"outer-{number}" for number in range(1, len(plan.angles) + 1)]
    split = [name for name in (*planned, *(f"core-{core.chamber}" for core in plan.cores)) if name not in printed]
    told = f"Put the parts of {', '.join(split)} together, keys into their sockets; glue those of cores."
    return [told] if split else []


def _leaving(plan: SplitPlan) -> list[str]:
    """How the cores leave the part."""
    whole = [core.chamber for core in plan.cores if core.leaves_whole(plan.spec.release_stretch)]
    broken = [core.chamber for core in plan.cores if core.chamber not in whole]
    sentences = [f"Pull the cores of chambers {', '.join(whole)} out through their ports."] if whole else []
    if broken:
        sentences.append(
            f"The cores of chambers {', '.join(broken)} are wider than their ports: dissolve them in warm water, or "
            "break them and shake them out."
        )
    return sentences


def note_of(item: Item) -> str:
    return f" ({item.note})" if item.note else ""


def _sections(plan: SplitPlan, parts: Sequence[Part], title: str) -> Figure:
    figure = Figure(figsize=PAGE, layout="constrained")
    upright, level = figure.subplots(2, 1, height_ratios=[3, 1.6])
    angle = _through_a_port(plan)
    shown = [part for part in parts if part.role in _COLOURS]
    numbers = {part.name: number for number, part in enumerate(shown, start=1)}
    places: tuple[Places, Places] = {}, {}
    for part in shown:
        # The plane of the section becomes z = 0: turned about z first, then about x.
        turned = part.solid.rotate((0.0, 0.0, -float(np.degrees(angle)))).rotate((-90.0, 0.0, 0.0))
        fill(upright, turned.slice(0.0).to_polygons(), part, numbers[part.name], places[0])
        fill(level, part.solid.slice(plan.length / 2.0).to_polygons(), part, numbers[part.name], places[1])
    low, high = plan.bottom - PLATE, plan.length + PLATE
    wide = plan.outer + plan.spec.clearance + plan.spec.mould_wall
    dimension(upright, (-wide - 6.0, low), (-wide - 6.0, high), f"{high - low:.1f}")
    dimension(upright, (wide + 6.0, 0.0), (wide + 6.0, plan.length), f"{plan.length:.1f}")
    dimension(upright, (-plan.outer, low - 6.0), (plan.outer, low - 6.0), f"Ø {2 * plan.outer:.1f}")
    dimension(upright, (-plan.flange, low - 13.0), (plan.flange, low - 13.0), f"Ø {2 * plan.flange:.1f} (flange)")
    upright.set_title(f"section at {np.degrees(angle):.0f}°, mm", fontsize=9)
    level.set_title(f"section at z = {plan.length / 2.0:.0f} mm", fontsize=9)
    finish(figure, dict(zip((upright, level), places, strict=True)), title)
    return figure


def _through_a_port(plan: SplitPlan) -> float:
    """The angle of a section through the axis that shows a port with its stem, a little off the partings."""
    stem = next((each for each in plan.stems if not each.closed), plan.stems[0])
    x, y = (stem.direction if stem.way == "side" else stem.start)[:2]
    if np.hypot(x, y) < ON_AXIS:
        return float(plan.angles[0] + np.pi / len(plan.angles))
    angle = float(np.arctan2(y, x))
    # The other half of the section lies opposite.
    near = any(abs(np.sin(angle - parting)) < OFF for parting in plan.angles)
    return angle + OFF if near else angle


def finish(figure: Figure, drawn: Mapping[Axes, Places], title: str) -> None:
    """Finish a figure: axes in mm, to scale and without frames, the names of the pieces in them, and the title."""
    for axes, places in drawn.items():
        axes.set_aspect("equal")
        axes.autoscale_view()
        axes.set_axis_off()
        _name(axes, places)
    figure.suptitle(title, fontsize=11, weight="bold")


def _name(axes: Axes, places: Places) -> None:
    """Write the names of pieces in a column on either side, with a line from each to a point in its piece."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    middle, step, aside = (left + right) / 2.0, LINE * (high - low), 0.05 * (right - left)
    order = sorted(places, key=lambda name: places[name][0])
    # As many names on both sides: pieces near the middle go to the emptier one.
    halves = order[: len(order) // 2], order[len(order) // 2 :]
    for names, x, side in ((halves[0], left - aside, "right"), (halves[1], right + aside, "left")):
        heights = {name: places[name][1] for name in names}
        below = -np.inf
        for name in sorted(names, key=heights.__getitem__):
            heights[name] = below = max(heights[name], below + step)
        # Back down as far as they went up too far on the whole.
        surplus = max((heights[name] for name in names), default=high) - high
        for name in names:
            at = x, heights[name] - max(surplus, 0.0)
            line = {"arrowstyle": "-", "lw": 0.5, "color": "#2d353d", "shrinkA": 1, "shrinkB": 0}
            axes.annotate(name, places[name], at, fontsize=8, ha=side, va="center", arrowprops=line)
            axes.plot(*places[name], "o", markersize=1.8, color="#2d353d")
    axes.set_xlim(middle - 1.4 * (middle - left), middle + 1.4 * (right - middle))


def fill(axes: Axes, polygons, part: Part, number: int, places: Places) -> None:
    """Fill the outlines of a section, holes left out, and note a point in it by the piece's name.

    Parameters
    ----------
    axes : Axes
        In mm.
    polygons : sequence of (n, 2 or more) arrays
        Outlines of the section, mm; those of holes too.
    part : Part
        The piece.
    number : int
        Of the piece, by which neighbours have different colours.
    places : dict
        Takes the point.
    """
    if not len(polygons):
        return
    loops = [np.asarray(polygon)[:, :2] for polygon in polygons]
    vertices = np.concatenate([np.concatenate([loop, loop[:1]]) for loop in loops])
    codes = np.concatenate([[Outline.MOVETO, *[Outline.LINETO] * (len(loop) - 1), Outline.CLOSEPOLY] for loop in loops])
    colour = _COLOURS[part.role][number % 2]
    axes.add_patch(PathPatch(Outline(vertices, codes), facecolor=colour, edgecolor="#2d353d", linewidth=0.5))
    places[part.name] = _within(loops)


def _within(loops: Sequence[np.ndarray]) -> tuple[float, float]:
    """The point of a grid within outlines that is farthest from them."""
    corners = np.concatenate(loops)
    low, high = corners.min(axis=0), corners.max(axis=0)
    grid = np.stack(np.meshgrid(*np.linspace(low, high, GRID + 2)[1:-1].T), axis=-1).reshape(-1, 2)
    # Within a hole a point is in two outlines.
    inside = np.sum([Outline(loop).contains_points(grid) for loop in loops], axis=0) % 2 == 1
    if not inside.any():
        return float(loops[0][0, 0]), float(loops[0][0, 1])
    share = np.linspace(0.0, 1.0, GRID)[:, None, None]
    edges = [(1 - share) * loop + share * np.roll(loop, -1, axis=0) for loop in loops]
    distance, _ = KDTree(np.concatenate([edge.reshape(-1, 2) for edge in edges])).query(grid[inside])
    x, y = grid[inside][np.argmax(distance)]
    return float(x), float(y)


def dimension(axes: Axes, start: tuple[float, float], stop: tuple[float, float], text: str) -> None:
    """Draw a dimension line.

    Parameters
    ----------
    axes : Axes
        In mm.
    start, stop : (2,)
        Ends of the line, mm.
    text : str
        In its middle.
    """
    axes.annotate("", start, stop, arrowprops={"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0})
    middle = (start[0] + stop[0]) / 2.0, (start[1] + stop[1]) / 2.0
    upright = start[0] == stop[0]
    axes.text(
        *middle, text, fontsize=8, rotation=90 if upright else 0, ha="center", va="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )  # fmt: skip
    axes.update_datalim([start, stop])


def text_pages(parts: Mapping[str, Sequence[str]]) -> Iterator[Figure]:
    """Pages with lines under headings, one after the other, as many as are needed; the bill's are in columns."""
    figure, top = Figure(figsize=PAGE), 0.95
    for heading, lines in parts.items():
        family = "monospace" if heading.startswith("Bill") else None
        for number, line in enumerate(lines):
            wrapped = _wrapped(line, 96)
            needed = 0.0145 * (wrapped.count("\n") + 1) + 0.008
            if top - needed - (0.04 if number == 0 else 0.0) < FOOT:
                yield figure
                figure, top = Figure(figsize=PAGE), 0.95
            if number == 0:
                figure.text(0.08, top, heading, fontsize=13, weight="bold", va="top")
                top -= 0.035
            figure.text(0.08, top, wrapped, fontsize=9, va="top", family=family)
            top -= needed
        top -= 0.02
    yield figure


def _wrapped(line: str, width: int) -> str:
    rows, row = [], ""
    indent = " " * (22 if line.startswith(" ") else 3)
    for word in line.split(" "):
        if len(row) + len(word) > width:
            rows.append(row.rstrip())
            row = indent
        row += word + " "
    return "\n".join([*rows, row.rstrip()])
