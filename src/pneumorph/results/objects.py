"""Records as JSON objects: the only place that converts them to JSON, and back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache
from types import UnionType
from typing import TYPE_CHECKING, Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np

from pneumorph.results.records import FineResult, TaskResult
from pneumorph.results.sweeps import SweepStep

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

LARGEST = 1e100
"""Largest number in a file; beyond it squares would overflow."""

Record = TypeVar("Record", bound="DataclassInstance")

RARE = (
    "constants",
    "region_stretches",
    "reinforcements",
    "self_intersecting",
    "buckled_MPa",
    "holds",
    "limit_MPa",
    "gas_mm3",
    "filled_mm3",
    "pull_N",
    "on_fine_mesh",
    "fine_translation_mm",
    "fine_rotation_rad",
    "fine_reaction",
    "fine_volume_mm3",
    "rubber_translation_mm",
    "rubber_rotation_rad",
    "rubber_reaction",
    "rubber_volume_mm3",
    "castings",
    "chambers",
    "stiffness",
)
"""Keys that are left out of files where they are empty."""


def to_json(record: Any) -> dict[str, Any]:
    """A record as a JSON object: plain values by their keys, null for NaN and infinity."""
    content = {each.metadata.get("key", each.name): _plain(getattr(record, each.name)) for each in fields(record)}
    for key in RARE:
        if not content.get(key, True):
            del content[key]
    if isinstance(record, TaskResult | FineResult) and not record.contact:
        for key in ("contact_N", "contact_normal_N", "contact_area_mm2"):
            del content[key]
    if isinstance(record, TaskResult | SweepStep) and not record.pose_translations:
        del content["pose_mm"], content["pose_rad"]
    if isinstance(record, SweepStep):
        if not record.turns:
            del content["turn_rad"]
        if record.time is None:
            del content["time_s"]
        if record.converged:
            del content["reason"]
        else:
            known = {"task", "pressure_MPa", "move_mm", "turn_rad", "time_s", "converged", "reason"}
            content |= dict.fromkeys(content.keys() - known - {"buckled_MPa", "limit_MPa", "filled_mm3"})
    return content


def from_json(kind: type[Record], content: Mapping[str, Any]) -> Record:
    """Restore a record from the object that `to_json` made of it.

    Raises
    ------
    KeyError
        If a key is missing.
    ValueError
        If a value is not of its kind.
    """
    values, hints = {}, _hints(kind)
    _check(isinstance(content, Mapping), kind.__name__)
    for each in fields(kind):
        key = each.metadata.get("key", each.name)
        inner = each.metadata.get("of")
        optional = each.default is not MISSING or each.default_factory is not MISSING
        if inner is not None and not (optional and key not in content):
            _check(isinstance(content[key], Mapping), key)
            values[each.name] = {name: from_json(inner, part) for name, part in content[key].items()}
        elif (inner := each.metadata.get("one")) is not None and content.get(key) is not None:
            values[each.name] = from_json(inner, content[key])
        elif not optional or content.get(key) is not None:
            values[each.name] = _tuples(content[key])
            _check(_fits(values[each.name], hints[each.name]), key)
    return kind(**values)


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _check(fits: bool, key: str) -> None:
    if not fits:
        raise ValueError(f'"{key}" is not what it should be')


def _fits(value: Any, hint: Any) -> bool:
    """Whether a value from a file is of the kind that a record's field has; numbers are finite and of sensible size."""
    inner = get_args(hint)
    if hint is float or hint is int:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        return number and abs(value) <= LARGEST and (hint is float or isinstance(value, int))
    if get_origin(hint) is UnionType:
        return any(_fits(value, each) for each in inner)
    if get_origin(hint) is tuple:
        kinds = [inner[0]] * len(value) if isinstance(value, tuple) and inner[-1] is Ellipsis else inner
        return isinstance(value, tuple) and len(value) == len(kinds) and all(map(_fits, value, kinds))
    if get_origin(hint) is not None:
        return isinstance(value, Mapping) and all(_fits(part, inner[1]) for part in value.values())
    return isinstance(value, hint)


def _tuples(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _tuples(part) for key, part in value.items()}
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    if hasattr(value, "__dataclass_fields__"):
        return to_json(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
