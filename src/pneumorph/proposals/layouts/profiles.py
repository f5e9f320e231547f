"""One chamber in a body whose cross-section is an ellipse, a rectangle or half a disc, with or without cloth."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError
from scipy.spatial import KDTree

from pneumorph.problem.outline import Outline
from pneumorph.problem.section import Section
from pneumorph.proposals.layouts.layout import (
    MARGIN,
    Drawn,
    Draws,
    Layout,
    NoRoom,
    ends_of,
    mm,
    span,
)
from pneumorph.proposals.layouts.single import BESIDE, bends_one_way
from pneumorph.proposals.layouts.wound import CLOTH, NOT_ALLOWED, THREAD
from pneumorph.proposals.target import Target

SHAPES = ("half-round", "rectangle", "ellipse")

SHRINKING, TRIES = 0.94, 24
"""By what a chamber is made smaller until it keeps its walls, and how often."""

_SECTION: TypeAdapter[Any] = TypeAdapter(Section)
_FEW, _MANY = (np.linspace(0.0, 1.0, count, endpoint=False) for count in (120, 600))


def _table(shape: str, width: float, depth: float, corner: float) -> dict[str, Any]:
    """The table of a section of a size along x and along y, mm; half a disc is as deep as it is."""
    if shape == "ellipse":
        return {"kind": shape, "width": mm(width), "depth": mm(depth)}
    if shape == "rectangle":
        return {"kind": shape, "width": mm(width), "depth": mm(depth), "corner": mm(corner)}
    return {"kind": shape, "round_radius": mm(depth / 2.0), "corner": mm(corner)}


def _outline(table: dict[str, Any]) -> Outline:
    try:
        return _SECTION.validate_python(table).outline
    except ValidationError:
        raise NoRoom(f"corners of {table['corner']}, which limits.curvature asks for, do not fit") from None


def _apart(outer: Outline, inner: Outline) -> float:
    """Least distance of an outline from one around it, mm; negative where it leaves it."""
    points, around = inner.at(_FEW), outer.at(_MANY)
    distance = float(KDTree(around).query(points)[0].min())
    return distance if Outline(around).contains(points).all() else -distance


def _largest(allowed: Callable[[float], bool], what: str) -> float:
    """The largest of some scales that is allowed."""
    for scale in SHRINKING ** np.arange(TRIES):
        if allowed(float(scale)):
            return float(scale)
    raise NoRoom(f"the walls leave no room for {what}")


def _fitted(target: Target, towards: np.ndarray, shape: str, aspect: float, share: float) -> tuple[float, float]:
    """Size of a section in the direction of the bend and across it, mm, with which it fills a share of the space."""
    width, depth = aspect, 1.0
    unit = _outline(_table(shape, 100.0 * width, 100.0 * depth, 12.0 * min(width, depth))).points / 100.0
    sides = target.space.sides
    along_axes = bool(np.isclose(np.abs(towards).max(), 1.0))
    if sides is None or not along_axes:
        scale = target.space.round / np.linalg.norm(unit, axis=1).max()
    else:
        along, across = sides if abs(towards[0]) > 0.5 else sides[::-1]
        scale = min(along / np.abs(unit[:, 0]).max(), across / np.abs(unit[:, 1]).max())
    return share * scale * width, share * scale * depth


def _body(target: Target, draws: Draws) -> tuple[dict[str, Any], float, float, str]:
    """The table of a body, its radius (mm), the direction of its thick wall's ends (degrees) and words."""
    [towards] = target.directions
    shape, aspect, share = draws.one_of(SHAPES), draws.between(0.6, 1.5), draws.between(0.75, 0.98)
    taper = min(draws.between(0.6, 1.3), 1.0)
    wall = MARGIN * target.limits.wall
    side, floor = draws.between(1.0, 1.4) * wall, draws.between(1.0, 2.2) * wall
    width, depth = _fitted(target, towards, shape, aspect, share)
    # Corners are no sharper at the tip than the limit of curvature allows.
    sharpest = 1.15 / np.sqrt(2.0 * target.limits.curvature)
    corner = max(0.15 * min(width, depth), sharpest / taper)
    if corner > 0.22 * min(width, depth):
        raise NoRoom(f"corners of {corner:.2g} mm, which limits.curvature asks for, do not fit a {shape} section")
    outside = _table(shape, width, depth, corner)
    outer = _outline(outside)
    # A chamber narrows a little more than its body does.
    sharper = 1.05 * sharpest / (taper if taper == 1.0 else 0.85 * taper)
    start, stop = ends_of(target)
    length = target.space.length

    def inside(scale: float) -> tuple[dict[str, Any], Outline]:
        w, d = scale * (width - side - floor), scale * (depth - 2.0 * side)
        if min(w, d) <= 2.5 * sharper:
            raise NoRoom(f"walls of {target.limits.wall:g} mm leave no chamber in a {shape} section of {depth:.3g} mm")
        table = _table(shape, w, d, max(0.15 * min(w, d), sharper))
        own = _outline(table)
        # The wall on the inside of the bend, at -x before the turn, is the thick one.
        return table, own.moved(float(outer.points[:, 0].min()) + floor - float(own.points[:, 0].min()), 0.0)

    lower = outer.scaled(1.0 + (taper - 1.0) * start / length)
    upper = outer.scaled(1.0 + (taper - 1.0) * stop / length)
    scale = _largest(lambda each: _apart(lower, inside(each)[1]) >= wall, "a chamber")
    table, placed = inside(scale)
    own = _outline(table)
    off = float(placed.points[:, 0].max() - own.points[:, 0].max())
    narrowing = _largest(lambda each: _apart(upper, own.scaled(each).moved(off, 0.0)) >= wall, "a tapered chamber")
    if narrowing / own.curvature < sharpest:
        raise NoRoom("the chamber's corners would be too sharp at the tip")
    turn = (float(np.degrees(np.arctan2(towards[1], towards[0]))) + 180.0) % 360.0
    turned = {"turn": f"{turn:.6g} deg"} if turn else {}
    radius = float(np.sqrt(outer.area / np.pi))
    body = {
        "length": mm(length),
        "section": outside | turned,
        "control_density": f"{max(3.0 / radius, 1.0 / (1.5 * corner)):.3g} /mm",
        "chamber": [
            {
                "name": "A",
                "section": table | turned,
                "center": [mm(each) for each in -off * towards],
                "span": span(target),
            }
        ],
    }
    words = f"{shape} {width if shape != 'half-round' else depth / 2.0:.3g}"
    words += f" by {depth:.3g} mm" if shape != "half-round" else " mm in radius"
    if taper < 1.0:
        body["taper"] = round(taper, 4)
        words += f", {taper:.2g} of that at the tip"
    if narrowing < 1.0:
        body["chamber"][0]["taper"] = round(narrowing, 4)
    flat = np.degrees(np.arctan2(0.42 * depth, -float(outer.points[:, 0].min())))
    return body, radius, float(flat), f"{words}, inner wall {floor:.2g} mm"


