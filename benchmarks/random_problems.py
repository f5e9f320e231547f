"""Random valid problems over the whole input space, each reproducible from a seed and its number.

Lengths are drawn relative to the body's radius, pressures and loads relative to the rubber's shear modulus, limits
relative to the values of the start. Layout, kind of objective and rubber cycle with the number, so that few problems
cover all of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import tomli_w
from pydantic import TypeAdapter

from pneumorph.errors import ProblemError
from pneumorph.mechanics.setup import MIXED_FROM
from pneumorph.objective import build_objectives
from pneumorph.problem import Material, Problem, loads
from pneumorph.problem.material import library

LAYOUTS = ("on axis", "off axis", "series", "parallel", "unequal")
KINDS = ("maximize", "match_curve", "maximize", "reach", "match_sections", "maximize", "custom")
MOST_CONTROL_POINTS = 4000
MOST_ELEMENTS = 4500
SPRINGS = ("axial", "bending_x", "bending_y", "torsion")


class _Again(Exception):
    """The values drawn are inconsistent; draw again."""


@dataclass(frozen=True)
class Drawn:
    """A problem file and its description.

    Attributes
    ----------
    text : the problem file.
    layout, objective : one of `LAYOUTS`, and the kind of the first task's objective.
    flags : other features, such as "pole" or "gravity".
    redraws : number of draws refused before this one.
    """

    text: str
    layout: str
    objective: str
    flags: tuple[str, ...]
    redraws: int


@dataclass
class Draws:
    """Draws of a problem."""

    rng: np.random.Generator

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def one_of(self, *choices: Any) -> Any:
        return choices[int(self.rng.integers(len(choices)))]


@dataclass
class _Plan(Draws):
    """Values that are drawn first and on which later draws depend; lengths in mm."""

    layout: str
    kinds: list[str]
    rubber: str
    length: float = 0.0
    radius: float = 0.0
    wall: float = 0.0
    longest: float = math.inf
    planar: bool = False
    symmetric: bool = False
    motions: list[str] = field(default_factory=list)


def rubber_for(seed: int, index: int) -> str:
    """The rubber of problem number `index` of a seed: all of them take turns."""
    rubbers = sorted(library())
    order = np.random.default_rng(seed).permutation(len(rubbers))
    return rubbers[order[index % len(order)]]


def draw(seed: int, index: int, longest: float = math.inf) -> Drawn:
    """Draw problem number `index` of a seed, no longer than so many radii."""
    rng = np.random.default_rng([seed, index])
    for redraws in range(1000):
        plan = _Plan(rng, LAYOUTS[index % len(LAYOUTS)], [KINDS[index % len(KINDS)]], rubber_for(seed, index))
        plan.longest = longest
        try:
            content = _content(plan)
            content["title"] = f"Random problem {index} of seed {seed}"
            text = tomli_w.dumps(content)
            problem = loads(text)
            build_objectives(problem)
        except (_Again, ProblemError):
            continue
        return Drawn(text, plan.layout, plan.kinds[0], _flags(problem), redraws)
    raise RuntimeError(f"no sound problem in 1000 draws for number {index} of seed {seed}")


def _flags(problem: Problem) -> tuple[str, ...]:
    body, material = problem.body, problem.material
    stiff = material.bulk_modulus / material.initial_shear_modulus >= MIXED_FROM
    plate = problem.end_effector
    found = {
        "pole": any(chamber.ends == "pole" for chamber in body.chamber),
        "mixed": problem.mesh.element == "mixed" or (problem.mesh.element == "auto" and stiff),
        "gravity": problem.gravity is not None,
        "spring": any(plate.spring.model_dump(exclude_defaults=True)),
        "loaded or held tip": bool(plate.hold) or any(plate.force) or any(plate.moment),
        "free tip": plate.kind == "free",
        "symmetry": body.symmetry != type(body.symmetry)(),
        "lobes": body.ripple is not None and body.ripple.lobes != 0,
        "no ripple": body.ripple is None,
        "several chambers": len(body.chamber) > 1,
        "several tasks": len(problem.task) > 1,
        "free pressures": any(pressure.free for task in problem.task for pressure in task.pressure.values()),
        "envelope": problem.limits.envelope is not None,
    }
    return tuple(name for name, present in found.items() if present)


def _mm(value: float) -> str:
    return f"{value:.10g} mm"


def _content(plan: _Plan) -> dict[str, Any]:
    """The tables of a problem file; raises `_Again` if the draws are inconsistent."""
    plan.radius = round(plan.between(6, 20), 2)
    longest = min(120.0, plan.longest * plan.radius)
    plan.length = round(plan.between(max(min(30.0, longest), 1.8 * plan.radius), longest), 2)
    plan.wall = max(1.2, round(plan.between(0.15, 0.4) * plan.radius, 2))
    plan.symmetric = plan.chance(0.35)
    plan.planar = plan.symmetric or plan.chance(0.4)
    for _ in range(plan.one_of(0, 0, 0, 0, 1, 1, 2)):
        plan.kinds.append(plan.one_of(*KINDS))
    plan.motions = [_motion(plan) for _ in plan.kinds]
    if len(plan.kinds) > 1 and plan.symmetric:
        plan.motions = [motion if "twist" not in motion else "extension" for motion in plan.motions]
    chambers = _chambers(plan)
    rubber = TypeAdapter(Material).validate_python({"name": plan.rubber})
    ripple, density, own = _ripple(plan, chambers)
    tip = _tip(plan, rubber.initial_shear_modulus)
    size = _mesh_size(plan, chambers)
    content = {
        "material": {"name": plan.rubber},
        "body": {
            "length": _mm(plan.length),
            "radius": _mm(plan.radius),
            "control_density": f"{density:.4g} /mm",
            **({"ripple": ripple} if ripple else {}),
            **_symmetry(plan, chambers, ripple),
            "chamber": [chamber.table() for chamber in chambers],
        },
        "end_effector": tip,
        **_gravity(plan, rubber),
        "task": [
            _task(plan, number, chambers, rubber.initial_shear_modulus, size) for number in range(len(plan.kinds))
        ],
        "limits": _limits(plan, chambers, ripple, own),
        "mesh": {"size": _mm(size), "element": plan.one_of("auto", "auto", "auto", "auto", "mixed", "quadratic")},
        "optimizer": {"step": _mm(round(plan.between(0.1, 0.4), 3)), "iterations": 10},
    }
    return content


# --- the body ---------------------------------------------------------------------------------------------------------


@dataclass
class _Chamber:
    name: str
    radius: float
    center: tuple[float, float]
    span: tuple[float, float]
    ends: str = "flat"
    ripple: dict[str, Any] | None = None

    def table(self) -> dict[str, Any]:
        return {
            "name": self.name,
            "radius": _mm(self.radius),
            "center": [_mm(part) for part in self.center],
            "span": [_mm(part) for part in self.span],
            "ends": self.ends,
            **({"ripple": self.ripple} if self.ripple else {}),
        }


def _chambers(plan: _Plan) -> list[_Chamber]:
    places = {
        "on axis": _on_axis,
        "off axis": _off_axis,
        "series": _in_series,
        "parallel": _parallel,
        "unequal": _unequal,
    }[plan.layout](plan)
    poles = plan.chance(0.35)
    chambers = []
    for name, (radius, center, span) in zip("ABCD", places, strict=False):
        radius = math.floor(1000 * radius) / 1000
        if radius < 1.2 or span[1] - span[0] < 4:
            raise _Again
        ends = "pole" if poles and span[1] - span[0] >= 2 * radius and plan.chance(0.8) else "flat"
        center = tuple(round(part, 6) for part in center)
        chambers.append(_Chamber(name, radius, center, (round(span[0], 4), round(span[1], 4)), ends))
    return chambers


def _on_axis(plan: _Plan):
    return [((plan.radius - plan.wall) * plan.between(0.6, 1.0), (0.0, 0.0), _whole(plan))]


def _off_axis(plan: _Plan):
    room = plan.radius - plan.wall
    across = plan.between(0.4, 0.75) * room
    return [(across, _polar(plan.between(0.3, 1.0) * (room - across), _turn(plan)), _whole(plan))]


def _in_series(plan: _Plan):
    count = min(plan.one_of(2, 3, 4), int(plan.length / plan.radius))
    across = (plan.radius - plan.wall) * plan.between(0.6, 1.0)
    along = (plan.length - (count + 1) * plan.wall) / count
    starts = [plan.wall + k * (along + plan.wall) for k in range(count)]
    return [(across, (0.0, 0.0), (start, start + along)) for start in starts]


def _parallel(plan: _Plan):
    count, turn, whole = plan.one_of(2, 3, 4), _turn(plan), _whole(plan)
    away = (plan.radius - plan.wall / 2) / (1 + math.sin(math.pi / count))
    across = (plan.radius - plan.wall - away) * plan.between(0.7, 1.0)
    return [(across, _polar(away, turn + 2 * math.pi * k / count), whole) for k in range(count)]


def _unequal(plan: _Plan):
    """Chambers in parallel or in series, with different radii, lengths and positions."""
    if plan.chance(0.5):
        found = []
        for across, center, (start, end) in _parallel(plan):
            share = (end - start) * 0.4
            span = (start + plan.between(0, share), end - plan.between(0, share))
            found.append((across * plan.between(0.6, 1.0), center, span))
        return found
    count = min(plan.one_of(2, 3, 4), int(plan.length / plan.radius))
    shares = plan.rng.uniform(0.5, 1.5, count)
    lengths = (plan.length - (count + 1) * plan.wall) * shares / shares.sum()
    starts = plan.wall * np.arange(1, count + 1) + np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    found = []
    for start, along in zip(starts, lengths, strict=True):
        room = plan.radius - plan.wall
        across = room * plan.between(0.5, 1.0)
        center = _polar(plan.between(0.0, 1.0) * (room - across), _turn(plan))
        found.append((across, center, (float(start), float(start + along))))
    return found


def _whole(plan: _Plan) -> tuple[float, float]:
    base = round(plan.wall * plan.between(1.0, 1.5), 2)
    tip = base if plan.symmetric else round(plan.wall * plan.between(1.0, 1.5), 2)
    return base, plan.length - tip


def _turn(plan: _Plan) -> float:
    return 0.0 if plan.symmetric else plan.between(0, 2 * math.pi)


def _polar(distance: float, angle: float) -> tuple[float, float]:
    return distance * math.cos(angle), distance * math.sin(angle)


def _ripple(plan: _Plan, chambers: list[_Chamber]) -> tuple[dict[str, Any] | None, float, bool]:
    """The body's ripple, the control density, and whether a chamber has its own ripple."""
    area = 2 * math.pi * (plan.radius * plan.length + sum(c.radius * (c.span[1] - c.span[0]) for c in chambers))
    most = math.sqrt(MOST_CONTROL_POINTS / area)
    if most < 0.35:
        raise _Again
    density = round(plan.between(max(0.35, 4.2 / plan.length), min(0.8, most)), 3)
    twists = any("twist" in motion for motion in plan.motions)
    if not twists and plan.chance(0.12):
        return None, density, False
    least = min(plan.wall, *(0.5 * chamber.radius for chamber in chambers))
    lobes = plan.one_of(1, 2, 3, 3, 4, -2, -3) if twists or (not plan.symmetric and plan.chance(0.15)) else 0
    amplitude = round(plan.between(0.03, 0.12) * least, 3)
    period = max(3.2 / density, plan.radius * plan.between(0.7, 1.5))
    if lobes:
        period = plan.radius * plan.between(2.0, 5.0)
    ripple: dict[str, Any] = {"amplitude": _mm(amplitude), "period": _mm(round(period + 0.005, 2))}
    if lobes:
        ripple["lobes"] = lobes
    own = not plan.symmetric and not lobes and plan.chance(0.1)
    if own:
        chambers[0].ripple = {"amplitude": _mm(round(0.6 * amplitude, 4)), "period": ripple["period"]}
    return ripple, density, own


