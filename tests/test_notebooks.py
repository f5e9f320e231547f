"""The notebooks run from the first cell to the last, on a short body with a coarse mesh and for one design."""

import shutil
from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient", reason="needs nbclient and ipykernel, of the extra dev")
nbformat = pytest.importorskip("nbformat")

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
COARSE = 'size, designs = "6 mm", 1'
SMALLER = {
    'control_density = "0.86 /mm"': 'control_density = "0.3 /mm"',
    'length = "80 mm"': 'length = "30 mm"',
    'span = ["3 mm", "77 mm"]': 'span = ["3 mm", "27 mm"]',
}


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["material", "own_objective", "quick_start"]


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    example = tmp_path / "examples" / "linear.toml"
    text = example.read_text(encoding="utf-8")
    for line, smaller in SMALLER.items():
        assert text.count(line) == 1
        text = text.replace(line, smaller)
    example.write_text(text, encoding="utf-8")
    (tmp_path / "notebooks").mkdir()
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells), "its outputs are not stored: clear them"
    (parameters,) = [cell for cell in notebook.cells if "parameters" in cell.metadata.get("tags", [])]
    assert parameters.source.startswith("size, designs =")
    parameters.source = COARSE
    kernel = {"metadata": {"path": str(tmp_path / "notebooks")}}
    ran = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=kernel).execute()
    # What the last line of a cell shows: problems, runs and designs as tables, figures as pictures.
    kinds = {kind for cell in ran.cells for output in cell.get("outputs", []) for kind in output.get("data", {})}
    assert {"text/html", "image/png"} <= kinds or path.stem == "own_objective"
    assert list((tmp_path / "notebooks" / "runs").glob("*/result.json"))
