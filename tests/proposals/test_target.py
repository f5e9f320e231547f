"""Target files: what they say, and one line for each mistake."""

import re

import numpy as np
import pytest
import tomli_w

from pneumorph.errors import ProblemError
from pneumorph.problem import load
from pneumorph.proposals import load_target

BEND = {"name": "bend", "objective": {"motion": "bending_y"}}


def content(**changes):
    """The tables of a target, some of them changed."""
    return {
        "material": {"name": "Dragon Skin 30"},
        "space": {"length": "60 mm", "radius": "11 mm"},
        "pressure": {"max": "50 kPa"},
        "task": [BEND],
    } | changes


def target(folder, **changes):
    path = folder / "target.toml"
    path.write_text(tomli_w.dumps(content(**changes)))
    return load_target(path)


@pytest.mark.parametrize(
    "motion, towards",
    [("bending_y", (1, 0)), ("-bending_y", (-1, 0)), ("bending_x", (0, -1)), ("extension", None), ("twist", None)],
)
def test_the_tip_goes_to_where_the_body_bends(tmp_path, motion, towards):
    [task] = target(tmp_path, task=[{"name": "move", "objective": {"motion": motion}}]).task
    if towards is None:
        assert task.towards is None
    else:
        np.testing.assert_allclose(task.towards, towards, atol=1e-12)


def test_rubbers_may_be_a_list(tmp_path):
    both = target(tmp_path, material=[{"name": "Dragon Skin 30"}, {"name": "Ecoflex 00-30"}])
    assert [rubber.name for rubber in both.material] == ["Dragon Skin 30", "Ecoflex 00-30"]


@pytest.mark.parametrize(
    "changes, key",
    [
        ({"body": {"length": "80 mm"}}, "body"),
        ({"pressure": {"max": "0 kPa"}}, "pressure.max"),
        ({"task": [BEND | {"pressure": {"A": "20 kPa"}}]}, "task[0].pressure"),
        ({"space": {"length": "60 mm"}}, "space.radius"),
        ({"space": {"length": "60 mm", "width": "20 mm"}}, "space.depth"),
        ({"space": {"length": "60 mm", "width": "20 mm", "depth": "9 mm", "radius": "9 mm"}}, "space.width"),
        ({"material": {"name": "Dragon Skin 3"}}, "material"),
        ({"colour": "red"}, "colour"),
        ({"task": []}, "task"),
        ({"task": [BEND, BEND]}, 'task: the name "bend" is used twice'),
        ({"minimize": "mass"}, 'minimize: should be a list; write it in brackets, ["mass"]'),
        ({"task": [BEND | {"minimize": ["mass"]}]}, "task[0].minimize: belongs to the top of the file"),
        ({"obstacle": []}, "obstacle: unknown key; the keys here are"),
    ],
)
def test_a_mistake_names_its_key(tmp_path, changes, key):
    with pytest.raises(ProblemError, match=f"^{re.escape(key)}"):
        target(tmp_path, **changes)


def test_a_target_is_no_problem(tmp_path):
    file = tmp_path / "some target.toml"
    file.write_text('space = { length = "80 mm", radius = "12 mm" }\n', encoding="utf-8")
    with pytest.raises(ProblemError, match=f"run: pneumorph propose '{file}'"):
        load(file)