def _symmetry(plan: _Plan, chambers: list[_Chamber], ripple: dict[str, Any] | None) -> dict[str, Any]:
    """A symmetry that allows the objectives to be improved."""
    if not plan.symmetric:
        return {}
    lobes = abs(ripple.get("lobes", 0)) if ripple else 0
    on_axis = all(chamber.center == (0.0, 0.0) for chamber in chambers)
    if lobes:
        choices = [{"rotation": lobes}] if lobes > 1 else []
        if on_axis and plan.layout == "on axis":
            choices += [{"half_turn": "x"}, {"rotation": lobes, "half_turn": "x"}]
        return {"symmetry": plan.one_of(*choices)} if choices and on_axis else {}
    straight = all(
        kind == "maximize" and motion.endswith("extension")
        for kind, motion in zip(plan.kinds, plan.motions, strict=True)
    )
    choices = [{"mirror": ["xz"]}]
    if straight and on_axis:
        choices += [{"rotation": plan.one_of(2, 3, 4, 6)}, {"mirror": ["xz", "yz"]}, {"mirror": ["xz"], "rotation": 3}]
    if straight and plan.layout == "on axis":
        choices += [{"mirror": ["xy"]}, {"mirror": ["xz", "xy"]}, {"point": True}]
    if straight and plan.layout == "parallel":
        choices += [{"rotation": len(chambers)}, {"mirror": ["xz"], "rotation": len(chambers)}]
    return {"symmetry": plan.one_of(*choices)}


