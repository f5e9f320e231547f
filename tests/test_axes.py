"""The sketch of axes says what the computation does."""

import importlib.util
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from texts import EXTEND, problem_text

import pneumorph as pm
from pneumorph.mechanics import rotation
from pneumorph.problem import loads

DOCS = Path(__file__).parents[1] / "docs"
NUMBER = {"bending_x": 0, "bending_y": 1, "twist": 2}


def sketch():
    """The script that draws it."""
    spec = importlib.util.spec_from_file_location("axes", DOCS / "hooks" / "axes.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def drawn():
    """The groups of the sketch by the name of the motion."""
    root = ET.fromstring((DOCS / "images" / "axes.svg").read_text(encoding="utf-8"))
    return {group.get("id"): group for group in root.iter("{http://www.w3.org/2000/svg}g") if group.get("id")}


def test_the_sketch_is_that_of_the_script():
    assert (DOCS / "images" / "axes.svg").read_text(encoding="utf-8") == sketch().svg()


def test_tips_are_drawn_where_rotation_vectors_turn_them(drawn):
    module = sketch()
    assert list(drawn) == list(NUMBER)
    for name, group in drawn.items():
        vector = np.zeros(3)
        vector[NUMBER[name]] = module.ANGLE
        R = np.asarray(rotation(jnp.array(vector)))
        # The outermost point of the tip at +x, relative to the tip's centre.
        axis, _, towards = module.PANELS[name]
        centre = np.array(module.moved(0.0, 0.0, module.LENGTH, axis))
        rim = np.array(module.moved(module.RADIUS, 0.0, module.LENGTH, axis)) - centre
        np.testing.assert_allclose(rim, R @ [module.RADIUS, 0, 0], atol=1e-12)
        # A body that bends evenly goes where its tip looks.
        sideways = (R @ [0, 0, 1])[:2]
        assert np.sign(np.round(sideways, 9)).tolist() == list(towards[:2])
        assert np.sign(np.round(centre[:2], 6)).tolist() == list(towards[:2])
        tip = [float(part) for part in group.get("data-tip").split()]
        np.testing.assert_allclose(tip, module.projected(tuple(centre)), atol=0.06)
        places = [
            [float(n) for n in re.findall(r"-?[\d.]+", line.get("points"))]
            for line in group.iter()
            if line.get("points")
        ]
        assert any(np.allclose(np.reshape(place, (-1, 2)).mean(axis=0), tip, atol=0.2) for place in places)


def test_a_body_bends_and_twists_as_it_is_drawn():
    """Torques about all axes turn its tip."""
    text = problem_text(
        f'[end_effector]\nmoment = ["20 N*mm", "20 N*mm", "20 N*mm"]\n{EXTEND}[mesh]\nsize = "6 mm"\n',
        body='control_density = "0.3 /mm"',
    )
    start = pm.starting_design(loads(text))
    found, module = start.results["extend"], sketch()
    assert min(found.rotation) > 1e-3
    assert np.sign(found.translation[:2]).tolist() == [
        module.PANELS["bending_y"][2][0], module.PANELS["bending_x"][2][1],
    ]  # fmt: skip
    # Counter-clockwise seen from the tip: what is at +x goes towards +y.
    at, u = start.fields.mesh.points, start.fields.u["extend"]
    tip = at[:, 2] > 23.9
    outer = tip & (at[:, 0] > 7.0)
    assert (u[outer, 1] - u[tip, 1].mean()).mean() > 0
    assert "counter-clockwise" in module.PANELS["twist"][1]


@pytest.mark.parametrize("page", [DOCS.parent / "README.md", DOCS / "tutorial.md", DOCS / "theory" / "targets.md"])
def test_pages_show_it(page):
    assert "images/axes.svg" in page.read_text(encoding="utf-8")
