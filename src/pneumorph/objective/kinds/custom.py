"""Objectives written by users: Python functions of the features in jax.numpy."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from pneumorph.errors import ProblemError
from pneumorph.objective.features import Features, Pressing, equidistant
from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.kinds.trial import FILE, Asked, fault_of, words_of
from pneumorph.objective.objective import Objective
from pneumorph.problem import Custom


def build(asked: Custom, scope: Scope) -> Objective:
    """Load a user's objective function, once a process of its own has shown that it loads and returns one number.

    Raises
    ------
    ProblemError
        If there is no such function, or it fails, does not end, or does not return a number for features of this
        problem's shapes; names the key and the line of the code.
    """
    wanted = Asked(asked.code, asked.function, asked.sections, tuple(scope.chambers), tuple(scope.obstacles))
    if fault := fault_of(wanted):
        raise ProblemError(f"{scope.key}.{fault.key}: {fault.words}")
    try:
        function = _loaded(wanted)[asked.function]
    except Exception as error:
        raise ProblemError(f"{scope.key}.code: {words_of(error)}") from None

    def measure(f: Features) -> Array:
        return jnp.asarray(function(f))

    return Objective(measure, equidistant(asked.sections, scope.length))


def shape_of(asked: Asked) -> tuple[str, str] | None:
    """What is wrong with a function, by the key and as a clause; None if it returns one real number.

    To be called by `trial.main`, where the code may do anything; raises what it raises.
    """
    function = _loaded(asked).get(asked.function)
    if not callable(function):
        return "function", f'the code has no function "{asked.function}"; define it there'
    returned: list[Any] = []

    def measure(f: Features) -> Array:
        returned.append(function(f))
        return jnp.zeros(()) if returned[-1] is None else jnp.asarray(returned[-1])

    result = jax.eval_shape(measure, _zeros(asked))
    if returned[-1] is None:
        return "function", f"{asked.function} returns nothing; make it return one real number"
    if result.shape != () or not jnp.issubdtype(result.dtype, jnp.floating):
        kind = f"an array of shape {result.shape} and type {result.dtype}"
        return "function", f"{asked.function} returns {kind}; make it return one real number"
    return None


def _loaded(asked: Asked) -> dict[str, Any]:
    space: dict[str, Any] = {}
    exec(compile(asked.code, FILE, "exec"), space)
    return space


def _zeros(asked: Asked) -> Features:
    """Features of a problem's shapes."""
    return Features(
        jnp.zeros(3),
        jnp.zeros(3),
        {name: jnp.zeros(()) for name in asked.chambers},
        jnp.zeros((asked.sections, 3)),
        jnp.zeros((asked.sections, 3, 3)),
        {name: Pressing(jnp.zeros(3), jnp.zeros(()), jnp.zeros(())) for name in asked.obstacles},
        {name: jnp.zeros(6) for name in asked.obstacles},
        jnp.zeros(()),
    )
