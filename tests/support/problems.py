"""Random problems: sound ones from gentle to absurd, and files that were spoiled in many ways."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from copy import deepcopy
from typing import Any, get_args

import tomli_w
from hypothesis import strategies as st

from pneumorph.mechanics.elements.plate import COMPONENTS
from pneumorph.problem.material import library
from pneumorph.problem.models import MeshSpec

ELEMENTS = get_args(MeshSpec.model_fields["element"].annotation)
MOTIONS = ("extension", "bending_x", "-bending_y", "twist")


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Powers of ten with exponents between low and high."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


def quantity(value: float, unit: str) -> str:
    return f"{value:.8g} {unit}"


@st.composite
def problems(draw: st.DrawFn) -> str:
    """A sound problem file. Lengths are drawn in body radii, pressures and loads in shear moduli, then scaled."""
    radius, shear = draw(powers(0.0, 1.8)), draw(powers(-3.0, 2.0))
    wall = draw(st.floats(0.1, 0.4))
    length, chambers = draw(layouts(wall))
    density = max(draw(st.floats(10, 24)) / (2 * math.pi), 4.2 / length)
    names = [f"c{number}" for number in range(len(chambers))]
    body: dict[str, Any] = {
        "length": quantity(length * radius, "mm"),
        "radius": quantity(radius, "mm"),
        "control_density": quantity(density / radius, "/mm"),
        "chamber": [
            {
                "name": name,
                "radius": quantity(across * radius, "mm"),
                "center": [quantity(part * radius, "mm") for part in center],
                "span": [quantity(part * radius, "mm") for part in span],
                "ends": draw(st.sampled_from(["flat", "pole"])) if span[1] - span[0] > 2.01 * across else "flat",
            }
            for name, (across, center, span) in zip(names, chambers, strict=True)
        ],
    }
    amplitude = draw(st.sampled_from([0.0, 0.0, 0.1, 0.25])) * min(wall, *(across for across, *_ in chambers))
    if amplitude:
        period = max(3.1 / density, draw(st.floats(0.5, 1.5)))
        body["ripple"] = {
            "amplitude": quantity(amplitude * radius, "mm"),
            "period": quantity(period * radius, "mm"),
        }
    pressures = {name: quantity(shear * draw(loads(-4.0, 1.0)), "MPa") for name in names}
    content: dict[str, Any] = {
        "title": "drawn",
        "material": draw(materials(shear)),
        "body": body,
        "end_effector": draw(end_effectors(shear, radius)),
        "task": [
            {"name": "t", "pressure": pressures, "objective": {"motion": draw(st.sampled_from(MOTIONS))}},
        ],
        "limits": {
            "wall": quantity(0.05 * wall * radius, "mm"),
            "fold": {"distance": quantity(0.01 * radius, "mm"), "neighbourhood": quantity(0.05 * radius, "mm")},
            "curvature": "1e9 /mm^2",
        },
        "mesh": {
            "size": quantity(draw(st.floats(0.7, 0.99)) * radius, "mm"),
            "element": draw(st.sampled_from(ELEMENTS)),
        },
    }
    if draw(st.booleans()):
        content["limits"]["envelope"] = {
            "radius": quantity(draw(st.floats(1.05, 3.0)) * radius * (1 + amplitude), "mm")
        }
    if draw(st.booleans()):
        direction = draw(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda vector: math.hypot(*vector) > 1e-3))
        content["gravity"] = {
            "acceleration": quantity(draw(powers(-1.0, 2.0)), "m/s^2"),
            "direction": list(direction),
        }
    return tomli_w.dumps(content)


Chamber = tuple[float, tuple[float, float], tuple[float, float]]


@st.composite
def layouts(draw: st.DrawFn, wall: float) -> tuple[float, list[Chamber]]:
    """The body's length, and radius, centre and span of one to four chambers, in radii of the body."""
    kind = draw(st.sampled_from(["on axis", "off axis", "parallel", "series"]))
    count = draw(st.integers(2, 4)) if kind in ("parallel", "series") else 1
    length = draw(st.floats(1.5, 4.0)) + (0.8 * count if kind == "series" else 0.0)
    whole = (wall, length - wall)
    share, turn = draw(st.floats(0.5, 1.0)), draw(st.floats(0.0, 2 * math.pi))
    if kind == "on axis":
        return length, [((1 - wall) * share, (0.0, 0.0), whole)]
    if kind == "off axis":
        across = 0.6 * (1 - wall) * share
        return length, [(across, _polar(1 - wall - across, turn), whole)]
    if kind == "parallel":
        # As far out as leaves a wall to the exterior and between neighbours.
        away = (1 - wall / 2) / (1 + math.sin(math.pi / count))
        across = (1 - wall - away) * share
        return length, [(across, _polar(away, turn + 2 * math.pi * k / count), whole) for k in range(count)]
    along = (length - (count + 1) * wall) / count
    starts = [wall + k * (along + wall) for k in range(count)]
    return length, [((1 - wall) * share, (0.0, 0.0), (start, start + along)) for start in starts]


