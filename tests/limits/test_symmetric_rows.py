"""Of samples and knot spans that are images of each other in symmetric bodies, one has rows and certificates."""

import numpy as np
import pytest
from certifying import certified
from scipy.spatial import KDTree

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.limits.of_shape import limits_at
from pneumorph.limits.table import BY_NAME, ROWS
from pneumorph.limits.tube.samples import sample_limits
from pneumorph.problem import loads
from pneumorph.symmetry.operations import operations

FILE = """
[material]
name = "Hei-Cast 8400"
[body]
length = "24 mm"
radius = "8 mm"
control_density = "0.3 /mm"
symmetry = {symmetry}
{chambers}
[[task]]
name = "extend"
pressure = {{ {pressure} }}
objective = {{ kind = "maximize", motion = "extension" }}
[mesh]
size = "6 mm"
"""
ONE = '[[body.chamber]]\nname = "A"\nradius = "4 mm"\ncenter = ["0 mm", "0 mm"]\nspan = ["3 mm", "21 mm"]\n'
ROUND = ONE + 'ends = "pole"\n'
PAIR = "".join(
    f'[[body.chamber]]\nname = "{name}"\nradius = "1.8 mm"\ncenter = ["{x} mm", "0 mm"]\nspan = ["3 mm", "21 mm"]\n'
    for name, x in (("A", -4), ("B", 4))
)
CASES = {
    "a mirror through one chamber": ('{ mirror = ["xz"] }', ONE, 2),
    "two mirrors, of which one swaps chambers": ('{ mirror = ["xz", "yz"] }', PAIR, 4),
    "a mirror of the ends": ('{ mirror = ["xy"] }', ROUND, 2),
    "sectors": ("{ rotation = 3 }", ONE, 3),
    "sectors and a half turn": ('{ rotation = 3, half_turn = "x" }', ROUND, 6),
    "a point": ("{ point = true }", PAIR, 2),
    "none": ("{ }", ONE, 1),
}


def count(places):
    return sum(len(found.attained) for found in places.values())


def problem_with(symmetry, chambers):
    pressure = ", ".join(f'{name} = "1 kPa"' for name in ("AB" if chambers is PAIR else "A"))
    return loads(FILE.format(symmetry=symmetry, chambers=chambers, pressure=pressure))


@pytest.mark.parametrize(("symmetry", "chambers", "order"), CASES.values(), ids=CASES)
def test_one_knot_span_is_certified_for_its_images(symmetry, chambers, order):
    problem = problem_with(symmetry, chambers)
    start = starting_body(problem.tubes)
    samples = sample_limits(start, problem.limits, operations(problem.body.symmetry))
    limits, own = limits_at(samples), samples.own_spans
    assert 1 / order <= np.concatenate(own).mean() < 1 / order + 0.08
    space = build_design_space(problem, start)
    for seed, most in ((0, 0.05), (1, 0.2), (2, 0.4)):
        body = space.body(space.start + most * np.random.default_rng(seed).normal(size=space.n))
        whole, part = certified(body, problem.limits), limits.certify(body)
        assert [reading.limit for reading in part.violated()] == [reading.limit for reading in whole.violated()]
        for one, other in zip(whole.readings, part.readings, strict=True):
            # Each is as bad as all points that the other has seen.
            sign = -1.0 if BY_NAME[one.limit].at_least else 1.0
            assert sign * one.value >= sign * other.attained - 1e-9, one.limit
            assert sign * other.value >= sign * one.attained - 1e-9, one.limit
        assert count(part.places) <= count(whole.places)
        assert bool(count(part.places)) == bool(count(whole.places))


@pytest.mark.parametrize(("symmetry", "chambers", "order"), CASES.values(), ids=CASES)
def test_one_row_stands_for_its_images(symmetry, chambers, order):
    problem = problem_with(symmetry, chambers)
    group = operations(problem.body.symmetry)
    assert len(group) == order
    start = starting_body(problem.tubes)
    space = build_design_space(problem, start)
    samples, every = sample_limits(start, problem.limits, group), sample_limits(start, problem.limits)
    assert all(mask.all() for mask in (*every.own_fine, *every.own_coarse))
    own = sum(np.count_nonzero(mask) for mask in samples.own_coarse)
    assert 1 / order <= own / sum(mask.size for mask in every.own_coarse) < 1 / order + 0.08

    # On any symmetric body the own samples and their images are all samples, poles aside.
    phi = space.start + 0.2 * np.random.default_rng(3).normal(size=space.n)
    body = space.body(phi)
    centre = np.array([0.0, 0.0, 12.0])
    for surface, grid, mask in zip(body.surfaces, samples.coarse, samples.own_coarse, strict=True):
        inner = slice(1, -1) if any(surface.poles) else slice(None)
        x = np.moveaxis(grid.combine(surface.net, grid.local_r, ((0, 0),))[0], 0, -1)[inner]
        own_x = [
            np.moveaxis(part.combine(other.net, part.local_r, ((0, 0),))[0], 0, -1)[kept]
            for other, part, kept in zip(body.surfaces, samples.coarse, samples.own_coarse, strict=True)
        ]
        images = np.concatenate([(np.concatenate(own_x) - centre) @ matrix.T + centre for matrix in group])
        assert KDTree(images).query(x.reshape(-1, 3))[0].max() < 1e-9
        assert mask.shape == x.shape[:2] or any(surface.poles)

    # So the worst values are the same, of every limit. A fold far within its bound is a distance between samples; peaks
    # of measures of the shape are sought from several samples, of which an image may lead a little higher.
    sought = {"fold": 5e-3, **dict.fromkeys(("curvature", "skew", "stretch", "area"), 2e-2)}
    some, all_ = (limits_at(each).rows(body, 2.0, -0.5) for each in (samples, every))
    for kind, name in enumerate(ROWS):
        there = all_.value[all_.kind == kind]
        if len(there):
            assert some.value[some.kind == kind].max() == pytest.approx(there.max(), abs=sought.get(name, 1e-9)), name
    assert len(some.value) <= len(all_.value) * (1 / order + 0.15)
