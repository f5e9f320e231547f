"""The page on performance: single sections are measured again, and the rest stays as it is."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "all.py"


def test_a_section_is_replaced(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# P\n\n## A\n\na\n\n## Beside the paper\n\nold\n\n## B\n\nb\n")
    command = [sys.executable, SCRIPT, "--quick", tmp_path, "--out", page, "--only", "Beside the paper"]
    subprocess.run(command, check=True)
    before, after = page.read_text().split("`benchmarks/table.py`")
    assert before.startswith("# P\n\n## A\n\na\n\n## Beside the paper\n\nDesigns and time")
    assert after.endswith("\n\n## B\n\nb\n") and "old" not in after and "| run |" in after


def test_a_new_section_comes_before_the_last(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# P\n\n## A\n\na\n\n## What limits next\n\nb\n")
    subprocess.run([sys.executable, SCRIPT, "--quick", tmp_path, "--out", page, "--only", "Beside the"], check=True)
    assert [line for line in page.read_text().splitlines() if line.startswith("## ")] == [
        "## A",
        "## Beside the paper",
        "## What limits next",
    ]
