"""A body that is no tube, of surfaces that the package has never seen, is meshed, solved, differentiated and designed.

Its surfaces are spheres, displaced by smooth functions of the direction from the centre. Of its problem only the length
and the names of chambers are known: nothing else of a table [body] may be asked for.
"""

from dataclasses import dataclass, field, replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse
from scipy.spatial import ConvexHull, KDTree

from pneumorph.analysis import analyse, design_gradient
from pneumorph.geometry import Body, Triangulation, build_space, tied_coordinates
from pneumorph.limits.linearised import Rows
from pneumorph.limits.report import LimitReading, LimitReport
from pneumorph.limits.table import ROWS
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mesh import SurfaceMesher, scaled_jacobian
from pneumorph.optimize import DesignAccepted, Finished, optimise, setup_among
from pneumorph.optimize.start import resumed
from pneumorph.output.report_shapes import packed_surfaces
from pneumorph.output.shell import shell_of
from pneumorph.problem import loads
from pneumorph.run import StoredDesign
from pneumorph.sensitivity.taylor import taylor_test

RADII, CAP, WALL = (10.0, 7.5), 0.85, 2.0
PROBLEM = """
[material]
name = "Hei-Cast 8400"
[body]
length = "20 mm"
radius = "10 mm"
chamber = [{ name = "A", radius = "5 mm", center = ["0 mm", "0 mm"], span = ["3 mm", "17 mm"] }]
[[task]]
name = "grow"
pressure = { A = "15 kPa" }
objective = { kind = "maximize", motion = "extension" }
[mesh]
size = "4.5 mm"
element = "quadratic"
[optimizer]
step = "0.3 mm"
iterations = 3
"""


