"""The command, in this process."""

import pytest
from typer.testing import CliRunner

from pneumorph.cli import app


@pytest.fixture
def run():
    """Run the command with arguments; the result has exit_code, stdout and stderr."""
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])