def _mesh_size(plan: _Plan, chambers: list[_Chamber]) -> float:
    volume = math.pi * (plan.radius**2 * plan.length - sum(c.radius**2 * (c.span[1] - c.span[0]) for c in chambers))
    size = (6 * volume / plan.between(600, 1500)) ** (1 / 3)
    size = round(min(size, 1.5 * plan.wall, 1.5 * min(c.radius for c in chambers), 0.6 * plan.radius), 2)
    if 6 * volume / size**3 > MOST_ELEMENTS:
        raise _Again
    return size


# --- end-effector and gravity -----------------------------------------------------------------------------------------


def _tip(plan: _Plan, shear: float) -> dict[str, Any]:
    """A plate, often with springs similar to the stiffness of the body; sometimes a free tip."""
    if "reach" not in plan.kinds and plan.chance(0.15):
        return {"kind": "free"}
    tip: dict[str, Any] = {"kind": "plate"}
    area = math.pi * plan.radius * plan.wall
    own = {
        "axial": (3 * shear * area / plan.length, "N/mm"),
        "bending_x": (3 * shear * area * plan.radius**2 / 2 / plan.length, "N*mm/rad"),
        "bending_y": (3 * shear * area * plan.radius**2 / 2 / plan.length, "N*mm/rad"),
        "torsion": (shear * area * plan.radius**2 / plan.length, "N*mm/rad"),
    }
    if plan.chance(0.35):
        names = set(plan.rng.choice(SPRINGS, plan.one_of(1, 1, 2), replace=False))
        tip["spring"] = {
            name: f"{own[name][0] * 10 ** plan.between(-1.0, 0.4):.4g} {own[name][1]}"
            for name in SPRINGS
            if name in names
        }
    if "axial" in tip.get("spring", {}) and set(plan.kinds) == {"maximize"} and plan.chance(0.5):
        bends = any("bending" in motion for motion in plan.motions)
        tip["hold"] = [] if bends else ["shift_x", "shift_y", "bending_x", "bending_y"]
    if plan.chance(0.12):
        force = 0.02 * 3 * shear * area
        tip["force"] = [f"{plan.between(-force, force) * (plan.radius / plan.length if i < 2 else 1):.4g} N"
                        for i in range(3)]  # fmt: skip
        if plan.symmetric:
            tip["force"][1] = "0 N"
    if plan.chance(0.08):
        moment = 0.05 * own["bending_y"][0]
        tip["moment"] = ["0 N*mm", f"{plan.between(-moment, moment):.4g} N*mm", "0 N*mm"]
    return tip


