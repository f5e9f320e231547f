"""Fit rubbers to tension tests."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tomli_w
from pydantic import TypeAdapter, ValidationError

from pneumorph import atomic, units
from pneumorph.errors import ProblemError, writing
from pneumorph.mechanics.material.fit import TensionTest, material_keys
from pneumorph.mechanics.material.homogeneous import shear_modulus
from pneumorph.mechanics.material.judge import Fit, faults, fit_all, reports
from pneumorph.mechanics.material.undetermined import kept, sentences, undetermined
from pneumorph.problem.covariance import rows_of
from pneumorph.problem.material import MODELS, Material
from pneumorph.problem.stiffness import no_rubber
from pneumorph.problem.tension import FEWEST, Reading, read_tension

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BULK_RATIO = 1000.0
"""Bulk over shear modulus of fitted models, which a tension test does not determine: ν = 0.4995."""

LEAST_R2 = 0.9
"""Coefficient of determination below which a fit is refused unless asked for."""

SOFTEST, STIFFEST = 5e-4, 50.0
"""Initial shear moduli in MPa between which rubbers are: softer ones are gels, stiffer ones plastics."""

MOST_POINTS = 200
"""Points of a file beyond which neighbours are averaged: a recorded curve has thousands, which tell no more."""

MODES = {"uniaxial": "uniaxial", "equibiaxial": "equibiaxial", "biaxial": "equibiaxial", "planar": "planar",
         "shear": "planar"}  # fmt: skip
"""Names of modes; pure shear is planar tension."""

STRAIN_FROM = {
    "extensometer": ("strain measured on the specimen", "moduli are those of the rubber"),
    "crosshead": (
        "strain of the crosshead",
        "shoulders and slip in the clamps count as strain, so moduli are too low, of soft silicones by up to a half; "
        "measure marks on the specimen, or let a strip hang (--beam)",
    ),
    None: (
        "how strain was measured is not known",
        "that of the crosshead makes moduli too low by up to a half; say --strain-from extensometer or crosshead",
    ),
}
"""What is stored of how strain was measured, and what is told of it."""

Files = str | Path | Sequence[str | Path]

OFF, FEW, SMALL = 0.15, 3, 0.7
"""A model is told to miss small stretches: by more than this share of the stress, at so many points at least, all below
this share of the largest stretch."""

_reader: TypeAdapter[Any] = TypeAdapter(Material)


@dataclass(frozen=True, eq=False)
class MaterialFit:
    """Rubber models fitted to tension tests.

    Attributes
    ----------
    fits : the models, the best first: the simplest that is plausible and fits as well as any.
    tests : the tests that they were fitted to.
    files : of the tests.
    read : how each file was read, line by line.
    density : as text with its unit; tension tests do not determine it.
    least_r2 : coefficient of determination of the least that is accepted.
    strain_from : "extensometer" or "crosshead", how strain was measured; None if it is not known.

    Examples
    --------
    >>> import pneumorph as pm
    >>> modes = ("uniaxial", "equibiaxial", "planar")
    >>> fitted = pm.fit_material({mode: f"examples/treloar/{mode}.csv" for mode in modes}, max_stretch=3.0)
    >>> fitted.fits[0].form.label
    'ogden, 2 terms'
    >>> problem = pm.load("examples/small.toml").with_changes({"material": fitted.table})
    >>> problem.material.model
    'ogden'
    """

    fits: Sequence[Fit]
    tests: Sequence[TensionTest]
    files: Sequence[Path]
    read: Sequence[str]
    density: str
    least_r2: float = LEAST_R2
    strain_from: str | None = None

    @property
    def table(self) -> dict[str, Any]:
        """The best model as the table ``[material]`` of a problem.

        Raises
        ------
        ProblemError
            If it is not plausible or not stable; the message names models that are.
        """
        if self._table is None:
            raise ProblemError(f"no [material] is written: {self._refused()}")
        return self._table

    def toml(self) -> str:
        """The same as text of a problem file; raises as `table` does."""
        return tomli_w.dumps({"material": self.table})

    @property
    def reports(self) -> list[str]:
        """What the tests do not decide, and what is doubtful, in sentences."""
        best = self.fits[0]
        shear = shear_modulus(best.form.energy, best.parameters)
        doubts = []
        if not SOFTEST <= shear <= STIFFEST:
            doubts.append(
                f"an initial shear modulus of {shear:.3g} MPa is not that of a rubber ({SOFTEST:g} to {STIFFEST:g} "
                "MPa); check the unit of the stress, and whether the strain is in per cent"
            )
        doubts += [*self._misses(), *sentences(best, self.tests)]
        return [*doubts, ": ".join(STRAIN_FROM[self.strain_from]), *reports(self.fits)]

    def _misses(self) -> Iterator[str]:
        """Where the best model is far from a test at small stretches, which least squares of stresses hardly see."""
        best = self.fits[0]
        for test in self.tests:
            seen = test.stress > 0.0
            stretch, off = test.stretch[seen], best.stress(test.stretch[seen], test.mode) / test.stress[seen] - 1.0
            far = np.abs(off) > OFF
            if far.sum() >= FEW and (until := stretch[far].max()) < SMALL * stretch.max():
                word, ends = "below" if np.median(off[far]) < 0.0 else "above", 100 * np.abs(off[far])
                yield (
                    f"{best.form.label} is {ends.min():.0f} to {ends.max():.0f} % {word} the {test.mode} test at "
                    f"{far.sum()} points up to a stretch of {until:.3g}, since large stresses weigh most in a fit; "
                    "if the body stretches its rubber no further than that, fit this part of the test alone: "
                    f"max_stretch = {until:.2g} (--max-stretch {until:.2g})"
                )

    def records(self) -> list[dict[str, Any]]:
        """Every model with its parameters and the verdicts on it, for JSON."""
        return [_record(one) | {"strain_from": self.strain_from} for one in self.fits]

    def plot(self, path: str | Path | None = None) -> Figure:
        """Nominal stress over stretch in all three modes: tests, models, and the band that the tests leave open.

        Parameters
        ----------
        path : file in which the figure is saved, if given: .png, .pdf or .svg.

        Raises
        ------
        ProblemError
            If the file cannot be written.
        """
        from pneumorph.interface.drawing import saved
        from pneumorph.output.fit import fits_figure

        figure = fits_figure(self.tests, self.fits, _names_of(self.files))
        return figure if path is None else saved(figure, Path(path))

    def _repr_html_(self) -> str:
        from pneumorph.interface.html import fit_html

        return fit_html(self.fits, self.reports)

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``fit.png``, ``fit.json`` and, for a plausible model, ``material.toml`` into a folder.

        Raises
        ------
        ProblemError
            If it cannot be written.
        """
        folder = Path(folder)
        texts = {"fit.json": json.dumps(self.records(), indent=2, allow_nan=False) + "\n"}
        if self._table is not None:
            texts["material.toml"] = self.toml()
        with writing(folder, "name another folder"):
            folder.mkdir(parents=True, exist_ok=True)
            self.plot(folder / "fit.png")
            for name, text in texts.items():
                atomic.write_bytes(folder / name, text.encode())
        return [folder / name for name in ("fit.png", *texts)]

    @cached_property
    def _table(self) -> dict[str, Any] | None:
        """None where the best model is not acceptable, or not valid in a problem file."""
        best = self.fits[0]
        if not best.is_acceptable or best.r2 < self.least_r2:
            return None
        table = {
            "name": self.files[0].stem,
            "model": best.form.model,
            **parameters(best),
            # Of any rubber, until its shear modulus is known.
            "bulk_modulus": "9 GPa",
            "density": self.density,
            "valid_stretch": float(f"{best.reach:.4g}"),
            "covariance": rows_of(relative_covariance(best)),
            "source": f"fitted to {_names_of(self.files)}, R2 {best.r2:.4f}; {STRAIN_FROM[self.strain_from][0]}; "
            f"bulk modulus: {BULK_RATIO:g} times shear, assumed",
        }
        try:
            shear = _reader.validate_python(table).initial_shear_modulus
        except ValidationError:
            return None
        return table | {"bulk_modulus": f"{BULK_RATIO * shear:.4g} MPa"}

    def _refused(self) -> str:
        """Why there is no table, and which models can be had."""
        best = self.fits[0]
        if best.is_acceptable and best.r2 < self.least_r2:
            return (
                f"{best.form.label} fits badly, R² {best.r2:.3g}, below {self.least_r2:g}; look at fit.png, leave out "
                "what does not belong to the first loading (max_stretch, skip), or accept it by least_r2 (--least-r2)"
            )
        shear = shear_modulus(best.form.energy, best.parameters)
        if best.is_acceptable and shear > 0.0 and (reason := no_rubber(3.0 * shear)):
            return f"the initial shear modulus of {best.form.label} is {shear:.3g} MPa, {reason}"
        had = [one.form.label for one in self.fits[1:] if one.is_acceptable]
        if had:
            instead = f"use one of {', '.join(had)}"
        elif len({one.form.model for one in self.fits}) == 1:
            instead = "the model all tries the others"
        else:
            instead = "give more modes (equibiaxial, planar) or a smaller max_stretch"
        why = ", ".join(faults(best)) or "without a positive initial shear modulus"
        return f"{best.form.label} is {why}; {instead}"


