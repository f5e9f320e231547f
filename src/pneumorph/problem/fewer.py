"""A problem with fewer chambers, or with fewer supplies for them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from pneumorph.cad.fill import filled
from pneumorph.cad.read import read_faces
from pneumorph.cad.shells import shells_of
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.problem.defaults import limits_by_default
from pneumorph.problem.solid import SolidSpec, packed
from pneumorph.problem.whole import Problem


def with_fewer_chambers(problem: Problem, without: Collection[str], shared: Mapping[str, str]) -> Problem:
    """The problem without some chambers, and with chambers that share the supply of another.

    It keeps as much of the symmetry of the body as the chambers that are left have.

    Parameters
    ----------
    problem : with its chambers.
    without : names of chambers that are left out; closed voids of a body from a file are filled.
    shared : chambers, each with the one whose pressure it has from now on in every task.

    Raises
    ------
    ProblemError
        If no chamber would be left, a void of a file cannot be filled, or the tasks make no sense without the chambers.

    Examples
    --------
    >>> import pneumorph as pm
    >>> problem = pm.load("examples/arm_parallel.toml")
    >>> fewer = pm.with_fewer_chambers(problem, ["C"], {})
    >>> [chamber.name for chamber in fewer.body.chamber]
    ['A', 'B', 'D']
    """
    table = table_of(problem)
    names = [chamber.name for chamber in problem.body.chamber]
    for name in (*without, *shared, *shared.values()):
        if name not in names:
            raise ProblemError(f'there is no chamber "{name}"; the chambers are {", ".join(names)}')
    if without and not set(names) - set(without):
        raise ProblemError(f"body.chamber: none is left without {', '.join(without)}; keep one")
    for task in table["task"]:
        if "pressure" in task:
            task["pressure"] = _pressures(task["pressure"], without, shared)
        if task.get("volume"):
            task["volume"] = {name: value for name, value in task["volume"].items() if name not in without}
    if not without:
        return Problem.model_validate(table)
    body = table["body"]
    if problem.solid is not None:
        body |= _filled(problem.solid, without)
    body["chamber"] = [each for each in body["chamber"] if each["name"] not in without]
    table["region"] = [each for each in map(lambda each: _region(each, without), table["region"]) if each is not None]
    refused: ProblemError | None = None
    for symmetry in _symmetries(body["symmetry"]):
        try:
            return Problem.model_validate(table | {"body": body | {"symmetry": symmetry}})
        except ProblemError as error:
            refused = error
    assert refused is not None
    raise refused


def _filled(solid: SolidSpec, without: Collection[str]) -> dict[str, Any]:
    """The keys that change in the table of a body from a file where some of its chambers are filled."""
    if opened := [each.name for each in solid.chamber if each.name in without and each.port is not None]:
        raise ProblemError(f"body.chamber: {opened[0]} opens through a port; fill it in CAD")
    centres = np.array([solid.parts.chambers[name].centre for name in without]) / solid.factor
    try:
        data = filled(solid.content, solid.format, centres)
        before, left = (len(shells_of(each).voids) for each in (solid.outline, read_faces(data, "brep", solid.factor)))
    except ComputationError as error:
        raise ProblemError(f"body.file: it {error}") from None
    if left != before - len(centres):
        raise ProblemError(f"body.file: {', '.join(without)} could not be filled; fill them in CAD")
    return {"data": packed(data), "format": "brep"}


def table_of(problem: Problem) -> dict[str, Any]:
    """The tables of a problem as in its file, without limits that depend on its chambers and are as by default."""
    table = problem.model_dump(mode="json", exclude_none=True)
    for key, value in limits_by_default(problem).items():
        if getattr(problem.limits, key) == value:
            del table["limits"][key]
    return table


def _pressures(given: Mapping[str, Any], without: Collection[str], shared: Mapping[str, str]) -> dict[str, Any]:
    """The pressures of a task; a chamber that shared the supply of one that is left out has what that one had."""
    found: dict[str, Any] = {}
    for name, value in given.items():
        leader = shared.get(name) or (value.get("same_as") if isinstance(value, dict) else None)
        if name in without:
            continue
        if leader is None:
            found[name] = value
        elif leader in without:
            found[name] = given[leader]
        else:
            found[name] = {"same_as": shared.get(leader, leader)}
    return found


def _region(region: dict[str, Any], without: Collection[str]) -> dict[str, Any] | None:
    """A region without sleeves of chambers that are left out; None if nothing is left of it."""
    if "sleeve" not in region:
        return region
    chambers = [name for name in region["sleeve"]["chambers"] if name not in without]
    return {**region, "sleeve": {**region["sleeve"], "chambers": chambers}} if chambers else None


def _symmetries(symmetry: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The symmetry and what is left of it when parts are left out, the most first."""
    parts = [("mirror", plane) for plane in symmetry.get("mirror", ())]
    parts += [
        (key, symmetry[key]) for key in ("rotation", "point", "half_turn") if symmetry.get(key) not in (None, 1, False)
    ]
    for count in range(len(parts), -1, -1):
        for chosen in combinations(parts, count):
            planes = [value for key, value in chosen if key == "mirror"]
            yield {"mirror": planes} | {key: value for key, value in chosen if key != "mirror"}
