"""What is possible in a problem but hardly meant, in sentences for the commands to print."""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.problem.materials import materials
from pneumorph.problem.regions import REST
from pneumorph.problem.stiffness import HARD
from pneumorph.problem.tables import Tables


def doubts(problem: Tables) -> Iterator[str]:
    """A sentence for each."""
    for name, material in materials(problem).items():
        young = 3.0 * material.initial_shear_modulus
        if young > HARD:
            where = "" if name == REST else f' of region "{name}"'
            yield (
                f"the rubber{where} has a Young's modulus of about {young:.3g} MPa, hundreds of times that of the "
                "silicones of soft robots; air pressure hardly deforms it"
            )
