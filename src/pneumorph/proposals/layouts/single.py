"""One chamber: on the axis, beside it, or in a body with threads."""

from __future__ import annotations

from pneumorph.proposals.layouts.layout import (
    MARGIN,
    MIRRORS,
    ON_AXIS,
    Drawn,
    Draws,
    Layout,
    chamber,
    fitting,
    mm,
    span,
    tube,
)
from pneumorph.proposals.target import Target

BESIDE = ({"mirror": ["xz"]}, {"mirror": ["yz"]}, {})


MIRRORED = "a body that is its own mirror image does not twist"


def one_way(target: Target) -> str:
    """Why one pressure does not do: it bends a body one way only."""
    if len(target.directions) > 1:
        return "one chamber bends a body one way, and tasks ask for several"
    return ""


def _central(target: Target) -> str:
    if reason := one_way(target):
        return reason
    if target.said and target.motions == {"twist"}:
        return MIRRORED
    return ""


def _draw_central(target: Target, draws: Draws) -> Drawn:
    body, radius = tube(target, draws)
    inner = fitting(target, radius, draws.between(0.4, 0.75) * radius)
    body["chamber"] = [chamber("A", inner, ON_AXIS, span(target))]
    words = f"radius {radius:.3g} mm, chamber {inner:.3g} mm" + (", rings" if "ripple" in body else "")
    return Drawn({"body": body}, {"A": ON_AXIS}, MIRRORS, radius, words)


def bends_one_way(target: Target) -> str:
    """Why a body that bends one way only does not do."""
    if reason := one_way(target):
        return reason
    if not target.directions:
        return "it bends, which no task asks for"
    return ""


def _draw_beside(target: Target, draws: Draws) -> Drawn:
    body, radius = tube(target, draws)
    [towards] = target.directions
    room = radius - MARGIN * target.limits.wall
    off = draws.between(0.15, 0.45) * room
    inner = fitting(target, radius, draws.between(0.7, 1.0) * room, off)
    body["chamber"] = [chamber("A", inner, -off * towards, span(target))]
    words = f"radius {radius:.3g} mm, chamber {inner:.3g} mm, {off:.2g} mm beside the axis"
    return Drawn({"body": body}, {"A": -towards}, BESIDE, radius, words + (", rings" if "ripple" in body else ""))


def _threads(target: Target) -> str:
    if target.said and "twist" not in target.motions:
        return "threads twist the body, which no task asks for"
    return one_way(target)


def _draw_threads(target: Target, draws: Draws) -> Drawn:
    body, radius = tube(target, draws, rings=False)
    inner = fitting(target, radius, draws.between(0.4, 0.65) * radius)
    lobes, period = draws.one_of((2, 3, 4)), target.space.length / draws.one_of((1, 2, 3))
    # Shallow threads unwind: a body with right-handed ones twists clockwise.
    sense = sense_of(target)
    body["ripple"] = {
        "amplitude": mm(draws.between(0.02, 0.06) * radius),
        "period": mm(period),
        "lobes": -sense * lobes,
    }
    body["chamber"] = [chamber("A", inner, ON_AXIS, span(target))]
    turned = {"rotation": lobes}
    symmetries = (turned | {"half_turn": "x"}, turned, {})
    words = f"radius {radius:.3g} mm, chamber {inner:.3g} mm, {lobes} threads of {period:.3g} mm"
    return Drawn({"body": body}, {"A": ON_AXIS}, symmetries, radius, words)


def sense_of(target: Target) -> int:
    """The sense in which tasks twist a body: 1 counter-clockwise seen from the tip, which is a right-handed screw."""
    asked = [task.objective.asked_motions.get("twist") for task in target.task]
    return -1 if any(each is not None and each.value < 0.0 for each in asked) else 1


CENTRAL = Layout("central", "one chamber on the axis", _central, _draw_central)
BESIDE_AXIS = Layout("beside", "one chamber beside the axis", bends_one_way, _draw_beside)
THREADS = Layout("threads", "one chamber in a body with threads like a screw", _threads, _draw_threads)
