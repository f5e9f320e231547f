"""The kinds of a task's objective: the largest motion, a target shape, a target of the plate, or a user's function."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag, ValidationInfo, model_validator

from pneumorph import units
from pneumorph.problem.components import MOTION_OF
from pneumorph.problem.table import TAG, InvalidKey, Quantity, Table

Length = Annotated[float, Quantity(units.LENGTH)]
Angle = Annotated[float, Quantity(units.ANGLE)]
Weight = Annotated[float, Strict(), Field(ge=0)]
Sections = Annotated[int, Strict(), Field(ge=2, le=100)]
HALF_TURN = np.pi - 1e-6
Position = tuple[Length, Length, Length]
RotationVector = tuple[Angle, Angle, Angle]


def _keeps(vectors: Any, signs: Sequence[float]) -> bool:
    """Whether vectors (…, 3) are their own images under a change of their components' signs."""
    return np.allclose(np.asarray(vectors)[..., np.asarray(signs) < 0], 0.0, atol=1e-12)


def _motion(name: Any) -> Any:
    """The motion that a spring's name stands for."""
    if not isinstance(name, str):
        return name
    sign, component = (name[0], name[1:]) if name[:1] in ("+", "-") else ("", name)
    return sign + MOTION_OF.get(component, component)


class Maximize(Table):
    """Objective: the largest motion of the tip along or about an axis; a minus sign turns it round.

    "extension" may be written "axial", and "twist" "torsion", as springs have it.
    """

    kind: Literal["maximize"] = "maximize"
    motion: Annotated[Literal[
        "extension", "bending_x", "bending_y", "twist",
        "+extension", "+bending_x", "+bending_y", "+twist",
        "-extension", "-bending_x", "-bending_y", "-twist",
    ], BeforeValidator(_motion)] = Field(description='e.g. motion = "extension"')  # fmt: skip

    @property
    def sign(self) -> float:
        """-1.0 for a motion with a minus sign, else 1.0."""
        return -1.0 if self.motion.startswith("-") else 1.0

    @property
    def component(self) -> str:
        """The motion without its sign."""
        return self.motion.lstrip("+-")

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """Whether it is its own image under a mirror that changes the signs of vectors and of rotations like this."""
        signs = dict(zip(("bending_x", "bending_y", "twist"), axial, strict=True)) | {"extension": polar[2]}
        return signs[self.component] > 0


