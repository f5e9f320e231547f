"""The table [body] of a body of tubes: its sizes, symmetry and chambers at the start."""

import math
from abc import abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, Strict, TypeAdapter, ValidationError, model_validator
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.problem.axis import Arc, Axis
from pneumorph.problem.gas import Gas
from pneumorph.problem.models import MOST_CHAMBERS, Length, Number, PositiveLength, Whole
from pneumorph.problem.names import Name
from pneumorph.problem.outline import Outline, arc
from pneumorph.problem.section import Section
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.symmetry.images import WITHIN, snapped
from pneumorph.symmetry.part import MOST_TURNS

_SECTION: TypeAdapter[Section] = TypeAdapter(Section)
_ARCS: TypeAdapter[tuple[Arc, ...]] = TypeAdapter(tuple[Arc, ...])


def _either(handler: GetJsonSchemaHandler, schema: CoreSchema, keys: dict[str, str]) -> dict[str, Any]:
    """The schema of a table in which other keys may be given in place of some."""
    described = handler(schema)
    own = handler.resolve_ref_schema(described)
    own["required"] = [key for key in own["required"] if key not in keys]
    own["allOf"] = [{"anyOf": [{"required": [one]}, {"required": [other]}]} for one, other in keys.items()]
    return described


def _following(data: dict[str, Any], key: str, value: float, of: str) -> dict[str, Any]:
    """A table with a length that follows from another key, which a file that is written has too."""
    written = Quantity(units.LENGTH).write(value)
    given = data.get(key, written)
    if abs((Quantity(units.LENGTH).read(given) if isinstance(given, str) else given) - value) > WITHIN:
        raise InvalidKey(key, f"is not {value:g} mm, that of {of}; leave it out")
    return {key: written} | data


class Ripple(Table):
    """Sinusoidal variation of the starting radii along z; with lobes it winds around the axis as a helix.

    Positive lobes are right-handed threads, negative ones left-handed. A plain tube, with or without rings, is its own
    mirror image, so it does not twist, and no small change of shape has a first-order effect on twist: start a twisting
    actuator from a helix. A slight one unwinds under pressure, so that negative lobes turn the tip counter-clockwise.
    """

    amplitude: PositiveLength
    """Largest deviation of the radii from the mean."""
    period: PositiveLength
    """Distance of successive waves along z."""
    lobes: Annotated[Whole, Field(ge=-12, le=12)] = 0
    """Number of waves around the axis; 0 gives rings, other numbers helices."""


class Symmetry(Table):
    """Symmetries of the shape in every design.

    The mirror planes xz and yz contain the axis, xy cuts the body at half its length. `rotation` is the order of the
    rotational symmetry about z. The point symmetry, and the half turn about x or y, are about the body's centre.
    """

    mirror: Annotated[tuple[Literal["xz", "yz", "xy"], ...], Field(max_length=3)] = ()
    """Mirror planes."""
    rotation: Annotated[Whole, Field(ge=1, le=MOST_TURNS)] = 1
    """Order of the rotational symmetry about z; 1 is none."""
    point: Annotated[bool, Strict()] = False
    """Whether the shape is point symmetric about its centre."""
    half_turn: Literal["x", "y"] | None = None
    """Axis of a half turn about the centre."""


