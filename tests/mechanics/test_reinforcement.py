"""Sheets and fibres: their energies in closed form, what they cover, half bodies, and derivatives by the design."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiny import tiny

from pneumorph import open_run, run
from pneumorph.analysis import analyse_body, checkpoint, collect_fields, discretise, run_gradient_check
from pneumorph.analysis.analyse import analyse, predict_states
from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.slopes import design_gradient
from pneumorph.errors import ProblemError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import (
    TOLERANCE,
    Equilibrium,
    Tangent,
    configure,
    loads_of,
    mirrors_of,
    model_of,
    solve,
    whole_of,
)
from pneumorph.mechanics.elements.reinforcement import Fibres, Membrane, connect_covered
from pneumorph.mechanics.elements.terms import Loads, Local
from pneumorph.mesh import Covered
from pneumorph.mesh.tets import RULE, TetMesh, triangle_gradient, triangle_shape
from pneumorph.problem import Problem, loads
from pneumorph.results import unpack_fields
from pneumorph.run.complete import complete
from pneumorph.sensitivity import taylor_test

pytestmark = pytest.mark.usefixtures("without_mesh_errors")

SMALL = 0.01
FLAT = np.array([[0.0, 0, 0], [2, 0, 0], [0, 1, 0], [1, 0, 0], [1, 0.5, 0], [0, 0.5, 0]])
"""A face of 1 mm²; x is its first coordinate."""


def energy(of, stretches, angle=0.0, changed=(0.0, 0.0)):
    """Of a face whose principal stretches are at an angle in rad to x, turned in space; x is from base to tip."""
    points = np.concatenate([RULE, np.full((3, 1), 1 / 6), np.ones((3, 1)), np.zeros((3, 1))], axis=1)
    seen = connect_covered(Covered(np.arange(6)[None], points[None]))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    flat = np.zeros((6, 3))
    flat[:, :2] = FLAT[:, :2] @ (turn @ np.diag(stretches) @ turn.T)
    moved = Rotation.from_rotvec([0.3, -0.8, 0.5]).apply(flat)
    local = Local(FLAT[None], (moved - FLAT)[None], np.zeros((1, 0)), np.zeros(0), seen.data)
    loads = Loads(*np.zeros((4, 0)), reinforcement=np.array([changed]))
    return float(of.energies(local, loads)[0])


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_a_sheet_is_taut_wrinkled_or_slack(angle):
    k, ratio = 50.0, 0.3
    of = Membrane(k, ratio, SMALL)

    def force(stretches, step=1e-6):
        """In the principal directions, N/mm, from the energy of 1 mm²."""
        return [
            (energy(of, np.add(stretches, unit), angle) - energy(of, np.subtract(stretches, unit), angle)) / (2 * step)
            for unit in step * np.eye(2)
        ]

    assert energy(of, (1.0, 1.0)) == pytest.approx(0.0, abs=1e-9)
    plane = k / (1 - ratio**2)
    assert force((1.05, 1.02), 1e-6) == pytest.approx([plane * (0.05 + ratio * 0.02), plane * (0.02 + ratio * 0.05)])
    assert force((1.05, 1 - ratio * 0.05)) == pytest.approx([k * 0.05, 0.0], abs=1e-5)
    # Narrower than uniaxial tension makes it, it wrinkles: across the wrinkles it bears the force of wrinkling alone.
    across = -k * SMALL
    assert force((1.05, 0.8)) == pytest.approx([k * 0.05 + ratio * across, across], rel=1e-5)
    assert force((0.8, 0.7)) == pytest.approx([across, across], rel=1e-5)
    part, whole = energy(Membrane(k, ratio, SMALL, 0.3), (1.05, 0.98)), energy(of, (1.05, 0.98))
    assert part == pytest.approx(0.3 * whole)
    assert energy(of, (1.05, 0.98), 0.0, (10.0, -0.25)) == pytest.approx(1.2 * 0.75 * whole)


def test_the_stress_of_a_sheet_has_derivatives_where_stretches_are_equal():
    """In tension, at rest and in compression: differences of forces from both sides agree."""
    of = Membrane(50.0, 0.3, SMALL)
    for stretch in (1.03, 1.0, 0.99):
        here, sides = energy(of, (stretch, stretch)), []
        for h in (1e-3, 5e-4, 2.5e-4):
            both = energy(of, (stretch + h, stretch)) + energy(of, (stretch - h, stretch))
            sides.append((both - 2 * here) / h**2)
        gap = np.abs(np.diff(sides))
        # The curvature is one number, to first order in h.
        assert gap[1] < 0.6 * gap[0] + 1e-4 * sides[0], stretch


def test_fibres_pull_along_themselves_and_buckle():
    k, winding = 50.0, 0.6
    sine, cosine = np.sin(winding), np.cos(winding)
    one, two = (Fibres(k, winding, SMALL, hands) for hands in ((1,), (1, -1)))
    stretch = np.hypot(1.1 * cosine, 1.04 * sine)
    assert energy(one, (1.1, 1.04)) == pytest.approx(k / 2 * (stretch - 1) ** 2)
    assert energy(two, (1.1, 1.04)) == pytest.approx(k * (stretch - 1) ** 2)
    # The normal of this face is z, and counter-clockwise about an axis x below it is −y.
    along = {hand: energy(Fibres(k, winding, SMALL, (hand,)), (1.1, 0.95), -winding) for hand in (1, -1)}
    assert along[1] == pytest.approx(k / 2 * 0.1**2)
    assert along[-1] < along[1]
    short = np.hypot(0.8 * cosine, 0.85 * sine)
    assert energy(one, (0.8, 0.85)) == pytest.approx(k * SMALL * (1 - short - SMALL))


def problem(mirror=("xz",), ends="flat", centre=0.0, **tables) -> Problem:
    chamber = {"name": "A", "radius": "4 mm", "center": [f"{centre} mm", "0 mm"], "span": ["3 mm", "21 mm"]}
    return Problem.model_validate(
        {
            "material": {"name": "Hei-Cast 8400"},
            "body": {
                "length": "24 mm",
                "radius": "8 mm",
                "control_density": "0.4 /mm",
                "chamber": [chamber | {"ends": ends}],
                "symmetry": {"mirror": list(mirror)},
            },
            "task": [{"name": "one", "pressure": {"A": "40 kPa"}, "objective": {"motion": "extension"}}],
            "mesh": {"size": "6 mm"},
            **tables,
        }
    )


def part(**rest):
    return {"name": "sheet", "stiffness": "60 N/mm", **rest}


def area_and_direction(mesh: TetMesh, name: str):
    """Of what is covered: its area, and the mean of |cos| of the angle between the direction and the meridian."""
    own = mesh.covers[name]
    nodes = mesh.points[own.nodes]
    tangents = np.einsum("eai,eqak->eqki", nodes, triangle_gradient(own.points[..., :2]))
    normal = np.cross(tangents[..., 0, :], tangents[..., 1, :])
    area = own.points[..., 2] * np.linalg.norm(normal, axis=-1)
    along = np.einsum("eqk,eqki->eqi", own.points[..., 3:], tangents)
    places = np.einsum("eqa,eai->eqi", triangle_shape(own.points[..., :2]), nodes)
    meridian = np.cross(np.cross(normal, [0.0, 0.0, 1.0]), normal)
    cosine = np.sum(along * meridian, axis=-1) / np.linalg.norm(along, axis=-1) / np.linalg.norm(meridian, axis=-1)
    outwards = np.sum(normal[..., :2] * places[..., :2], axis=-1)
    return area.sum(), float(np.sum(area * cosine) / area.sum()), outwards


PARTS = [
    ({}, np.pi * 8 * 24),
    ({"span": ["5.3 mm", "17.1 mm"], "angles": ["-71 deg", "71 deg"]}, 8 * np.radians(142) / 2 * 11.8),
    ({"angles": ["100 deg", "260 deg"]}, 8 * np.radians(160) / 2 * 24),
    ({"surfaces": ["A"], "span": ["4 mm", "17 mm"]}, np.pi * 4 * 13),
    ({"surfaces": ["A", "exterior"]}, np.pi * (8 * 24 + 4 * 18)),
]


def test_covers_are_as_large_as_asked_on_half_a_body():
    """Wherever their edges cross faces; their direction is from base to tip, and faces are seen from outside."""
    asked = problem(membrane=[part(**where) | {"name": f"{k}"} for k, (where, _) in enumerate(PARTS)])
    mesh = mesh_of(asked, starting_body(asked.tubes), mirrors_of(asked)).mesh
    assert mesh.mirrors == ("xz",)
    for name, (_, area) in enumerate(PARTS):
        found, cosine, outwards = area_and_direction(mesh, f"{name}")
        assert found == pytest.approx(area, rel=6e-3)
        assert cosine == pytest.approx(1.0, abs=1e-3)
        assert outwards.min() > 0.0


def test_a_cover_of_a_chamber_with_poles():
    """Above z = 12 mm is half of a sphere and of the tube between the poles."""
    asked = problem((), "pole", membrane=[part(surfaces=["A"], span=["12 mm", "21 mm"])])
    mesh = mesh_of(asked, starting_body(asked.tubes), ()).mesh
    found, cosine, _ = area_and_direction(mesh, "sheet")
    assert found == pytest.approx(2 * np.pi * 4 * 9, rel=0.02)
    assert cosine > 0.95


FIBRES = {"name": "braid", "stiffness": "30 N/mm", "winding": "60 deg", "surfaces": ["exterior", "A"]}
REINFORCED = {"membrane": [part(angles=["-80 deg", "80 deg"], span=["2 mm", "22 mm"])], "fibres": [FIBRES]}


def test_half_a_body_moves_as_the_whole():
    asked = problem(**REINFORCED)
    half = mesh_of(asked, starting_body(asked.tubes), mirrors_of(asked)).mesh
    model = model_of(asked, half)
    whole = whole_of(model, half)
    at = configure(model, half.points, loads_of(asked, model, {"A": 0.04}))
    found = solve(at, Tangent(model))
    assert isinstance(found, Equilibrium)
    assert whole.negative_pivots(at, found.state) == 0
    other = solve(whole.configuration(at), Tangent(whole.model))
    assert other.plate == pytest.approx(found.plate, abs=1e-9)
    assert found.plate[4] > 0.002


def test_a_helix_has_no_mirror():
    helix = FIBRES | {"families": 1}
    assert mirrors_of(problem(fibres=[FIBRES])) == ("xz",)
    assert mirrors_of(problem(fibres=[helix])) == ()
    assert mirrors_of(problem(fibres=[helix | {"winding": "90 deg"}])) == ("xz",)
    assert mirrors_of(problem(membrane=[part(angles=["0 deg", "90 deg"])])) == ()


def free(start, low, high, unit):
    return {key: f"{value} {unit}" for key, value in zip(("start", "min", "max"), (start, low, high), strict=True)}


DESIGNED = {
    "membrane": [
        part(
            angles=["-80 deg", "80 deg"],
            stiffness=free(30, 5, 60, "N/mm"),
            coverage={"start": 0.5, "min": 0.2, "max": 1.0},
        )
    ],
    "fibres": [
        FIBRES | {"winding": free(60, 20, 80, "deg"), "stiffness": free(20, 5, 60, "N/mm"), "surfaces": ["exterior"]}
    ],
}


HELIX = FIBRES | {"families": 1, "angles": ["-60 deg", "100 deg"], "winding": free(60, 20, 80, "deg")}


@pytest.mark.parametrize(
    "tables",
    [REINFORCED, {"fibres": [HELIX], "mirror": ()}],
    ids=["sheet and braid", "part of a helix"],
)
def test_the_gradient_of_a_reinforced_body(tables):
    """On a body that is no tube of revolution, so that directions follow the shape."""
    asked = problem(centre=1.5, **tables)
    space = build_design_space(asked, starting_body(asked.tubes))
    body = space.body(space.start + 0.1 * np.random.default_rng(0).normal(size=space.n))
    check = run_gradient_check(analyse_body(asked, body))
    assert check.passed, check
    assert ("sheets and fibres" in check.tests) == ("membrane" not in tables)
    assert not any(check.is_exact(name) for name in check.tests)


def test_the_gradient_by_stiffnesses_coverage_and_angle():
    """Each for itself; a check of the problem tests them together."""
    asked = problem(**DESIGNED)
    at = analyse_body(asked, starting_body(asked.tubes))
    space, disc = at.space, at.disc
    slope = design_gradient(asked, space, disc, at.analysis)
    starts = {name: found.state for name, found in at.analysis.equilibria.items()}
    assert [(each.name, each.key) for each in space.free_data] == [
        ("sheet", "stiffness"), ("sheet", "coverage"), ("braid", "stiffness"), ("braid", "winding"),
    ]  # fmt: skip
    for direction in np.eye(space.n)[-4:]:
        test = taylor_test(
            lambda phi: analyse(asked, space, disc, phi, starts, tolerance=TOLERANCE).value,
            space.start,
            slope,
            direction,
            0.1,
        )
        assert test.passed, test
        assert abs(slope @ direction) * 0.1 > 10 * test.remainders[-1]


def test_states_are_predicted_after_a_change_of_the_angle():
    asked = problem(**DESIGNED)
    at = analyse_body(asked, starting_body(asked.tubes))
    ahead = at.space.start + 0.02 * np.eye(at.space.n)[-1]
    found = analyse(asked, at.space, at.disc, ahead, tolerance=TOLERANCE).equilibria["one"].state
    before = at.analysis.equilibria["one"].state
    predicted = predict_states(at.space, at.disc, at.analysis, ahead)["one"].state
    assert np.abs(predicted.plate - found.plate).max() < 0.1 * np.abs(before.plate - found.plate).max()


def test_an_angle_is_designed_and_resumed(tmp_path):
    """For extension fibres turn around the tube, beyond the magic angle, 54.7°; all results of a run know of it."""
    braid = '[[fibres]]\nname = "braid"\nstiffness = "40 N/mm"\n'
    asked = loads(tiny(iterations="1") + braid + 'winding = { start = "50 deg", min = "20 deg", max = "80 deg" }\n')
    first = complete(run.create(tmp_path, asked), lambda event: None)
    assert first.completed
    again = asked.with_changes({"optimizer.iterations": 2})
    complete(run.resume(tmp_path, again), lambda event: None)
    found = open_run(tmp_path)
    angles = [np.degrees(entry.reinforcements["braid"]["winding"]) for entry in found.history]
    assert angles[0] == pytest.approx(50.0) and len(angles) == 3
    assert np.all(np.diff(angles) > 3.0) and angles[-1] > 54.7, angles
    assert np.degrees(found.result.reinforcements["braid"]["winding"]) == pytest.approx(angles[-1])
    best, problem = found.best, found.problem
    assert problem.fibres[0].winding.start == pytest.approx(np.radians(50.0))
    assert f"winding {angles[-1]:.4g} deg" in best.problem.fibres[0].words
    # A simulation of the design is one of its own fibres.
    (step,) = best.simulate().steps
    assert step.translation[2] == pytest.approx(best.results["extend"].translation[2], rel=0.02)
    history = tmp_path / "history.jsonl"
    history.write_text(history.read_text().replace('"winding": ', '"winding": 9'))
    with pytest.raises(ProblemError, match="line 1: its sheets and fibres are not those of the problem"):
        _ = open_run(tmp_path).history


def test_covers_are_stored_and_restored():
    asked = problem(**REINFORCED)
    body = starting_body(asked.tubes)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    found = analyse(asked, space, disc, space.start)
    stored = {name: np.asarray(value) for name, value in checkpoint.pack(found, disc).items()}
    _, restored = checkpoint.unpack(asked, space, stored)
    assert restored.value == pytest.approx(found.value, rel=1e-6)
    arrays = collect_fields(disc, found).pack()
    mesh = unpack_fields(arrays).whole().mesh
    assert area_and_direction(mesh, "sheet")[0] == pytest.approx(8 * np.radians(160) * 20, rel=6e-3)
    assert set(model_of(asked, mesh).reinforcements) == {"sheet", "braid"}
    with pytest.raises(ValueError, match="braid"):
        unpack_fields(arrays | {"points braid": arrays["points braid"] * np.array([1, 1, 1, 0, 0])})
    with pytest.raises(ValueError, match="covers"):
        unpack_fields(arrays | {"cover braid": arrays["cover braid"] + 10**6})
