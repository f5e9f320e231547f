"""Checks of symmetries: whether sections, chambers and ripples are images of each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from pneumorph.problem.body import BodySpec
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables
from pneumorph.symmetry.images import WITHIN, image, place, placed
from pneumorph.symmetry.operations import operations


def check_symmetry(problem: Tables) -> Iterator[tuple[str, str]]:
    """Check that chambers and ripples are symmetric."""
    body = problem.tubes
    group = operations(body.symmetry)
    if body.ripple and body.ripple.lobes:
        if any(np.linalg.det(matrix) < 0 for matrix in group):
            yield (
                "body.ripple.lobes",
                "a helix is not its own mirror image; use lobes = 0, or leave out body.symmetry.mirror and point",
            )
        if body.ripple.lobes % body.symmetry.rotation:
            yield (
                "body.ripple.lobes",
                f"is not a multiple of body.symmetry.rotation = {body.symmetry.rotation}; make it one",
            )
        if body.symmetry.half_turn == "y" and body.ripple.lobes % 2:
            yield (
                "body.ripple.lobes",
                'is odd, which suits only a half turn about x; use half_turn = "x"',
            )
    missing = list(_unlike_images(body, group)) or list(_missing_images(body, group))
    if missing:
        yield from missing
        return
    for matrix in group:
        for index in range(len(body.chamber)):
            fault = _fault_of_ripple(body, index, matrix)
            if fault:
                yield fault
                return


def _unlike_images(body: BodySpec, group: list[np.ndarray]) -> Iterator[tuple[str, str]]:
    """Sections and tapers that the symmetry does not keep."""
    if body.section and not all(body.outline.is_image_of(body.outline, matrix) for matrix in group):
        yield "body.section", "is not its own image under body.symmetry; turn it, or ask for less symmetry"
    if body.taper != 1.0 and any(matrix[2, 2] < 0.0 for matrix in group):
        yield "body.taper", "makes the two halves along the axis unlike, but body.symmetry maps one to the other"
    if body.dome and any(matrix[2, 2] < 0.0 for matrix in group):
        yield "body.dome", "makes the two halves along the axis unlike, but body.symmetry maps one to the other"
    places = np.array([place(chamber) for chamber in body.chamber])
    for index, chamber in enumerate(body.chamber):
        for matrix in group:
            there = np.abs(places - placed(places[index], matrix, body.length)).max(axis=1) <= WITHIN
            if there.any() and image(body.chamber, index, matrix, body.length) is None:
                yield (
                    f"body.chamber[{index}]",
                    f'"{chamber.name}" and "{body.chamber[int(there.argmax())].name}", in the place of its image under '
                    "body.symmetry, have unlike sections, tapers or ends; make them images of each other",
                )
                return


def _missing_images(body: BodySpec, group: list[np.ndarray]) -> Iterator[tuple[str, str]]:
    """Every place where a chamber should be, for the first chamber of which an image is missing."""
    for index, chamber in enumerate(body.chamber):
        there = np.zeros((0, 5))
        for matrix in group:
            if image(body.chamber, index, matrix, body.length) is not None:
                continue
            wanted = placed(place(chamber), matrix, body.length)
            if np.any(np.all(np.abs(there - wanted) <= WITHIN, axis=1)):
                continue
            there = np.vstack([there, wanted])
        turns = body.symmetry.rotation
        only = turns > 1 and len(group) == turns and len(there) == turns - 1 and math.hypot(*chamber.center) > WITHIN
        for x, y, start, end, _ in there:
            yield (
                f"body.chamber[{index}]",
                f'"{chamber.name}" has no image under body.symmetry; put one like it at '
                f'center = ["{_mm(x)}", "{_mm(y)}"], span = ["{_mm(start)}", "{_mm(end)}"]'
                + (f", or give it copies = {turns}" if only else "")
                + ", or ask for less symmetry",
            )
        if len(there):
            return


def _mm(value: float) -> str:
    """A length as it can be written in a file; rounding is far below `WITHIN`."""
    return f"{round(value, 5) + 0.0:g} mm" if abs(value) < 1.0 else f"{value:.6g} mm"


def _fault_of_ripple(body: BodySpec, index: int, matrix: np.ndarray) -> tuple[str, str] | None:
    """The fault in the ripple of a chamber's image, if there is one."""
    chamber, number = body.chamber[index], image(body.chamber, index, matrix, body.length)
    assert number is not None, "chambers without an image are reported before"
    if chamber.ripple is None and body.chamber[number].ripple is None:
        return None
    own, other = body.ripple_of(chamber), body.ripple_of(body.chamber[number])
    lobes = 0 if own is None else own.lobes
    # cos(k z − l θ) becomes cos(k z' ∓ l (θ' − α)), with the plus sign for a reflection.
    turns = lobes * math.atan2(matrix[1, 0], matrix[0, 0]) / (2.0 * math.pi)
    wanted = own if own is None else own.model_copy(update={"lobes": round(np.linalg.det(matrix)) * lobes})
    if other != wanted or abs(turns - round(turns)) > ROUNDING:
        return (
            f"body.chamber[{index}].ripple",
            f'is not the image of that of "{body.chamber[number].name}"; give both the same amplitude and period, and '
            "mirror images lobes of opposite sign (an even number for the mirror yz)",
        )
    return None
