"""The table [material]: a rubber of the library given by its name, or a rubber model with its parameters."""

from __future__ import annotations

import difflib
import tomllib
from abc import abstractmethod
from collections.abc import Iterator
from functools import cache
from importlib import resources
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Strict,
    Tag,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import CoreSchema, InitErrorDetails

from pneumorph import units
from pneumorph.errors import short
from pneumorph.problem.covariance import fault_of
from pneumorph.problem.memory import MEMORY, RelaxingPart, Softening, State
from pneumorph.problem.stiffness import FOAM, INCOMPRESSIBLE, neo_hookean_table, no_rubber
from pneumorph.problem.table import TAG, Example, InvalidKey, Quantity, Table

AnyModulus = Annotated[float, Quantity(units.MODULUS)]
Modulus = Annotated[float, Quantity(units.MODULUS, "positive")]
Number = Annotated[float, Strict()]


class RubberModel(Table):
    """What all rubbers have: bulk modulus (MPa), density (t/mm³), largest stretch at which the parameters are valid."""

    name: Annotated[str, Field(max_length=300)] = "rubber"
    """A name for messages."""
    bulk_modulus: Modulus
    """κ; 1000 times the shear modulus is nearly incompressible."""
    compressible: Annotated[bool, Strict()] = False
    """Confirms a bulk modulus below three times the shear modulus, as foams have."""
    density: Annotated[float, Quantity(units.DENSITY, "positive")]
    """Density of the undeformed rubber."""
    valid_stretch: Annotated[Number, Field(gt=1)] | None = None
    """Largest stretch for which the parameters are valid; states beyond it are reported."""
    scatter: Annotated[Number, Field(ge=0, le=0.5)] | None = None
    """Relative standard deviation of the moduli, e.g. 0.1; by default half the range of what sources give."""
    covariance: Annotated[tuple[tuple[Number, ...], ...], Field(max_length=12)] = ()
    """Of the relative errors of the fitted constants, in the order of their keys, without bulk_modulus."""
    source: Annotated[str, Field(max_length=2000)] = ""
    """Where the parameters come from."""
    relaxation: Annotated[tuple[RelaxingPart, ...], Field(max_length=12)] = ()
    """Parts of the moduli that relax, in simulations with a rate: relaxation = [{ share = 0.1, time = "10 s" }]."""
    softening: Softening | None = None
    """Softening by earlier stretches, in simulations with cycles: softening = { r = 2.0, m = "5 kPa" }."""
    state: State = "first pull"
    """What elastic rubber it is elsewhere, as in designs: relaxed for ever, softened up to softening.stretch, both."""
    blamed_key: ClassVar[str] = "shear_modulus"
    """The key named in the error when the initial shear modulus is not positive."""
    locks: ClassVar[bool] = False
    """Whether its own parameters limit the stretch."""

    @property
    @abstractmethod
    def initial_shear_modulus(self) -> float:
        """μ of the undeformed rubber, MPa."""

    @property
    @abstractmethod
    def constants(self) -> dict[str, float]:
        """The constants of its energy by their names but for the bulk modulus, MPa or pure numbers.

        They have the names of their keys; c1, c2, … are Yeoh's coefficients, and mu1, alpha1, … the moduli and
        exponents of Ogden's terms.
        """

    @model_validator(mode="after")
    def _is_stiff_at_rest(self) -> RubberModel:
        if not self.initial_shear_modulus > 0:
            raise InvalidKey(
                self.blamed_key,
                f"makes the initial shear modulus {self.initial_shear_modulus:g} MPa; raise it above zero",
            )
        if reason := no_rubber(3.0 * self.initial_shear_modulus):
            raise InvalidKey(
                self.blamed_key, f"makes the initial shear modulus {self.initial_shear_modulus:.3g} MPa, {reason}"
            )
        ratio = self.bulk_modulus / self.initial_shear_modulus
        if ratio < FOAM and not self.compressible:
            raise InvalidKey(
                "bulk_modulus",
                f"{self.bulk_modulus:g} MPa is only {ratio:.2g} times the initial shear modulus, as of a foam; rubber "
                f'hardly changes its volume: write "{_bulk(self.initial_shear_modulus)}" or, if it is a foam, add '
                "compressible = true",
            )
        return self

    @model_validator(mode="after")
    def _has_a_covariance(self) -> RubberModel:
        if self.covariance and (fault := fault_of(self.covariance, list(self.constants))):
            raise InvalidKey("covariance", fault)
        return self

    @model_validator(mode="after")
    def _is_in_a_state(self) -> RubberModel:
        if not self.relaxing < 1:
            raise InvalidKey("relaxation", f"has shares that add up to {self.relaxing:g}; they must leave some of 1")
        if "relaxed" in self.state and not self.relaxation:
            raise InvalidKey("state", 'is "relaxed" without a relaxation; add relaxation = [{ share, time }, …]')
        if "softened" in self.state and (self.softening is None or self.softening.stretch is None):
            raise InvalidKey("state", 'is "softened" up to no stretch; add softening = { r, m, stretch = 1.5 }')
        return self

    @property
    def relaxing(self) -> float:
        """The share of the moduli that relaxes."""
        return sum(part.share for part in self.relaxation)

    @property
    def remembers(self) -> bool:
        """Whether it relaxes or softens."""
        return bool(self.relaxation) or self.softening is not None

    @classmethod
    def _unknown_and_missing(cls, data: dict[Any, Any]) -> Iterator[InitErrorDetails]:
        """A missing bulk modulus is hinted at as what the rubber's other parameters make of it."""
        for fault in super()._unknown_and_missing(data):
            if "bulk_modulus" not in data and getattr(fault.get("ctx", {}).get("error"), "key", "") == "bulk_modulus":
                fault["ctx"] = {"error": InvalidKey("bulk_modulus", _bulk_hint(cls, data))}
            yield fault


