"""A body small and coarse enough to simulate in a second."""

import pytest
import tiny as problems
from typer.testing import CliRunner

from pneumorph.cli import app


@pytest.fixture
def tiny(tmp_path):
    """The path of a tiny problem file."""
    path = tmp_path / "tiny.toml"
    path.write_text(problems.tiny(spring='{ axial = "4 N/mm" }'))
    return path


@pytest.fixture
def run():
    """Run the command with arguments; the result has exit_code, stdout and stderr."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])
