"""`pneumorph material`: show the library of elastomers, and fit models to a tension test."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import TypeAdapter, ValidationError
from rich.console import Console
from rich.text import Text

from pneumorph import units
from pneumorph.errors import ProblemError
from pneumorph.mechanics import rubber_of
from pneumorph.mechanics.material.fit import Fit, TensionTest, fit, forms, material_keys, ranked
from pneumorph.output.fit import draw_fits
from pneumorph.problem.material import MODELS, Material, library
from pneumorph.problem.tension import read_tension
from pneumorph.run import atomic

BULK_RATIO = 1000.0
"""Bulk over shear modulus of fitted models, which a tension test does not determine: ν = 0.4995."""

COMMON = ("name", "model", "bulk_modulus", "density", "valid_stretch", "source")

_reader: TypeAdapter[Any] = TypeAdapter(Material)


def list_() -> None:
    """List the elastomers of the library: model, parameters, stiffness, range and source."""
    for name in library():
        _describe(Console(), name)
        print()


def show(name: str) -> None:
    """Show an elastomer of the library."""
    if name not in library():
        raise ProblemError(f'material: "{name}" is not in the library; use one of {", ".join(library())}')
    _describe(Console(), name)


def _describe(console: Console, name: str) -> None:
    elastomer = _reader.validate_python({"name": name})
    table, rubber = elastomer.model_dump(exclude_none=True), rubber_of(elastomer)
    own = ", ".join(f"{key} {_in_words(value)}" for key, value in table.items() if key not in COMMON)
    reach = f"up to {rubber.valid_stretch:.3g}" if rubber.valid_stretch else "not stated"
    lines = {
        "model": f"{table['model']}, {own}",
        "moduli": f"shear {rubber.shear_modulus:.4g} MPa, bulk {table['bulk_modulus']}, κ/μ = "
        f"{rubber.bulk_modulus / rubber.shear_modulus:.4g}; density {table['density']}",
        "stretch": reach,
        "source": table["source"],
        "assumed": library()[name].get("assumed", "nothing"),
    }
    console.print(Text(name, style="bold"))
    for key, words in lines.items():
        console.print(Text(f"  {key:<8} {words}"), soft_wrap=True)


def _in_words(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_in_words(part) for part in value)
    if isinstance(value, dict):
        return "(" + ", ".join(_in_words(part) for part in value.values()) + ")"
    return f"{value:g}" if isinstance(value, float) else str(value)


def fit_(data: Path, model: str, out: Path | None, density: str) -> None:
    """Fit models to a uniaxial tension test, check their stability, and write the best as a table [material]."""
    if model != "all" and model not in MODELS:
        raise ProblemError(f'--model: "{model}" is not a known model; use one of {", ".join(MODELS)} or all')
    try:
        units.parse(density, units.DENSITY)
    except ValueError as error:
        raise ProblemError(f"--density: {error}") from None
    test = TensionTest(*read_tension(data))
    asked = [form for form in forms(test) if model in (form.model, "all")]
    fits = ranked([fit(form, test) for form in asked])
    console = Console()
    reach = f"{test.stretch.min():.3g} to {test.stretch.max():.3g}"
    console.print(Text(f"{len(test.stretch)} points at stretches from {reach}"))
    for one in fits:
        console.print(Text(_row(one), style="" if one.is_stable else "yellow"), soft_wrap=True)
    folder = out or Path(f"{data.stem}-fit")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        draw_fits(folder / "fit.png", test, fits, data.name)
        report = json.dumps([_record(one) for one in fits], indent=2, allow_nan=False)
        atomic.write_bytes(folder / "fit.json", f"{report}\n".encode())
        block = _block(fits[0], data, density)
        if block is not None:
            atomic.write_bytes(folder / "material.toml", block.encode())
    except OSError as error:
        raise ProblemError(f"--out {folder}: cannot be written ({error.strerror}); name another folder") from None
    if block is None:
        console.print(Text(f"{fits[0].form.label} is not a rubber: its initial shear modulus is not positive", "red"))
    else:
        console.print(Text(f"\n{block}"), soft_wrap=True)
    console.print(Text(f"written to {folder}: fit.png, fit.json{'' if block is None else ', material.toml'}"))


def _row(one: Fit) -> str:
    numbers = ", ".join(f"{key} {_in_words(value)}" for key, value in _written(one).items())
    return f"{one.form.label:<15} R² {one.r2:.5f}, RMS {1e3 * one.rms:.3g} kPa, {_stability(one)}; {numbers}"


def _stability(one: Fit) -> str:
    """The result of Drucker's stability check."""
    if one.is_stable:
        return f"stable up to {one.reach:.3g}"
    failing = [f"{stretch:.3g} ({mode})" for mode, stretch in one.stable.items() if stretch < one.reach]
    return f"stable up to {', '.join(failing)} only"


def _written(one: Fit) -> dict[str, Any]:
    """The parameters as in a problem file, to six digits."""

    def written(key: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return [written(key, part) for part in value]
        if isinstance(value, dict):
            return {part: written(part, number) for part, number in value.items()}
        pure = key in ("limit", "locking_stretch", "exponent")
        return float(f"{value:.6g}") if pure else f"{value:.6g} MPa"

    return {key: written(key, value) for key, value in material_keys(one)}


def _record(one: Fit) -> dict[str, Any]:
    return {
        "model": one.form.model,
        "form": one.form.label,
        "parameters": _written(one),
        "r2": one.r2,
        "rms_MPa": one.rms,
        "largest_stretch": one.reach,
        "stable_up_to": one.stable,
        "stable": one.is_stable,
    }


def _block(one: Fit, data: Path, density: str) -> str | None:
    """The table [material] of a fit, validated like a problem file; None if it is not valid."""
    table = {
        "name": data.stem,
        "model": one.form.model,
        **_written(one),
        "bulk_modulus": "1 MPa",
        "density": density,
        "valid_stretch": float(f"{min(one.reach, *one.stable.values()):.4g}"),
        "source": f"fitted to {data.name}, R2 {one.r2:.4f}; bulk modulus: {BULK_RATIO:g} times shear, assumed",
    }
    if not table["valid_stretch"] > 1:
        del table["valid_stretch"]
    try:
        shear = _reader.validate_python(table).initial_shear_modulus
    except ValidationError:
        return None
    table["bulk_modulus"] = f"{BULK_RATIO * shear:.4g} MPa"
    return tomli_w.dumps({"material": table})
