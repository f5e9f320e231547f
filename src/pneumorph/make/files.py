"""All files for manufacturing a body, in one folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from pneumorph.atomic import publish
from pneumorph.doing import doing
from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.make.checks import Check, check_mesh, check_step
from pneumorph.make.mould.effect import PortEffect
from pneumorph.make.mould.files import make_mould
from pneumorph.make.mould.plan import Plan
from pneumorph.make.printing import write_3mf, write_stl
from pneumorph.make.silicone.files import make_silicone_mould
from pneumorph.make.silicone.plan import SiliconePlan
from pneumorph.make.silicone.sag import Sag
from pneumorph.make.solid import fill_chamber
from pneumorph.make.step import write_body_step, write_chamber_step
from pneumorph.make.triangles import triangulate
from pneumorph.problem import Problem
from pneumorph.processes import temporary_folder


@dataclass(frozen=True)
class MadeFiles:
    """The files that were written, and their checks.

    Attributes
    ----------
    files : tuple of Path
        The files written, ``checks.json`` last.
    checks : tuple of Check
        The results of checking them.
    """

    files: tuple[Path, ...]
    checks: tuple[Check, ...]

    @property
    def failed(self) -> tuple[Check, ...]:
        """The checks that were not passed."""
        return tuple(check for check in self.checks if not check.passed)


def make(
    body: Body,
    folder: Path,
    chord: float = 0.02,
    problem: Problem | None = None,
    effects: Callable[[Plan], Sequence[PortEffect]] | None = None,
    sags: Callable[[SiliconePlan], Sequence[Sag]] | None = None,
) -> MadeFiles:
    """Write a body as STEP, 3MF and STL, every chamber as STEP, and the results of checking them as ``checks.json``.

    Parameters
    ----------
    body : Body
        In mm.
    folder : Path
        Where to write; created if it does not exist. Existing files of the same names are replaced.
    chord : float
        Largest distance in mm between the surfaces and the triangles of 3MF and STL.
    problem : Problem, optional
        The problem that the body was designed for. With it the body's mould is made too, in the folder ``mould``.
    effects : callable, optional
        Computes how much the ports of a planned mould change the motion of the body.
    sags : callable, optional
        Computes how far planned silicone negatives sag.

    Raises
    ------
    OSError
        If the folder or a file cannot be written.
    ComputationError
        If the chord error needs too many triangles, see `triangulate`; or if the body cannot be moulded. The files of
        the body are written first.
    """
    return published(folder, lambda work: _make(body, work, chord, problem, effects, sags))


def published(folder: Path, write: Callable[[Path], MadeFiles]) -> MadeFiles:
    """What is written into a folder that nobody else writes in, put into another one.

    Raises
    ------
    ComputationError
        Raised by `write`; what is complete is put there first.
    """
    with temporary_folder() as work:
        try:
            made = write(work)
        except ComputationError:
            _publish(work, folder)
            raise
        _publish(work, folder)
        files = [folder / path.relative_to(work) for path in made.files]
    return MadeFiles(tuple(files), made.checks)


def _publish(work: Path, folder: Path) -> None:
    """Put what is complete into the folder, if there is anything; links that are in it are not followed."""
    if any(work.iterdir()):
        folder.mkdir(parents=True, exist_ok=True)
        publish(work, folder)


def _make(
    body: Body,
    folder: Path,
    chord: float,
    problem: Problem | None,
    effects: Callable[[Plan], Sequence[PortEffect]] | None,
    sags: Callable[[SiliconePlan], Sequence[Sag]] | None,
) -> MadeFiles:
    """See `make`; in a folder that nobody else writes in."""
    # First, so that a chord error that is too small is refused before anything is written.
    with doing("triangulating the surfaces"):
        parts = {"body": triangulate(body.surfaces, chord)}
        parts |= {f"chamber {chamber.name}": triangulate([fill_chamber(chamber)], chord) for chamber in body.chambers}
    step, mesh, plain = folder / "body.step", folder / "body.3mf", folder / "body.stl"
    cores = {folder / f"chamber_{chamber.name}.step": chamber for chamber in body.chambers}
    with doing("writing the body and its chambers"):
        write_body_step(body, step)
        for path, chamber in cores.items():
            write_chamber_step(chamber, path)
        write_3mf(mesh, parts)
        write_stl(plain, parts["body"])
    with doing("checking the files of the body") as far:
        far(step.name)
        checks = [*check_step(step, body.surfaces)]
        for path, chamber in cores.items():
            far(path.name)
            checks += check_step(path, [fill_chamber(chamber)])
        for path in (mesh, plain):
            far(path.name)
            checks += check_mesh(path, body.surfaces, chord)
    report = folder / "checks.json"
    report.write_text(as_json(checks), encoding="utf-8")
    files = [step, *cores, mesh, plain]
    if problem is not None:
        if problem.region:
            raise ComputationError(
                f"a mould needs a body of one rubber, but this one has regions ({problem.region[0].name}, …); only the "
                "CAD and the triangles of the body are written"
            )
        if problem.tubes.bent:
            raise ComputationError(
                "a mould needs a body with a straight axis; only the CAD and the triangles of this one, which has "
                "body.axis, are written"
            )
        if problem.tubes.dome:
            raise ComputationError(
                "a mould needs a body with a flat tip; only the CAD and the triangles of this one, which has "
                "body.dome, are written"
            )
        if problem.make.method == "silicone mould":
            moulded, proved = make_silicone_mould(body, problem, folder / "mould", chord, effects, sags)
        else:
            moulded, proved = make_mould(body, problem, folder / "mould", chord, effects)
        files += moulded
        checks += proved
        report.write_text(as_json(checks), encoding="utf-8")
    return MadeFiles((*files, report), tuple(checks))


def as_json(checks: Sequence[Check]) -> str:
    """What ``checks.json`` contains."""
    content = [{**asdict(check), "passed": check.passed} for check in checks]
    return json.dumps({"checks": content}, indent=2, allow_nan=False) + "\n"