def fit_material(
    tests: Files | Mapping[str, Files],
    model: str = "all",
    density: str = "1.1 g/cm^3",
    *,
    max_stretch: float | None = None,
    weights: Mapping[str, float] | None = None,
    stress: str | None = None,
    strain: str | None = None,
    strain_column: str | None = None,
    stress_column: str | None = None,
    stress_unit: str | None = None,
    skip: int = 0,
    gauge_length: str | None = None,
    section: str | None = None,
    least_r2: float = LEAST_R2,
    strain_from: str | None = None,
) -> MaterialFit:
    """Fit rubber models to tension tests and judge them in all modes.

    Parameters
    ----------
    tests : files of uniaxial tests, or {mode: files}
        CSV or text, as testing machines write them. Modes are uniaxial, equibiaxial and planar (pure shear).
    model : neo-hookean, mooney-rivlin, yeoh, gent, arruda-boyce, ogden, or all.
    density : for the table ``[material]``; a tension test does not determine it.
    max_stretch : largest stretch that the rubber will bear; points beyond it are left out.
    weights : {mode: number}
        How much the tests of a mode count, by default 1.
    stress : nominal or true, where a file's title does not say it.
    strain : stretch, strain, percent or true, where a file's title does not say it.
    strain_column, stress_column : title or number (from 1) of a column.
    stress_unit : e.g. "kPa" or "psi".
    skip : number of lines left out at the start of the files.
    gauge_length : undeformed length, for files of displacement, e.g. "25 mm".
    section : undeformed section, for files of force, e.g. "4 mm x 2 mm" or "8 mm^2".
    least_r2 : coefficient of determination below which no table is given.
    strain_from : extensometer or crosshead
        Whether strain was measured on the specimen itself (an extensometer, marks on photographs) or is the motion of
        the crosshead or the clamps, which is larger.

    Raises
    ------
    ProblemError
        If a file cannot be read, or an argument does not fit.

    Examples
    --------
    >>> import pneumorph as pm
    >>> fitted = pm.fit_material("examples/treloar/uniaxial.csv", model="neo-hookean", max_stretch=2.0)
    >>> fitted.table["model"], fitted.read[0]
    ('neo-hookean', 'uniaxial.csv: uniaxial tension, 24 points')
    """
    if model != "all" and model not in MODELS:
        raise ProblemError(f'model: "{model}" is not a known model; use one of {", ".join(MODELS)} or all')
    for name, value, known in (
        ("stress", stress, ("nominal", "true")),
        ("strain", strain, ("stretch", "strain", "percent", "true")),
        ("strain_from", strain_from, ("extensometer", "crosshead")),
    ):
        if value is not None and value not in known:
            raise ProblemError(f'{name}: "{value}" is not known; use one of {", ".join(known)}')
    if max_stretch is not None and not max_stretch > 1.0:
        raise ProblemError(f"max_stretch: {max_stretch:g} is not above 1, the stretch at rest; raise it")
    units.parse_positive("density", density, units.DENSITY)
    length = None if gauge_length is None else units.parse_positive("gauge_length", gauge_length, units.LENGTH)
    area = None if section is None else _area(section)
    reading = Reading(strain_column, stress_column, skip, strain, stress, stress_unit, length, area)
    files = _by_mode(tests)
    counts = _weights(weights or {}, [mode for mode, _ in files])
    read = [_read(mode, path, counts.get(mode, 1.0), reading, max_stretch) for mode, path in files]
    fits = fit_all([test for test, _ in read], None if model == "all" else model)
    if not fits:
        raise ProblemError(f"model: there are too few points for {model}; give more, or fit neo-hookean")
    lines = [line for _, told in read for line in told]
    paths = [path for _, path in files]
    return MaterialFit(fits, [test for test, _ in read], paths, lines, density, least_r2, strain_from)


