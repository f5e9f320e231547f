"""Layers of other rubbers: meshed so that they fit together, of the right size and place, moving with the surfaces."""

from itertools import pairwise

import numpy as np
import pytest

from pneumorph.geometry import Body, build_levels, build_linings, starting_body
from pneumorph.geometry.design_space import build_design_space
from pneumorph.mesh import Morph, TetMesh, mesh_body, scaled_jacobian, unfold
from pneumorph.mesh.tets import TET_FACES, TET_RULE, tet_gradient
from pneumorph.problem import Problem

STIFF = {"model": "neo-hookean", "shear_modulus": "2 MPa", "bulk_modulus": "20 MPa", "density": "2 g/cm^3"}
LENGTH, RADIUS, BORE = 30.0, 8.0, 4.0


def problem(*regions: dict, ends: str = "flat", mirror: tuple[str, ...] = ("xz",)) -> Problem:
    chamber = {"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "27 mm"], "ends": ends}
    body = {"length": "30 mm", "radius": "8 mm", "control_density": "0.4 /mm", "chamber": [chamber]}
    return Problem.model_validate(
        {
            "material": {"name": "Hei-Cast 8400"},
            "body": body | {"symmetry": {"mirror": mirror}},
            "region": [{"name": f"part{k}", "material": STIFF} | region for k, region in enumerate(regions)],
            "task": [{"name": "one", "pressure": {"A": "20 kPa"}, "objective": {"motion": "extension"}}],
        }
    )


def ring(outer: float, thickness: float, height: float, share: float = 1.0) -> float:
    return share * np.pi * (outer**2 - (outer - thickness) ** 2) * height


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
}


def meshed(asked: Problem, body: Body, mirrors: tuple[str, ...] = ("xz",)) -> Morph:
    linings, levels = build_linings(asked.body, asked.region), build_levels(asked.body, asked.region)
    return mesh_body(body, 3.5, mirrors, linings, (), levels)


@pytest.fixture(scope="module", params=CASES.values(), ids=list(CASES))
def case(request: pytest.FixtureRequest):
    asked, volumes = request.param
    body = starting_body(asked.body)
    return asked, volumes, meshed(asked, body)


def volume(mesh: TetMesh, elements: np.ndarray) -> float:
    jacobian = np.einsum("eai,gak->egik", mesh.points[mesh.tets[elements]], tet_gradient(TET_RULE))
    return float(np.linalg.det(jacobian).sum() / 24)


def test_regions_have_their_volumes(case) -> None:
    asked, volumes, morph = case
    mesh = morph.mesh
    assert list(mesh.regions) == ["body", *(region.name for region in asked.region)]
    found = [2 * volume(mesh, mesh.regions[region.name]) for region in asked.region]
    assert found == pytest.approx(volumes, rel=6e-3)
    assert np.array_equal(np.sort(np.concatenate([*mesh.regions.values()])), np.arange(len(mesh.tets)))
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.05


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
    space = build_design_space(asked, starting_body(asked.body))
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
    assert asked.region[-1].beyond or (nodes < morph.n_surface).sum() > 0.5 * len(nodes)
    for region in asked.region:
        if region.beyond is not None:
            elements = moved.tets[moved.regions[region.name], :4]
            own = np.intersect1d(elements, nodes)
            assert np.abs(moved.points[own, 2] - region.beyond).min() < 1e-9
            assert moved.points[elements, 2].min() > region.beyond - 1e-9


def test_gradients_of_nodes_are_exact(case) -> None:
    asked, _, morph = case
    rng = np.random.default_rng(0)
    P = starting_body(asked.body).control_points()
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
    asked, _ = CASES[name]
    morph = meshed(asked, starting_body(asked.body), ())
    found = thickness_at(morph, asked)
    assert len(found) > 8
    assert found == pytest.approx([radius] * len(found), rel=2e-3)
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
    mesh = meshed(asked, starting_body(asked.body), mirrors).mesh
    found = 2 ** len(mirrors) * volume(mesh, mesh.regions["body"])
    assert found == pytest.approx(np.pi * (64 * height - 16 * max(height - 16, 0)), rel=3e-3)
    assert scaled_jacobian(mesh.points, mesh.tets).min() > 0.2
    shared = np.intersect1d(mesh.tets[mesh.regions["body"]], mesh.tets[mesh.regions["part0"]])
    assert np.abs(mesh.points[shared, 2] - height).max() < 1e-9


@pytest.mark.parametrize("mirror", [("xz",), ("xz", "xy")], ids=["side", "upside down"])
def test_designs_keep_planes_between_rubbers(mirror: tuple[str, ...]) -> None:
    """However control points are moved within their bounds, rings are in the plane and surfaces on their sides."""
    asked = problem({"beyond": "12.3 mm"}, ends="pole", mirror=mirror)
    space = build_design_space(asked, starting_body(asked.body))
    assert np.all((space.lower < space.start) & (space.start < space.upper))
    (level,) = build_levels(asked.body, asked.region)
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
    space = build_design_space(asked, starting_body(asked.body))
    low = np.clip(space.start - 50.0, space.lower, space.upper)
    (chamber,) = space.body(low).chambers
    assert chamber.net[..., 2].min() == pytest.approx(14.0 + asked.limits.wall)
