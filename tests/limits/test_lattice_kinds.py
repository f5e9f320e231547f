"""Limits on bending, on the volume of rubber, and on a space from an STL file, of bodies from files."""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from solids import box, cylinder, problem, written

from pneumorph.cad.read import read_faces
from pneumorph.cad.space import TOUCHING, Space
from pneumorph.cad.stl import Surface, pack
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.limits.lattice.bending import Bendings, bendings
from pneumorph.limits.lattice.sampled import SampledLattices
from pneumorph.limits.of_shape import limits_of
from pneumorph.limits.table import ROWS
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.problem import loads

STEPS = np.linspace(0.0, 1.0, 7)
GRID = np.array([[1 - u - v, u, v] for u in STEPS for v in STEPS if u + v <= 1 + 1e-12])
VOLUME = 16 * 14 * 24 - np.pi * 9 * 16
LIMITS = """
[design]
spacing = "6 mm"
[limits]
wall = "1.5 mm"
bending = "0.08 /mm"
volume = "4.9 ml"
envelope = {{ triangles = "{space}" }}
"""


def surface_of(shape):
    """The surface of a block-like shape in triangles."""

    with tempfile.TemporaryDirectory() as folder:
        faces = read_faces(written(shape, Path(folder) / "a.step").read_bytes(), "step")
    used, corners = np.unique(faces.triangles[:, :3], return_inverse=True)
    return Surface(faces.points[used], corners.reshape(-1, 3))


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """A block with a round void in a space that has a step in its side."""
    where = tmp_path_factory.mktemp("kinds")
    written(box((-8, -7, 0), (8, 7, 24)) - cylinder(3, 4, 20, x=-3), where / "block.step")
    room = box((-9, -8, 0), (10, 8, 25)) - box((8.5, -9, 12), (11, 9, 26))
    text = problem("block.step", size="4 mm") + LIMITS.format(space=pack(surface_of(room)))
    return loads(text, folder=where)


@pytest.fixture(scope="module")
def space(asked):
    return space_of(asked)


@pytest.fixture(scope="module")
def limits(asked):
    return limits_of(asked, body_of(asked))


def moved(space, seed, far):
    z = build_smoothing(space).apply(np.random.default_rng(seed).uniform(-1, 1, space.n))
    return space.body(space.start + far * z / np.abs(z).max())


def scaled(body, factors):
    return body.with_control_points(body.control_points() * factors)


def test_at_the_start(asked, limits):
    found = limits.certify(body_of(asked))
    assert found["bending"].attained == pytest.approx(0.0, abs=1e-9)
    assert found["volume"].attained == pytest.approx(VOLUME, rel=4e-4)
    assert VOLUME <= found["volume"].value <= 1.01 * VOLUME
    # The lower end of the block lies in the surface of the space.
    assert found["space"].attained == pytest.approx(-TOUCHING, abs=1e-9)
    assert found["space"].satisfied()
    assert {"bending", "volume_mm3", "envelope_mm"} <= set(found.values())


def test_volumes_are_those_of_affine_images(asked, limits):
    body = body_of(asked)
    for factors in ([1.02, 1.0, 1.0], [1.0, 0.9, 1.1]):
        exact = VOLUME * np.prod(factors)
        found = limits.certify(scaled(body, factors))["volume"]
        assert found.attained == pytest.approx(exact, rel=4e-4)
        assert exact <= found.value <= 1.01 * exact
        assert found.satisfied() == (found.value <= 4900.0)


