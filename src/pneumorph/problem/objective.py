"""Objectives of a task: the largest motion, a target shape or pose of the plate, contact, or a user's function."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    GetJsonSchemaHandler,
    Strict,
    Tag,
    ValidationInfo,
    model_validator,
)
from pydantic_core import CoreSchema

from pneumorph import units
from pneumorph.errors import short
from pneumorph.problem.components import MOTION_OF, MOTIONS, POSE, renamed
from pneumorph.problem.directions import Direction, unit_vector
from pneumorph.problem.names import Name
from pneumorph.problem.reading import read_bytes
from pneumorph.problem.table import TAG, Example, InvalidKey, Quantity, Table

Length = Annotated[float, Quantity(units.LENGTH)]
Angle = Annotated[float, Quantity(units.ANGLE)]
Weight = Annotated[float, Strict(), Field(ge=0)]
Sections = Annotated[int, Strict(), Field(ge=2, le=100)]
HALF_TURN = np.pi - 1e-6
MOST_CODE = 100_000
"""Characters of a user's function: whoever is asked whether it may run has to read it."""
Position = tuple[Length, Length, Length]
RotationVector = tuple[Angle, Angle, Angle]


def _keeps(vectors: Any, signs: Sequence[float]) -> bool:
    """Whether vectors (…, 3) are unchanged by these changes of their components' signs."""
    return np.allclose(np.asarray(vectors)[..., np.asarray(signs) < 0], 0.0, atol=1e-12)


def _motion(name: Any) -> Any:
    """The name of a motion, which may be given by the name of its spring."""
    if not isinstance(name, str):
        return name
    sign, component = (name[0], name[1:]) if name[:1] in ("+", "-") else ("", name)
    return sign + MOTION_OF.get(component, component)


class Maximize(Table):
    """Objective: the largest motion of the tip along or about an axis; a minus sign reverses the direction.

    "extension" may also be written "axial", and "twist" "torsion", as for springs.
    """

    kind: Literal["maximize"] = "maximize"
    """The kind of objective; this one if it is left out."""
    motion: Annotated[Literal[
        "extension", "bending_x", "bending_y", "twist",
        "+extension", "+bending_x", "+bending_y", "+twist",
        "-extension", "-bending_x", "-bending_y", "-twist",
    ], BeforeValidator(_motion), Example('e.g. motion = "extension"')]  # fmt: skip
    """The motion of the tip; with a minus sign, its other sense."""

    @property
    def sign(self) -> float:
        """-1.0 for a motion with a minus sign, otherwise 1.0."""
        return -1.0 if self.motion.startswith("-") else 1.0

    @property
    def component(self) -> str:
        """The motion without its sign."""
        return self.motion.lstrip("+-")

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """Whether a symmetry keeps the objective; signs (3,) that it gives components of vectors and of rotations."""
        signs = dict(zip(("bending_x", "bending_y", "twist"), axial, strict=True)) | {"extension": polar[2]}
        return signs[self.component] > 0


