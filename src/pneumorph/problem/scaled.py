"""Rubbers whose moduli are all multiplied by a factor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter

from pneumorph.problem.material import Material
from pneumorph.units import MODULUS, parse, write

_reader: TypeAdapter[Any] = TypeAdapter(Material)


def scaled(
    material: Material,
    factor: float,
    *,
    name: str,
    source: str,
    scatter: float | None = None,
    bulk: float | None = None,
) -> Material:
    """A rubber with all moduli times a factor, under another name.

    Parameters
    ----------
    material : the rubber.
    factor : positive.
    name, source : of the new one.
    scatter : relative standard deviation of its moduli, if it is known.
    bulk : another bulk modulus, MPa.
    """
    table = material.model_dump(mode="json", exclude_none=True)
    kept = {key: value for key, value in table.items() if key not in ("name", "source", "scatter", "density")}
    words: dict[str, Any] = {"name": name, "source": source, "density": table["density"]}
    if scatter is not None:
        words["scatter"] = scatter
    if bulk is not None:
        words["bulk_modulus"] = write(bulk, MODULUS)
    return _reader.validate_python({key: _times(value, factor) for key, value in kept.items()} | words)


def _times(value: Any, factor: float) -> Any:
    """A value of a material's table with all moduli in it times a factor, to twelve digits."""
    if isinstance(value, Mapping):
        return {key: _times(each, factor) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_times(each, factor) for each in value]
    try:
        return write(float(f"{factor * parse(value, MODULUS):.12g}"), MODULUS) if isinstance(value, str) else value
    except ValueError:
        return value