def _gravity(plan: _Plan, rubber: Any) -> dict[str, Any]:
    """Gravity, unless the body is so slender and soft that it would hang like a rope."""
    sag = rubber.density * 9810 * plan.length**3 / (2 * 3 * rubber.initial_shear_modulus * plan.radius**2)
    if sag > 0.3 or not plan.chance(0.4):
        return {}
    if plan.symmetric or plan.chance(0.6):
        return {"gravity": {"direction": plan.one_of([-1, 0, 0], [0, 0, -1], [0, 0, 1])}}
    return {"gravity": {"direction": [round(float(part), 3) for part in plan.rng.normal(size=3)]}}


# --- tasks ------------------------------------------------------------------------------------------------------------


def _motion(plan: _Plan) -> str:
    if plan.symmetric:
        return plan.one_of("extension", "extension", "bending_y", "-bending_y", "twist")
    if plan.planar:
        return plan.one_of("extension", "extension", "bending_y", "-bending_y")
    return plan.one_of("extension", "-extension", "bending_x", "bending_y", "-bending_x", "twist", "-twist")


def _task(plan: _Plan, number: int, chambers: list[_Chamber], shear: float, size: float) -> dict[str, Any]:
    pressures = {}
    for chamber in chambers:
        if len(chambers) > 1 and plan.chance(0.25) and (pressures or chamber is not chambers[-1]):
            continue
        pressures[chamber.name] = _pressure(plan, chamber, shear)
    return {
        "name": f"t{number + 1}",
        "weight": 1.0 if number == 0 else round(plan.between(0.5, 3.0), 2),
        "pressure": pressures,
        "objective": _objective(plan, plan.kinds[number], plan.motions[number], chambers, size),
    }


