"""The tables of a problem, each validated on its own."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag

from pneumorph.problem.body import BodySpec
from pneumorph.problem.contact import ACTIVATION, ContactSpec, ObstacleSpec
from pneumorph.problem.design import DesignSpec
from pneumorph.problem.fabrication import MakeSpec
from pneumorph.problem.material import Material
from pneumorph.problem.models import (
    MOST_OBSTACLES,
    MOST_TASKS,
    EndEffector,
    Gravity,
    Limits,
    MeshSpec,
    OptimizerSpec,
    Task,
)
from pneumorph.problem.regions import MOST_REGIONS, Region
from pneumorph.problem.reinforcement import MOST_REINFORCEMENTS, FibresSpec, MembraneSpec
from pneumorph.problem.robust import RobustSpec
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.table import TAG, Example, Table


def _kind_of_body(data: Any) -> str:
    of_file = isinstance(data, SolidSpec) or (isinstance(data, dict) and ("file" in data or "data" in data))
    return TAG + ("file" if of_file else "tube")


def _with_pressures(given: Any) -> Any:
    """Tasks, where one that has the pressures of another has them written out."""
    if not isinstance(given, list | tuple):
        return given
    tables = [each for each in given if isinstance(each, dict) and {"name", "pressure"} <= each.keys()]
    own = {each["name"]: each["pressure"] for each in tables if isinstance(each["name"], str)}

    def whole(task: Any) -> Any:
        if not isinstance(task, dict) or "pressure" in task or not isinstance(of := task.get("pressures_of"), str):
            return task
        # That there is no such task is said by `checks`.
        return task | {"pressure": own.get(of, {})}

    return tuple(map(whole, given))


class Tables(Table):
    """The tables of a problem; `Problem` is those that are consistent with each other."""

    title: Annotated[str, Field(max_length=300)] = ""
    """A title for messages and pictures."""
    material: Annotated[Material, Example('[material] with name = "Hei-Cast 8400"')]
    """The rubber: a name of the library alone, or a model with its parameters."""
    body: Annotated[
        Annotated[BodySpec, Tag(TAG + "tube")] | Annotated[SolidSpec, Tag(TAG + "file")],
        Discriminator(_kind_of_body),
        Example("[body] with its length, radius and chambers, or with a file"),
    ]
    """The starting body with its chambers: a tube, or a body from a CAD file."""
    design: DesignSpec | None = None
    """How finely a body from a file is designed, and which of its faces stay; tubes have body.control_density."""
    region: tuple[Region, ...] = Field(default=(), max_length=MOST_REGIONS)
    """Parts of another rubber, each a table [[region]]."""
    membrane: tuple[MembraneSpec, ...] = Field(default=(), max_length=MOST_REINFORCEMENTS)
    """Sheets of paper or fabric on surfaces, which limit strain, each a table [[membrane]]."""
    fibres: tuple[FibresSpec, ...] = Field(default=(), max_length=MOST_REINFORCEMENTS)
    """Fibres wound around surfaces, each a table [[fibres]]."""
    end_effector: EndEffector = EndEffector()
    """What the tip carries."""
    gravity: Gravity | None = None
    """Weight of the body; without this table gravity is off."""
    contact: ContactSpec | None = None
    """Contact of the body with itself; without it the body may self-intersect."""
    obstacle: tuple[ObstacleSpec, ...] = Field(default=(), max_length=MOST_OBSTACLES)
    """Rigid obstacles, each a table [[obstacle]]; tasks may move them."""
    task: Annotated[tuple[Task, ...], BeforeValidator(_with_pressures), Example("a table [[task]]")] = Field(
        min_length=1, max_length=MOST_TASKS
    )
    """Tasks, each a table [[task]]; all share the shape."""
    robust: RobustSpec | None = None
    """What varies from casting to casting, against which designs are robust; without it they are not."""
    limits: Limits = Limits()
    """Limits that every design satisfies."""
    mesh: MeshSpec = MeshSpec()
    """Size and kind of the elements."""
    optimizer: OptimizerSpec = OptimizerSpec()
    """Steps and number of designs."""
    make: MakeSpec = MakeSpec()
    """How the body and its mould are made."""

    @property
    def tubes(self) -> BodySpec:
        """The table of a body of tubes, for what knows these alone."""
        assert isinstance(self.body, BodySpec), "bodies from files do not come here"
        return self.body

    @property
    def contact_distance(self) -> float:
        """The distance below which contact forces act, mm."""
        given = None if self.contact is None else self.contact.distance
        return given or ACTIVATION * self.mesh.size

    @property
    def solid(self) -> SolidSpec | None:
        """The table of a body from a file; None for one of tubes."""
        return self.body if isinstance(self.body, SolidSpec) else None