def _draw_profile(target: Target, draws: Draws) -> Drawn:
    [towards] = target.directions
    body, radius, _, words = _body(target, draws)
    return Drawn({"body": body}, {"A": -towards}, BESIDE, radius, words)


def _sheet(target: Target) -> str:
    if not target.reinforcement:
        return NOT_ALLOWED
    return bends_one_way(target)


def _draw_sheet(target: Target, draws: Draws) -> Drawn:
    [towards] = target.directions
    threaded, winding = draws.one_of((True, False)), draws.between(80.0, 88.0)
    body, radius, flat, words = _body(target, draws)
    middle = float(np.degrees(np.arctan2(towards[1], towards[0]))) % 360.0
    strip = [f"{middle - flat:.4g} deg", f"{middle + flat:.4g} deg"]
    tables: dict[str, Any] = {"body": body, "membrane": [{"name": "cloth", "stiffness": CLOTH, "angles": strip}]}
    words += ", cloth on the inner wall"
    if threaded:
        tables["fibres"] = [{"name": "thread", "stiffness": THREAD, "winding": f"{winding:.3g} deg", "families": 2}]
        words += f", thread at {winding:.2g}°"
    return Drawn(tables, {"A": -towards}, BESIDE, radius, words)


PROFILE = Layout("profile", "one chamber in a half-round, rectangular or elliptic body", bends_one_way, _draw_profile)
SHEET = Layout("sheet", "the same with cloth on the inside of the bend", _sheet, _draw_sheet)
