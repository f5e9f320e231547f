"""A body's rubber, walls and pressures from a measured curve, and the problem with them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from pneumorph.analysis.along import Curve
from pneumorph.analysis.calibration import PARAMETERS, Calibration, calibrate, covariance_after
from pneumorph.analysis.constants import changed, rubbers_in
from pneumorph.errors import Hopeless, ProblemError
from pneumorph.geometry import Body
from pneumorph.interface.other_loads import under_loads
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting
from pneumorph.problem.components import MOTION_OF, PUSH, PUSHES
from pneumorph.problem.constants import BULK, constants, is_modulus, may_be_constant, named
from pneumorph.problem.covariance import rows_of
from pneumorph.problem.material import Material
from pneumorph.problem.measured import Measured, read_measured
from pneumorph.problem.quantities import shown
from pneumorph.problem.reasons import faults_of
from pneumorph.problem.regions import REST
from pneumorph.problem.scaled import scaled

WORDS = {
    "modulus": "moduli of the rubber",
    "wall": "rubber at the chambers",
    "pressure": "pressure",
}


@dataclass(frozen=True, eq=False, repr=False)
class CalibratedDesign:
    """What a measured curve says of a design.

    Attributes
    ----------
    problem : Problem
        With the rubber of the fit, to design with.
    measured : Measured
    fit : Calibration

    Examples
    --------
    >>> import pneumorph as pm
    >>> fitted = pm.open_run("runs/small").best.calibrate("curve.csv")  # doctest: +SKIP
    >>> fitted.fit.factor, fitted.problem.to_toml()  # doctest: +SKIP
    """

    problem: Problem
    measured: Measured
    fit: Calibration

    def __str__(self) -> str:
        return "\n".join(_lines(self.measured, self.fit))

    __repr__ = __str__


def calibrated(
    problem: Problem,
    body: Body,
    task: Task,
    pressures: Mapping[str, float],
    path: Path,
    names: Sequence[str],
    block: Iterable[str] = (),
) -> CalibratedDesign:
    """Fit a body of a problem to the curve in a file.

    Parameters
    ----------
    problem, body : the body is one of the problem's.
    task : whose loads act.
    pressures : {chamber: MPa} of chambers without a column.
    path : the file.
    names : what is fitted, of `PARAMETERS` and of the constants of the rubbers.
    block : motions of the tip that were held, "shift_x" or "shift_x=2 mm".

    Raises
    ------
    ProblemError
        If the file has no curve, or a name is unknown.
    ComputationError
        If a state is not found.
    Hopeless
        If the curve is not one of this body, or does not determine what is fitted.
    """
    require_parameters(names, problem)
    measured, curve = curve_in(path, problem, pressures)
    fit = calibrate(problem, body, as_measured(problem, task, measured.quantity, block), curve, names)
    return CalibratedDesign(with_found(problem, fit), measured, fit)


def as_measured(problem: Problem, task: Task, quantity: str, block: Iterable[str] = ()) -> Task:
    """A task whose tip is held as it was measured: where a force was measured along a motion, this is held too.

    Parameters
    ----------
    problem, task : one of its tasks.
    quantity : what was measured.
    block : motions that were held, "shift_x" where it is at rest, or "shift_x=2 mm".

    Raises
    ------
    ProblemError
        If a motion is unknown, or there is no plate to hold.
    """
    pushed = [quantity.removeprefix(PUSH)] if quantity in PUSHES else []
    alone = problem.model_copy(update={"task": (task,)})
    held = under_loads(alone, {}, block, pushed)
    (task,) = held.task
    if quantity in {MOTION_OF.get(name, name) for name in acting(held, task).hold.values}:
        raise ProblemError(
            f"{quantity} was measured, and the tip is held against it; give the force, push_{quantity}, or leave out "
            "what holds it"
        )
    return task


def curve_in(path: Path, problem: Problem, pressures: Mapping[str, float]) -> tuple[Measured, Curve]:
    """What a file says, and the curve with the pressures (MPa) of chambers that have no column.

    Raises
    ------
    ProblemError
        If the file has no curve of the problem's body.
    """
    chambers = [each.name for each in problem.body.chamber]
    measured = read_measured(path, chambers)
    count = len(measured.values)
    columns = [measured.pressures.get(name, np.full(count, pressures.get(name, 0.0))) for name in chambers]
    return measured, Curve(np.column_stack(columns), measured.quantity, measured.values)


def require_parameters(names: Sequence[str], problem: Problem | None = None) -> None:
    """Refuse names that are none of `PARAMETERS` and of no constant, each at most once and at least one.

    Parameters
    ----------
    names : what is to be fitted.
    problem : whose rubbers have the constants; without it, those of any rubber are let pass.
    """
    known = {}
    if problem is not None:
        of_regions = rubbers_in(problem).items()
        known = {named(region, name): value for region, each in of_regions for name, value in constants(each).items()}
    for name in names:
        if name not in PARAMETERS and name not in known and (known or not may_be_constant(name)):
            own = (
                f"constants of its rubber: {', '.join(known)}"
                if known
                else "constants of the rubber such as c10 or mu1"
            )
            raise ProblemError(f'--fit: "{name}" cannot be fitted; use {", ".join(PARAMETERS)}, or {own}')
        if known.get(name) == 0.0:
            raise ProblemError(f"--fit: {name} is 0 in [material]; give it a value there to start from")
    moduli = {name for name in known if is_modulus(name.rpartition(".")[2]) and not name.endswith(BULK)}
    if moduli and "modulus" in names and moduli <= set(names):
        raise ProblemError(
            f"--fit: modulus is a factor of all moduli, so it is one too many beside {', '.join(sorted(moduli))}; "
            "leave it out"
        )
    if not names or len(set(names)) < len(names):
        raise ProblemError(f"--fit: give each of {', '.join(PARAMETERS)} and constants at most once, and at least one")


def with_moduli(problem: Problem, factor: float) -> Problem:
    """The problem with the moduli of all its rubbers times a factor."""
    if factor == 1.0:
        return problem
    regions = tuple(
        region.model_copy(update={"material": _scaled(region.material, factor)}) for region in problem.region
    )
    return problem.model_copy(update={"material": _scaled(problem.material, factor), "region": regions})


def with_found(problem: Problem, fit: Calibration) -> Problem:
    """The problem with the rubbers of a fit, and the covariances of their constants.

    Raises
    ------
    Hopeless
        If the constants that were found are none of a rubber.
    """
    found = {}
    for region, material in changed(problem, fit.constants).items():
        covariance = covariance_after(problem, fit, region)
        rows = tuple(map(tuple, rows_of(covariance))) if covariance.any() else ()
        own = {named(region, name): name for name in constants(material)}
        told = [f"{own[name]} times {1.0 + by:.4g}" for name, by in fit.constants.items() if name in own]
        if told or fit.factor != 1.0:
            material = _scaled(material.model_copy(update={"covariance": rows}), fit.factor, told)
        found[region] = material
    regions = tuple(each.model_copy(update={"material": found[each.name]}) for each in problem.region)
    rest = found[REST if regions else ""]
    return problem.model_copy(update={"material": rest, "region": regions})


def _scaled(material: Material, factor: float, told: Sequence[str] = ()) -> Material:
    source = f"calibrated: {', '.join([f'moduli times {factor:.4g}'] * (factor != 1.0) + list(told))}"
    try:
        return scaled(material, factor, name=f"{material.name}, calibrated", source=source)
    except ValidationError as error:
        key, reason = faults_of(error)[0]
        raise Hopeless(f"no rubber has the constants found: {key} {reason}; fit fewer of them") from None


def _lines(measured: Measured, fit: Calibration) -> Iterator[str]:
    told = shown(measured.quantity)
    for name, value, half in zip(fit.names, fit.values, fit.half, strict=True):
        yield f"{WORDS.get(name, name)}: {value:+.3g} ± {half:.2g} {PARAMETERS.get(name, '%')} (95 %)"
    for name, by in fit.short.items():
        yield (
            f"the search ended before the nearest curve: its last step still changed {WORDS.get(name, name)} by "
            f"{by:+.2g} {PARAMETERS.get(name, '%')}; fit fewer parameters, or measure more points"
        )
    for one, other in fit.together:
        yield f"this curve does not tell {WORDS.get(one, one)} and {WORDS.get(other, other)} apart; fit one of them"
    for name in fit.undetermined:
        yield f"this curve does not determine {name}; leave it out, or measure where the rubber is stretched more"
    yield f"{told.word} in {told.unit}: measured, as designed, calibrated"
    pressures = list(measured.pressures.items())
    for k, row in enumerate(zip(measured.values, fit.before, fit.after, strict=True)):
        at = ", ".join(f"{name} {1e3 * each[k]:.4g} kPa" for name, each in pressures)
        yield f"  {at:<20}" + "".join(f"{told.size * each:>10.3f}" for each in row)
    for word, curve in (("as designed", fit.before), ("calibrated", fit.after)):
        rms = told.size * float(np.sqrt(np.mean((curve - measured.values) ** 2)))
        yield f"root mean square of the differences, {word}: {rms:.3g}{told.after}"
