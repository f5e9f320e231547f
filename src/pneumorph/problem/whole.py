"""The whole problem: its tables, each validated and then checked for consistency with the others."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any, Self

import tomli_w
from pydantic import ModelWrapValidatorHandler, ValidationError, model_validator

from pneumorph.problem.changes import change
from pneumorph.problem.checks.across import inconsistencies
from pneumorph.problem.defaults import limits_by_default
from pneumorph.problem.models import Pressure
from pneumorph.problem.reasons import faults_of, refusal
from pneumorph.problem.tables import Tables


class Problem(Tables):
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

    @model_validator(mode="wrap")
    @classmethod
    def _sound(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        """Report invalid input in one line, and give every task a pressure for every chamber, bodies their limits."""
        try:
            problem = handler(data)
        except ValidationError as error:
            raise refusal(faults_of(error)) from None
        if faults := inconsistencies(problem):
            raise refusal(faults)
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
        given = {key for key, value in problem.limits if value is not None}
        others = {key: value for key, value in limits_by_default(problem).items() if key not in given}
        object.__setattr__(problem, "limits", problem.limits.model_copy(update=others))
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
        for key, value in limits_by_default(self).items():
            # They depend on other keys, which may change.
            if getattr(self.limits, key) == value:
                del table["limits"][key]
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
