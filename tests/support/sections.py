"""Tubes of every kind of section."""

from pneumorph.problem import Problem

CROSS = [(10, -5), (10, 5), (5, 5), (5, 10), (-5, 10), (-5, 5)]
CROSS += [(-x, -y) for x, y in CROSS]

SECTIONS = {
    "ellipse": (
        {"kind": "ellipse", "width": "22 mm", "depth": "16 mm"},
        {"kind": "ellipse", "width": "12 mm", "depth": "7 mm"},
    ),
    "rectangle": (
        {"kind": "rectangle", "width": "20 mm", "depth": "16 mm", "corner": "3 mm"},
        {"kind": "rectangle", "width": "11 mm", "depth": "7 mm", "corner": "2 mm"},
    ),
    "polygon": (
        {"kind": "polygon", "sides": 6, "inner_radius": "9 mm", "corner": "3 mm"},
        {"kind": "polygon", "sides": 3, "inner_radius": "4 mm", "corner": "2.5 mm"},
    ),
    "half-round": (
        {"kind": "half-round", "round_radius": "13 mm", "corner": "2.5 mm"},
        {"kind": "half-round", "round_radius": "7 mm", "corner": "2 mm"},
    ),
    "points": (
        {"kind": "points", "corner": "2.5 mm", "points": [[f"{x} mm", f"{y} mm"] for x, y in CROSS]},
        {"kind": "ellipse", "width": "9 mm", "depth": "8 mm"},
    ),
}
"""Of the exterior and of the chamber."""


def problem(kind, taper=1.0, ends="flat"):
    """A tube with a chamber in it, of a kind of section."""
    exterior, chamber = SECTIONS[kind]
    inside = {"name": "A", "section": chamber, "taper": taper, "center": ["0 mm", "0 mm"], "ends": ends}
    return Problem.model_validate(
        {
            "material": {"name": "Hei-Cast 8400"},
            "body": {
                "length": "32 mm",
                "section": exterior,
                "taper": taper,
                "control_density": "0.5 /mm",
                "chamber": [inside | {"span": ["6 mm", "26 mm"]}],
            },
            "task": [{"name": "extend", "pressure": {"A": "20 kPa"}, "objective": {"motion": "extension"}}],
        }
    )