def _pressure(plan: _Plan, chamber: _Chamber, shear: float) -> Any:
    """A pressure from the wall strain ε of a thick tube, p = 2 μ ε (1 − a²/b²), moderate for nearly every start."""
    away = math.hypot(*chamber.center)
    outer = chamber.radius + max(plan.radius - away - chamber.radius, 0.5 * plan.wall)
    strain = plan.between(0.15, 0.22) if plan.chance(0.06) else plan.between(0.02, 0.11)
    value = 1e3 * 2 * shear * strain * (1 - (chamber.radius / outer) ** 2)
    if plan.chance(0.04):
        value *= -0.3
    if plan.chance(0.35) and value > 0:
        low = plan.one_of(0.0, round(0.5 * value, 4))
        high = round(plan.between(1.2, 2.0) * value, 4)
        return {"start": f"{value:.6g} kPa", "min": f"{low:.6g} kPa", "max": f"{high:.6g} kPa"}
    return f"{value:.6g} kPa"


def _objective(plan: _Plan, kind: str, motion: str, chambers: list[_Chamber], size: float) -> dict[str, Any]:
    most = int(plan.length / size)
    if kind != "maximize" and most < 2:
        raise _Again
    aside = plan.one_of(0.0, math.pi) if plan.planar else plan.between(0, 2 * math.pi)
    across = np.array([math.cos(aside), math.sin(aside), 0.0])
    about = np.array([-across[1], across[0], 0.0])
    angle = math.radians(plan.between(5, 60))
    sections = min(most, plan.one_of(4, 6, 8, 10))
    match kind:
        case "maximize":
            return {"kind": kind, "motion": motion}
        case "match_curve":
            table = {"kind": kind, "control_points": _curve(plan, across, angle), "sections": sections}
            if plan.chance(0.4):
                table["position_weight"] = round(10 ** plan.between(-4, -2), 6)
            return table
        case "match_sections":
            turns = [angle * (k + 0.5) / sections * about for k in range(sections)]
            return {"kind": kind, "rotations": [[f"{math.degrees(part):.5g} deg" for part in turn] for turn in turns]}
        case "reach":
            return {"kind": kind, **_reach(plan, across, about, angle)}
    return {"kind": "custom", **_custom(plan, chambers, sections)}


def _curve(plan: _Plan, across: np.ndarray, angle: float) -> list[list[str]]:
    """A gentle arc, or one that bends back."""
    length = plan.length * plan.between(0.98, 1.1)
    s = np.linspace(0.0, 1.0, 400)
    slope = angle * s if plan.chance(0.6) else 0.5 * angle * np.sin(math.pi * s) ** 2 * np.sign(0.6 - s)
    step = length / (len(s) - 1)
    out = np.concatenate([[0.0], np.cumsum(np.sin(slope))[:-1]]) * step
    up = np.concatenate([[0.0], np.cumsum(np.cos(slope))[:-1]]) * step
    chosen = np.linspace(0, len(s) - 1, plan.one_of(5, 6, 7)).astype(int)
    points = out[chosen, None] * across + up[chosen, None] * np.array([0.0, 0.0, 1.0])
    return [[f"{part:.5g} mm" for part in point] for point in points]


def _reach(plan: _Plan, across: np.ndarray, about: np.ndarray, angle: float) -> dict[str, Any]:
    shift = plan.length * plan.between(0.02, 0.2)
    tilt = plan.between(0, math.pi / 2)
    place = shift * (math.sin(tilt) * across + math.cos(tilt) * np.array([0, 0, 1])) + [0, 0, plan.length]
    table: dict[str, Any] = {}
    if plan.chance(0.7):
        table["position"] = [f"{part:.5g} mm" for part in place]
    if not table or plan.chance(0.5):
        table["rotation"] = [f"{math.degrees(part):.5g} deg" for part in angle * about]
    return table