def _polar(distance: float, angle: float) -> tuple[float, float]:
    return distance * math.cos(angle), distance * math.sin(angle)


@st.composite
def loads(draw: st.DrawFn, low: float, high: float) -> float:
    """Zero, or powers of ten of either sign."""
    return draw(st.sampled_from([1.0, 1.0, 1.0, -1.0, 0.0])) * draw(powers(low, high))


@st.composite
def materials(draw: st.DrawFn, shear: float) -> dict[str, Any]:
    """One of the library, or one of its own by any model, from nearly incompressible to cork."""
    if draw(st.integers(0, 9)) == 0:
        return {"name": draw(st.sampled_from(sorted(library())))}
    modulus, half = quantity(shear, "MPa"), quantity(shear / 2, "MPa")
    model = draw(
        st.sampled_from(
            [
                {"model": "neo-hookean", "shear_modulus": modulus},
                {"model": "mooney-rivlin", "c10": half, "c01": quantity(shear / 20, "MPa")},
                {"model": "yeoh", "coefficients": [half, quantity(shear / 100, "MPa"), quantity(shear / 1e4, "MPa")]},
                {"model": "gent", "shear_modulus": modulus, "limit": 30.0},
                {"model": "arruda-boyce", "shear_modulus": modulus, "locking_stretch": 3.0},
                {"model": "ogden", "terms": [{"modulus": modulus, "exponent": 1.5}]},
            ]
        )
    )
    return {
        **model,
        "bulk_modulus": quantity(shear * draw(powers(0.0, 5.0)), "MPa"),
        "density": quantity(draw(powers(-0.3, 0.7)), "g/cm^3"),
    }


@st.composite
def end_effectors(draw: st.DrawFn, shear: float, radius: float) -> dict[str, Any]:
    """A free tip, or a plate with springs, forces, moments and guides."""
    if draw(st.integers(0, 4)) == 0:
        return {"kind": "free"}
    plate: dict[str, Any] = {"kind": "plate"}
    if draw(st.booleans()):
        units = {"axial": ("N/mm", 1), "bending_x": ("N*mm/rad", 3), "bending_y": ("N*mm/rad", 3)}
        units["torsion"] = ("N*mm/rad", 3)
        plate["spring"] = {
            name: quantity(shear * radius**power * draw(powers(-3.0, 3.0)), unit)
            for name, (unit, power) in units.items()
            if draw(st.booleans())
        }
    if draw(st.booleans()):
        plate["force"] = [quantity(shear * radius**2 * draw(loads(-4.0, 0.5)), "N") for _ in range(3)]
    if draw(st.integers(0, 2)) == 0:
        plate["moment"] = [quantity(shear * radius**3 * draw(loads(-4.0, 0.5)), "N*mm") for _ in range(3)]
    plate["hold"] = draw(st.lists(st.sampled_from(COMPONENTS), unique=True, max_size=6))
    return plate