def parameters(one: Fit) -> dict[str, Any]:
    """The parameters of a fit as in a problem file, to six digits."""

    def written(key: str, value: Any) -> Any:
        if isinstance(value, tuple):
            return [written(key, part) for part in value]
        if isinstance(value, dict):
            return {part: written(part, number) for part, number in value.items()}
        pure = key in ("limit", "locking_stretch", "exponent")
        return float(f"{value:.6g}") if pure else f"{value:.6g} MPa"

    return {key: written(key, value) for key, value in material_keys(one.form, one.parameters)}


def relative_covariance(one: Fit) -> np.ndarray:
    """The covariance of the relative errors of the parameters that a problem file has."""
    shown = kept(one)
    size = one.parameters[shown]
    return one.covariance[np.ix_(shown, shown)] / np.outer(size, size)


def _record(one: Fit) -> dict[str, Any]:
    def finite(value: float) -> float | None:
        return float(value) if np.isfinite(value) else None

    return {
        "model": one.form.model,
        "form": one.form.label,
        "parameters": parameters(one),
        "not_determined": list(undetermined(one)),
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


def _names_of(files: Sequence[Path]) -> str:
    return ", ".join(path.name for path in files)


def _by_mode(tests: Files | Mapping[str, Files]) -> list[tuple[str, Path]]:
    given = tests if isinstance(tests, Mapping) else {"uniaxial": tests}
    listed = []
    for name, files in given.items():
        if name not in MODES:
            raise ProblemError(f'tests: "{name}" is not a mode; use one of {", ".join(MODES)}')
        several = [files] if isinstance(files, str | Path) else files
        listed += [(MODES[name], Path(path)) for path in several]
    if not listed:
        raise ProblemError("tests: no file is given; give at least one")
    return listed


def _area(text: str) -> float:
    """mm² of "4 mm x 2 mm" or "8 mm^2"."""
    sides = re.split(r"\s*[x×*]\s*", text)
    if len(sides) == 2:
        width, thickness = (units.parse_positive("section", side, units.LENGTH) for side in sides)
        return width * thickness
    return units.parse_positive("section", text, units.AREA)


def _weights(given: Mapping[str, float], modes: list[str]) -> dict[str, float]:
    weights = {}
    for name, weight in given.items():
        if name not in MODES or not isinstance(weight, int | float) or not 0 < weight <= 1e6:
            raise ProblemError(f"weights: {name} {weight} is not a mode and a positive number; give e.g. planar 0.5")
        if MODES[name] not in modes:
            raise ProblemError(f"weights: {name}: there is no file of this mode; give one, or leave the weight out")
        weights[MODES[name]] = weight
    return weights


def _read(mode: str, path: Path, weight: float, reading: Reading, most: float | None) -> tuple[TensionTest, list[str]]:
    """A test from a file, and how it was read."""
    read = read_tension(path, reading)
    lines = [f"{path.name}: {mode} tension, {len(read.stretch)} points", *(f"  {line}" for line in read.told)]
    within = read.stretch <= (most or np.inf)
    if not within.all():
        lines.append(f"  {np.count_nonzero(~within)} points beyond the largest stretch of {most:g} are left out")
    if np.count_nonzero(within) < FEWEST or not read.stress[within].max() > 0:
        # The fifth point, or the first that bears anything where that is later.
        needed = max(np.sort(read.stretch)[FEWEST - 1], read.stretch[read.stress > 0].min())
        least = np.ceil(1e3 * needed) / 1e3
        raise ProblemError(
            f"max_stretch: {most:g} leaves {np.count_nonzero(within)} of the {len(within)} points of {path}; a "
            f"fit takes {FEWEST}, some of them with stress; raise it to {least:g} (--max-stretch {least:g}) or "
            "more, or measure more points below it"
        )
    stretch, stress = read.stretch[within], read.stress[within]
    if len(stretch) > MOST_POINTS:
        lines.append(f"  neighbouring points are averaged to {MOST_POINTS}")
        stretch, stress = (
            np.array([part.mean() for part in np.array_split(values, MOST_POINTS)]) for values in (stretch, stress)
        )
    return TensionTest(stretch, stress, mode, weight), lines