class MatchCurve(Table):
    """Objective: the body takes the shape of a curve, a clamped B-spline of the given degree.

    Equidistant sections are compared with the curve by the rotation of each relative to the previous one (squared
    angles, rad²) and, with a position_weight (1/mm²), by their positions.
    """

    kind: Literal["match_curve"]
    """The kind of objective."""
    control_points: Annotated[
        tuple[Position, ...], Example('e.g. control_points = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "80 mm"]]')
    ] = Field(min_length=2, max_length=1000)
    """Control points of the curve, from the centre of the base."""
    degree: Annotated[int, Strict(), Field(ge=1, le=5)] = 3
    """Degree of the B-spline."""
    sections: Sections = 10
    """Number of sections that are compared."""
    orientation_weight: Weight = 1.0
    """Weight of the squared angles, 1/rad²."""
    position_weight: Weight = 0.0
    """Weight of the squared distances, 1/mm²."""

    @model_validator(mode="after")
    def _is_a_curve(self) -> "MatchCurve":
        if len(self.control_points) <= self.degree:
            raise InvalidKey(
                "control_points",
                f"are too few for degree {self.degree}; give at least {self.degree + 1} or lower the degree",
            )
        steps = np.diff(np.array(self.control_points), axis=0)
        if not np.linalg.norm(steps[0]) > 0 or not np.linalg.norm(steps, axis=1).sum() > 1e-6:
            raise InvalidKey(
                "control_points", "the first two coincide, so the curve has no direction there; move one of them"
            )
        if steps[0, 2] <= 0.5 * np.linalg.norm(steps[0]):
            raise InvalidKey(
                "control_points",
                "the curve leaves the base at more than 60° to the body's axis z; let it start along +z",
            )
        if self.orientation_weight == 0 and self.position_weight == 0:
            raise InvalidKey("position_weight", "is zero, and so is orientation_weight; make one of them positive")
        return self

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`; a curve in the mirror plane is its own image."""
        return _keeps(self.control_points, polar)


class MatchSections(Table):
    """Objective: equidistant sections take these orientations, given as rotation vectors from the base upwards."""

    kind: Literal["match_sections"]
    """The kind of objective."""
    rotations: Annotated[tuple[RotationVector, ...], Example('e.g. rotations = [["0 deg", "10 deg", "0 deg"], …]')] = (
        Field(min_length=2, max_length=100)
    )
    """Rotation vector of each section relative to the base."""

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`."""
        return _keeps(self.rotations, axial)


class Reach(Table):
    """Objective: the plate reaches a position (of its centre, from the base's) and an orientation (rotation vector).

    The weights are those of the squared distance (1/mm²) and of the squared angle (1/rad²).
    """

    kind: Literal["reach"]
    """The kind of objective."""
    position: Position | None = None
    """Position of the plate's centre relative to the centre of the base."""
    rotation: RotationVector | None = None
    """Rotation vector of the plate."""
    position_weight: Weight = 0.01
    """Weight of the squared distance, 1/mm²."""
    rotation_weight: Weight = 1.0
    """Weight of the squared angle, 1/rad²."""

    @model_validator(mode="after")
    def _has_a_target(self) -> "Reach":
        if self.position is None and self.rotation is None:
            raise InvalidKey(
                "position", 'is missing, and so is rotation; give one, e.g. position = ["0 mm", "20 mm", "70 mm"]'
            )
        # At half a turn both senses of rotation are equally far, and the gradient does not exist.
        if self.rotation is not None and np.linalg.norm(self.rotation) > HALF_TURN:
            raise InvalidKey("rotation", "is a turn by 180° or more; give one of less than half a turn")
        places = self.position is not None and self.position_weight > 0
        if not places and not (self.rotation is not None and self.rotation_weight > 0):
            raise InvalidKey(
                "position_weight", "leaves no target with a weight; give position or rotation a positive weight"
            )
        return self

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`."""
        return (self.position is None or _keeps(self.position, polar)) and (
            self.rotation is None or _keeps(self.rotation, axial)
        )


class TargetMotion(Table):
    """Objective: the tip moves by these amounts along and about the axes; motions that are not given are free.

    The weights are those of the squared differences in length (1/mm²) and in angle (1/rad²). "extension" may also be
    written "axial", and "twist" "torsion", as for springs.
    """

    kind: Literal["motion"]
    """The kind of objective."""
    shift_x: Length | None = None
    """Motion of the tip along x."""
    shift_y: Length | None = None
    """Motion of the tip along y."""
    extension: Length | None = None
    """Motion of the tip along z."""
    bending_x: Angle | None = None
    """Rotation of the tip about x; above zero it bends towards -y."""
    bending_y: Angle | None = None
    """Rotation of the tip about y; above zero it bends towards +x."""
    twist: Angle | None = None
    """Rotation of the tip about z; above zero it is counter-clockwise, seen from the tip."""
    position_weight: Weight = 0.01
    """Weight of the squared lengths, 1/mm²."""
    rotation_weight: Weight = 1.0
    """Weight of the squared angles, 1/rad²."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_springs(cls, data: Any) -> Any:
        return renamed(data, MOTION_OF)

    @model_validator(mode="after")
    def _has_a_target(self) -> "TargetMotion":
        _require_target(self, "bending_y", "60 deg")
        return self

    @property
    def targets(self) -> dict[str, float]:
        """The motions that are given, in mm and rad, in the order of `MOTIONS`."""
        return _given(self, MOTIONS)

    def weight_of(self, motion: str) -> float:
        """The weight of a motion's squared difference."""
        return self.position_weight if motion in MOTIONS[:3] else self.rotation_weight

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`; where a motion should be zero, its sign does not matter."""
        signs: dict[str, float] = dict(zip(MOTIONS, (*polar, *axial), strict=True))
        return all(signs[motion] > 0 or value == 0 for motion, value in self.targets.items())


class TargetPose(Table):
    """Objective: a free obstacle is moved and turned by these amounts from its place; motions not given are free.

    The weights are those of the squared differences in length (1/mm²) and in angle (1/rad²).
    """

    kind: Literal["pose"]
    """The kind of objective."""
    obstacle: Annotated[Name, Example('the name of a free obstacle, e.g. obstacle = "ball"')]
    """Name of the obstacle, which has a table `free`."""
    x: Length | None = None
    """Displacement of the centre about which it turns along x."""
    y: Length | None = None
    """The same along y."""
    z: Length | None = None
    """The same along z."""
    turn_x: Angle | None = None
    """Component of its rotation vector about x."""
    turn_y: Angle | None = None
    """The same about y."""
    turn_z: Angle | None = None
    """The same about z."""
    position_weight: Weight = 0.01
    """Weight of the squared lengths, 1/mm²."""
    rotation_weight: Weight = 1.0
    """Weight of the squared angles, 1/rad²."""

    @model_validator(mode="after")
    def _has_a_target(self) -> "TargetPose":
        _require_target(self, "z", "5 mm")
        return self

    def weight_of(self, motion: str) -> float:
        """The weight of a motion's squared difference."""
        return self.position_weight if motion in POSE[:3] else self.rotation_weight

    @property
    def targets(self) -> dict[str, float]:
        """The motions that are given, in mm and rad, in the order of `POSE`."""
        return _given(self, POSE)

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Press.keeps`."""
        return False


def _given(asked: TargetMotion | TargetPose, motions: Sequence[str]) -> dict[str, float]:
    values = {motion: getattr(asked, motion) for motion in motions}
    return {motion: value for motion, value in values.items() if value is not None}


def _require_target(asked: TargetMotion | TargetPose, key: str, example: str) -> None:
    """Refuse a table without a motion, for which an example is given, or without one that has a weight."""
    if not asked.targets:
        fix = f'give at least one, e.g. {key} = "{example}"'
        raise InvalidKey(key, f"is missing, and so is every other motion; {fix}")
    if not any(asked.weight_of(motion) > 0 for motion in asked.targets):
        weight = "rotation_weight" if asked.rotation_weight == 0 else "position_weight"
        raise InvalidKey(weight, "leaves no motion with a weight; make it positive")


class Press(Table):
    """Objective: the largest force on an obstacle or, with `force`, one as near as possible to that.

    Without a direction it is the sum of all normal forces, by which a grip holds: those of opposite sides add up. The
    start must touch the obstacle, or nothing says which way to go.
    """

    kind: Literal["press"]
    """The kind of objective."""
    obstacle: Annotated[Name, Example('the name of an obstacle, e.g. obstacle = "cylinder"')]
    """Name of the obstacle."""
    direction: Annotated[Direction, Example("e.g. direction = [1, 0, 0]")] | None = None
    """Direction, of any length, of the component of the force on it; without it all normal forces count."""
    force: Annotated[float, Quantity(units.FORCE)] | None = None
    """Target for the force; without it, as large as possible."""

    @model_validator(mode="after")
    def _unit_direction(self) -> "Press":
        if self.direction is not None:
            object.__setattr__(self, "direction", unit_vector("direction", self.direction))
        if self.direction is None and self.force is not None and self.force <= 0:
            raise InvalidKey("force", 'is not above zero, as normal forces are; write e.g. force = "2 N"')
        return self

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`; bodies that touch obstacles are solved whole."""
        return False


class ContactArea(Table):
    """Objective: the largest area of contact with an obstacle or, with `area`, one as near as possible to that.

    The area is that of the deformed surface. The start must touch the obstacle.
    """

    kind: Literal["contact_area"]
    """The kind of objective."""
    obstacle: Annotated[Name, Example('the name of an obstacle, e.g. obstacle = "cylinder"')]
    """Name of the obstacle."""
    area: Annotated[float, Quantity(units.AREA, "positive")] | None = None
    """Target for the area; without it, as large as possible."""

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Press.keeps`."""
        return False


class Custom(Table):
    """Objective: a function of the features to be minimised, written in Python with jax.numpy.

    In a problem file, `file` names a Python file in the same folder. On reading, its text is stored as `code`, so that
    a run does not depend on the file.
    """

    kind: Literal["custom"]
    """The kind of objective."""
    code: Annotated[
        str,
        Strict(),
        Field(max_length=MOST_CODE),
        Example('a file next to the problem file, e.g. file = "objective.py"'),
    ]
    """The text of the Python file; `file` is given in its place."""
    function: Annotated[str, Strict(), Field(max_length=100)] = "objective"
    """Name of the function."""
    sections: Annotated[int, Strict(), Field(ge=0, le=100)] = 0
    """Number of sections in the features; 0 for none."""

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or "file" not in data:
            return data
        if "code" in data:
            raise InvalidKey("file", "is given together with code; leave one of them out")
        if not isinstance(data["file"], str):
            raise InvalidKey("file", 'should be the name of a Python file; write e.g. file = "objective.py"')
        path = Path((info.context or {}).get("folder", ".")) / data["file"]
        try:
            # With the ends of lines that Python gives every text.
            code = io.TextIOWrapper(io.BytesIO(read_bytes(path)), encoding="utf-8").read()
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or "it is not UTF-8 text"
            shown = short(path, 120)
            raise InvalidKey("file", f"{shown} cannot be read ({why}); put it next to the problem file") from None
        return {key: value for key, value in data.items() if key != "file"} | {"code": code}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        reference = handler(schema)
        table = handler.resolve_ref_schema(reference)
        table["properties"]["file"] = {
            "type": "string",
            "title": "File",
            "description": 'Name of a Python file beside the problem file, e.g. file = "objective.py".',
        }
        table["required"].remove("code")
        table["oneOf"] = [{"required": ["file"]}, {"required": ["code"]}]
        return reference

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`; False because the symmetry of a user's function is unknown."""
        return False


KINDS = {
    "maximize": Maximize,
    "match_curve": MatchCurve,
    "match_sections": MatchSections,
    "reach": Reach,
    "motion": TargetMotion,
    "pose": TargetPose,
    "press": Press,
    "contact_area": ContactArea,
    "custom": Custom,
}


def _of_a_known_kind(data: Any) -> Any:
    kind = data.get("kind", "maximize") if isinstance(data, dict) else "maximize"
    if not isinstance(kind, str) or kind not in KINDS:
        shown = f'"{short(kind)}"' if isinstance(kind, str) else f"a {type(kind).__name__}"
        raise InvalidKey("kind", f"{shown} is not a known kind of objective; use one of {', '.join(KINDS)}")
    return data


def _tag(data: Any) -> str:
    return TAG + (data.get("kind", "maximize") if isinstance(data, dict) else getattr(data, "kind", "maximize"))


ObjectiveSpec = Annotated[
    Annotated[Maximize, Tag(TAG + "maximize")]
    | Annotated[MatchCurve, Tag(TAG + "match_curve")]
    | Annotated[MatchSections, Tag(TAG + "match_sections")]
    | Annotated[Reach, Tag(TAG + "reach")]
    | Annotated[TargetMotion, Tag(TAG + "motion")]
    | Annotated[TargetPose, Tag(TAG + "pose")]
    | Annotated[Press, Tag(TAG + "press")]
    | Annotated[ContactArea, Tag(TAG + "contact_area")]
    | Annotated[Custom, Tag(TAG + "custom")],
    Discriminator(_tag),
    BeforeValidator(_of_a_known_kind),
]
