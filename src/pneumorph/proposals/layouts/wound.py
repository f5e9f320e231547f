"""One chamber in a tube that thread keeps from widening, with a strip of cloth where it bends."""

from __future__ import annotations

import numpy as np

from pneumorph.proposals.layouts.layout import MIRRORS, ON_AXIS, Drawn, Draws, Layout, chamber, fitting, span, tube
from pneumorph.proposals.layouts.single import BESIDE, one_way, sense_of
from pneumorph.proposals.target import Target

CLOTH, THREAD = "300 N/mm", "50 N/mm"
"""Glass cloth, and windings of thread."""


NOT_ALLOWED = "cloth and thread are not allowed; reinforcement = true allows them"


def _wound(target: Target) -> str:
    if not target.reinforcement:
        return NOT_ALLOWED
    if target.said and target.motions == {"twist"}:
        return "windings in both senses do not twist a body"
    return one_way(target)


def _draw(target: Target, draws: Draws) -> Drawn:
    body, radius = tube(target, draws, rings=False)
    inner = fitting(target, radius, draws.between(0.55, 0.75) * radius)
    body["chamber"] = [chamber("A", inner, ON_AXIS, span(target))]
    winding = draws.between(75.0, 88.0)
    tables = {
        "body": body,
        "fibres": [{"name": "thread", "stiffness": THREAD, "winding": f"{winding:.3g} deg", "families": 2}],
    }
    words = f"radius {radius:.3g} mm, chamber {inner:.3g} mm, thread at {winding:.2g}°"
    if not target.directions:
        return Drawn(tables, {"A": ON_AXIS}, MIRRORS, radius, words)
    [towards] = target.directions
    middle, half = float(np.degrees(np.arctan2(towards[1], towards[0]))) % 360.0, draws.between(40.0, 75.0)
    strip = [f"{middle - half:.4g} deg", f"{middle + half:.4g} deg"]
    tables["membrane"] = [{"name": "cloth", "stiffness": CLOTH, "angles": strip}]
    return Drawn(tables, {"A": -towards}, BESIDE, radius, f"{words}, cloth over {2 * half:.0f}°")


def _helix(target: Target) -> str:
    if not target.reinforcement:
        return NOT_ALLOWED
    if target.said and "twist" not in target.motions:
        return "thread in one sense twists the body, which no task asks for"
    return one_way(target)


def _draw_helix(target: Target, draws: Draws) -> Drawn:
    body, radius = tube(target, draws, rings=False)
    inner = fitting(target, radius, draws.between(0.55, 0.75) * radius)
    body["chamber"] = [chamber("A", inner, ON_AXIS, span(target))]
    # A tube that widens and extends stretches a thread less if it twists against the sense in which it is wound.
    winding = -sense_of(target) * draws.between(25.0, 65.0)
    tables = {
        "body": body,
        "fibres": [{"name": "thread", "stiffness": THREAD, "winding": f"{winding:.3g} deg", "families": 1}],
    }
    turned = {"rotation": 3}
    words = f"radius {radius:.3g} mm, chamber {inner:.3g} mm, thread in one sense at {winding:.2g}°"
    return Drawn(tables, {"A": ON_AXIS}, (turned | {"half_turn": "x"}, turned, {}), radius, words)


HELIX = Layout("helix", "one chamber, wound with thread in one sense", _helix, _draw_helix)
WOUND = Layout(
    "wound", "one chamber, wound with thread, with a strip of cloth on the inside of the bend", _wound, _draw
)