# What no quantity, number, word or table of a problem file can be.
JUNK: list[Any] = [
    "60 parsec", "-3 kg^2", "12", "mm", "", " ", "nan mm", "inf kPa", "1e9999 mm", "ä mm", "1 mm; 2 mm", "\x7f",
    "0x10 mm", "1 mm**999999999", "((((", "1 2 mm", [], {}, [[]], {"a": {"b": [1]}}, float("nan"), float("inf"), -1,
    True, 10**400,
]  # fmt: skip


MAGNITUDES = ["1e-300", "1e-29", "1e-9", "1e9", "1e29", "1e300"]


@st.composite
def spoiled(draw: st.DrawFn) -> bytes:
    """A problem file that was sound before something happened to it. Now and then it still is."""
    text = draw(problems())
    how = draw(st.sampled_from(["values", "values", "keys", "chambers", "lines", "cut", "bytes", "junk", "magnitude"]))
    if how in ("values", "keys", "magnitude", "chambers"):
        content = tomllib.loads(text)
        for _ in range(draw(st.integers(1, 2))):
            {"values": _junk, "keys": _rekey, "magnitude": _magnify, "chambers": _collide}[how](draw, content)
        return tomli_w.dumps(content).encode()
    if how == "lines":
        lines = text.splitlines()
        first, second = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        lines[first] = draw(st.sampled_from([lines[second], "", lines[first] * 2, lines[first][:-1]]))
        return "\n".join(lines).encode()
    content = text.encode()
    place = draw(st.integers(0, len(content)))
    if how == "cut":
        return content[:place]
    if how == "bytes":
        return content[:place] + draw(st.binary(min_size=1, max_size=8)) + content[place + 1 :]
    return draw(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode(errors="replace")))


Place = tuple[Any, Any]


def _places(table: Any) -> Iterator[Place]:
    """Every table or list in a file with each of its keys or indices."""
    for key, value in list(table.items() if isinstance(table, dict) else enumerate(table)):
        yield table, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _junk(draw: st.DrawFn, content: dict[str, Any]) -> None:
    table, key = draw(st.sampled_from(list(_places(content))))
    table[key] = draw(st.sampled_from(JUNK).map(deepcopy))


def _rekey(draw: st.DrawFn, content: dict[str, Any]) -> None:
    """Lose a key, misspell it, or add one."""
    table, key = draw(st.sampled_from([place for place in _places(content) if isinstance(place[0], dict)]))
    match draw(st.integers(0, 2)):
        case 0:
            del table[key]
        case 1:
            table[draw(st.sampled_from([key[:-1], key.upper(), key + key, f"{key} ", "ü", ""]))] = table.pop(key)
        case 2:
            table[draw(st.sampled_from(["colour", "a.b", "", "name", "radius"]))] = draw(
                st.sampled_from(JUNK).map(deepcopy)
            )


def _magnify(draw: st.DrawFn, content: dict[str, Any]) -> None:
    """A quantity of another magnitude or sign."""
    quantities = [
        (table, key) for table, key in _places(content) if isinstance(table[key], str) and " " in table[key].strip()
    ]
    if quantities:
        table, key = draw(st.sampled_from(quantities))
        number, unit = table[key].split(" ", 1)
        other = draw(st.sampled_from(["-" + number.lstrip("-"), "0", *MAGNITUDES]))
        table[key] = f"{other} {unit}"


def _collide(draw: st.DrawFn, content: dict[str, Any]) -> None:
    """A second chamber in the place of the first, one outside the body, or two of one name."""
    chambers = content["body"]["chamber"]
    first = dict(chambers[0])
    match draw(st.integers(0, 3)):
        case 0:
            chambers.append(first | {"name": "again"})
        case 1:
            chambers.append(first)
        case 2:
            chambers[0]["span"] = first["span"][::-1]
        case 3:
            chambers[0]["radius"] = content["body"]["radius"]
