"""The limit that keeps bodies at rest out of obstacles: values against distances by formulas, rows, and repairs."""

from dataclasses import replace

import numpy as np
import pytest
from solids import box, cylinder, problem, written

from pneumorph.cad.stl import Surface, pack
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.limits.obstacles import Obstacles, image_of, region_of
from pneumorph.limits.of_shape import limits_of
from pneumorph.limits.table import ROWS, in_history
from pneumorph.mechanics.contact.shapes import Shape
from pneumorph.mechanics.setup import rigid_body_of
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.optimize.within import Within, within
from pneumorph.problem import loads

TUBE = """
[material]
name = "Dragon Skin 20"
[body]
length = "24 mm"
radius = "8 mm"
control_density = "0.5 /mm"
symmetry = { mirror = ["xz"] }
[[body.chamber]]
name = "A"
radius = "4 mm"
center = ["0 mm", "0 mm"]
span = ["3 mm", "21 mm"]
[[task]]
name = "bend"
pressure = { A = "20 kPa" }
objective = { motion = "bending_y" }
"""
LATTICE = """
[design]
spacing = "5 mm"
"""
CORNERS = np.array([[x, y, z] for x in (0, 5) for y in (0, 4) for z in (0, 6)], dtype=float)
SIDES = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
BLOCK = pack(Surface(CORNERS, np.array([part for a, b, c, d in SIDES for part in ([a, c, b], [a, d, c])])[:, ::-1]))
OBSTACLES = {
    "plane": 'point = ["11 mm", "0 mm", "0 mm"]\nnormal = [-3, 1, 0]',
    "sphere": 'center = ["12 mm", "2 mm", "11 mm"]\nradius = "3.3 mm"',
    "cylinder": 'center = ["11.5 mm", "1 mm", "11 mm"]\naxis = [0, 1, 1]\nradius = "2.8 mm"\nlength = "9 mm"',
    "box": 'center = ["11 mm", "2 mm", "11 mm"]\nsize = ["5 mm", "4 mm", "6 mm"]',
    "mesh": f'triangles = "{BLOCK}"\nposition = ["8.6 mm", "1 mm", "8 mm"]\nrotation = ["0 deg", "5 deg", "0 deg"]',
}
STEPS = np.linspace(0.0, 1.0, 9)
GRID = np.array([[1 - u - v, u, v] for u in STEPS for v in STEPS if u + v <= 1 + 1e-12])


