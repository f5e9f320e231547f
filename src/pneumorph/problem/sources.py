"""What other sources say of the rubbers of the library, how far they differ, and what time does to them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from pneumorph import units
from pneumorph.problem.material import Gent, NeoHookean, Ogden, RubberModel, Yeoh, elastomer, library
from pneumorph.problem.memory import MEMORY
from pneumorph.problem.stiffness import gent

MOST_DEVIATION = 0.5
"""Largest relative deviation of a modulus for which first derivatives tell anything."""


class OtherSource(NamedTuple):
    """The initial shear modulus of a rubber in MPa, and who gives it."""

    shear_modulus: float
    source: str


def other_sources(material: RubberModel) -> tuple[OtherSource, ...]:
    """What other sources give for a rubber of the library; none for other rubbers, or where none are known."""
    return tuple(_read(each, material) for each in _entry(material).get("others", []))


def chosen(material: RubberModel) -> str:
    """Why the library has the value that it has, among those of all sources; empty where there is one source alone."""
    return _entry(material).get("chosen", "")


def range_of(material: RubberModel) -> tuple[float, float] | None:
    """The least and the largest initial shear modulus in MPa by all sources; None where there is one alone."""
    others = other_sources(material)
    if not others:
        return None
    moduli = [material.initial_shear_modulus, *(each.shear_modulus for each in others)]
    return min(moduli), max(moduli)


def deviation_of(material: RubberModel) -> float | None:
    """Relative standard deviation of the moduli: what the material says, or else half the range of the sources.

    That half is one of logarithms, ln(largest/least)/2, so that all sources are within one deviation of the middle of
    their range, and at most `MOST_DEVIATION`. None where nothing is known.
    """
    if material.scatter is not None:
        return material.scatter
    ends = range_of(material)
    return None if ends is None else min(math.log(ends[1] / ends[0]) / 2.0, MOST_DEVIATION)


def largest_deviation(rubbers: Iterable[RubberModel]) -> float | None:
    """That of the rubber of which least is known; None where nothing is known of any."""
    return max(filter(None, map(deviation_of, rubbers)), default=None)


class History(NamedTuple):
    """What loading, unloading and time do to the moduli of a rubber: a relative standard deviation, and its source."""

    deviation: float
    source: str


def history_of(material: RubberModel) -> History | None:
    """What is known of creep and hysteresis of a rubber of the library; None where no public test tells."""
    entry = _entry(material).get("history")
    return None if entry is None else History(entry["deviation"], entry["source"])


def doubt(material: RubberModel) -> str | None:
    """A sentence on how well the moduli of a rubber are known; None where nothing is known of that."""
    ends = range_of(material)
    if ends is None:
        if not material.scatter:
            return None
        shear, scatter = 1e3 * material.initial_shear_modulus, 100 * material.scatter
        return f"{material.name}: the shear modulus is {shear:.3g} kPa ± {scatter:.2g} % (one standard deviation)"
    low, high = (f"{1e3 * end:.3g}" for end in ends)
    return (
        f"{material.name}: the shear modulus used is {1e3 * material.initial_shear_modulus:.3g} kPa, sources give "
        f"{low} to {high} kPa; measure your batch before you cast"
    )


def told(material: RubberModel) -> Iterator[str]:
    """Sentences on how well the moduli of a rubber are known, and in which state it is elastic if it has others."""
    if sentence := doubt(material):
        yield sentence
    if material.remembers:
        others = [f"{100 * material.relaxing:.2g} % of its moduli relax"] if material.relaxation else []
        others += ["earlier stretches soften it"] if material.softening is not None else []
        yield (
            f'{material.name}: elastic here, in the state "{material.state}"; {" and ".join(others)}, which simulate '
            "--rate and --cycles follow"
        )


def at_100_percent(material: RubberModel) -> float:
    """Nominal stress in MPa at a stretch of 2 in uniaxial tension, of an incompressible rubber."""
    neo_hookean, beyond_3 = 2.0 - 1.0 / 4.0, 4.0 + 1.0 - 3.0  # λ − 1/λ² and Ī₁ − 3
    match material:
        case NeoHookean():
            return material.shear_modulus * neo_hookean
        case Gent():
            return material.shear_modulus * neo_hookean / (1.0 - beyond_3 / material.limit)
        case Yeoh():
            slopes = (k * c * beyond_3 ** (k - 1) for k, c in enumerate(material.coefficients, 1))
            return 2.0 * sum(slopes) * neo_hookean
        case Ogden():
            powers = (
                (term, 2.0 ** (term.exponent - 1.0) - 0.5 ** (term.exponent / 2.0 + 1.0)) for term in material.terms
            )
            return sum(2.0 * term.modulus / term.exponent * power for term, power in powers)
    raise NotImplementedError(f"no rubber of the library has the model of {material.name}")


def _entry(material: RubberModel) -> Mapping[str, Any]:
    """What the library has of a rubber that is its own."""
    known = library()
    if material.name not in known:
        return {}
    # What it remembers is beside what the library has.
    own = elastomer(material.name)
    return known[material.name] if material.model_copy(update={key: getattr(own, key) for key in MEMORY}) == own else {}


def _read(entry: Mapping[str, Any], material: RubberModel) -> OtherSource:
    """A source gives a shear modulus, Young's modulus, the stress at 100 % strain, or a hardness."""
    source = entry.get("source", "")
    if "hardness" in entry:
        hardness = float(entry["hardness"])
        return OtherSource(gent(hardness) / 3.0, f"its hardness, Shore A {hardness:g}, by Gent's relation of 1958")
    if "at_100_percent" in entry:
        stress = entry["at_100_percent"]
        factor = units.parse(stress, units.MODULUS) / at_100_percent(material)
        modulus = factor * material.initial_shear_modulus
        return OtherSource(modulus, f"{source}: {stress} at 100 % strain, by the curve of the library's rubber")
    if "youngs_modulus" in entry:
        young = entry["youngs_modulus"]
        return OtherSource(units.parse(young, units.MODULUS) / 3.0, f"{source}: Young's modulus {young}")
    return OtherSource(units.parse(entry["shear_modulus"], units.MODULUS), source)
