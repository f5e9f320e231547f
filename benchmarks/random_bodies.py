"""Random valid problems with bodies from CAD files, each reproducible from a seed and its number.

Bodies are those of `pneumorph.bodies` with sizes drawn relative to a radius or a height; pressures and springs are
drawn relative to the rubber's shear modulus, limits relative to those of the kind. Kind and rubber cycle with the
number.
"""

from __future__ import annotations

import tempfile
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic import TypeAdapter
from random_problems import Drawn, Draws, rubber_for

from pneumorph import bodies
from pneumorph.bodies.parts import Part, write_parts
from pneumorph.cad.findings import findings_of
from pneumorph.errors import ProblemError
from pneumorph.objective import build_objectives
from pneumorph.problem import Material, Problem, load

KINDS = ("dome", "fast_pneunet", "bellows", "pneunet", "hand")
MOST_ELEMENTS = 2500
STEP = "body.step"
"""Name of the file with the body, beside the problem file."""

PRESSURES = {"dome": (0.15, 0.45), "fast_pneunet": (0.2, 0.7), "bellows": (0.1, 0.35), "pneunet": (0.1, 0.3)}
PRESSURES["hand"] = (0.3, 0.7)
"""Of each kind, relative to the shear modulus and to the wall over the width."""


@dataclass(frozen=True)
class DrawnBody(Drawn):
    """A problem file with the parts of the CAD file that it names; `layout` is the kind of the body."""

    parts: tuple[Part, ...] = ()

    def write(self, path: Path) -> None:
        """Write the problem file and, beside it, the CAD file."""
        write_parts(self.parts, path.with_name(STEP))
        path.write_text(self.text, encoding="utf-8")


def draw(seed: int, index: int) -> DrawnBody:
    """Draw problem number `index` of a seed."""
    kind, rubber = KINDS[index % len(KINDS)], rubber_for(seed, index)
    draws = Draws(np.random.default_rng([seed, index]))
    for redraws in range(200):
        sizes = _sizes(draws, kind)
        try:
            start = getattr(bodies, kind)(
                **{name: size if isinstance(size, int) else _mm(round(size, 3)) for name, size in sizes.items()}
            )
        except ProblemError:
            continue
        content = tomllib.loads(start.text) | {"title": f"Random body {index} of seed {seed}"}
        _fill_in(draws, kind, sizes, rubber, content)
        drawn = DrawnBody(tomli_w.dumps(content), kind, "", (), redraws, start.parts)
        problem = _sound(drawn, content)
        if problem is not None:
            found = {"text": tomli_w.dumps(content), "objective": problem.task[0].objective.kind}
            return replace(drawn, **found, flags=_flags(problem))
    raise RuntimeError(f"no sound problem in 200 draws for number {index} of seed {seed}")


