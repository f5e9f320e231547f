"""The whole problem: its tables, each validated and then checked for consistency with the others."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Annotated, Any, Self

import tomli_w
from pydantic import Field, ModelWrapValidatorHandler, ValidationError, model_validator

from pneumorph.problem.changes import change
from pneumorph.problem.checks import faults
from pneumorph.problem.contact import ContactSpec, ObstacleSpec
from pneumorph.problem.fabrication import MakeSpec
from pneumorph.problem.material import Material
from pneumorph.problem.models import (
    MOST_OBSTACLES,
    MOST_TASKS,
    BodySpec,
    EndEffector,
    Gravity,
    Limits,
    MeshSpec,
    OptimizerSpec,
    Pressure,
    Task,
)
from pneumorph.problem.reasons import faults_of, refusal
from pneumorph.problem.regions import MOST_REGIONS, Region
from pneumorph.problem.reinforcement import MOST_REINFORCEMENTS, FibresSpec, MembraneSpec
from pneumorph.problem.table import Example, Table


class Problem(Table):
    """A design problem with the tables of a problem file, read by `load` or built in Python.

    Quantities are given as text with a unit or as pint quantities; as attributes they are floats in mm, N, MPa, t, s
    and rad. A chamber for which a task gives no pressure has zero gauge pressure.

    Raises
    ------
    ProblemError
        One line: the key, what is wrong, and how to fix it.

    Examples
    --------
    >>> import pneumorph as pm
    >>> problem = pm.Problem(
    ...     material={"name": "Hei-Cast 8400"},
    ...     body={
    ...         "length": "24 mm",
    ...         "radius": "8 mm",
    ...         "chamber": [{"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "21 mm"]}],
    ...     },
    ...     task=[{"name": "extend", "pressure": {"A": "60 kPa"}, "objective": {"motion": "extension"}}],
    ... )
    >>> problem.task[0].pressure["A"].start
    0.06
    """

    title: Annotated[str, Field(max_length=300)] = ""
    """A title for messages and pictures."""
    material: Annotated[Material, Example('[material] with name = "Hei-Cast 8400"')]
    """The rubber: a name of the library alone, or a model with its parameters."""
    body: Annotated[BodySpec, Example("[body] with its length, radius and chambers")]
    """The starting body with its chambers."""
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
    task: Annotated[tuple[Task, ...], Example("a table [[task]]")] = Field(min_length=1, max_length=MOST_TASKS)
    """Tasks, each a table [[task]]; all share the shape."""
    limits: Limits = Limits()
    """Limits that every design satisfies."""
    mesh: MeshSpec = MeshSpec()
    """Size and kind of the elements."""
    optimizer: OptimizerSpec = OptimizerSpec()
    """Steps and number of designs."""
    make: MakeSpec = MakeSpec()
    """How the body and its mould are made."""

    @model_validator(mode="wrap")
    @classmethod
    def _sound(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Report invalid input in one line, and give every task a pressure for every chamber."""
        try:
            problem = handler(data)
        except ValidationError as error:
            raise refusal(faults_of(error)) from None
        if found := faults(problem):
            raise refusal(found)
        zero = Pressure.model_validate("0 kPa")
        tasks = [
            task.model_copy(
                update={
                    "pressure": {
                        chamber.name: task.pressure.get(chamber.name, zero) for chamber in problem.body.chamber
                    }
                }
            )
            for task in problem.task
        ]
        object.__setattr__(problem, "task", tuple(tasks))
        return problem

    def with_changes(self, changes: Mapping[str, Any]) -> Problem:
        """A copy of the problem with some values changed.

        Parameters
        ----------
        changes : mapping of keys to values
            Dotted keys as in a problem file, with an index for tables that occur several times, such as
            ``task[0].pressure.A``. Values as in the constructor; False removes a key. ``material.name`` selects another
            elastomer of the library.

        Raises
        ------
        ProblemError
            One line: the key, what is wrong, and how to fix it.

        Examples
        --------
        >>> import pneumorph as pm
        >>> problem = pm.load("examples/small.toml")
        >>> stiffer = problem.with_changes({"end_effector.spring.axial": "4 N/mm", "mesh.size": "5 mm"})
        >>> stiffer.end_effector.spring.axial, stiffer.mesh.size
        (4.0, 5.0)
        """
        table = self.model_dump(mode="json", exclude_none=True)
        for key, value in changes.items():
            # The present table has all parameters of its elastomer, so a new name replaces the whole table.
            change(table, *(("material", {"name": value}) if key == "material.name" else (key, value)))
        return Problem.model_validate(table)

    def _repr_html_(self) -> str:
        """In notebooks, its text."""
        return f"<pre>{escape(self.to_toml())}</pre>"

    def to_toml(self) -> str:
        """The text of a problem file for this problem, with all defaults written out.

        Examples
        --------
        >>> import pneumorph as pm
        >>> print(pm.load("examples/small.toml").to_toml().splitlines()[0])
        title = "Small linear actuator"
        """
        return tomli_w.dumps(self.model_dump(exclude_none=True))
