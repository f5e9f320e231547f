"""What a run stores of a design is never refused when it is resumed, whatever mesh the design was analysed on."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from pneumorph.analysis import checkpoint
from pneumorph.analysis.analyse import build_discretisation, mesh_of
from pneumorph.errors import MeshError
from pneumorph.geometry.starting import space_of
from pneumorph.mechanics import part_of, rest
from pneumorph.mesh import relax
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.problem import load
from pneumorph.results.checkpoint import check

EXAMPLES = Path(__file__).parents[2] / "examples"
DESIGNS = 3
WORST = 0.02


def stored(problem, space, disc, phi):
    """The state of a design as the loop stores it, at rest: what is checked does not depend on the equilibrium."""
    found = {task.name: SimpleNamespace(state=rest(disc.model)) for task in problem.task}
    state = checkpoint.pack(SimpleNamespace(phi=phi, equilibria=found, limit_points={}), disc)
    return state | {"values": [0.0], "radius": 1.0, "iteration": 3}


def test_designs_are_restored_after_a_remeshing(monkeypatch):
    problem = load(EXAMPLES / "small.toml")
    space = space_of(problem)
    rng = np.random.default_rng(5)
    monkeypatch.setattr(checkpoint, "analyse", lambda problem, space, disc, phi, starts: (phi, starts))
    done = 0
    while done < DESIGNS:
        # Meshed for one design, and then moved to another, with nodes inside that are moved for it.
        built, phi = (space.start + step * rng.uniform(-1.0, 1.0, space.n) for step in (0.4, 0.5))
        try:
            morph = mesh_of(problem, space.body(built), part_of(problem))
        except MeshError:
            continue
        points = space.control_points(phi)
        relaxed = relax(morph, points)
        if scaled_jacobian(relaxed.positions(points), morph.mesh.tets).min() < WORST:
            relaxed, phi, points = morph, built, space.control_points(built)
        disc = build_discretisation(problem, relaxed, space.control_points(built))
        state = stored(problem, space, disc, phi)
        check(problem, state)
        again, (back, starts) = checkpoint.unpack(problem, space, state)
        np.testing.assert_array_equal(back, phi)
        np.testing.assert_allclose(again.morph.positions(points), relaxed.positions(points), atol=1e-9)
        assert starts.keys() == {task.name for task in problem.task}
        done += 1
