"""A body small and coarse enough to simulate in a second."""

import pytest
from typer.testing import CliRunner

from pneumorph.cli import app

TINY = """
title = "Tiny"
[material]
name = "Hei-Cast 8400"
[body]
length = "24 mm"
radius = "8 mm"
control_density = "0.3 /mm"
[[body.chamber]]
name = "A"
radius = "4 mm"
center = ["0 mm", "0 mm"]
span = ["3 mm", "21 mm"]
[end_effector]
spring = { axial = "4 N/mm" }
[[task]]
name = "extend"
pressure = { A = "60 kPa" }
objective = { kind = "maximize", motion = "extension" }
[mesh]
size = "6 mm"
[optimizer]
iterations = 2
"""


@pytest.fixture
def tiny(tmp_path):
    """The path of a tiny problem file."""
    path = tmp_path / "tiny.toml"
    path.write_text(TINY)
    return path


@pytest.fixture
def run():
    """Run the command with arguments; the result has exit_code, stdout and stderr."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])
