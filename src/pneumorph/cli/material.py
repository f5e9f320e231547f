"""`pneumorph material`: show the library of elastomers, and fit models to tension tests."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from rich.console import Console
from rich.text import Text

from pneumorph.errors import ProblemError
from pneumorph.interface.beam import fit_beam
from pneumorph.interface.material import MODES, fit_material, parameters
from pneumorph.mechanics import rubber_of
from pneumorph.mechanics.material.judge import Fit, faults
from pneumorph.mechanics.material.undetermined import undetermined
from pneumorph.problem.delimited import number
from pneumorph.problem.material import Material, library
from pneumorph.problem.memory import MEMORY
from pneumorph.problem.sources import chosen, deviation_of, history_of, other_sources, range_of

COMMON = ("name", "model", "bulk_modulus", "density", "valid_stretch", "scatter", "covariance", "source", *MEMORY)

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
    """Show an elastomer of the library.

    Raises
    ------
    ProblemError
        If there is no such elastomer in the library.
    """
    if name not in library():
        raise ProblemError(f'material: "{name}" is not in the library; use one of {", ".join(library())}')
    _describe(Console(), name)


def _entry(name: str) -> dict[str, Any]:
    """An elastomer as in a problem file, with numbers beside it that a script can compare."""
    from pneumorph.output.export import formats_of

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
        "other_sources": [
            {"shear_modulus_MPa": each.shear_modulus, "source": each.source} for each in other_sources(elastomer)
        ],
        "shear_modulus_range_MPa": range_of(elastomer),
        "scatter": deviation_of(elastomer),
        "chosen": library()[name].get("chosen"),
        "history": library()[name].get("history"),
        "exports": list(formats_of(rubber)),
    }


def _describe(console: Console, name: str) -> None:
    elastomer = _reader.validate_python({"name": name})
    table, rubber = elastomer.model_dump(exclude_none=True), rubber_of(elastomer)
    own = ", ".join(
        f"{key} {_in_words(value)}" for key, value in table.items() if key not in COMMON and value is not False
    )
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
    if elastomer.relaxation:
        parts = ", ".join(f"{100 * part.share:.3g} % in {part.time:g} s" for part in elastomer.relaxation)
        console.print(Text(f"  {'relaxes':<8} of a held stress {parts}: simulate --rate"), soft_wrap=True)
    for each in other_sources(elastomer):
        console.print(Text(f"  {'others':<8} shear {each.shear_modulus:.4g} MPa: {each.source}"), soft_wrap=True)
    if history := history_of(elastomer):
        told = f"± {100 * history.deviation:.2g} % of the moduli by loading, unloading and time: {history.source}"
        console.print(Text(f"  {'history':<8} {told}"), soft_wrap=True)
    if why := chosen(elastomer):
        console.print(Text(f"  {'chosen':<8} {why}"), soft_wrap=True)
    if ends := range_of(elastomer):
        low, high = (f"{end:.4g}" for end in ends)
        told = f"shear {low} to {high} MPa by all sources"
    else:
        told = "one source alone"
    deviation = deviation_of(elastomer)
    used = "" if deviation is None else f"; tolerance takes ± {100 * deviation:.2g} % as one standard deviation"
    console.print(Text(f"  {'range':<8} {told}{used}"), soft_wrap=True)


def _in_words(value: Any) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(_in_words(part) for part in value)
    if isinstance(value, dict):
        return "(" + ", ".join(_in_words(part) for part in value.values()) + ")"
    return f"{value:g}" if isinstance(value, float) else str(value)


def fit_(
    data: list[str],
    model: str,
    out: Path | None,
    density: str,
    weights: list[str],
    options: dict[str, Any],
    of_beams: dict[str, str | None],
) -> None:
    """Fit models to tension tests, judge them in all modes, and write the best as a table [material].

    Parameters
    ----------
    data : list of "[MODE=]FILE"
        Files of tests.
    model : str
        A model's name, or "all".
    out : Path or None
        Folder of the results; by default named by the first file.
    density : str
        For the table, with its unit.
    weights : list of "MODE=NUMBER"
        How much the tests of a mode count.
    options : dict
        Further arguments of `fit_material`.
    of_beams : {option: text or None}
        Options that are for strips that bend alone.

    Raises
    ------
    ProblemError
        If a file or an option has a mistake.
    """
    for option, text in of_beams.items():
        if text is not None:
            raise ProblemError(f"--{option.replace('_', '-')}: is for strips that bend; add --beam or leave it out")
    if not data:
        raise ProblemError("material fit: give a file with a tension test, or --beam")
    tests: dict[str, list[Path]] = {}
    for entry in data:
        mode, equals, path = entry.partition("=")
        known = equals and mode in MODES
        tests.setdefault(MODES[mode] if known else "uniaxial", []).append(Path(path if known else entry))
    fitted = fit_material(tests, model, density, weights=_weights(weights), **options)
    console = Console()
    for line in fitted.read:
        console.print(Text(line), soft_wrap=True)
    for one in fitted.fits:
        console.print(Text(_row(one), style="" if one.is_acceptable else "yellow"), soft_wrap=True)
    for sentence in fitted.reports:
        console.print(Text(sentence), soft_wrap=True)
    folder = out or Path(f"{fitted.files[0].stem}-fit")
    written = fitted.write(folder)
    try:
        console.print(Text(f"\n{fitted.toml()}"), soft_wrap=True)
    except ProblemError as error:
        console.print(Text(f"\n{error}"), soft_wrap=True)
    console.print(Text(f"written to {folder}: {', '.join(path.name for path in written)}"))


def beam(
    data: list[str], options: dict[str, Any], given: dict[str, str | None], density: str | None, out: Path | None
) -> None:
    """Find the modulus of a strip that bends under its own weight, and write it as a table [material].

    Parameters
    ----------
    data : list of str
        A file with points of the centre line, or none where the deflection is given.
    options : dict
        Further arguments of `fit_beam`.
    given : {option: text or None}
        Those that it needs.
    density : str or None
        Of the rubber.
    out : Path or None
        Folder of the result.

    Raises
    ------
    ProblemError
        If a file or an option has a mistake.
    """
    for option, text in {**given, "density": density}.items():
        if text is None:
            raise ProblemError(f'--beam: needs --{option}; give e.g. --{option} "{BEAM_EXAMPLES[option]}"')
    if len(data) > 1:
        raise ProblemError("--beam: is for one file; give the others one by one")
    known = {key: value for key, value in {**options, **given, "density": density}.items() if value is not None}
    fitted = fit_beam(data[0] if data else None, **known)
    console = Console()
    for sentence in fitted.reports:
        console.print(Text(sentence), soft_wrap=True)
    path = fitted.write(out or Path(f"{Path(data[0]).stem}-fit" if data else "beam-fit"))
    console.print(Text(f"\n{fitted.toml()}"), soft_wrap=True)
    console.print(Text(f"written to {path}"))


BEAM_EXAMPLES = {"length": "100 mm", "section": "20 mm x 8 mm", "density": "1.07 g/cm^3"}


def _weights(entries: list[str]) -> dict[str, float]:
    """Weights of modes, as in planar=0.5."""
    weights = {}
    for entry in entries:
        name, _, text = entry.partition("=")
        weight = number(text, ".")
        if name not in MODES or weight is None:
            raise ProblemError(f'--weight: "{entry}" is not a mode and a number; write e.g. planar=0.5')
        weights[name] = weight
    return weights


def _row(one: Fit) -> str:
    numbers = ", ".join(f"{key} {_in_words(value)}" for key, value in parameters(one).items())
    verdict = ", ".join(faults(one)) or f"stable up to {one.reach:.3g}"
    names = undetermined(one)
    weak = f"; not determined: {', '.join(names)}" if names else ""
    return f"{one.form.label:<15} R² {one.r2:.5f}, RMS {1e3 * one.rms:.3g} kPa, {verdict}; {numbers}{weak}"
