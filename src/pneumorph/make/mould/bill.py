"""The bill of materials: rubber to weigh, parts to print, screws and tubes to buy."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pneumorph.make.mould.pieces import ROD, SCREW
from pneumorph.make.mould.plan import PLATE, Plan, SplitPlan
from pneumorph.make.mould.proof import RUBBER, Part

MIX = {
    "Ecoflex 00-30": (1.0, 1.0),
    "Ecoflex 00-50": (1.0, 1.0),
    "Dragon Skin 10": (1.0, 1.0),
    "Dragon Skin 20": (1.0, 1.0),
    "Dragon Skin 30": (1.0, 1.0),
    "Elastosil M4601": (9.0, 1.0),
    "Smooth-Sil 950": (10.0, 1.0),
}
"""Parts A and B by weight, from the makers' data sheets. Rubbers of one part or with several mixtures are not here."""


@dataclass(frozen=True)
class Item:
    """One line of the bill.

    Attributes
    ----------
    item : str
    quantity : float
    unit : str
    note : str
    """

    item: str
    quantity: float
    unit: str
    note: str = ""


def bill(plan: SplitPlan, parts: Sequence[Part], rubber: str, density: float) -> list[Item]:
    """Everything that is needed.

    Parameters
    ----------
    parts : sequence of Part
        All pieces, among them the rubber part.
    rubber : str
        Its name.
    density : float
        Of the rubber, t/mm³.
    """
    volume = next(part for part in parts if part.role == "product").solid.volume()
    items = weighed("rubber", rubber, density, volume, plan.spec.waste)
    for part in printed(parts):
        items.append(Item(f"print {part.name}", part.solid.volume() / 1000.0, "cm³", _core_note(plan, part)))
    items += bought(plan, 4, plan.length - plan.bottom + 2.0 * PLATE)
    closed = sum(stem.closed for stem in plan.stems)
    if closed:
        items.append(Item("plugs of the same rubber", closed, "pieces", "for the holes of second stems"))
    return items


def bought(plan: Plan, rods: int, height: float) -> list[Item]:
    """Rods through a mould of a height in mm, screws and tubes."""
    return [
        Item("threaded rods M4", rods, "pieces", f"at least {height + 15.0:.0f} mm, holes of {ROD:g} mm"),
        Item("nuts and washers M4", 2 * rods, "pieces"),
        Item("screws M3", 6, "pieces", f"for the clamp, holes of {SCREW:g} mm, through {PLATE + 4.0:.0f} mm"),
        Item("tube", sum(not stem.closed for stem in plan.stems), "pieces", f"outer diameter {plan.spec.tube:g} mm"),
    ]


def weighed(what: str, rubber: str, density: float, volume: float, waste: float) -> list[Item]:
    """The lines of a rubber: its volume with the waste, its weight, and the weights of its parts A and B.

    Parameters
    ----------
    what : str
        What it is for.
    rubber : str
        Its name.
    density : float
        t/mm³.
    volume : float
        Of the part, mm³.
    waste : float
        What is poured beyond the part, over its volume.
    """
    poured = volume * (1.0 + waste)
    grams = poured * density * 1e6
    items = [
        Item(f"{what}, {rubber}", poured / 1000.0, "cm³", f"part {volume / 1000.0:.1f} cm³ and waste"),
        Item(f"{what}, {rubber}", grams, "g", "" if rubber in MIX else "its mixture: see the maker's data sheet"),
    ]
    if rubber in MIX:
        a, b = MIX[rubber]
        items += [
            Item(f"{rubber} part {name}", grams * share / (a + b), "g", f"mixed {a:g} : {b:g} by weight")
            for name, share in (("A", a), ("B", b))
        ]
    return items


def printed(parts: Sequence[Part]) -> list[Part]:
    """The pieces that are printed."""
    return [part for part in parts if part.role not in RUBBER]


def _core_note(plan: SplitPlan, part: Part) -> str:
    """What a core is printed of, which depends on how it leaves."""
    for core in plan.cores:
        if f"{part.name}-".startswith(f"core-{core.chamber}-"):
            whole = core.leaves_whole(plan.spec.release_stretch)
            soluble = "soluble filament, or a brittle shell; removed through the port"
            return "rigid plastic; pulled out through the port" if whole else soluble
    return ""


def write_bill(items: Sequence[Item], path: Path) -> None:
    """Write the bill as a CSV file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["item", "quantity", "unit", "note"])
        writer.writerows([item.item, f"{item.quantity:.4g}", item.unit, item.note] for item in items)
