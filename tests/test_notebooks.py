"""The notebooks run from the first cell to the last, on coarse meshes and for one design."""

import ast
import shutil
from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient", reason="needs nbclient and ipykernel, of the extra dev")
nbformat = pytest.importorskip("nbformat")

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
COARSE = 'size, designs = "6 mm", 1'
DENSE = 'control_density = "0.86 /mm"'


def test_there_are_three():
    assert [path.stem for path in NOTEBOOKS] == ["material", "own_objective", "quick_start"]


def in_a_kernel(notebook, folder):
    """Run a notebook as Jupyter does; the kinds of what its cells show."""
    kernel = {"metadata": {"path": str(folder)}}
    ran = nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=kernel).execute()
    return {kind for cell in ran.cells for output in cell.get("outputs", []) for kind in output.get("data", {})}


def here(notebook, folder):
    """The same in this process, which has compiled what most of the time would go into."""
    names, kinds = {"__name__": "__main__"}, set()
    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        *before, last = ast.parse(cell.source).body
        if not isinstance(last, ast.Expr):
            before.append(last)
        exec(compile(ast.Module(before, []), "cell", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
            kinds |= {kind for kind, words in KINDS.items() if hasattr(value, words) and getattr(value, words)()}
    return kinds


KINDS = {"text/html": "_repr_html_", "image/png": "_repr_png_"}


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    example = tmp_path / "examples" / "linear.toml"
    text = example.read_text(encoding="utf-8")
    assert DENSE in text
    example.write_text(text.replace(DENSE, 'control_density = "0.3 /mm"'), encoding="utf-8")
    folder = tmp_path / "notebooks"
    folder.mkdir()
    monkeypatch.chdir(folder)
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells), "its outputs are not stored: clear them"
    (parameters,) = [cell for cell in notebook.cells if "parameters" in cell.metadata.get("tags", [])]
    assert parameters.source.startswith("size, designs =")
    parameters.source = COARSE
    run = in_a_kernel if path.stem == "quick_start" else here
    kinds = run(notebook, folder)
    # What the last line of a cell shows: problems, runs and designs as tables, figures as pictures.
    assert {"text/html", "image/png"} <= kinds or path.stem == "own_objective"
    assert list((folder / "runs").glob("*/result.json"))
