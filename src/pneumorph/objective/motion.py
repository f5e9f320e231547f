"""Objectives to be minimised, as functions of features."""

from __future__ import annotations

from collections.abc import Callable

from jax import Array

from pneumorph.objective.features import Features

Objective = Callable[[Features], Array]

_READERS = {
    "extension": lambda f: f.translation[2],
    "bending_x": lambda f: f.rotation[0],
    "bending_y": lambda f: f.rotation[1],
    "twist": lambda f: f.rotation[2],
}
MOTIONS = tuple(_READERS)


def motion(name: str) -> Objective:
    """A motion of the end-effector: "extension" in mm, "bending_x", "bending_y" or "twist" in rad.

    With a sign before it, as in "-twist", the other way.
    """
    sign = -1.0 if name.startswith("-") else 1.0
    read = _READERS[name.lstrip("+-")]
    return lambda f: sign * read(f)


def maximize(name: str) -> Objective:
    """The objective whose minimum has the largest `motion` (the paper's Remark 1)."""
    measure = motion(name)
    return lambda f: -measure(f)
