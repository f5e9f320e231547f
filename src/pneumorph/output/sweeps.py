"""The equilibria along pressure sweeps as a table for spreadsheets."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from math import degrees, isnan, nan
from types import MappingProxyType

from pneumorph.analysis import Curve
from pneumorph.mechanics import COMPONENTS
from pneumorph.problem.components import is_turn
from pneumorph.results import SweepStep

AXES = ("x", "y", "z")
UNITS = {name: "N" if name in COMPONENTS[:3] else "N*mm" for name in COMPONENTS}
"""Units of the reactions."""


def reactions(curves: Sequence[Curve]) -> list[str]:
    """The plate components with a block or a spring, in their usual order."""
    blocked = {name for curve in curves for step in curve.found for name in step.reaction}
    return [name for name in COMPONENTS if name in blocked]


Row = list[str | float | bool]


def table(curves: Sequence[Curve], chambers: Sequence[str]) -> tuple[list[str], list[Row]]:
    """Header, with units, and a row per step; values of steps without an equilibrium are NaN."""
    blocked = reactions(curves)
    header = ["task", "swept", *(["time_s"] if _timed(curves) else [])]
    header += [f"pressure_{name}_kPa" for name in chambers]
    header += [f"filled_{name}_mm3" for name in _filled(curves)]
    header += [f"move_{name}_{axis}_mm" for name in _moved(curves) for axis in AXES]
    header += [f"turn_{name}_{axis}_deg" for name in _turned(curves) for axis in AXES]
    header += [f"held_{name}_{'deg' if is_turn(name) else 'mm'}" for name in _held(curves)]
    header += [f"translation_{axis}_mm" for axis in AXES]
    header += [f"rotation_{axis}_deg" for axis in AXES]
    header += [f"reaction_{name}_{UNITS[name].replace('*', '_')}" for name in blocked]
    header += [f"volume_{name}_mm3" for name in chambers]
    header += [f"error_{name}" for name in _errors(curves)]
    header += [f"contact_{name}_{axis}_N" for name in touched(curves) for axis in AXES]
    header += [f"contact_normal_{name}_N" for name in touched(curves)]
    header += [f"contact_area_{name}_mm2" for name in touched(curves)]
    header += [f"pull_{name}_N" for name in pulled(curves)]
    header += [f"pose_{name}_{axis}_mm" for name in _free(curves) for axis in AXES]
    header += [f"pose_{name}_turn_{axis}_deg" for name in _free(curves) for axis in AXES]
    header += ["self_contact_N"] if _touches_itself(curves) else []
    if _scatters(curves):
        header += [f"rubber_translation_{axis}_mm" for axis in AXES] + [f"rubber_rotation_{axis}_deg" for axis in AXES]
        header += [f"rubber_reaction_{name}_{UNITS[name].replace('*', '_')}" for name in blocked]
        header += [f"rubber_volume_{name}_mm3" for name in chambers]
    header += ["max_stretch", "beyond_validity", "converged", "reason"]
    rows = [
        [curve.task, "+".join(curve.swept), *_cells(step, chambers, blocked, curves)]
        for curve in curves
        for step in curve.steps
    ]
    return header, rows


def _errors(curves: Sequence[Curve]) -> list[str]:
    """Names of the distances from targets that some step has, with their units."""
    return sorted({name for curve in curves for step in curve.found for name in step.errors})


def _timed(curves: Sequence[Curve]) -> bool:
    """Whether steps have times."""
    return any(step.time is not None for curve in curves for step in curve.steps)


def touched(curves: Sequence[Curve]) -> list[str]:
    """The obstacles of a problem, in its order."""
    return list(dict.fromkeys(name for curve in curves for step in curve.found for name in step.contact))


def pulled(curves: Sequence[Curve]) -> list[str]:
    """The obstacles that close chambers."""
    return list(dict.fromkeys(name for curve in curves for step in curve.found for name in step.pull))


def _filled(curves: Sequence[Curve]) -> list[str]:
    """The chambers that some step fills to a volume."""
    return list(dict.fromkeys(name for curve in curves for step in curve.steps for name in step.filled))


def _moved(curves: Sequence[Curve]) -> list[str]:
    """The obstacles that some step moves from their places."""
    return list(dict.fromkeys(name for curve in curves for step in curve.steps for name in step.moves))


def _turned(curves: Sequence[Curve]) -> list[str]:
    """The obstacles that some step turns."""
    return list(dict.fromkeys(name for curve in curves for step in curve.steps for name in step.turns))


def _held(curves: Sequence[Curve]) -> list[str]:
    """The components of the plate that some step holds where they are not at rest."""
    held = {name for curve in curves for step in curve.steps for name in step.holds}
    return [name for name in COMPONENTS if name in held]


def _free(curves: Sequence[Curve]) -> list[str]:
    """The free obstacles of a problem."""
    return list(dict.fromkeys(name for curve in curves for step in curve.found for name in step.pose_translations))


def _touches_itself(curves: Sequence[Curve]) -> bool:
    return any(step.self_contact > 0.0 for curve in curves for step in curve.found)


def _scatters(curves: Sequence[Curve]) -> bool:
    """Whether it is known how far steps scatter with the rubber."""
    return any(step.rubber_translation is not None for curve in curves for step in curve.steps)


def _cells(step: SweepStep, chambers: Sequence[str], blocked: Sequence[str], curves: Sequence[Curve]) -> Row:
    obstacles = touched(curves)
    return [
        *([nan if step.time is None else step.time] if _timed(curves) else []),
        *(1e3 * step.pressures.get(name, nan) for name in chambers),
        *(step.filled.get(name, nan) for name in _filled(curves)),
        *(part for name in _moved(curves) for part in step.moves.get(name, (0.0, 0.0, 0.0))),
        *(degrees(part) for name in _turned(curves) for part in step.turns.get(name, (0.0, 0.0, 0.0))),
        *(degrees(at) if is_turn(name) else at for name in _held(curves) for at in [step.holds.get(name, 0.0)]),
        *step.translation,
        *map(degrees, step.rotation),
        *(step.reaction.get(name, nan) for name in blocked),
        *(step.volumes.get(name, nan) for name in chambers),
        *(step.errors.get(name, nan) for name in _errors(curves)),
        *(part for name in obstacles for part in step.contact.get(name, (nan,) * 3)),
        *(step.contact_normal.get(name, nan) for name in obstacles),
        *(step.contact_area.get(name, nan) for name in obstacles),
        *(step.pull.get(name, nan) for name in pulled(curves)),
        *(part for name in _free(curves) for part in step.pose_translations.get(name, (nan,) * 3)),
        *(degrees(part) for name in _free(curves) for part in step.pose_rotations.get(name, (nan,) * 3)),
        *([step.self_contact if step.converged else nan] if _touches_itself(curves) else []),
        *(_scatter(step, chambers, blocked) if _scatters(curves) else []),
        step.max_stretch,
        step.beyond_validity,
        step.converged,
        step.reason,
    ]


def _scatter(step: SweepStep, chambers: Sequence[str], blocked: Sequence[str]) -> list[float]:
    """One standard deviation of motions, reactions and volumes by the rubber."""
    return [
        *(step.rubber_translation or (nan,) * 3),
        *map(degrees, step.rubber_rotation or (nan,) * 3),
        *(step.rubber_reaction.get(name, nan) for name in blocked),
        *(step.rubber_volumes.get(name, nan) for name in chambers),
    ]


def csv_text(
    curves: Sequence[Curve], chambers: Sequence[str], more: Mapping[str, Sequence[float]] = MappingProxyType({})
) -> str:
    """The table as CSV, with more columns: a line per step; values of steps without an equilibrium are empty."""
    header, rows = table(curves, chambers)
    header, rows = [*header, *more], [[*row, *cells] for row, *cells in zip(rows, *more.values(), strict=True)]
    text = io.StringIO()
    written = csv.writer(text, lineterminator="\n")
    written.writerow(header)
    for row, step in zip(rows, (step for curve in curves for step in curve.steps), strict=True):
        cells = dict(zip(header, map(_written, row), strict=True))
        if not step.converged:
            cells["beyond_validity"] = ""
        written.writerow(cells.values())
    return text.getvalue()


def _written(cell: str | float | bool) -> str:
    if isinstance(cell, str):
        return cell
    if isinstance(cell, bool):
        return str(cell).lower()
    return "" if isnan(cell) else f"{cell:.12g}"