def _custom(plan: _Plan, chambers: list[_Chamber], sections: int) -> dict[str, Any]:
    """A custom function: a volume, a motion with a penalty on another, or a target for all sections."""
    goal = plan.length * plan.between(0.02, 0.15)
    head = "import jax.numpy as jnp\n\n\ndef objective(f):\n"
    lines, sections = plan.one_of(
        (f'    return -f.volume["{chambers[0].name}"] / 1000\n', 0),
        ("    return -f.translation[2] + 0.1 * f.translation[0] ** 2\n", 0),
        (f"    return (f.translation[0] - {goal:.4g}) ** 2 + 0.1 * f.rotation[2] ** 2\n", 0),
        (f"    return jnp.sum((f.section_position[:, 0] - jnp.linspace(0, {goal:.4g}, {sections})) ** 2)\n", sections),
        ("    return -jnp.mean(f.section_rotation[:, 0, 2])\n", sections),
    )
    return {"code": head + lines, "sections": sections}


# --- limits -----------------------------------------------------------------------------------------------------------


def _limits(plan: _Plan, chambers: list[_Chamber], ripple: dict[str, Any] | None, own: bool) -> dict[str, Any]:
    """Limits relative to the start and to the defaults at the scale of the body; each is sometimes tight."""
    amplitude = float(ripple["amplitude"].split()[0]) if ripple else 0.0
    wave = 2 * math.pi / float(ripple["period"].split()[0]) if ripple else 0.0
    thinnest = _thinnest(plan, chambers, amplitude, own)
    if thinnest < 0.6:
        raise _Again
    wall = thinnest if plan.chance(0.2) else thinnest * plan.between(0.5, 1.0)
    scale = plan.radius / 8
    neighbourhood = 2.0 * scale * plan.between(0.7, 1.3)
    distance = neighbourhood * (plan.between(0.7, 0.85) if plan.chance(0.15) else plan.between(0.3, 0.5))
    bend = max(
        0.5 * ((radius - amplitude) ** -2 + (amplitude * wave**2) ** 2)
        for radius in (plan.radius, *(chamber.radius for chamber in chambers))
    )
    domes = [chamber.radius**-2 for chamber in chambers if chamber.ends == "pole"]
    bend = max([bend, *(1.3 * dome for dome in domes)])
    curvature = max(0.3 / scale**2 * plan.between(0.5, 1.5), 1.3 * bend)
    if plan.chance(0.2):
        curvature = plan.between(1.05, 1.3) * bend
    skew = plan.between(0.05, 0.1) if plan.chance(0.15) else plan.between(0.15, 0.3)
    stretch = 0.1 / scale**2 * (plan.between(0.2, 0.4) if plan.chance(0.15) else plan.between(0.7, 1.5))
    limits: dict[str, Any] = {
        "wall": _mm(math.floor(1e4 * wall) / 1e4),
        "fold": {"distance": f"{distance:.4g} mm", "neighbourhood": f"{neighbourhood:.4g} mm"},
        "curvature": f"{curvature:.4g} /mm^2",
        "skew": round(skew, 4),
        "stretch": f"{stretch:.4g} /mm^2",
    }
    if plan.chance(0.7):
        widest = plan.radius + amplitude
        envelope = widest if plan.chance(0.12) else max(widest, plan.radius * plan.between(1.0, 1.6))
        limits["envelope"] = {"radius": _mm(math.ceil(1e4 * envelope) / 1e4)}
    return limits


def _thinnest(plan: _Plan, chambers: list[_Chamber], amplitude: float, own: bool) -> float:
    """The thinnest wall at the start, where ripples of neighbouring surfaces approach each other."""
    walls = []
    for index, one in enumerate(chambers):
        side = plan.radius - math.hypot(*one.center) - one.radius
        walls += [side - (1.6 * amplitude if own else 0.0), one.span[0], plan.length - one.span[1]]
        for other in chambers[index + 1 :]:
            along = max(other.span[0] - one.span[1], one.span[0] - other.span[1])
            across = math.dist(one.center, other.center) - one.radius - other.radius
            walls.append(math.hypot(max(along, 0.0), max(across - 2 * amplitude, 0.0)))
    return min(walls)
