"""The targets among the examples: each is read, and bodies are drawn for it."""

from pathlib import Path

import pytest

from pneumorph.proposals import draw_candidates, load_target
from pneumorph.proposals.estimates import impossible

TARGETS = sorted((Path(__file__).parents[2] / "examples" / "targets").glob("*.toml"))


@pytest.mark.parametrize("path", TARGETS, ids=[path.stem for path in TARGETS])
def test_bodies_are_drawn(path):
    found = list(draw_candidates(load_target(path), 8))
    assert sum(each.problem is not None for each in found) >= 6
    assert not impossible(load_target(path))
