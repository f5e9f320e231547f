"""The modulus of a rubber from a strip that bends under its own weight, as a table [material]."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from pneumorph import atomic, units
from pneumorph.errors import ProblemError, writing
from pneumorph.mechanics.material.beam import FEWEST_FOR_TILT, BeamModulus, Strip, from_deflection, from_points
from pneumorph.problem.line import read_line
from pneumorph.problem.material import elastomer, library
from pneumorph.problem.scaled import scaled
from pneumorph.problem.stiffness import INCOMPRESSIBLE

THICK = 6.0
"""Length over thickness below which the clamp, which keeps the section from narrowing, makes a strip look stiffer."""

STEEP = 0.03
"""Deflection over length below which a photograph tells little."""


@dataclass(frozen=True, eq=False, repr=False)
class BeamFit:
    """A rubber fitted to a strip under its own weight.

    Attributes
    ----------
    found : BeamModulus
        Young's modulus with its deviation.
    table : dict
        The table ``[material]`` of a problem.
    points : int
        Measured points; 0 for a deflection alone.

    Examples
    --------
    >>> import pneumorph as pm
    >>> fitted = pm.fit_beam(deflection="6.5 mm", length="100 mm", section="30 mm x 30 mm", density="1.07 g/cm^3")
    >>> print(fitted.table["model"], fitted.table["shear_modulus"])
    neo-hookean 0.09885 MPa
    """

    found: BeamModulus
    table: dict[str, Any]
    points: int

    def toml(self) -> str:
        """The table as text of a problem file."""
        return tomli_w.dumps({"material": self.table})

    def write(self, folder: str | Path) -> Path:
        """Write ``material.toml`` into a folder.

        Raises
        ------
        ProblemError
            If it cannot be written.
        """
        folder = Path(folder)
        with writing(folder, "name another folder"):
            folder.mkdir(parents=True, exist_ok=True)
            atomic.write_bytes(folder / "material.toml", self.toml().encode())
        return folder / "material.toml"

    @property
    def reports(self) -> list[str]:
        """What was found, and what is doubtful, in sentences."""
        found, strip = self.found, self.found.strip
        young, wide = 1e3 * found.young, 1.0 + 1.96 * found.deviation
        told = [
            f"Young's modulus {young:.3g} kPa, shear modulus {young / 3.0:.3g} kPa; with 95 % between "
            f"{young / 3.0 / wide:.3g} and {young / 3.0 * wide:.3g} kPa",
        ]
        if self.points >= FEWEST_FOR_TILT:
            side, tilt = "below" if strip.tilt >= 0 else "above", abs(math.degrees(strip.tilt))
            told.append(
                f"the clamp points {tilt:.2g}° {side} the horizontal; "
                f"points are {found.misfit:.2g} mm from the line (root mean square)"
            )
        if strip.length < THICK * strip.thickness:
            slender = strip.length / strip.thickness
            told.append(
                f"the strip is only {slender:.2g} times as long as thick: its clamp makes it look stiffer by some per "
                f"cent; cast one of at least {THICK:g} times"
            )
        return told

    def __str__(self) -> str:
        return "\n".join(self.reports)

    __repr__ = __str__


def fit_beam(
    line: str | Path | None = None,
    *,
    length: str,
    section: str,
    density: str,
    deflection: str | None = None,
    error: str = "0.5 mm",
    tip_mass: str | None = None,
    like: str | None = None,
) -> BeamFit:
    """Find the modulus of a rubber from a strip that is clamped horizontally and bends under its own weight.

    Parameters
    ----------
    line : file with points of the photographed centre line
        Columns x and y with their unit; the first row is the point at the clamp.
    length : of the free part, from the clamp to the tip, undeformed.
    section : width x thickness, the thickness in the vertical plane, e.g. "20 mm x 8 mm".
    density : of the rubber.
    deflection : how far the tip is below the clamp, in place of a file.
    error : standard deviation of the deflection.
    tip_mass : of a body that hangs at the tip.
    like : a rubber of the library whose stiffening at large stretches is kept; by default the rubber is neo-Hookean.

    Raises
    ------
    ProblemError
        If an argument does not fit, or no rubber bends like this.

    Examples
    --------
    >>> import pneumorph as pm
    >>> fitted = pm.fit_beam(
    ...     deflection="6.5 mm", length="100 mm", section="30 mm x 30 mm", density="1.07 g/cm^3", like="Dragon Skin 20"
    ... )
    >>> fitted.table["model"], round(fitted.table["scatter"], 2)
    ('ogden', 0.08)
    """
    if (line is None) == (deflection is None):
        raise ProblemError("beam: give a file with points of the centre line, or the deflection of the tip")
    if like is not None and like not in library():
        raise ProblemError(f'like: "{like}" is not in the library; use one of {", ".join(library())}')
    sides = re.split(r"\s*[x×*]\s*", section)
    if len(sides) != 2:
        raise ProblemError(f'section: "{section}" is not width x thickness; write e.g. "20 mm x 8 mm"')
    width, thickness = (units.parse_positive("section", side, units.LENGTH) for side in sides)
    mass = 0.0 if tip_mass is None else units.parse_positive("tip_mass", tip_mass, units.MASS)
    strip = Strip(
        length=units.parse_positive("length", length, units.LENGTH),
        width=width,
        thickness=thickness,
        density=units.parse_positive("density", density, units.DENSITY),
        gravity=units.STANDARD_GRAVITY,
        load=mass * units.STANDARD_GRAVITY,
    )
    try:
        if line is not None:
            points = read_line(Path(line))
            deepest, found, count = float(points[:, 1].max()), from_points(strip, points), len(points)
            where = f"the centre line in {Path(line).name}"
        else:
            deepest = units.parse_positive("deflection", deflection, units.LENGTH)
            found = from_deflection(strip, deepest, units.parse_positive("error", error, units.LENGTH))
            where, count = f"a tip {deepest:g} mm below its clamp", 0
    except ValueError:
        raise ProblemError(
            f"beam: no rubber of this density bends like this on a free length of {strip.length:g} mm; check the "
            "sizes, their units and which side of the section is vertical"
        ) from None
    if deepest < STEEP * strip.length:
        raise ProblemError(
            f"beam: the tip is only {deepest:.2g} mm below the clamp, too little; take a longer or thinner strip"
        )
    return BeamFit(found, _table(found, strip, density, like, where), count)


def _table(found: BeamModulus, strip: Strip, density: str, like: str | None, where: str) -> dict[str, Any]:
    shear, scatter = found.young / 3.0, float(f"{found.deviation:.2g}")
    source = (
        f"fitted to {where}, of a strip of {strip.length:g} x {strip.width:g} x {strip.thickness:g} mm under its own "
        "weight"
    )
    if like is None:
        return {
            "name": "own batch",
            "model": "neo-hookean",
            "shear_modulus": f"{shear:.4g} MPa",
            "bulk_modulus": f"{INCOMPRESSIBLE * shear:.4g} MPa",
            "density": density,
            "scatter": scatter,
            "source": f"{source}; bulk modulus: {INCOMPRESSIBLE:g} times shear, assumed",
        }
    known = elastomer(like)
    factor = float(f"{shear / known.initial_shear_modulus:.5g}")
    batch = scaled(
        known,
        factor,
        name=f"{like}, own batch",
        source=f"{source}; all moduli of {like} times {factor:.5g}",
        scatter=scatter,
    )
    table = batch.model_dump(mode="json", exclude_none=True) | {"density": density}
    return {key: value for key, value in table.items() if value is not False}
