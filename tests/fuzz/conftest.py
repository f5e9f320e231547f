"""What the fuzzed properties share. A long run: pytest tests/fuzz --hypothesis-profile=nightly"""

import pytest
from tally import Tally
from typer.testing import CliRunner

from pneumorph.cli import app

TALLIES: list[Tally] = []


@pytest.fixture
def tally(request):
    """Counts the outcomes of a property; pytest shows the table at its end."""
    found = Tally(request.node.name)
    TALLIES.append(found)
    return found


@pytest.fixture
def command(tmp_path):
    """Run the command in this process on a file of this content, with further arguments."""

    def run(name: str, content: bytes, *arguments: str):
        path = tmp_path / "problem.toml"
        path.write_bytes(content)
        return CliRunner().invoke(app, [name, str(path), *arguments])

    return run


def pytest_terminal_summary(terminalreporter):
    for tally in TALLIES:
        terminalreporter.section("fuzz")
        for line in tally.table():
            terminalreporter.write_line(line)
