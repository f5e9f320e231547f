"""Where a further chamber would help, in sentences, and the problem with one there as a file."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pneumorph import atomic
from pneumorph.analysis.insertion import Insertion, with_further
from pneumorph.errors import writing
from pneumorph.interface.design import Design
from pneumorph.interface.runs import Run
from pneumorph.output.certainty import Moved
from pneumorph.problem import Problem
from pneumorph.problem.objectives.words import motion_amount


def write_with_further(run: Run, design: Design, path: Path) -> Iterator[str]:
    """Tell the best places for a further chamber, and write the problem of a run with one in the first that has room.

    A picture of what one would do everywhere is drawn beside it.

    Raises
    ------
    ProblemError
        If there is no such place, or the file cannot be written.
    """
    places = design.further_chambers()
    if not places:
        yield f"insert    no sphere that keeps limits.wall and limits.curvature would help; {path} is not written"
        return
    for each in places:
        yield f"insert    {words(run.problem, each)}"
    problem, chosen = with_further(run.problem, places)
    with writing(path):
        atomic.write_bytes(path, problem.to_toml().encode())
    first, *images = [chamber.name for chamber in problem.body.chamber[len(run.problem.body.chamber) :]]
    x, y, z = chosen.place
    others = f", and {', '.join(images)} as its image{'s' if images[1:] else ''}" if images else ""
    yield f"written   {path}: the start with {first} at ({x:.1f}, {y:.1f}, {z:.1f}) mm{others}"
    design.plot_further_chambers(path.with_suffix(".png"))
    yield f"drawn     {path.with_suffix('.png')}: what a small chamber at any place would do"


def words(problem: Problem, further: Insertion) -> str:
    """What a further chamber would do, to first order."""
    parts = []
    for task in problem.task:
        motion, pressure = further.motions[task.name], 1e3 * further.pressures[task.name]
        moved = Moved(motion[:3], motion[3:])
        amounts = [motion_amount(name, sign, moved) for name, sign in task.objective.tip_motions.items()]
        told = ", ".join(
            f"{amount.word} {amount.value:+.2g}{'' if amount.unit == '°' else ' '}{amount.unit}" for amount in amounts
        )
        parts.append(f"{task.name} at {pressure:.3g} kPa" + (f": {told}" if told else ""))
    x, y, z = further.place
    sphere = f"a sphere of radius {further.radius:.2g} mm at ({x:.1f}, {y:.1f}, {z:.1f}) mm, and each of its images"
    gain = f"would lower the objective by {further.gain:.2g}, to first order"
    return f"{sphere} under the symmetry, {gain}; {'; '.join(parts)}"