def test_bending_of_a_parabola(asked, limits):
    """φ = x + ½ a z² e_x has |∂²φ/∂z²| = a everywhere; control points are polar forms of that."""
    body, a = body_of(asked), 0.05
    moved = []
    for surface in body.surfaces:
        net, (_, _, basis) = surface.net.copy(), surface.lattice.bases
        low, high = surface.lattice.lower[2], surface.lattice.upper[2]
        knots = low + basis.knots * (high - low)
        first, second, third = (knots[k : k + basis.count] for k in (1, 2, 3))
        polar = (first * second + second * third + third * first) / 3.0
        index = np.tile(np.arange(basis.count), len(net) // basis.count)
        net[:, 0] += 0.5 * a * polar[index]
        moved.append(net)
    bent = body.with_control_points(np.concatenate(moved))
    own = replace(limits, kinds=(Bendings(),))
    found = own.certify(bent)["bending"]
    assert found.attained == pytest.approx(a, rel=1e-6)
    assert a * (1 - 1e-9) <= found.value <= 1.01 * a
    assert found.satisfied()
    twice = body.with_control_points(2 * bent.control_points() - body.control_points())
    assert not own.certify(twice)["bending"].satisfied()


@pytest.mark.parametrize("far", [0.4, 1.5, 2.5])
def test_certificates_enclose_dense_samples(asked, space, limits, far):
    body = moved(space, 3, far)
    found, at = limits.certify(body), limits.sampled(body)
    assert isinstance(at, SampledLattices)
    room, worst, bent = Space(*asked.limits.envelope.surface), -np.inf, 0.0
    for number, (surface, patches) in enumerate(zip(at.surfaces, at.patches, strict=True)):
        count = len(patches.nodes)
        places = patches.places(np.repeat(np.arange(count), len(GRID)), np.tile(GRID, (count, 1)))
        bent = max(bent, bendings(surface, places).max())
        if number == 0:
            worst = room.beyond(surface.map(places)).max()
    # Far from the bound certificates are only as sharp as necessary; near it they decide whether it holds.
    bound, sharp = found["bending"].bound, bent + max(0.3 * (0.08 - bent), 0.02 * bent)
    assert bent <= found["bending"].value <= (max(sharp, bound) if 0.9 * bound < bent < bound else sharp)
    assert worst <= found["space"].value + 1e-9
    assert found["space"].value <= worst + 0.05 * abs(worst) + 0.01


def test_rows_are_derivatives(space, limits):
    body = moved(space, 5, 0.8)
    step = 1e-4 * np.random.default_rng(6).normal(size=3 * space.reference.n_points)
    other = body.with_control_points(body.control_points() + step.reshape(-1, 3))
    rows, again = (limits.rows(each, 3.0, -0.99) for each in (body, other))
    predicted = rows.value + rows.jacobian @ step
    for name in ("bending", "volume", "space"):
        number = ROWS.index(name)
        assert (rows.kind == number).any(), name
        worst = [np.max(values[kind == number]) for values, kind in ((predicted, rows.kind), (again.value, again.kind))]
        before = rows.value[rows.kind == number].max()
        assert worst[0] == pytest.approx(worst[1], abs=0.02 * abs(worst[1] - before) + 1e-8), name


def test_what_is_beyond_a_space_is_found(asked, limits):
    """The block's side is within the lower part of the space alone."""
    body = body_of(asked)
    for shift, beyond in ((0.4, False), (0.6, True)):
        found = limits.certify(body.with_control_points(body.control_points() + np.array([shift, 0.0, 0.0])))["space"]
        assert found.satisfied() != beyond
        if beyond:
            assert found.attained == pytest.approx(0.1 - TOUCHING, abs=1e-6)
            assert found.value == pytest.approx(0.1, abs=0.01)


@pytest.mark.parametrize("key", ['bending = "1 /mm"', 'volume = "9 ml"', 'envelope = {{ triangles = "{space}" }}'])
def test_they_are_for_bodies_from_files(key):
    text = """
[material]
name = "Hei-Cast 8400"
[body]
length = "40 mm"
radius = "8 mm"
[[body.chamber]]
name = "A"
radius = "4 mm"
center = ["0 mm", "0 mm"]
span = ["3 mm", "37 mm"]
[[task]]
name = "extend"
pressure = { A = "60 kPa" }
objective = { motion = "extension" }
[limits]
"""
    with pytest.raises(ProblemError, match=r"limits\.(bending|volume|envelope)"):
        loads(text + key.format(space=pack(surface_of(box((-9, -9, 0), (9, 9, 41))))))


def test_spaces_that_are_none(tmp_path):
    written(box((-8, -7, 0), (8, 7, 24)) - cylinder(3, 4, 20), tmp_path / "block.step")
    (tmp_path / "space.stl").write_text("solid\nendsolid\n")
    text, packed = problem("block.step", size="4 mm"), pack(surface_of(box((0, 0, 0), (1, 1, 1))))
    both = f'{{ radius = "9 mm", triangles = "{packed}" }}'
    for table in ('{ file = "space.stl" }', '{ file = "none.stl" }', both):
        with pytest.raises(ProblemError, match=r"limits\.envelope\.(file|radius)"):
            loads(text + f"[limits]\nenvelope = {table}\n", folder=tmp_path)
