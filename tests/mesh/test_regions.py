"""Layers of other rubbers: meshed so that they fit together, of the right size and place, moving with the surfaces."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy import sparse

from pneumorph.geometry import Body
from pneumorph.geometry.tube.level import build_levels
from pneumorph.geometry.tube.lining import build_linings
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.geometry.tube.wedge import Wedge, build_wedges
from pneumorph.mesh import Morph, TetMesh, scaled_jacobian, unfold
from pneumorph.mesh.tets import TET_FACES, TET_RULE, tet_gradient
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import Problem

STIFF = {"model": "neo-hookean", "shear_modulus": "2 MPa", "bulk_modulus": "20 MPa", "density": "2 g/cm^3"}
LENGTH, RADIUS, BORE = 30.0, 8.0, 4.0


def problem(
    *regions: dict, ends: str = "flat", mirror: tuple[str, ...] = ("xz",), density: float = 0.4, **changes
) -> Problem:
    chamber = {"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "27 mm"], "ends": ends}
    body = {"length": "30 mm", "radius": "8 mm", "control_density": f"{density} /mm", "chamber": [chamber]}
    return Problem.model_validate(
        {
            "material": {"name": "Hei-Cast 8400"},
            "body": body | {"symmetry": {"mirror": mirror}},
            "region": [{"name": f"part{k}", "material": STIFF} | region for k, region in enumerate(regions)],
            "task": [{"name": "one", "pressure": {"A": "20 kPa"}, "objective": {"motion": "extension"}}],
        }
    ).with_changes(changes)


def ring(outer: float, thickness: float, height: float, share: float = 1.0) -> float:
    return share * np.pi * (outer**2 - (outer - thickness) ** 2) * height


def within(start: float, end: float) -> dict:
    return {"within": [f"{start} deg", f"{end} deg"]}


SLEEVE = {"sleeve": {"thickness": "1 mm", "chambers": ["A"]}}
CASES = {
    "sleeve": (problem(SLEEVE), [np.pi * (25 * 26 - 16 * 24)]),
    "dome": (problem(SLEEVE, ends="pole"), [np.pi * (4 / 3 * (125 - 64) + (25 - 16) * 16)]),
    "layer": (problem({"layer": {"thickness": "1 mm"}}), [ring(8, 1, 30)]),
    "patch": (
        problem({"layer": {"thickness": "1.2 mm", "span": ["8 mm", "20 mm"], "angles": ["-50 deg", "50 deg"]}}),
        [ring(8, 1.2, 12, 100 / 360)],
    ),
    "side": (problem({"layer": {"thickness": "1 mm", "angles": ["90 deg", "270 deg"]}}), [ring(8, 1, 30, 0.5)]),
    "several": (
        problem(
            {"layer": {"thickness": "1 mm", "span": ["0 mm", "9 mm"]}},
            {"layer": {"thickness": "0.7 mm", "span": ["16 mm", "30 mm"]}},
            {"sleeve": {"thickness": "0.8 mm", "chambers": ["A"]}},
        ),
        [ring(8, 1, 9), ring(8, 0.7, 14), np.pi * (4.8**2 * 25.6 - 16 * 24)],
    ),
    "beyond": (problem({"beyond": "12.3 mm"}), [np.pi * (64 * 17.7 - 16 * 14.7)]),
    "beyond, dome": (
        problem({"beyond": "11 mm"}, {"beyond": "20 mm"}, ends="pole"),
        [np.pi * 48 * 9, np.pi * (64 * 10 - 16 * 3 - 128 / 3)],
    ),
    "beyond and layer": (
        problem({"layer": {"thickness": "1 mm", "span": ["0 mm", "10 mm"]}}, {"beyond": "14 mm"}),
        [ring(8, 1, 10), np.pi * (64 * 16 - 16 * 13)],
    ),
    "within": (problem(within(-60, 60), density=0.6), [np.pi * (64 * 30 - 16 * 24) / 3]),
    "within, dome": (
        problem(within(-50, 50), within(120, 240), ends="pole", density=0.8),
        [np.pi * (64 * 30 - 16 * 16 - 256 / 3) * share for share in (5 / 18, 1 / 3)],
    ),
}


def meshed(asked: Problem, body: Body, mirrors: tuple[str, ...] = ("xz",)) -> Morph:
    linings, levels = build_linings(asked.tubes, asked.region), build_levels(asked.tubes, asked.region)
    return mesh_body(body, 3.5, mirrors, linings, (), levels, build_wedges(asked.tubes, asked.region))


@cache
def half(name: str) -> Morph:
    asked, _ = CASES[name]
    return meshed(asked, starting_body(asked.tubes))


@pytest.fixture(scope="module", params=CASES)
def case(request: pytest.FixtureRequest):
    return *CASES[request.param], half(request.param)


def volume(mesh: TetMesh, elements: np.ndarray) -> float:
    jacobian = np.einsum("eai,gak->egik", mesh.points[mesh.tets[elements]], tet_gradient(TET_RULE))
    return float(np.linalg.det(jacobian).sum() / 24)


def test_regions_have_their_volumes(case) -> None:
    asked, volumes, morph = case
    mesh = morph.mesh
    assert set(mesh.regions) == {"body", *(region.name for region in asked.region)}
    found = [2 * volume(mesh, mesh.regions[region.name]) for region in asked.region]
    assert found == pytest.approx(volumes, rel=6e-3)
    assert np.array_equal(np.sort(np.concatenate([*mesh.regions.values()])), np.arange(len(mesh.tets)))
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.04


def test_regions_fit_together(case) -> None:
    """Every face is on the boundary or has elements on both sides, with the same mid-side nodes; half and whole."""
    _, _, morph = case
    for mesh in (morph.mesh, unfold(morph.mesh).mesh):
        corners = np.sort(mesh.tets[:, TET_FACES].reshape(-1, 3), axis=1)
        faces, count = np.unique(corners, axis=0, return_counts=True)
        assert count.max() == 2
        named = np.sort(np.concatenate(list(mesh.faces.values()))[:, :3], axis=1)
        assert set(map(tuple, faces[count == 1])) == set(map(tuple, named))
        assert len(np.unique(mesh.tets)) == len(mesh.points)
        ends = np.sort(mesh.tets[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]], axis=2).reshape(-1, 2)
        edges, first = np.unique(ends, axis=0, return_index=True)
        middles = mesh.tets[:, 4:].ravel()
        assert len(np.unique(middles)) == len(edges)
        assert (middles == middles[first][np.unique(ends, axis=0, return_inverse=True)[1].ravel()]).all()


def interface(mesh: TetMesh) -> np.ndarray:
    """Corner nodes that two regions share."""
    parts = [np.unique(mesh.tets[own, :4]) for own in mesh.regions.values()]
    nodes, count = np.unique(np.concatenate(parts), return_counts=True)
    return nodes[count > 1]


def test_the_inner_side_moves_as_the_surface_does(case) -> None:
    """Where rubbers meet does not depend on when a body was meshed: moved or meshed anew, it is the same surface."""
    asked, _, morph = case
    space = build_design_space(asked, starting_body(asked.tubes))
    phi = np.clip(space.start + 0.1 * np.random.default_rng(3).normal(size=space.n), space.lower, space.upper)
    body = space.body(phi)
    P = body.control_points()
    anew = meshed(asked, body)
    moved = morph.at(P)
    for name in moved.regions:
        # Meshes differ in their chords, so volumes differ by little.
        both = [volume(mesh, mesh.regions[name]) for mesh in (moved, anew.mesh)]
        assert both[0] == pytest.approx(both[1], rel=4e-3), name
    nodes = interface(moved)
    assert not asked.region[-1].thickness or (nodes < morph.n_surface).sum() > 0.5 * len(nodes)
    for region in asked.region:
        if region.beyond is not None:
            elements = moved.tets[moved.regions[region.name], :4]
            own = np.intersect1d(elements, nodes)
            assert np.abs(moved.points[own, 2] - region.beyond).min() < 1e-9
            assert moved.points[elements, 2].min() > region.beyond - 1e-9
    for wedge in build_wedges(asked.tubes, asked.region):
        points = moved.points[np.unique(moved.tets[moved.regions[wedge.region]])]
        aside = beside(points[..., :2], wedge)
        # Of half a body there is one half-plane of each.
        assert wedge.region == "body" or (np.abs(aside).min() < 1e-12 and (aside > -1e-12).all())


def beside(places: np.ndarray, wedge: Wedge) -> np.ndarray:
    """How far places (..., 2) are inside a wedge, by the nearer of its half-planes."""
    x, y = np.moveaxis(places, -1, 0)
    start, end = (y * np.cos(angle) - x * np.sin(angle) for angle in (wedge.start, wedge.end))
    return np.minimum(start, -end) if wedge.end - wedge.start < np.pi + 1e-9 else np.maximum(start, -end)


def test_gradients_of_nodes_are_exact(case) -> None:
    asked, _, morph = case
    rng = np.random.default_rng(0)
    P = starting_body(asked.tubes).control_points()
    dP = rng.normal(size=P.shape)
    np.testing.assert_allclose(morph.positions(P + dP) - morph.positions(P), morph.push(dP), atol=1e-9)
    w = rng.normal(size=morph.reference.shape)
    assert np.sum(w * morph.push(dP)) == pytest.approx(np.sum(morph.pullback(w) * dP), rel=1e-9)


def thickness_at(morph: Morph, asked: Problem) -> list[float]:
    """Distances from the axis of the nodes where two regions meet, away from the ends."""
    points = morph.mesh.points[interface(morph.mesh)]
    middle = points[(points[:, 2] > 10) & (points[:, 2] < 15)]
    return np.hypot(middle[:, 0], middle[:, 1]).tolist()


@pytest.mark.parametrize(("name", "radius"), [("sleeve", 5.0), ("dome", 5.0), ("layer", 7.0)])
def test_the_interface_is_at_the_thickness(name: str, radius: float) -> None:
    found = thickness_at(half(name), CASES[name][0])
    assert len(found) > 4
    assert found == pytest.approx([radius] * len(found), rel=2e-3)


def test_a_whole_body_has_its_surfaces_as_faces() -> None:
    asked, _ = CASES["layer"]
    morph = meshed(asked, starting_body(asked.tubes), ())
    found = thickness_at(morph, asked)
    assert len(found) > 8 and found == pytest.approx([7.0] * len(found), rel=2e-3)
    # Nothing differs in the faces, in whole bodies as in halves.
    assert set(morph.mesh.faces) == {"base", "tip", "exterior", "chamber A"}
    assert all(len(one) for one, _ in pairwise(morph.mesh.faces.values()))


PLANES = [(), ("xz",), ("yz",), ("xz", "yz")]


@pytest.mark.parametrize("mirrors", PLANES, ids=lambda planes: " ".join(planes) or "whole")
@pytest.mark.parametrize("height", [12.0, 24.0])
def test_sections_of_parts_of_a_body(mirrors: tuple[str, ...], height: float) -> None:
    """Through the chamber and through the solid below it, where the axis of a quarter is in the solid."""
    asked = problem({"beyond": f"{height} mm"}, mirror=mirrors)
    asked = asked.with_changes({"body.chamber[0].span": ["16 mm", "27 mm"]})
    mesh = meshed(asked, starting_body(asked.tubes), mirrors).mesh
    found = 2 ** len(mirrors) * volume(mesh, mesh.regions["body"])
    assert found == pytest.approx(np.pi * (64 * height - 16 * max(height - 16, 0)), rel=3e-3)
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.2
    shared = np.intersect1d(mesh.tets[mesh.regions["body"]], mesh.tets[mesh.regions["part0"]])
    assert np.abs(mesh.points[shared, 2] - height).max() < 1e-9


@pytest.mark.parametrize("mirror", [("xz",), ("xz", "xy")], ids=["side", "upside down"])
def test_designs_keep_planes_between_rubbers(mirror: tuple[str, ...]) -> None:
    """However control points are moved within their bounds, rings are in the plane and surfaces on their sides."""
    asked = problem({"beyond": "12.3 mm"}, ends="pole", mirror=mirror)
    space = build_design_space(asked, starting_body(asked.tubes))
    assert np.all((space.lower < space.start) & (space.start < space.upper))
    (level,) = build_levels(asked.tubes, asked.region)
    q = np.linspace(0.0, 1.0, 41)
    for seed in range(5):
        phi = np.clip(space.start + 4.0 * np.random.default_rng(seed).normal(size=space.n), space.lower, space.upper)
        for surface in space.body(phi).surfaces:
            r = np.linspace(0.0, 1.0, 101)
            z, at = surface.sample(q, r)[..., 2], level.rings[surface.name]
            assert surface.sample(q, np.array([at]))[..., 2].ravel() == pytest.approx(np.full(41, 12.3), abs=1e-9)
            assert z[r < at].max() <= 12.3 + 1e-9 and z[r > at].min() >= 12.3 - 1e-9
    # Of all that moves along z, each variable moves its own.
    assert np.diff(space.L[2::3].indptr).max() == 1


def test_chambers_beside_a_plane_stay_away_from_it() -> None:
    asked = problem({"beyond": "14 mm"}).with_changes({"body.chamber[0].span": ["17 mm", "27 mm"]})
    space = build_design_space(asked, starting_body(asked.tubes))
    low = np.clip(space.start - 50.0, space.lower, space.upper)
    (chamber,) = space.body(low).chambers
    assert chamber.net[..., 2].min() == pytest.approx(14.0 + asked.limits.wall)


@pytest.mark.parametrize("mirrors", [(), ("xz",)], ids=["whole", "half"])
def test_half_planes_of_parts_of_a_body(mirrors: tuple[str, ...]) -> None:
    """Through the chamber and the solid on both sides of it, where half-planes meet on the axis."""
    asked = problem(within(-90, 90), ends="pole", mirror=mirrors, density=0.6)
    mesh = meshed(asked, starting_body(asked.tubes), mirrors).mesh
    parts = [2 ** len(mirrors) * volume(mesh, own) for own in mesh.regions.values()]
    assert parts == pytest.approx([np.pi * (32 * 30 - 16 * 8 - 128 / 3)] * 2, rel=3e-3)
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.2
    shared = np.intersect1d(*(mesh.tets[own] for own in mesh.regions.values()))
    assert np.abs(mesh.points[shared, 0]).max() < 1e-12
    on_axis = mesh.points[shared][np.hypot(*mesh.points[shared, :2].T) < 1e-12, 2]
    assert len(on_axis) > 3 and ((on_axis < 3 + 1e-5) | (on_axis > 27 - 1e-5)).all()


@pytest.mark.parametrize(
    "asked",
    [
        problem(within(-60, 60), mirror=(), density=0.6),
        problem(within(-90, 90), ends="pole", mirror=("xz", "xy")),
        problem(within(-35, 36), within(36, 110), ends="pole", mirror=(), density=1.0),
        problem(within(-60, 60), density=0.8, **{"body.symmetry": {"rotation": 3}}),
        problem(within(-40, 40), mirror=("xz", "yz"), density=1.0),
    ],
    ids=["third", "opposite", "several", "turned", "images"],
)
def test_designs_keep_half_planes_between_rubbers(asked: Problem) -> None:
    """However control points are moved within their bounds, lines are in half-planes and surfaces between them."""
    space = build_design_space(asked, starting_body(asked.tubes))
    assert np.all((space.lower < space.start) & (space.start < space.upper))
    assert space.control_points(space.start) == pytest.approx(space.reference.control_points(), abs=1e-12)
    product = space.L.T @ space.L
    assert abs(product - sparse.diags_array(product.diagonal())).max() < 1e-12
    wedges, r = build_wedges(asked.tubes, asked.region), np.linspace(0.0, 1.0, 41)
    for seed in range(3):
        phi = np.clip(space.start + 3.0 * np.random.default_rng(seed).normal(size=space.n), space.lower, space.upper)
        for surface in space.body(phi).surfaces:
            for wedge in wedges:
                q = np.linspace(*wedge.parts[surface.name], 61)
                places = surface.sample(q, r)[..., :2]
                assert beside(places, wedge).min() > -1e-12
                for end, angle in zip((0, -1), (wedge.start, wedge.end)[:: -1 if surface.cavity else 1], strict=True):
                    along = np.array([np.cos(angle), np.sin(angle)])
                    assert (places[:, end] @ along).min() > -1e-12
                    assert np.abs(places[:, end] @ [-along[1], along[0]]).max() < 1e-12


@pytest.mark.parametrize("angles", [(-60, 60), (-90, 90), (120, 240)], ids=str)
def test_chambers_beside_half_planes_stay_away_from_them(angles: tuple[int, int]) -> None:
    chambers = [
        {"name": name, "radius": "1.2 mm", "center": [f"{x} mm", "0 mm"], "span": ["3 mm", "27 mm"], "ends": ends}
        for name, x, ends in (("A", 4.3, "flat"), ("B", -4.6, "pole"))
    ]
    asked = problem(within(*angles), mirror=(), density=0.6, **{"body.chamber": chambers, "limits.wall": "1 mm"})
    space = build_design_space(asked, starting_body(asked.tubes))
    assert np.all((space.lower < space.start) & (space.start < space.upper))
    wedges, least = build_wedges(asked.tubes, asked.region), []
    for seed in range(3):
        phi = np.clip(space.start + 9.0 * np.random.default_rng(seed).normal(size=space.n), space.lower, space.upper)
        for chamber in space.body(phi).chambers:
            (wedge,) = (each for each in wedges if chamber.name in each.parts)
            assert wedge.region == ("part0" if (chamber.name == "A") == (abs(angles[0]) < 100) else "body")
            places = chamber.net[..., 0] + 1j * chamber.net[..., 1]
            for angle in (wedge.start, wedge.end):
                turned = places * np.exp(-1j * angle)
                least.append(np.where(turned.real < 0.0, np.abs(turned), np.abs(turned.imag)).min())
    assert min(least) == pytest.approx(1.0, abs=0.02) and min(least) > 1.0 - 1e-9