class MatchCurve(Table):
    """Objective: the body takes the shape of a curve.

    Clamped B-spline of the given degree; sections at equal distances are compared with it, by the rotations of each
    against the one before (squared angles, rad²) and, with a position_weight (1/mm²), by their places.
    """

    kind: Literal["match_curve"]
    control_points: tuple[Position, ...] = Field(
        min_length=2, description='e.g. control_points = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "80 mm"]]'
    )
    degree: Annotated[int, Strict(), Field(ge=1, le=5)] = 3
    sections: Sections = 10
    orientation_weight: Weight = 1.0
    position_weight: Weight = 0.0

    @model_validator(mode="after")
    def _is_a_curve(self) -> "MatchCurve":
        if len(self.control_points) <= self.degree:
            raise InvalidKey(
                "control_points", f"are too few for degree {self.degree}; give {self.degree + 1} or lower degree"
            )
        steps = np.diff(np.array(self.control_points), axis=0)
        if not np.linalg.norm(steps[0]) > 0 or not np.linalg.norm(steps, axis=1).sum() > 1e-6:
            raise InvalidKey(
                "control_points", "the first two are at one place, so the curve has no direction; part them"
            )
        if steps[0, 2] <= 0.5 * np.linalg.norm(steps[0]):
            raise InvalidKey(
                "control_points",
                "the curve leaves the base by more than 60° from the body's axis z; let it begin along +z",
            )
        if self.orientation_weight == 0 and self.position_weight == 0:
            raise InvalidKey(
                "position_weight", "is zero, and orientation_weight too; give one of them a weight above 0"
            )
        return self

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`: a curve in the mirror plane has its image in itself."""
        return _keeps(self.control_points, polar)


class MatchSections(Table):
    """Objective: sections at equal distances take these orientations, rotation vectors from the base, in order."""

    kind: Literal["match_sections"]
    rotations: tuple[RotationVector, ...] = Field(
        min_length=2, max_length=100, description='e.g. rotations = [["0 deg", "10 deg", "0 deg"], …]'
    )

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`."""
        return _keeps(self.rotations, axial)


class Reach(Table):
    """Objective: the plate comes to a place (its centre, from the base's) and an orientation (a rotation vector).

    Weights are of squared distances (1/mm²) and squared angles (1/rad²).
    """

    kind: Literal["reach"]
    position: Position | None = None
    rotation: RotationVector | None = None
    position_weight: Weight = 0.01
    rotation_weight: Weight = 1.0

    @model_validator(mode="after")
    def _has_a_target(self) -> "Reach":
        if self.position is None and self.rotation is None:
            raise InvalidKey(
                "position", 'is missing, and rotation too; give one, e.g. position = ["0 mm", "20 mm", "70 mm"]'
            )
        # At half a turn both ways round are as long, and there is no gradient that takes one of them.
        if self.rotation is not None and np.linalg.norm(self.rotation) > HALF_TURN:
            raise InvalidKey("rotation", "turns by 180° or more; give a target less than half a turn away")
        places = self.position is not None and self.position_weight > 0
        if not places and not (self.rotation is not None and self.rotation_weight > 0):
            raise InvalidKey("position_weight", "leaves nothing to reach; give a weight above 0 to what has a target")
        return self

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`."""
        return (self.position is None or _keeps(self.position, polar)) and (
            self.rotation is None or _keeps(self.rotation, axial)
        )


class Custom(Table):
    """Objective: a function of the features, to be minimised, in Python with jax.numpy.

    In the file `file` names a Python file beside it; after reading, `code` is its text, so that a run has all it needs.
    """

    kind: Literal["custom"]
    code: Annotated[str, Strict()] = Field(description='a file beside the problem, e.g. file = "objective.py"')
    function: Annotated[str, Strict()] = "objective"
    sections: Annotated[int, Strict(), Field(ge=0, le=100)] = 0

    @model_validator(mode="before")
    @classmethod
    def _read(cls, data: Any, info: ValidationInfo) -> Any:
        if not isinstance(data, dict) or "file" not in data:
            return data
        if "code" in data:
            raise InvalidKey("file", "stands beside code; leave one of them out")
        if not isinstance(data["file"], str):
            raise InvalidKey("file", 'should be the name of a Python file; write e.g. file = "objective.py"')
        path = Path((info.context or {}).get("folder", ".")) / data["file"]
        try:
            code = path.read_text(encoding="utf-8")
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or "it is not UTF-8 text"
            raise InvalidKey("file", f"{path} cannot be read ({why}); put it beside the problem file") from None
        return {key: value for key, value in data.items() if key != "file"} | {"code": code}

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `Maximize.keeps`: nobody knows what the function does."""
        return False


KINDS = {
    "maximize": Maximize,
    "match_curve": MatchCurve,
    "match_sections": MatchSections,
    "reach": Reach,
    "custom": Custom,
}


def _of_a_known_kind(data: Any) -> Any:
    kind = data.get("kind", "maximize") if isinstance(data, dict) else "maximize"
    if not isinstance(kind, str) or kind not in KINDS:
        shown = f'"{kind}"' if isinstance(kind, str) else f"a {type(kind).__name__}"
        raise InvalidKey("kind", f"{shown} is not known here; take one of {', '.join(KINDS)}")
    return data


def _tag(data: Any) -> str:
    return TAG + (data.get("kind", "maximize") if isinstance(data, dict) else getattr(data, "kind", "maximize"))


ObjectiveSpec = Annotated[
    Annotated[Maximize, Tag(TAG + "maximize")]
    | Annotated[MatchCurve, Tag(TAG + "match_curve")]
    | Annotated[MatchSections, Tag(TAG + "match_sections")]
    | Annotated[Reach, Tag(TAG + "reach")]
    | Annotated[Custom, Tag(TAG + "custom")],
    Discriminator(_tag),
    BeforeValidator(_of_a_known_kind),
]
