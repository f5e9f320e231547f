"""Objectives that a user writes: a Python function of the features in jax.numpy."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jax import Array

from pneumorph.errors import ProblemError
from pneumorph.objective.features import Features
from pneumorph.problem import Custom

FILE = "<objective>"


def custom(key: str, asked: Custom, chambers: tuple[str, ...]) -> Callable[[Features], Array]:
    """The function that a table asks for, after it has given one number for features of this problem's shapes.

    Raises
    ------
    ProblemError
        Naming `key` and the line of the user's code, when it is no function or gives no number.
    """
    space: dict[str, Any] = {}
    _guarded(key, lambda: exec(compile(asked.code, FILE, "exec"), space))
    function = space.get(asked.function)
    if not callable(function):
        raise ProblemError(f'{key}.function: the code defines no function "{asked.function}"; define it there')
    none = Features(
        jnp.zeros(3),
        jnp.zeros(3),
        {name: jnp.zeros(()) for name in chambers},
        jnp.zeros((asked.sections, 3)),
        jnp.zeros((asked.sections, 3, 3)),
    )

    def measure(f: Features) -> Array:
        return jnp.asarray(function(f))

    found = _guarded(key, lambda: jax.eval_shape(measure, none))
    if found.shape != () or not jnp.issubdtype(found.dtype, jnp.floating):
        raise ProblemError(
            f"{key}.function: {asked.function} gives an array of shape {found.shape} and kind {found.dtype}; "
            "let it return one real number"
        )
    return measure


def _guarded(key: str, call: Callable[[], Any]) -> Any:
    """What a call into the user's code returns; a mistake in it as one line."""
    try:
        return call()
    except (Exception, SystemExit) as error:
        where = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == FILE]
        line = where[-1] if where else getattr(error, "lineno", None)
        at = f" in line {line}" if line else ""
        words = " ".join(str(error).split())
        raise ProblemError(f"{key}.code: {type(error).__name__}{at} ({words[:200]}); fix the function there") from None
