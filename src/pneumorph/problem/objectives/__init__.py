"""Objectives of a task, a file for the keys of each kind; `objective/kinds` has what is minimised and shown."""

from typing import Annotated, get_args

from pydantic import Tag

from pneumorph.problem.kinds import by_kind, known
from pneumorph.problem.objectives.blocked import Blocked
from pneumorph.problem.objectives.contact_area import ContactArea
from pneumorph.problem.objectives.custom import Custom
from pneumorph.problem.objectives.match_curve import MatchCurve
from pneumorph.problem.objectives.match_sections import MatchSections
from pneumorph.problem.objectives.maximize import Maximize
from pneumorph.problem.objectives.minimize import Minimize
from pneumorph.problem.objectives.motion import TargetMotion
from pneumorph.problem.objectives.pose import TargetPose
from pneumorph.problem.objectives.press import Press
from pneumorph.problem.objectives.reach import Reach
from pneumorph.problem.objectives.stiffness import StiffnessOfTip
from pneumorph.problem.objectives.workspace import LargestWorkspace
from pneumorph.problem.table import TAG

_Tables = (
    Annotated[Maximize, Tag(TAG + "maximize")]
    | Annotated[Minimize, Tag(TAG + "minimize")]
    | Annotated[MatchCurve, Tag(TAG + "match_curve")]
    | Annotated[MatchSections, Tag(TAG + "match_sections")]
    | Annotated[Reach, Tag(TAG + "reach")]
    | Annotated[TargetMotion, Tag(TAG + "motion")]
    | Annotated[TargetPose, Tag(TAG + "pose")]
    | Annotated[Press, Tag(TAG + "press")]
    | Annotated[ContactArea, Tag(TAG + "contact_area")]
    | Annotated[StiffnessOfTip, Tag(TAG + "stiffness")]
    | Annotated[Blocked, Tag(TAG + "blocked")]
    | Annotated[LargestWorkspace, Tag(TAG + "workspace")]
    | Annotated[Custom, Tag(TAG + "custom")]
)
KINDS = [table.__metadata__[0].tag.removeprefix(TAG) for table in get_args(_Tables)]


ObjectiveSpec = Annotated[_Tables, by_kind("maximize"), known(KINDS, "objective", "maximize")]