class _Tube(Table):
    """What the tables of tubes have in common: a cylinder, or a prism of another section, that may be tapered."""

    if TYPE_CHECKING:
        radius: float
        section: Section | None
        taper: float

    @property
    @abstractmethod
    def extent(self) -> tuple[float, float]:
        """From where to where it is along the axis, mm."""

    @property
    @abstractmethod
    def domes(self) -> tuple[float, float]:
        """Heights of the domes that close its ends at base and tip, mm; 0 for flat ends."""

    def scale_at(self, height: float) -> float:
        """Size of the cross-section at a height along the axis (mm) relative to that at the base, domes aside."""
        (start, end), (base, tip) = self.extent, self.domes
        size = 1.0 + (self.taper - 1.0) * (height - start) / (end - start)
        for dome, into in ((base, start + base - height), (tip, height - end + tip)):
            size *= math.sqrt(max(0.0, 1.0 - (into / dome) ** 2)) if into > 0.0 else 1.0
        return size

    @model_validator(mode="before")
    @classmethod
    def _radius_of_the_section(cls, data: Any) -> Any:
        """The radius follows from a section; a file that is written has both."""
        if not isinstance(data, dict) or data.get("section") is None:
            return data
        try:
            reach = _SECTION.validate_python(data["section"]).outline.reach
        except ValidationError:
            return {"radius": "1 mm"} | data  # reported with the key of the section
        return _following(data, "radius", reach, "the circle around the section")

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return _either(handler, schema, {"radius": "section"})

    @property
    def outline(self) -> Outline:
        """The cross-section at the base's end, about the tube's own axis."""
        return self.section.outline if self.section else Outline(arc([0.0, 0.0], self.radius, 0.0, 2.0 * math.pi)[:-1])

    @property
    def round(self) -> bool:
        """Whether it is a cylinder."""
        return self.section is None and self.taper == 1.0

    @property
    def mean_radius(self) -> float:
        """Radius of the circle as long as its outline, mm."""
        return self.section.outline.length / (2.0 * math.pi) if self.section else self.radius

    @property
    def area(self) -> float:
        """Mean area of its cross-sections, mm²."""
        area = self.section.outline.area if self.section else math.pi * self.radius**2
        return area * (1.0 + self.taper + self.taper**2) / 3.0

    @property
    def least_radius(self) -> float:
        """Least radius of curvature of its cross-sections, mm."""
        return min(1.0, self.taper) * (1.0 / self.section.outline.curvature if self.section else self.radius)

    @property
    def bend_of_domes(self) -> float:
        """Largest half sum of the squares of the principal curvatures of its domes, 1/mm²; 0 without any."""
        tall = [height / self.mean_radius for height in self.domes if height]
        # Half an ellipsoid is bent most at its pole or along its rim.
        bends = [max(each**2, 0.5 * (1.0 + each**-4)) for each in tall]
        return max(bends, default=0.0) / self.least_radius**2


class ChamberSpec(_Tube):
    """A starting chamber: a tube parallel to z, with flat or hemispherical ends."""

    name: Annotated[Name, Example('e.g. name = "A"')]
    """Name of the chamber in tasks and results."""
    radius: PositiveLength
    """Radius of the cylinder, or of the circle around its section; leave it out where there is a section."""
    section: Section | None = None
    """Cross-section, where it is no circle: ellipse, rectangle, polygon, half-round or points."""
    taper: Annotated[Number, Field(ge=0.2, le=5)] = 1.0
    """Size of the cross-section at the tip's end relative to that at the base's; between them it changes linearly."""
    center: Annotated[tuple[Length, Length], Example('e.g. center = ["0 mm", "0 mm"]')]
    """Position of its axis in x and y."""
    span: Annotated[tuple[Length, Length], Example('e.g. span = ["3 mm", "77 mm"]')]
    """Its extent along z."""
    ends: Literal["flat", "pole"] = "flat"
    """Flat ends, or hemispheres that close in a pole."""
    ripple: Ripple | None = None
    """Initial ripple of this chamber, instead of the body's."""
    gas: Gas | None = None
    """Gas that the chamber is sealed with; without it tasks give its pressure or its volume."""
    copies: Annotated[Whole, Field(ge=1, le=24)] = 1
    """Number of such chambers around the body's axis, equally spaced; copies of "A" are named A1, A2, …"""

    @property
    def extent(self) -> tuple[float, float]:
        return self.span

    @property
    def domes(self) -> tuple[float, float]:
        """Both are hemispheres where there is room for them."""
        height = 0.0 if self.ends == "flat" else min(self.mean_radius, (self.span[1] - self.span[0]) / 2.0)
        return height, height

    @model_validator(mode="after")
    def _copies_are_apart(self) -> "ChamberSpec":
        if self.copies > 1 and math.hypot(*self.center) < WITHIN:
            raise InvalidKey("copies", "would all be in one place; move center away from the body's axis")
        return self

    def all_copies(self) -> "list[ChamberSpec]":
        """This chamber and its copies around the axis, numbered from 1; the chamber itself if it is alone."""
        if self.copies == 1:
            return [self]
        (x, y), angles = self.center, [2.0 * math.pi * number / self.copies for number in range(self.copies)]
        centers = [(x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)) for a in angles]
        sections = [self.section and self.section.turned(a) for a in angles]
        return [
            self.model_copy(update={"name": f"{self.name}{number}", "center": center, "copies": 1, "section": section})
            for number, (center, section) in enumerate(zip(centers, sections, strict=True), 1)
        ]

    def is_image_of(self, other: "ChamberSpec", matrix: np.ndarray) -> bool:
        """Whether its ends and its cross-section are those of another chamber's image, see `symmetry.images.image`."""
        if self.ends != other.ends or (
            (self.taper, other.taper) != (1.0, 1.0) and self.taper != other.taper ** matrix[2, 2]
        ):
            return False
        return (self.section is other.section is None) or self.outline.is_image_of(other.outline, matrix)

    def at(self, place: np.ndarray) -> "ChamberSpec":
        """The chamber at another centre, span and radius (5,), see `symmetry.images.place`."""
        x, y, start, end, radius = place.tolist()
        return self.model_copy(update={"center": (x, y), "span": (start, end), "radius": radius})