def _bulk(shear: float) -> str:
    return f"{INCOMPRESSIBLE * shear:.3g} MPa"


def _bulk_hint(model: type[RubberModel], data: dict[Any, Any]) -> str:
    try:
        shear = model.model_validate(data | {"bulk_modulus": "9 GPa", "density": "1 g/cm^3"}).initial_shear_modulus
    except ValidationError:
        return f"is missing; add {INCOMPRESSIBLE:g} times the shear modulus for rubber, which hardly changes its volume"
    return (
        f'is missing; rubber hardly changes its volume, so add bulk_modulus = "{_bulk(shear)}", {INCOMPRESSIBLE:g} '
        "times the shear modulus"
    )


class NeoHookean(RubberModel):
    """μ/2 (Ī₁ − 3): the paper's energy (41)."""

    model: Literal["neo-hookean"] = "neo-hookean"
    """The model; neo-Hookean if it is left out."""
    shear_modulus: Modulus
    """μ."""

    @property
    def initial_shear_modulus(self) -> float:
        return self.shear_modulus

    @property
    def constants(self) -> dict[str, float]:
        return {"shear_modulus": self.shear_modulus}


class MooneyRivlin(RubberModel):
    """c10 (Ī₁ − 3) + c01 (Ī₂ − 3), and up to three terms of second order: a polynomial of five terms."""

    model: Literal["mooney-rivlin"]
    """The model."""
    c10: AnyModulus
    """Coefficient of Ī₁ − 3."""
    c01: AnyModulus
    """Coefficient of Ī₂ − 3."""
    c20: AnyModulus = 0.0
    """Coefficient of (Ī₁ − 3)²."""
    c11: AnyModulus = 0.0
    """Coefficient of (Ī₁ − 3) (Ī₂ − 3)."""
    c02: AnyModulus = 0.0
    """Coefficient of (Ī₂ − 3)²."""
    blamed_key: ClassVar[str] = "c10"

    @property
    def initial_shear_modulus(self) -> float:
        return 2 * (self.c10 + self.c01)

    @property
    def constants(self) -> dict[str, float]:
        second = {"c20": self.c20, "c11": self.c11, "c02": self.c02}
        return {"c10": self.c10, "c01": self.c01} | (second if any(second.values()) else {})


class Yeoh(RubberModel):
    """Σ cᵢ (Ī₁ − 3)ⁱ with the coefficients c₁, c₂, …"""

    model: Literal["yeoh"]
    """The model."""
    coefficients: Annotated[tuple[AnyModulus, ...], Example('coefficients = ["0.11 MPa", "0.02 MPa"]')] = Field(
        min_length=1, max_length=6
    )
    """c₁, c₂, …"""
    blamed_key: ClassVar[str] = "coefficients"

    @property
    def initial_shear_modulus(self) -> float:
        return 2 * self.coefficients[0]

    @property
    def constants(self) -> dict[str, float]:
        return {f"c{k}": value for k, value in enumerate(self.coefficients, 1)}


