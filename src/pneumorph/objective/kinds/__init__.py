"""Kinds of objectives, a file for what each minimises and where it aims; `problem/objectives` has their keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.mechanics.contact.pose import pose_of
from pneumorph.objective.kinds import (
    blocked,
    contact_area,
    custom,
    match_curve,
    match_sections,
    maximize,
    minimize,
    motion,
    pose,
    press,
    reach,
    stiffness,
    workspace,
)
from pneumorph.objective.kinds.kind import Kind, Scope, Target
from pneumorph.objective.objective import Objective
from pneumorph.problem import objectives as tables

if TYPE_CHECKING:
    from pneumorph.problem import Problem

KINDS: Mapping[type[tables.ObjectiveSpec], Kind] = {
    tables.Maximize: Kind(maximize.build),
    tables.Minimize: Kind(minimize.build),
    tables.MatchCurve: Kind(match_curve.build, match_curve.target),
    tables.MatchSections: Kind(match_sections.build, match_sections.target),
    tables.Reach: Kind(reach.build, reach.target),
    tables.TargetMotion: Kind(motion.build, motion.target),
    tables.TargetPose: Kind(pose.build),
    tables.Press: Kind(press.build),
    tables.ContactArea: Kind(contact_area.build),
    tables.StiffnessOfTip: Kind(stiffness.build),
    tables.Blocked: Kind(blocked.build),
    tables.LargestWorkspace: Kind(workspace.build),
    tables.Custom: Kind(custom.build),
}


def build_objectives(problem: Problem, aimed: bool = False) -> dict[str, Objective]:
    """Build the objective of every task, or of those with a target alone.

    Raises
    ------
    ProblemError
        If a target curve has no direction at some point, or a user's function fails or does not return a number.
    """
    chambers = tuple(chamber.name for chamber in problem.body.chamber)
    obstacles = tuple(obstacle.name for obstacle in problem.obstacle)
    (base, tip), objectives = problem.body.ends, {}
    for number, task in enumerate(problem.task):
        if aimed and not task.objective.aimed:
            continue
        signs = {
            name: -1.0 if pressure.start < 0.0 else 1.0 for name, pressure in task.pressure.items() if pressure.free
        }
        scope = Scope(f"task[{number}].objective", problem.body.length, tip - base, chambers, obstacles, signs)
        shift = [pose_of(task.poses.get(name, ())) for name in obstacles]
        built = KINDS[type(task.objective)].build(task.objective, scope)
        objectives[task.name] = replace(built, shift=np.array(shift).reshape(-1, 6))
    return objectives


def target_of(asked: tables.ObjectiveSpec, length: float, motion: np.ndarray | None = None) -> Target | None:
    """Where an objective wants a body of some length (mm) to be; None if it does not say that in places.

    The motion (6,) of the tip in mm and rad, if it is known, is taken for what of a target is free.
    """
    return KINDS[type(asked)].target(asked, length, motion)
