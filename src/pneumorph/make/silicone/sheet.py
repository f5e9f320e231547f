"""The sheet for the workshop: sections of the moulds, the steps, and the bill."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pneumorph.make.mould.bill import Item
from pneumorph.make.mould.proof import Part
from pneumorph.make.mould.sheet import AIR, PAGE, Places, dimension, fill, finish, last_steps, write_pages
from pneumorph.make.silicone.frame import frame_of
from pneumorph.make.silicone.pieces import BOX, PLATE
from pneumorph.make.silicone.plan import SiliconePlan, Slab, size_of


def write_sheet(
    plan: SiliconePlan, parts: Sequence[Part], items: Sequence[Item], told: Sequence[str], title: str, path: Path
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
    drawings = [_sections(plan, slab, parts, f"{title}, part {slab.number}") for slab in plan.slabs]
    write_pages(path, title, drawings, steps(plan, items), told, items)


def steps(plan: SiliconePlan, items: Sequence[Item]) -> list[str]:
    """What to do, in order."""
    grams = [item for item in items if item.unit == "g"]
    # Of each rubber the whole comes first, then its parts if it is mixed.
    second = next(n for n, item in enumerate(grams) if item.item.startswith("silicone"))
    rubber, silicone = (_amounts(part) for part in (grams[:second], grams[second:]))
    worst = max(each.stretch for each in plan.releases.values())
    count = len(plan.slabs)
    made = ", ".join(f"master-{slab.number}" for slab in plan.slabs)
    split = [name for name in ("master-1", "box-a", "cover-a") if not any(i.item == f"print {name}" for i in items)]
    joined = [f"Put the parts of {', '.join(split)} and others alike together, keys into sockets; glue them."]
    pins = f" The {len(plan.vents)} pins of vents reach the surface." if len(plan.vents) else ""
    return [
        "Print the masters, boxes and covers of the folder mould in hard resin, the masters with the finest layers; "
        "wash, cure and seal them: some resins stop platinum silicone from curing.",
        *(joined if split else []),
        "Brush release agent on the masters, boxes and covers.",
        f"For all {count} parts ({made}), one after another: bolt box-a to the side of the master's plate where the "
        f"part stands out. Weigh and degas silicone ({silicone} for all negatives), pour it up to the brim, and scrape "
        f"it level.{pins}",
        "When it has cured, turn everything over, bolt box-b to the other side, and pour that as well. Without the "
        "plate both negatives meet, keys in sockets.",
        "Open the boxes with a screwdriver in the slots and pull each negative straight off the master; the silicone "
        f"is stretched by up to {worst:.2f}. Cure the negatives once more as the data sheet says, so that they do not "
        "stop the rubber from curing.",
        "Brush release agent on the negatives: without it, silicone bonds to silicone.",
        "Put negatives a and b of a part into their boxes, keys into sockets, put on both covers, and tighten the six "
        "rods by hand: silicone that is squeezed changes the part.",
        f"Stand the mould upright, gate up. Weigh rubber ({rubber} for all parts), mix, degas, and inject it slowly "
        "through the gate until it leaves the vents." + AIR,
        "Let it cure as the data sheet says. Open the boxes, peel off negative a, pull the part off negative b, cut "
        "off the gate, and trim the flash.",
        f"When all {count} parts are cast, clean their bonding faces with alcohol and roughen them.",
        "Lay the parts into their negatives a. Brush a film of adhesive, at most 0.1 mm, on the bonding faces, not "
        "into chambers and ports, and press keys into sockets. The negatives hold the shape until it has set.",
        *last_steps(plan),
    ]


def _amounts(items: Sequence[Item]) -> str:
    whole, *mixed = [f"{item.quantity:.4g} g of {item.item}" for item in items]
    return " and ".join(mixed or [whole])


def _sections(plan: SiliconePlan, slab: Slab, parts: Sequence[Part], title: str) -> Figure:
    """The mould of a part, in the plane of symmetry of its gate, and across the axis half way up."""
    figure = Figure(figsize=PAGE, layout="constrained")
    along, level = figure.subplots(2, 1, height_ratios=[1.6, 1.6])
    own = [each for each in parts if each.name in (f"negative-{slab.number}-a", f"negative-{slab.number}-b")]
    boxes = [each for each in parts if each.role == "mould"] if slab.number == 1 else []
    shown = [next(each for each in parts if each.name == f"part-{slab.number}"), *own, *boxes]
    numbers = {each.name: number for number, each in enumerate(shown, start=1)}
    frame, size = frame_of(slab, plan), size_of(plan)
    places: tuple[Places, Places] = {}, {}
    for each in shown:
        # Across becomes the vertical, up stays up in the drawing, z runs to the right.
        drawn = each.solid.transform(np.column_stack([_rows(frame), -_rows(frame) @ frame.origin]))
        fill(along, drawn.slice(0.0).to_polygons(), each, numbers[each.name], places[0])
        turned = each.solid.slice(plan.length / 2.0).to_polygons()
        flat = np.stack([frame.across, frame.up])[:, :2]
        across = [(np.asarray(loop)[:, :2] - frame.origin[:2]) @ flat.T for loop in turned]
        fill(level, across, each, numbers[each.name], places[1])
    below, above = -plan.deep[1], plan.deep[0]
    dimension(along, (size.low, below - 12.0), (size.high, below - 12.0), f"{size.high - size.low:.1f}")
    dimension(along, (0.0, above + 12.0), (plan.length, above + 12.0), f"{plan.length:.1f}")
    dimension(along, (size.low - 14.0, below), (size.low - 14.0, above), f"{above - below:.1f}")
    edge = size.half + BOX
    dimension(level, (-size.half, below - 12.0), (size.half, below - 12.0), f"{2 * size.half:.1f}")
    dimension(level, (-edge, above + PLATE + 6.0), (edge, above + PLATE + 6.0), f"{2 * edge:.1f}")
    along.set_title("section along the axis, mm; the gate is at the right", fontsize=9)
    level.set_title(f"section at z = {plan.length / 2.0:.0f} mm", fontsize=9)
    finish(figure, dict(zip((along, level), places, strict=True)), title)
    return figure


def _rows(frame) -> np.ndarray:
    """Rows of the rotation that turns z to x, up to y, and across, reversed, to z."""
    return np.stack([[0.0, 0.0, 1.0], frame.up, -frame.across])