@cache
def sphere(level):
    """Corners (n, 3) and outward triangles (m, 3) of an icosahedron whose triangles are divided by four, often."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([np.roll([0, a, b * golden], k) for k in range(3) for a in (1, -1) for b in (1, -1)], float)
    for _ in range(level + 1):
        corners /= np.linalg.norm(corners, axis=1)[:, None]
        triangles = ConvexHull(corners).simplices
        a, b, c = (corners[triangles[:, k]] for k in range(3))
        inward = np.linalg.det(np.stack([a, b, c], axis=1)) < 0
        triangles[inward] = triangles[inward][:, [0, 2, 1]]
        edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
        found = corners, triangles
        corners = np.concatenate([corners, corners[edges].sum(axis=1)])
    return found


@dataclass(frozen=True)
class Neighbours:
    """An average over near control points: a symmetric matrix for each coordinate."""

    matrix: np.ndarray

    def within(self, L):
        return L[np.arange(3 * len(self.matrix)).reshape(-1, 3).T.ravel()], self.apply

    def apply(self, coordinates):
        return (coordinates.reshape(3, -1) @ self.matrix).ravel()


@dataclass(frozen=True, eq=False)
class Blob:
    """A sphere about (0, 0, 10), of which every point moves by a mean of the motions of the control points near it."""

    name: str
    radius: float
    cavity: bool
    points: np.ndarray = field(default_factory=lambda: sphere(1)[0])

    @property
    def n_points(self):
        return len(self.points)

    @property
    def shape(self):
        return self.points.shape[:1]

    def control_points(self):
        return self.points

    def with_control_points(self, points):
        return replace(self, points=points)

    def weights(self, directions):
        near = np.exp(8.0 * (directions @ sphere(1)[0].T - 1.0))
        return near / near.sum(axis=1, keepdims=True)

    def at(self, directions):
        """B and offset of the points in some directions."""
        B = self.weights(directions)
        return sparse.csr_array(B), self.radius * directions + [0.0, 0.0, 10.0] - B @ sphere(1)[0]

    def triangulation(self, size):
        corners, triangles = sphere(max(1, round(np.log2(1.15 * self.radius / size))))
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        ends, mids = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        middle = corners[ends].sum(axis=1)
        directions = np.concatenate([corners, middle / np.linalg.norm(middle, axis=1)[:, None]])
        triangles = np.hstack([triangles, len(corners) + mids.reshape(-1, 3)])
        if self.cavity:
            return Triangulation(*self.at(directions), {"chamber A": triangles[:, [0, 2, 1, 5, 4, 3]]})
        height = directions[triangles[:, :3], 2].mean(axis=1)
        parts = {"base": height < -CAP, "tip": height > CAP, "exterior": np.abs(height) <= CAP}
        return Triangulation(*self.at(directions), {name: triangles[part] for name, part in parts.items()})

    def shell(self):
        corners, triangles = sphere(3)
        B, offset = self.at(corners)
        return B @ self.points + offset, triangles[:, [0, 2, 1]] if self.cavity else triangles

    def average(self, strength):
        near = np.exp(8.0 * (sphere(1)[0] @ sphere(1)[0].T - 1.0))
        differences = np.diag(near.sum(axis=1)) - near
        values, vectors = np.linalg.eigh(np.eye(self.n_points) + strength * differences)
        return Neighbours((vectors / np.sqrt(values)) @ vectors.T)


@dataclass(frozen=True)
class WallAlone:
    """The distance of samples of the exterior from those of the chamber."""

    wall: float
    cells: int = 642

    @property
    def spec(self):
        return SimpleNamespace(wall=self.wall, fold=SimpleNamespace(distance=self.wall))

    @property
    def of_distances(self):
        """Itself, and nothing else: no distance is below minus infinity."""
        return self, WallAlone(-np.inf)

    def pairs(self, body):
        (B, b), (C, c) = (surface.at(sphere(3)[0]) for surface in body.surfaces)
        one, other = (M @ s.points + m for M, m, s in ((B, b, body.exterior), (C, c, body.chambers[0])))
        distance, near = KDTree(other).query(one)
        return distance, (one - other[near]) / distance[:, None], sparse.hstack([B, -C[near]]).tocsr()

    def rows(self, body, reach, least, places=None, violated=None):
        distance, way, by_points = self.pairs(body)
        near = np.flatnonzero(distance < self.wall + reach)
        axes = [sparse.diags_array(-way[near, k]) @ by_points[near] / self.wall for k in range(3)]
        jacobian = sparse.csr_array(sum(sparse.kron(part, np.eye(3)[[k]]) for k, part in enumerate(axes)))
        return Rows(np.full(len(near), ROWS.index("wall")), near, 1 - distance[near] / self.wall, jacobian, {})

    def certify(self, body):
        least = float(self.pairs(body)[0].min())
        return LimitReport((LimitReading("wall", least, self.wall, "exterior", 0.0, 0.0, least),), {})


@pytest.fixture(scope="module")
def setup():
    body = Body(Blob("exterior", RADII[0], False), (Blob("A", RADII[1], True),))
    variable = np.arange(3 * body.n_points).reshape(-1, 3)
    # The outside stays where it is clamped and where the plate is; all of the chamber has the same motion along x.
    held = np.concatenate([np.abs(sphere(1)[0][:, 2]) > 0.5, np.zeros(body.chambers[0].n_points, bool)])
    variable[held] = -1
    variable[body.slices[1], 0] = variable[body.slices[1].start, 0]
    variable = np.unique(variable, return_inverse=True)[1].reshape(variable.shape) - 1
    ends = np.zeros(3), np.array([0.0, 0.0, 20.0])
    names = SimpleNamespace(length=20.0, ends=ends, chamber=(SimpleNamespace(name="A", gas=None),))
    problem = loads(PROBLEM).model_copy(update={"body": names})
    space = build_space(problem, body, tied_coordinates(body.control_points().ravel(), variable.ravel()))
    return setup_among(problem, space, WallAlone(WALL), SurfaceMesher(problem.mesh.size))


@pytest.fixture(scope="module")
def start(setup):
    disc = setup.discretise(setup.space.reference, 0.0)
    found = analyse(setup.problem, setup.space, disc, setup.space.start, tolerance=1e-11)
    assert not isinstance(found, NoEquilibrium)
    return disc, found


def test_its_mesh_follows_the_surfaces(setup, start):
    disc, found = start
    mesh = disc.morph.mesh
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.05
    shell = 4 / 3 * np.pi * (RADII[0] ** 3 - RADII[1] ** 3)
    assert mesh.volume() == pytest.approx(shell, rel=0.02)
    moved = setup.space.start + 0.2 * np.random.default_rng(0).uniform(-1, 1, setup.space.n)
    points = disc.morph.positions(setup.space.control_points(moved))
    surfaces = setup.space.body(moved).surfaces
    parts = [(surface.triangulation(disc.morph.size), surface.points) for surface in surfaces]
    on = [part.B @ control + part.offset for part, control in parts]
    np.testing.assert_allclose(points[: disc.morph.n_surface], np.concatenate(on), atol=1e-9)
    assert found.equilibria["grow"].plate[2] > 0.05


def test_its_gradient_is_exact(setup, start):
    disc, found = start
    slope = design_gradient(setup.problem, setup.space, disc, found)
    states = {name: each.state for name, each in found.equilibria.items()}

    def value(phi):
        return analyse(setup.problem, setup.space, disc, phi, states, tolerance=1e-11).value

    direction = np.random.default_rng(1).uniform(-1, 1, setup.space.n)
    test = taylor_test(value, setup.space.start, slope, direction, 0.05, start=found.value)
    assert test.rate == pytest.approx(2.0, abs=0.02)


def test_three_steps_improve_it_within_its_wall(setup):
    events = list(optimise(setup))
    designs = [event for event in events if isinstance(event, DesignAccepted)]
    values = [event.entry.objective for event in designs]
    assert len(values) == 4
    assert values == sorted(values, reverse=True)
    assert values[-1] < 1.1 * values[0] < 0
    for event in designs:
        assert setup.limits.certify(event.body)["wall"].value >= WALL * (1 - 1e-9)
    assert isinstance(events[-1], Finished)
    again = resumed(setup, designs[1].state)
    assert again.analysis.value == pytest.approx(values[1], rel=1e-6)
    body = designs[-1].body
    stored = StoredDesign.of(body, designs[-1].pressures)
    assert [stored.exterior.shape, stored.chambers["A"].shape] == [(42, 3), (42, 3)]
    again = stored.on(setup.space.reference)
    np.testing.assert_array_equal(again.control_points(), body.control_points())
    told, arrays = packed_surfaces([event.body for event in designs])
    for each, surface in zip(told, body.surfaces, strict=True):
        assert (each["kind"], each["cavity"]) == ("triangles", surface.cavity)
        vertices, triangles = surface.shell()
        drawn = arrays[each["stored"]]
        assert drawn.values.shape == (4, *vertices.shape)
        np.testing.assert_allclose(drawn.step * drawn.values[-1], vertices, atol=1e-3)
        np.testing.assert_array_equal(arrays[f"corners {each['key']}"].values.reshape(-1, 3), triangles)
    shell = shell_of(body)
    volume = np.linalg.det(shell.points[shell.triangles]).sum() / 6
    assert volume == pytest.approx(designs[-1].fields.mesh.volume(), rel=0.05)