class Gent(RubberModel):
    """−μ J_m/2 ln(1 − (Ī₁ − 3)/J_m), where `limit` is J_m, the limiting value of Ī₁ − 3."""

    locks: ClassVar[bool] = True

    model: Literal["gent"]
    """The model."""
    shear_modulus: Modulus
    """μ."""
    limit: Annotated[Number, Field(gt=0), Example("limit = 30.0, the largest Ī₁ − 3")]
    """J_m, the largest Ī₁ − 3, a pure number."""

    @property
    def initial_shear_modulus(self) -> float:
        return self.shear_modulus

    @property
    def constants(self) -> dict[str, float]:
        return {"shear_modulus": self.shear_modulus, "limit": self.limit}


class ArrudaBoyce(RubberModel):
    """Eight-chain model as a series of five terms; shear modulus n k T of the chains, locking stretch λ_m."""

    locks: ClassVar[bool] = True

    model: Literal["arruda-boyce"]
    """The model."""
    shear_modulus: Modulus
    """n k T of the chains."""
    locking_stretch: Annotated[Number, Field(gt=1), Example("locking_stretch = 3.0")]
    """λ_m, the stretch of a chain at its full length."""

    @property
    def initial_shear_modulus(self) -> float:
        x = self.locking_stretch**-2
        series = 1 + 3 / 5 * x + 99 / 175 * x**2 + 513 / 875 * x**3 + 42039 / 67375 * x**4
        return self.shear_modulus * series

    @property
    def constants(self) -> dict[str, float]:
        return {"shear_modulus": self.shear_modulus, "locking_stretch": self.locking_stretch}


class OgdenTerm(Table):
    """One term of Ogden's energy, 2 μᵢ/αᵢ² (Σ λ̄^αᵢ − 3)."""

    modulus: AnyModulus
    """μᵢ."""
    exponent: Annotated[Number, Example("exponent = 2.0")]
    """αᵢ, not zero."""

    @model_validator(mode="after")
    def _has_a_power(self) -> OgdenTerm:
        if self.exponent == 0:
            raise InvalidKey("exponent", "is zero, so the term vanishes; use another value")
        return self


class Ogden(RubberModel):
    """Σ 2 μᵢ/αᵢ² (λ̄₁^αᵢ + λ̄₂^αᵢ + λ̄₃^αᵢ − 3); the moduli μᵢ add up to the initial shear modulus."""

    model: Literal["ogden"]
    """The model."""
    terms: Annotated[tuple[OgdenTerm, ...], Example('terms = [{ modulus = "0.4 MPa", exponent = 2.0 }]')] = Field(
        min_length=1, max_length=6
    )
    """Its terms."""
    blamed_key: ClassVar[str] = "terms"

    @property
    def initial_shear_modulus(self) -> float:
        return sum(term.modulus for term in self.terms)

    @property
    def constants(self) -> dict[str, float]:
        found: dict[str, float] = {}
        for k, term in enumerate(self.terms, 1):
            found |= {f"mu{k}": term.modulus, f"alpha{k}": term.exponent}
        return found


MODELS = {
    "neo-hookean": NeoHookean,
    "mooney-rivlin": MooneyRivlin,
    "yeoh": Yeoh,
    "gent": Gent,
    "arruda-boyce": ArrudaBoyce,
    "ogden": Ogden,
}

_PARAMETERS = {key for model in MODELS.values() for key in model.model_fields} - {"name", *MEMORY} | {
    "youngs_modulus",
    "shore",
}


BESIDE = ("assumed", "others", "chosen", "history")
"""Keys in the library that are no keys of [material]: what a source does not give, what other sources give, why the
library has the value that it has, and how far loading, unloading and time change the moduli."""

MOST_COMPARED = 100
"""Letters of a name that is compared with those of the library."""

SHOWN = 4
"""Names of the library that a message has: all of them are too many for a line."""