def _sound(drawn: DrawnBody, content: dict[str, Any]) -> Problem | None:
    """The problem, with elements of which there are not too many, if it can be read."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.toml"
        drawn.write(path)
        try:
            problem = load(path)
            build_objectives(problem)
        except ProblemError:
            return None
    least = (6.0 * findings_of(problem.body.outline).volume / MOST_ELEMENTS) ** (1 / 3)
    if problem.mesh.size < least:
        content["mesh"]["size"] = _mm(least)
    return problem


def _flags(problem: Problem) -> tuple[str, ...]:
    plate = problem.end_effector
    found = {
        "gravity": problem.gravity is not None,
        "spring": any(plate.spring.model_dump(exclude_defaults=True)),
        "free tip": plate.kind == "free",
        "symmetry": problem.body.symmetry != type(problem.body.symmetry)(),
        "several chambers": len(problem.body.chamber) > 1,
        "several tasks": len(problem.task) > 1,
        "free pressures": any(pressure.free for task in problem.task for pressure in task.pressure.values()),
        "envelope": problem.limits.envelope is not None,
    }
    return tuple(name for name, present in found.items() if present)


def _mm(value: float) -> str:
    return f"{value:.15g} mm"


def _sizes(draws: Draws, kind: str) -> dict[str, Any]:
    """Sizes in mm by their names, those without a unit as numbers."""
    between = draws.between
    match kind:
        case "dome":
            radius = between(10, 25)
            return {"radius": radius, "wall": radius * between(0.13, 0.25), "floor": radius * between(0.15, 0.3),
                    "boss": radius * between(0.2, 0.4)}  # fmt: skip
        case "bellows":
            radius = between(10, 20)
            wall = radius * between(0.12, 0.18)
            return {"radius": radius, "neck": radius * between(0.65, 0.85), "pitch": radius * between(0.6, 0.9),
                    "folds": draws.one_of(2, 3, 4), "wall": wall, "floor": wall * between(1.0, 2.0)}  # fmt: skip
        case "hand":
            height = between(11, 15)
            wall = height * between(0.14, 0.18)
            return {"fingers": draws.one_of(2, 3), "opening": height * between(2.0, 2.8), "palm": between(5, 9),
                    "length": height * between(2.6, 3.4), "width": height * between(0.9, 1.1), "height": height,
                    "chambers": draws.one_of(2, 3), "wall": wall, "gap": wall * between(1.0, 1.4),
                    "floor": wall * between(1.2, 1.6), "channel": wall * between(0.9, 1.1)}  # fmt: skip
    height = between(12, 20)
    wall = height * between(0.12, 0.17)
    row = {"length": height * between(2.5, 4.0), "width": height * between(0.9, 1.2), "height": height,
           "chambers": draws.one_of(2, 3, 4), "wall": wall, "floor": wall * between(1.2, 1.8),
           "channel": wall * between(1.0, 1.3)}  # fmt: skip
    return row | {"gap" if kind == "fast_pneunet" else "rib": wall * between(0.9, 1.5)}


def _fill_in(draws: Draws, kind: str, sizes: dict[str, Any], rubber: str, content: dict[str, Any]) -> None:
    """Change the tables of a problem file of this kind to what is drawn."""
    wide, wall = sizes.get("width") or 2.0 * sizes["radius"], sizes["wall"]
    shear = TypeAdapter(Material).validate_python({"name": rubber}).initial_shear_modulus
    content["material"] = {"name": rubber}
    content["body"]["file"] = STEP
    if kind != "hand" and draws.chance(0.25):
        del content["body"]["symmetry"]
    spacing = float(content["design"]["spacing"].removesuffix(" mm"))
    content["design"]["spacing"] = _mm(spacing * draws.between(0.85, 1.3))
    if "keep" in content["design"] and draws.chance(0.3):
        del content["design"]["keep"]
    low, high = PRESSURES[kind]
    strength = 1e3 * shear * (2.0 if kind in ("dome", "bellows") else 1.0) * wall / wide
    [task] = content["task"]
    task["pressure"] = _pressures(draws, task["pressure"], strength * draws.between(low, high))
    if kind == "hand":
        # The fingers begin just where they would press on the ball.
        touch = float(content["contact"]["distance"].removesuffix(" mm"))
        content["obstacle"][0]["radius"] = _mm(sizes["opening"] / 2.0 - 0.6 * touch)
    else:
        _aim(draws, kind, sizes, shear, content)
    if draws.chance(0.2) and kind != "hand":
        raised = {name: f"{1.3 * _start_of(value):.4g} kPa" for name, value in task["pressure"].items()}
        content["task"].append(task | {"name": "more", "pressure": raised})
    # Gravity along the axis keeps all symmetries.
    if draws.chance(0.3):
        content["gravity"] = {"direction": [0, 0, draws.one_of(-1, 1)]}
    _limit(draws, content)
    content["mesh"]["size"] = _mm(wall * draws.between(2.0, 2.6))
    content["optimizer"] = {"step": _mm(wall * draws.between(0.04, 0.1)), "iterations": 10}


def _start_of(pressure: Any) -> float:
    """kPa."""
    return float((pressure["start"] if isinstance(pressure, dict) else pressure).removesuffix(" kPa"))


def _pressures(draws: Draws, chambers: dict[str, Any], value: float) -> dict[str, Any]:
    """The same pressure in all chambers, in kPa, which may be designed where there is one."""
    if len(chambers) == 1 and draws.chance(0.2):
        free = {"start": f"{value:.4g} kPa", "min": "0 kPa", "max": f"{draws.between(1.1, 1.5) * value:.4g} kPa"}
        return dict.fromkeys(chambers, free)
    return dict.fromkeys(chambers, f"{value:.4g} kPa")


def _aim(draws: Draws, kind: str, sizes: dict[str, Any], shear: float, content: dict[str, Any]) -> None:
    """Often a plate with springs, and now and then a target in place of the largest motion."""
    bends = "pneunet" in kind
    if not bends or draws.chance(0.4):
        tip = content["end_effector"] = {"kind": "plate"}
        if draws.chance(0.5):
            wide = sizes.get("width") or 2.0 * sizes["radius"]
            stiff = shear * sizes["wall"] * 10 ** draws.between(-1.0, 0.3)
            name, unit, value = ("bending_y", "N*mm/rad", 0.3 * stiff * wide**2) if bends else ("axial", "N/mm", stiff)
            tip["spring"] = {name: f"{value:.4g} {unit}"}
    if content["end_effector"]["kind"] == "plate" and draws.chance(0.3):
        angle = draws.between(15, 60) if bends else 0.0
        far = draws.between(0.05, 0.3) * sizes.get("radius", 0.0)
        task = content["task"][0]
        if bends:
            task["objective"] = {"kind": "reach", "rotation": ["0 deg", f"{-angle:.4g} deg", "0 deg"]}
        else:
            height = _height(kind, sizes) + far
            task["objective"] = {"kind": "reach", "position": ["0 mm", "0 mm", _mm(height)]}


def _height(kind: str, sizes: dict[str, Any]) -> float:
    """Of a dome or bellows, mm."""
    if kind == "dome":
        return sizes["floor"] + sizes["radius"] + sizes["wall"] / 2.0
    return 2.0 * sizes["floor"] + sizes["folds"] * sizes["pitch"]


def _limit(draws: Draws, content: dict[str, Any]) -> None:
    """Limits relative to those of the kind, which are well within the start."""
    limits = content["limits"]
    limits["wall"] = _mm(float(limits["wall"].removesuffix(" mm")) * draws.between(0.75, 1.15))
    if "fold" in limits:
        factor = draws.between(0.7, 1.1)
        limits["fold"] = {
            name: _mm(factor * float(value.removesuffix(" mm"))) for name, value in limits["fold"].items()
        }
    if draws.chance(0.3):
        limits["scaling"] = {"least": round(draws.between(0.3, 0.8), 3), "largest": round(draws.between(1.3, 3.0), 3)}
    envelope = limits["envelope"]
    if draws.chance(0.25):
        del limits["envelope"]
    elif "radius" in envelope:
        envelope["radius"] = _mm(draws.between(1.0, 1.2) * float(envelope["radius"].removesuffix(" mm")))
    elif draws.chance(0.5):
        larger = draws.between(0.0, 0.2)
        low, high = (np.array([float(part.removesuffix(" mm")) for part in corner]) for corner in envelope["box"])
        grown = np.array([1.0, 1.0, 0.0]) * larger * (high - low) / 2.0
        envelope["box"] = [[_mm(part) for part in corner] for corner in ((low - grown), (high + grown))]