def obstacle(kind):
    return (
        f'[[obstacle]]\nname = "it"\nkind = "{kind}"\n{OBSTACLES[kind]}\n[contact]\nself = false\ndistance = "0.4 mm"\n'
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A file with a block that has a round void."""
    where = tmp_path_factory.mktemp("obstacles")
    written(box((-8, -7, 0), (8, 7, 24)) - cylinder(3, 4, 20, x=-3), where / "block.step")
    return where


@pytest.fixture(scope="module")
def asked(folder):
    """Problems with an obstacle beside a body of a kind."""

    def make(body, kind):
        text = TUBE if body == "tube" else problem("block.step", size="4 mm") + LATTICE
        return loads(text + obstacle(kind), folder=folder)

    return make


def alone(asked):
    """The limit of a problem on obstacles, without all others."""
    limits = limits_of(asked, body_of(asked))
    kind = limits.kinds[-1]
    assert isinstance(kind, Obstacles)
    return replace(limits, kinds=(kind,)), kind.rooms


def moved(space, seed, far):
    z = build_smoothing(space).apply(np.random.default_rng(seed).uniform(-1, 1, space.n))
    return space.body(space.start + far * z / np.abs(z).max())


def dense(body, limits):
    """Points (n, 3) all over the exterior."""
    surface = body.surfaces[0]
    if hasattr(surface, "lattice"):
        patches = limits.sampled(body).patches[0]
        count = len(patches.nodes)
        places = patches.places(np.repeat(np.arange(count), len(GRID)), np.tile(GRID, (count, 1)))
        return surface.lattice.weights(places) @ surface.net
    q, r = np.linspace(0, 1, 241), np.linspace(0, 1, 241)
    return np.einsum("rj,jkc,qk->rqc", surface.basis_r.matrix(r), surface.net, surface.basis_q.matrix(q)).reshape(-1, 3)


@pytest.mark.parametrize("kind", OBSTACLES)
@pytest.mark.parametrize("body", ["tube", "file"])
def test_certificates_enclose_distances(asked, body, kind):
    given = asked(body, kind)
    limits, rooms = alone(given)
    space = space_of(given)
    region, solid = region_of(given.obstacle[0]), rigid_body_of(given.obstacle[0])
    for far in (0.3, 1.5):
        at = moved(space, 4, far)
        x = dense(at, limits)
        reach = rooms[0].width - region.beyond(x).min()
        found = limits.certify(at)["obstacles"]
        assert reach <= found.value + 2e-3
        # Beside triangles certificates are sharp only as far as is needed to decide.
        assert found.value <= reach + (0.06 if kind == "mesh" else 0.02) + 0.03 * abs(reach)
        if isinstance(solid, Shape):
            # Beside edges regions reach a little farther than what has these edges.
            outside = np.asarray(solid.distance(x)) - region.beyond(x)
            assert outside.min() > -1e-9
            assert outside[region.beyond(x) < 0.5].max(initial=0.0) < 0.5


@pytest.mark.parametrize("kind", OBSTACLES)
@pytest.mark.parametrize("body", ["tube", "file"])
def test_rows_are_derivatives(asked, body, kind):
    given = asked(body, kind)
    limits, _ = alone(given)
    at = moved(space_of(given), 5, 0.5)
    step = 1e-5 * np.random.default_rng(6).normal(size=3 * at.n_points)
    other = at.with_control_points(at.control_points() + step.reshape(-1, 3))
    here, there = (limits.rows(each, 2.0, -1.0) for each in (at, other))
    assert len(here.value) and set(here.kind.tolist()) == {ROWS.index("obstacles")}
    # Cells whose worst sample is another one after the step are few.
    change = there.value - here.value if len(there.value) == len(here.value) else np.full(len(here.value), np.nan)
    predicted = here.jacobian @ step
    close = np.abs(change - predicted) < 1e-3 * np.abs(predicted).max()
    assert close.mean() > 0.9


@pytest.mark.parametrize("body", ["tube", "file"])
def test_designs_slide_along_obstacles(asked, body):
    """A step into an obstacle is shortened where that is, and goes on beside it."""
    given = asked(body, "sphere")
    limits, space = limits_of(given, body_of(given)), space_of(given)
    smooth = build_smoothing(space)
    # Outwards everywhere.
    start = space.body(space.start)
    out = start.control_points() * np.array([1.0, 1.0, 0.0])
    push = smooth.apply(space.L.T @ out.ravel())
    phi = space.start + 1.2 * push / np.abs(push).max()
    before = limits.certify(space.body(phi))
    assert before["obstacles"].value > 0.05
    found = within(space, smooth, limits, phi)
    assert isinstance(found, Within)
    assert found.report["obstacles"].satisfied()
    assert -0.02 < found.report["obstacles"].value <= 0.0
    # Far from the obstacle next to nothing was given up.
    kept, wanted = (dense(space.body(each), limits) for each in (found.phi, phi))
    far = wanted[:, 0] < -6.0
    assert np.abs(kept - wanted)[far].max() < 0.1


def test_images_are_kept_out_too(asked):
    """Of a symmetric tube a part is certified, against all images of an obstacle that is not symmetric."""
    given = asked("tube", "sphere")
    limits, rooms = alone(given)
    assert len(rooms) == 2
    at = moved(space_of(given), 7, 1.0)
    region = region_of(given.obstacle[0])
    mirror, middle = np.diag([1.0, -1.0, 1.0]), np.array([0.0, 0.0, 12.0])
    x = dense(at, limits)
    assert np.allclose(image_of(region, mirror, middle).beyond(x), region.beyond(x * [1, -1, 1]))
    reach = rooms[0].width - region.beyond(x).min()
    assert reach - 2e-3 <= limits.certify(at)["obstacles"].value <= reach + 0.02 + 0.03 * abs(reach)
    block = region_of(asked("tube", "mesh").obstacle[0])
    assert np.allclose(image_of(block, mirror, middle).beyond(x), block.beyond(x * [1, -1, 1]), atol=1e-9)


def test_the_room_is_half_of_what_is_there(asked):
    """A start is never moved away from an obstacle that it does not touch."""
    for kind in OBSTACLES:
        given = asked("file", kind)
        limits, rooms = alone(given)
        gap = rooms[0].obstacle.beyond(dense(body_of(given), limits)).min()
        assert rooms[0].width == pytest.approx(0.5 * min(0.4, gap), abs=5e-3)
        assert limits.certify(body_of(given)).satisfied()
        assert "obstacles" in {limit.name for limit, _, _ in in_history(given)}
