"""Sheets and fibres in pictures, on assembly sheets, and where a format cannot hold them."""

import numpy as np
import pytest
from tiny import tiny

from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.make.mould.sheet import reinforcing
from pneumorph.output.reinforcements import covering_handles, coverings_of
from pneumorph.problem import loads

SHEET = '[[membrane]]\nname = "paper"\nstiffness = "200 N/mm"\nangles = ["-90 deg", "90 deg"]\n'
BRAID = '[[fibres]]\nname = "braid"\nstiffness = "50 N/mm"\nwinding = "70 deg"\nsurfaces = ["exterior", "A"]\n'


@pytest.fixture(scope="module")
def problem():
    return loads(tiny() + SHEET + BRAID)


def test_pictures_show_sheets_as_areas_and_fibres_as_strokes(problem):
    mesh = mesh_of(problem, starting_body(problem.tubes), ()).mesh
    u = mesh.points * [0.0, 0.0, 0.5]
    sheet, braid = coverings_of(problem, mesh, u)
    radius = problem.body.radius
    assert np.hypot(*sheet.rest.T[:2]) == pytest.approx(radius, rel=0.02)
    assert sheet.points == pytest.approx(sheet.rest * [1.0, 1.0, 1.5])
    corners = sheet.rest[sheet.cells]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(np.pi * radius * problem.body.length, rel=0.03)
    strokes = np.diff(braid.rest[braid.cells], axis=1)[:, 0]
    steep = np.degrees(np.arccos(np.abs(strokes[:, 2]) / np.linalg.norm(strokes, axis=1)))
    assert np.median(steep) == pytest.approx(70.0, abs=1.0)
    # Strokes of a right-handed screw rise counter-clockwise.
    middle = braid.rest[braid.cells].mean(axis=1)
    turning = (middle[:, 0] * strokes[:, 1] - middle[:, 1] * strokes[:, 0]) * strokes[:, 2]
    assert (turning[0::2] > 0).all() and (turning[1::2] < 0).all()
    assert [handle.get_label() for handle in covering_handles([sheet, braid])] == ["sheet", "fibres"]
    assert coverings_of(loads(tiny()), mesh, u) == ()


def test_assembly_sheets_say_what_is_laid_where(problem):
    sheet, inside, outside = reinforcing(problem)
    assert sheet.startswith('Bond a sheet "paper" (surfaces exterior, angles -90 deg to 90 deg, stiffness 200 N/mm')
    assert inside.startswith('Before casting, lay fibres "braid"') and "cores of A" in inside
    assert outside.startswith('Bond fibres "braid"')
    assert reinforcing(loads(tiny())) == []