@cache
def library() -> dict[str, dict[str, Any]]:
    """The library of elastomers by name: tables [material] with the keys `BESIDE` about them."""
    text = resources.files("pneumorph.problem").joinpath("elastomers.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def elastomer(name: str) -> Material:
    """The table [material] of a rubber of the library."""
    return TypeAdapter(Material).validate_python({"name": name})


def _from_the_library(data: Any) -> Any:
    """Replace a name that is given without a model by its table from the library; check that a given model is known."""
    if not isinstance(data, dict):
        return data
    name, known = data.get("name"), library()
    table = known.get(name) if isinstance(name, str) else None
    if table and "covariance" in data and not data.keys() & (_PARAMETERS - {"covariance", "scatter"}):
        raise InvalidKey(
            "covariance", "is that of constants that were fitted; give these in place of the name of a rubber"
        )
    # Keys that no model has are faults of their own.
    if data.keys() & (_PARAMETERS - {"scatter"}) if table else data.keys() - {"name", *MEMORY}:
        model = data.get("model", "neo-hookean")
        if not isinstance(model, str) or model not in MODELS:
            shown = f'"{short(model)}"' if isinstance(model, str) else f"a {type(model).__name__}"
            raise InvalidKey(
                "model",
                f"{shown} is not a known rubber model; use one of {', '.join(MODELS)} (mooney-rivlin is a polynomial "
                "of up to five terms, yeoh a reduced one)",
            )
        return neo_hookean_table(data)
    if table:
        return {**{key: value for key, value in table.items() if key not in BESIDE}, **data}
    wrong = "is missing" if name is None else f'"{short(name)}" is not in the library'
    raise InvalidKey("name", f"{wrong}; {_names_like(name)} Or give a model, its parameters, bulk_modulus and density")


def _names_like(name: Any) -> str:
    """Names of the library that are like one that is not in it; else some of all."""
    names = {each.lower(): each for each in library()}
    asked = " ".join(name.lower().split()) if isinstance(name, str) and len(name) < MOST_COMPARED else ""
    like = (
        [names[asked]]
        if asked in names
        else [names[each] for each in difflib.get_close_matches(asked, names, cutoff=0.65)]
    )
    if like:
        return "did you mean " + " or ".join(f'"{each}"' for each in like) + "?"
    first = ", ".join(f'"{each}"' for each in list(library())[:SHOWN])
    return f"use one of {first}, … (pneumorph material list)."


def _tag(data: Any) -> str:
    model = data.get("model", "neo-hookean") if isinstance(data, dict) else getattr(data, "model", "neo-hookean")
    return TAG + model


class _ByNameAlone:
    """JSON schema of a material, which may also be just a name from the library."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        models = handler(schema)
        one = handler.resolve_ref_schema(models["oneOf"][0])["properties"]
        memory = {key: one[key] for key in MEMORY}
        beside = memory | {"scatter": one["scatter"]}
        by_name = {
            "type": "object",
            "title": "Elastomer",
            "description": "A rubber from the library.",
            "properties": {"name": {"enum": list(library())}, **beside},
            "required": ["name"],
            "additionalProperties": False,
        }
        by_stiffness = {
            "type": "object",
            "title": "Stiffness",
            "description": "A neo-Hookean rubber of which only the stiffness at rest is known.",
            "properties": {
                "name": {"type": "string"},
                "youngs_modulus": Quantity(units.MODULUS, "positive").json_schema(),
                "poisson": {"anyOf": [{"const": "incompressible"}, {"type": "number", "minimum": 0, "maximum": 0.5}]},
                "shore": {"type": "string", "description": "Shore A hardness", "examples": ["A 30"]},
                "density": Quantity(units.DENSITY, "positive").json_schema(),
                "valid_stretch": {"type": "number", "exclusiveMinimum": 1},
                "source": {"type": "string"},
                **memory,
            },
            "required": ["density"],
            "oneOf": [{"required": ["youngs_modulus", "poisson"]}, {"required": ["shore"]}],
            "additionalProperties": False,
        }
        return {"anyOf": [by_name, by_stiffness, models]}


Material = Annotated[
    Annotated[NeoHookean, Tag(TAG + "neo-hookean")]
    | Annotated[MooneyRivlin, Tag(TAG + "mooney-rivlin")]
    | Annotated[Yeoh, Tag(TAG + "yeoh")]
    | Annotated[Gent, Tag(TAG + "gent")]
    | Annotated[ArrudaBoyce, Tag(TAG + "arruda-boyce")]
    | Annotated[Ogden, Tag(TAG + "ogden")],
    Discriminator(_tag),
    BeforeValidator(_from_the_library),
    _ByNameAlone(),
]
