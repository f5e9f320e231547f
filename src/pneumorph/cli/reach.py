"""`pneumorph reach`: the pressures for a motion of a design."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneumorph import atomic
from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.errors import ProblemError, writing
from pneumorph.interface.reach import PressuresFound, as_motions, motions_wanted, read_motions
from pneumorph.problem.components import MOTIONS, PUSH, is_turn

MISSED = 3
"""Exit status where a motion is out of reach."""


def reach(
    source: Path,
    motions: Sequence[str],
    bounds: Sequence[str],
    curve: Path | None,
    out: Path | None,
    task: str | None,
    number: int | None,
    trust: bool,
    load: Sequence[str] = (),
    block: Sequence[str] = (),
    position: str | None = None,
    rotation: str | None = None,
) -> int:
    """Print the pressures for a motion, or for every motion of a file; the exit status is 3 where one is out of reach.

    Parameters
    ----------
    source : Path
        A run directory or a problem file.
    motions, bounds : sequence of "name=value"
    curve : Path or None
        A table of motions, in place of one.
    out : Path or None
        A table of what was found.
    task : str or None
        Whose loads act; by default the first.
    number : int or None
        Of a run's design, by default the last.
    trust : bool
        Whether code in the problem file is trusted.
    load : sequence of "name=value"
        In place of the task's.
    block : sequence of "motion" or "motion=value"
        Held motions of the plate.
    position, rotation : str or None
        A pose of the tip in coordinates, see `interface.reach.as_motions`.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    ComputationError
        If there is no stable equilibrium within the bounds, or the body cannot be meshed.
    """
    pose = {name: text for name, text in (("position", position), ("rotation", rotation)) if text is not None}
    if curve is not None and (motions or pose):
        raise ProblemError("--curve: is given beside a motion; leave one of them out")
    motion = pairs(motions, "bending_y=30deg")
    wanted = read_motions(curve) if curve is not None else [] if pose else [motions_wanted(motion)]
    given, acting = pairs(bounds, "A=0:60kPa"), pairs(load, "force_x=-0.1N")
    design = design_of(source, number, asking(trust))
    wanted = wanted or [motions_wanted(as_motions(motion | pose, design.problem))]
    if out is not None:
        with writing(f"--csv {out}"):
            out.parent.mkdir(parents=True, exist_ok=True)
    found = design.pressures_along(wanted, given, task, acting, block)
    for each in found:
        print(each)
    if out is not None:
        with writing(f"--csv {out}"):
            atomic.write_bytes(out, _table(found).encode())
        print(f"written to {out}")
    return 0 if all(each.found.reached for each in found) else MISSED


def pairs(given: Sequence[str], example: str) -> dict[str, str]:
    pairs = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not name.strip():
            raise ProblemError(f'"{text}": has no {"name" if equals else "value"}; write it as {example}')
        pairs[name.strip()] = value
    return pairs


def _table(found: Sequence[PressuresFound]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    titles = [f"{name} ({'mm' if number < 3 else 'deg'})" for number, name in enumerate(MOTIONS)]
    pushes = [f"{PUSH}{name} ({'N*mm' if is_turn(name) else 'N'})" for name in found[0].found.pushes]
    writer.writerow([f"pressure {name} (kPa)" for name in found[0].pressures] + titles + pushes + ["off (mm)"])
    for each in found:
        motion = each.found.motion * np.where(np.arange(6) < 3, 1.0, np.degrees(1.0))
        values = [*(1e3 * value for value in each.pressures.values()), *motion, *each.found.pushes.values()]
        values.append(each.found.distance)
        writer.writerow([f"{value:.6g}" for value in values])
    return text.getvalue()
