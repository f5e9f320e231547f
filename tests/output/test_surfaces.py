"""What a page has of a body from a file: the triangles of its surfaces, and how much of the limits they use."""

import numpy as np
import pytest
from solids import box, cylinder, problem, written

from pneumorph.geometry.starting import body_of
from pneumorph.limits.of_shape import limits_of
from pneumorph.limits.shares import NAMES
from pneumorph.output.report_limits import packed_usage
from pneumorph.output.report_shapes import packed_surfaces
from pneumorph.problem import loads

LIMITS = """
[limits]
wall = "1.5 mm"
envelope = { box = [["-8.5 mm", "-7.5 mm", "-1 mm"], ["8.5 mm", "7.5 mm", "25 mm"]] }
"""


def test_a_page_has_the_triangles_of_a_body_from_a_file(tmp_path):
    written(box((-8, -7, 0), (8, 7, 24)) - cylinder(3, 4, 20, x=-3), tmp_path / "block.step")
    asked = loads(problem("block.step", size="4 mm") + LIMITS, folder=tmp_path)
    start = body_of(asked)
    moved = start.with_control_points(start.control_points() * [1.03, 1.0, 1.0])
    limits = limits_of(asked, start)
    told, arrays = packed_surfaces([start, moved])
    words, used = packed_usage(limits, [start, moved])
    assert words["limit_words"][NAMES.index("envelope")] == "envelope"
    assert [each["name"] for each in told] == ["exterior", "A"]
    for each, surface in zip(told, moved.surfaces, strict=True):
        vertices, triangles = surface.shell()
        drawn, shares = arrays[each["stored"]], used[f"used {each['key']}"]
        np.testing.assert_allclose(drawn.step * drawn.values[1], vertices, atol=1e-3)
        np.testing.assert_array_equal(arrays[f"corners {each['key']}"].values.reshape(-1, 3), triangles)
        assert shares.values.shape == used[f"limit {each['key']}"].values.shape == (2, len(vertices))
    # The walls of 2 mm beside the void use three quarters of their limit, and the sides half a mm of room in the box.
    wall = used["used exterior"].values[0][used["limit exterior"].values[0] == NAMES.index("wall")]
    assert 0.01 * wall.max() == pytest.approx(1.5 / 2.0, abs=0.02)
    room = used["used exterior"].values[1][used["limit exterior"].values[1] == NAMES.index("envelope")]
    assert 0.01 * room.max() == pytest.approx(1.0 - 0.5 + 0.24, abs=0.02)
