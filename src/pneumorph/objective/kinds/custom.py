"""Objectives written by users: Python functions of the features in jax.numpy."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from pneumorph.errors import ProblemError
from pneumorph.objective.deadline import PROCESSOR, TooLong, deadline
from pneumorph.objective.features import Features, Pressing, equidistant
from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective
from pneumorph.problem import Custom

FILE = "<objective>"


def build(asked: Custom, scope: Scope) -> Objective:
    """Load a user's objective function, and check that it returns one number for features of this problem's shapes.

    Raises
    ------
    ProblemError
        If there is no such function, or it fails or does not return a number; names the key and the line of the code.
    """
    space: dict[str, Any] = {}
    key = scope.key
    _guarded(key, lambda: exec(compile(asked.code, FILE, "exec"), space))
    function = space.get(asked.function)
    if not callable(function):
        raise ProblemError(f'{key}.function: the code has no function "{asked.function}"; define it there')
    none = Features(
        jnp.zeros(3),
        jnp.zeros(3),
        {name: jnp.zeros(()) for name in scope.chambers},
        jnp.zeros((asked.sections, 3)),
        jnp.zeros((asked.sections, 3, 3)),
        {name: Pressing(jnp.zeros(3), jnp.zeros(()), jnp.zeros(())) for name in scope.obstacles},
        {name: jnp.zeros(6) for name in scope.obstacles},
    )

    def measure(f: Features) -> Array:
        return jnp.asarray(function(f))

    found = _guarded(key, lambda: jax.eval_shape(measure, none))
    if found.shape != () or not jnp.issubdtype(found.dtype, jnp.floating):
        raise ProblemError(
            f"{key}.function: {asked.function} returns an array of shape {found.shape} and type {found.dtype}; "
            "make it return one real number"
        )
    return Objective(measure, equidistant(asked.sections, scope.length))


def _guarded(key: str, call: Callable[[], Any]) -> Any:
    """Result of a call into the user's code; an error in it is raised again as one line."""
    try:
        with deadline():
            return call()
    except TooLong:
        raise ProblemError(
            f"{key}.code: takes more than {PROCESSOR:g} s of processor time to load, or waits; make it end sooner"
        ) from None
    except (Exception, SystemExit) as error:
        where = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == FILE]
        line = where[-1] if where else getattr(error, "lineno", None)
        at = f" in line {line}" if line else ""
        words = " ".join(str(error).split())
        raise ProblemError(f"{key}.code: {type(error).__name__}{at} ({words[:200]}); fix the code there") from None
