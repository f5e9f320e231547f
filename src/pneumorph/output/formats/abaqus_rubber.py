"""Rubbers in the words of the manuals of CalculiX and Abaqus, which agree but for the numbers of terms.

Their energies are those of `mechanics.material.energies` with U = (J − 1)²/D₁, D₁ = 2/κ; with Arruda and Boyce's model
U = ((J² − 1)/2 − ln J)/D₁, which is the same up to the third order in J − 1.
"""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.rubber import Rubber

MOST_YEOH, MOST_OGDEN = 3, 3
"""Terms that CalculiX 2.20 reads; Abaqus reads six of both."""

_MODELS = (
    energies.neo_hookean,
    energies.mooney_rivlin,
    energies.polynomial,
    energies.yeoh,
    energies.arruda_boyce,
    energies.ogden,
)

_PER_LINE = 8
"""Constants on a line of *HYPERELASTIC."""

_NONE = 1e20
"""Dᵢ of a term (J − 1)²ⁱ/Dᵢ that is not there: zero means so in Abaqus, but not in CalculiX. 1/MPa."""


def can_hold(rubber: Rubber) -> bool:
    """Whether the manuals have the model; they have none with a limit of Ī₁, as Gent's, or of softened rubber."""
    return rubber.isochoric in _MODELS


def hyperelastic(rubber: Rubber) -> Iterator[str]:
    """The keyword ``*HYPERELASTIC`` and its data, eight numbers a line; every model has as many Dᵢ as terms."""
    *own, bulk = (float(value) for value in rubber.parameters)
    keyword, terms, most = _form(rubber, len(own))
    if terms > most:
        yield f"** for Abaqus alone: CalculiX reads up to {most} terms"
    yield f"*HYPERELASTIC, {keyword}"
    data = [*_constants(rubber, own), 2 / bulk, *[_NONE] * (terms - 1)]
    for start in range(0, len(data), _PER_LINE):
        yield ", ".join(f"{number:.12e}" for number in data[start : start + _PER_LINE])


def _form(rubber: Rubber, count: int) -> tuple[str, int, int]:
    """The model with its number of terms, that number, and the most that CalculiX reads, for so many parameters."""
    match rubber.isochoric:
        case energies.neo_hookean:
            return "NEO HOOKE", 1, 1
        case energies.mooney_rivlin:
            return "MOONEY-RIVLIN", 1, 1
        case energies.polynomial:
            return "POLYNOMIAL, N=2", 2, 2
        case energies.yeoh:
            return f"REDUCED POLYNOMIAL, N={count}", count, MOST_YEOH
        case energies.arruda_boyce:
            return "ARRUDA-BOYCE", 1, 1
        case energies.ogden:
            return f"OGDEN, N={count // 2}", count // 2, MOST_OGDEN
    raise ValueError("no such model in the manuals; ask can_hold")


def _constants(rubber: Rubber, own: list[float]) -> list[float]:
    """Those before the Dᵢ."""
    return [own[0] / 2] if rubber.isochoric is energies.neo_hookean else own
