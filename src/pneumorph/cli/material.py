"""`pneumorph material`: show the library of elastomers, and fit models to tension tests."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic import TypeAdapter, ValidationError
from rich.console import Console
from rich.text import Text

from pneumorph import units
from pneumorph.cli.quantity import positive
from pneumorph.errors import ProblemError
from pneumorph.mechanics import rubber_of
from pneumorph.mechanics.material.fit import TensionTest, material_keys
from pneumorph.mechanics.material.judge import Fit, faults, fit_all, reports
from pneumorph.output.fit import draw_fits
from pneumorph.problem.delimited import number
from pneumorph.problem.material import MODELS, Material, library
from pneumorph.problem.tension import FEWEST, Reading, read_tension
from pneumorph.run import atomic

BULK_RATIO = 1000.0
"""Bulk over shear modulus of fitted models, which a tension test does not determine: ν = 0.4995."""

MOST_POINTS = 200
"""Points of a file beyond which neighbours are averaged: a recorded curve has thousands, which tell no more."""

COMMON = ("name", "model", "bulk_modulus", "density", "valid_stretch", "source")

_reader: TypeAdapter[Any] = TypeAdapter(Material)


def list_(as_json: bool = False) -> None:
    """List the elastomers of the library: model, parameters, stiffness, range and source."""
    if as_json:
        print(json.dumps([_entry(name) for name in library()], indent=2, ensure_ascii=False))
        return
    for name in library():
        _describe(Console(), name)
        print()


def show(name: str) -> None:
    """Show an elastomer of the library."""
    if name not in library():
        raise ProblemError(f'material: "{name}" is not in the library; use one of {", ".join(library())}')
    _describe(Console(), name)


def _entry(name: str) -> dict[str, Any]:
    """An elastomer as in a problem file, with numbers beside it that a script can compare."""
    from pneumorph.output.export import formats_of  # loads VTK

    elastomer = _reader.validate_python({"name": name})
    rubber = rubber_of(elastomer)
    return {
        **elastomer.model_dump(exclude_none=True, mode="json"),
        "name": name,
        "shear_modulus_MPa": rubber.shear_modulus,
        "bulk_modulus_MPa": rubber.bulk_modulus,
        "density_g_per_cm3": float(f"{rubber.density * 1e9:.6g}"),
        "valid_stretch": rubber.valid_stretch,
        "assumed": library()[name].get("assumed"),
        "exports": list(formats_of(rubber)),
    }


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


MODES = {"uniaxial": "uniaxial", "equibiaxial": "equibiaxial", "biaxial": "equibiaxial", "planar": "planar",
         "shear": "planar"}  # fmt: skip
"""Names of modes on the command line; pure shear is planar tension."""


@dataclass(frozen=True)
class Asked:
    """What `material fit` is asked for, as the options say it."""

    model: str
    out: Path | None
    density: str
    weights: list[str]
    max_stretch: float | None
    gauge_length: str | None
    section: str | None


def fit_(data: list[str], asked: Asked, reading: Reading) -> None:
    """Fit models to tension tests, judge them in all modes, and write the best as a table [material]."""
    if asked.model != "all" and asked.model not in MODELS:
        raise ProblemError(f'--model: "{asked.model}" is not a known model; use one of {", ".join(MODELS)} or all')
    positive("--density", asked.density, units.DENSITY)
    if asked.max_stretch is not None and not asked.max_stretch > 1:
        raise ProblemError(f"--max-stretch: {asked.max_stretch:g} is not above 1, the stretch at rest; raise it")
    length = None if asked.gauge_length is None else positive("--gauge-length", asked.gauge_length, units.LENGTH)
    area = None if asked.section is None else _area(asked.section)
    reading = replace(reading, gauge_length=length, area=area)
    files = [_mode_of(entry) for entry in data]
    weights = _weights(asked.weights, [mode for mode, _ in files])
    console = Console()
    tests = [_test(console, mode, path, weights.get(mode, 1.0), reading, asked.max_stretch) for mode, path in files]
    fits = fit_all(tests, None if asked.model == "all" else asked.model)
    if not fits:
        raise ProblemError(f"--model {asked.model}: there are too few points for it; give more, or --model neo-hookean")
    for one in fits:
        console.print(Text(_row(one), style="" if one.is_acceptable else "yellow"), soft_wrap=True)
    for sentence in reports(fits):
        console.print(Text(sentence), soft_wrap=True)
    name = files[0][1]
    folder, block = asked.out or Path(f"{name.stem}-fit"), _block(fits[0], [path for _, path in files], asked.density)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        draw_fits(folder / "fit.png", tests, fits, ", ".join(path.name for _, path in files))
        report = json.dumps([_record(one) for one in fits], indent=2, allow_nan=False)
        atomic.write_bytes(folder / "fit.json", f"{report}\n".encode())
        if block is not None:
            atomic.write_bytes(folder / "material.toml", block.encode())
    except OSError as error:
        raise ProblemError(f"--out {folder}: cannot be written ({error.strerror}); name another folder") from None
    console.print(Text(f"\n{block}" if block is not None else _refused(fits, asked.model)), soft_wrap=True)
    console.print(Text(f"written to {folder}: fit.png, fit.json{'' if block is None else ', material.toml'}"))


def _area(text: str) -> float:
    """mm² of "4 mm x 2 mm" or "8 mm^2"."""
    sides = re.split(r"\s*[x×*]\s*", text)
    if len(sides) == 2:
        return positive("--section", sides[0], units.LENGTH) * positive("--section", sides[1], units.LENGTH)
    return positive("--section", text, units.AREA)


def _mode_of(entry: str) -> tuple[str, Path]:
    """Mode and file of "planar=shear.csv", or of a file alone."""
    name, equals, path = entry.partition("=")
    if equals and name in MODES:
        return MODES[name], Path(path)
    return "uniaxial", Path(entry)


def _weights(entries: list[str], modes: list[str]) -> dict[str, float]:
    weights = {}
    for entry in entries:
        name, _, text = entry.partition("=")
        weight = number(text, ".")
        if name not in MODES or weight is None or not 0 < weight <= 1e6:
            raise ProblemError(f'--weight: "{entry}" is not a mode and a positive number; write e.g. planar=0.5')
        if MODES[name] not in modes:
            raise ProblemError(f"--weight {entry}: there is no file of this mode; give {name}=FILE")
        weights[MODES[name]] = weight
    return weights


def _test(console: Console, mode: str, path: Path, weight: float, reading: Reading, most: float | None) -> TensionTest:
    """A test from a file; what was recognised in it is printed."""
    read = read_tension(path, reading)
    kept = read.stretch <= (most or np.inf)
    console.print(Text(f"{path.name}: {mode} tension, {len(read.stretch)} points"))
    for line in read.told:
        console.print(Text(f"  {line}"), soft_wrap=True)
    if not kept.all():
        console.print(Text(f"  {np.count_nonzero(~kept)} points beyond --max-stretch {most:g} are left out"))
    if np.count_nonzero(kept) < FEWEST or not read.stress[kept].max() > 0:
        raise ProblemError(f"--max-stretch {most:g} leaves fewer than {FEWEST} useful points of {path}; raise it")
    stretch, stress = read.stretch[kept], read.stress[kept]
    if len(stretch) > MOST_POINTS:
        console.print(Text(f"  neighbouring points are averaged to {MOST_POINTS}"))
        stretch, stress = (
            np.array([part.mean() for part in np.array_split(values, MOST_POINTS)]) for values in (stretch, stress)
        )
    return TensionTest(stretch, stress, mode, weight)


def _refused(fits: list[Fit], model: str) -> str:
    """Why there is no table [material], and which models can be had."""
    had = [one.form.label for one in fits if one.is_acceptable]
    if had:
        instead = f"use one of {', '.join(had)}"
    elif model != "all":
        instead = "--model all tries the others"
    else:
        instead = "give more modes (equibiaxial=FILE, planar=FILE) or a smaller --max-stretch"
    why = ", ".join(faults(fits[0])) or "its initial shear modulus is not positive"
    return f"no [material] is written: {fits[0].form.label} is {why}; {instead}"


def _row(one: Fit) -> str:
    numbers = ", ".join(f"{key} {_in_words(value)}" for key, value in _written(one).items())
    verdict = ", ".join(faults(one)) or f"stable up to {one.reach:.3g}"
    weak = f"; not determined: {', '.join(_names(one)[k] for k in one.undetermined)}" if one.undetermined else ""
    return f"{one.form.label:<15} R² {one.r2:.5f}, RMS {1e3 * one.rms:.3g} kPa, {verdict}; {numbers}{weak}"


def _names(one: Fit) -> list[str]:
    """A name for each parameter of a fit."""
    if one.form.model == "ogden":
        return [f"{key} {k + 1}" for k in range(len(one.parameters) // 2) for key in ("modulus", "exponent")]
    if one.form.model == "yeoh":
        return [f"coefficient {k + 1}" for k in range(len(one.parameters))]
    return [key for key, _ in material_keys(one.form, one.parameters)]


def _written(one: Fit) -> dict[str, Any]:
    """The parameters as in a problem file, to six digits."""

    def written(key: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return [written(key, part) for part in value]
        if isinstance(value, dict):
            return {part: written(part, number) for part, number in value.items()}
        pure = key in ("limit", "locking_stretch", "exponent")
        return float(f"{value:.6g}") if pure else f"{value:.6g} MPa"

    return {key: written(key, value) for key, value in material_keys(one.form, one.parameters)}


def _record(one: Fit) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        "model": one.form.model,
        "form": one.form.label,
        "parameters": _written(one),
        "not_determined": [_names(one)[k] for k in one.undetermined],
        "r2": finite(one.r2),
        "rms_MPa": finite(one.rms),
        "criterion": finite(one.criterion),
        "largest_stretch": one.reach,
        "stable_up_to": one.stable,
        "stable": one.is_stable,
        "acceptable": one.is_acceptable,
        "faults": faults(one),
        "over_neo_hookean": {mode: [finite(low), finite(high)] for mode, (low, high) in one.ratios.items()},
        "relative_error": {mode: finite(curve.error) for mode, curve in one.curves.items()},
    }


def _block(one: Fit, data: list[Path], density: str) -> str | None:
    """The table [material] of a fit, validated like a problem file; None if it is not valid or not acceptable."""
    if not one.is_acceptable:
        return None
    names = ", ".join(path.name for path in data)
    table = {
        "name": data[0].stem,
        "model": one.form.model,
        **_written(one),
        "bulk_modulus": "1 MPa",
        "density": density,
        "valid_stretch": float(f"{one.reach:.4g}"),
        "source": f"fitted to {names}, R2 {one.r2:.4f}; bulk modulus: {BULK_RATIO:g} times shear, assumed",
    }
    try:
        shear = _reader.validate_python(table).initial_shear_modulus
    except ValidationError:
        return None
    table["bulk_modulus"] = f"{BULK_RATIO * shear:.4g} MPa"
    return tomli_w.dumps({"material": table})