class Dome(Table):
    """A dome that closes the tip of the body, in place of a flat disc: at the start half an ellipsoid.

    A part around its pole is bonded to the rigid plate at the tip, which loads act on and whose motion is that of the
    tip.
    """

    height: PositiveLength | None = None
    """Height of the dome, within the body's length; by default the radius at the tip, a hemisphere."""
    plate: PositiveLength | None = None
    """Radius of the part that is bonded to the plate; by default 0.3 of the radius at the tip."""


DOMED = "the base of a tube is flat, and so is its tip, unless a table [body.dome] closes it by a dome"
"""Said of keys that ask for other ends of the exterior."""

BONDED = 0.3
"""Radius of the part of a dome that is bonded to the plate, relative to the radius of the body at its tip."""


class BodySpec(_Tube):
    """The starting body: a tube with chambers in it, whose base is at z = 0; control_density in 1/mm."""

    instead: ClassVar[Mapping[str, str]] = MappingProxyType({"end": DOMED, "ends": DOMED, "tip": DOMED})

    length: PositiveLength
    """Length of the body along its axis, constant in all designs; leave it out where there is an axis."""
    axis: Annotated[tuple[Arc, ...], Field(min_length=1, max_length=20)] | None = None
    """The axis, where it is not straight: arcs from base to tip, e.g. [{ length = "60 mm", bend = "90 deg" }]. Then z
    and x, y of chambers, layers, sheets and fibres are along the axis and in the cross-section."""
    radius: PositiveLength
    """Radius of the cylinder, or of the circle around its section; leave it out where there is a section."""
    section: Section | None = None
    """Cross-section, where it is no circle: ellipse, rectangle, polygon, half-round or points."""
    taper: Annotated[Number, Field(ge=0.2, le=5)] = 1.0
    """Size of the cross-section at the tip's end relative to that at the base's; between them it changes linearly."""
    control_density: Annotated[float, Quantity(units.PER_LENGTH, "positive")] = 0.6
    """Control points per length, around and along."""
    dome: Dome | None = None
    """A dome that closes the tip, in place of a flat disc: [body.dome] alone is a hemisphere."""
    ripple: Ripple | None = None
    """Initial ripple of the exterior and of chambers without their own."""
    symmetry: Symmetry = Symmetry()
    """Symmetries of every design."""
    chamber: Annotated[tuple[ChamberSpec, ...], Example("a table [[body.chamber]]")] = Field(
        min_length=1, max_length=MOST_CHAMBERS
    )
    """The chambers, each a table [[body.chamber]]."""

    @model_validator(mode="before")
    @classmethod
    def _length_of_the_axis(cls, data: Any) -> Any:
        """The length follows from an axis; a file that is written has both."""
        if not isinstance(data, dict) or data.get("axis") is None:
            return data
        try:
            length = Axis(_ARCS.validate_python(data["axis"])).length
        except ValidationError:
            return {"length": "1 mm"} | data  # reported with the key of the axis
        return _following(data, "length", length, "the axis") if length else data

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return _either(handler, schema, {"radius": "section", "length": "axis"})

    @model_validator(mode="after")
    def _all_chambers_in_their_places(self) -> "BodySpec":
        chambers = [each for chamber in self.chamber for each in chamber.all_copies()]
        places = snapped(chambers, self.symmetry, self.length)
        object.__setattr__(self, "chamber", tuple(map(ChamberSpec.at, chambers, places)))
        return self

    @property
    def bent(self) -> Axis | None:
        """The axis; None where it is straight."""
        arcs = self.axis or ()
        return Axis(arcs) if any(arc.bend for arc in arcs) else None

    @property
    def straight(self) -> "BodySpec":
        """The same about a straight axis; its tubes have the same parameters."""
        return self.model_copy(update={"axis": None})

    @property
    def extent(self) -> tuple[float, float]:
        return 0.0, self.length

    @property
    def domes(self) -> tuple[float, float]:
        return 0.0, 0.0 if self.dome is None else self.dome.height or self.tip_radius

    @property
    def tip_radius(self) -> float:
        """Radius at the tip of the circle as long as the outline there, mm, as if the tip were flat."""
        return self.taper * self.mean_radius

    @property
    def bonded(self) -> float:
        """Radius of the part of a dome that is bonded to the plate, mm; 0 without a dome."""
        return 0.0 if self.dome is None else self.dome.plate or BONDED * self.tip_radius

    @property
    def farthest(self) -> tuple[np.ndarray, np.ndarray]:
        """Points (3,) of base and tip in the planes that the body is between, mm: centres of flat ends, and poles."""
        tip = np.array([0.0, 0.0, self.length]) if self.bent is None else self.bent.at([self.length])[0][0]
        return np.zeros(3), tip

    @property
    def ends(self) -> tuple[np.ndarray, np.ndarray]:
        """The centres (3,) of base and tip, mm: of flat ends, and of what of a dome is bonded to the plate."""
        base, tip = self.farthest
        return base, tip - self._depth * self.turns[1][:, 2]

    @property
    def _depth(self) -> float:
        """From the pole of a dome to the centroid of what is bonded to the plate, mm."""
        height, radius = self.domes[1], self.tip_radius
        if not height:
            return 0.0
        angle = np.linspace(0.0, math.asin(min(self.bonded / radius, 1.0)), 200)
        area = np.sin(angle) * np.hypot(radius * np.cos(angle), height * np.sin(angle))
        return float(np.average(height * (1.0 - np.cos(angle)), weights=area))

    @property
    def turns(self) -> tuple[np.ndarray, np.ndarray]:
        """The rotations (3, 3) of the cross-sections at base and tip; their third columns are along the axis."""
        return np.eye(3), np.eye(3) if self.bent is None else self.bent.at([self.length])[1][0]

    def across(self, normal: np.ndarray) -> list[tuple[float, float]]:
        """From where to where each chamber is along a normal (3,) across the axis, mm."""
        middles = [float(np.dot([*chamber.center, 0.0], normal)) for chamber in self.chamber]
        return [(at - each.radius, at + each.radius) for at, each in zip(middles, self.chamber, strict=True)]

    def opened(self, normal: np.ndarray, place: float) -> float:
        """The area in mm² of the chambers, as circles, in a plane along the axis at a place on its normal (3,)."""
        chords = [
            math.sqrt(max(0.0, (place - low) * (high - place))) * (each.span[1] - each.span[0])
            for (low, high), each in zip(self.across(normal), self.chamber, strict=True)
        ]
        return 2.0 * sum(chords)

    def ripple_of(self, chamber: ChamberSpec) -> Ripple | None:
        """The ripple a chamber starts with: its own or, if it has none, the body's."""
        return chamber.ripple or self.ripple
