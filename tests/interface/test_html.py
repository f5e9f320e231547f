"""What notebooks show: well-formed tables, in which nothing from a file is taken for HTML."""

from html.parser import HTMLParser

import numpy as np
from runs import waving_run
from tiny import tiny

import pneumorph as pm
from pneumorph.geometry.tube import starting_body
from pneumorph.interface.html import MOST_ROWS, table
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import loads
from pneumorph.results import Fields


class Tables(HTMLParser):
    """The rows of all tables, and whether every tag is closed where it should be."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.tags = [], [], set()
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.tags.add(tag)
        if tag == "tr":
            self.rows.append([])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open[-1:] in (["td"], ["th"]):
            self.rows[-1].append(data)


def test_tables_are_escaped_and_their_middle_is_left_out():
    found = Tables(table(("a", "b"), [(k, "<script>&") for k in range(3 * MOST_ROWS)]))
    assert len(found.rows) == 1 + MOST_ROWS + 1 and "script" not in found.tags
    assert found.rows[0] == ["a", "b"] and found.rows[1] == ["0", "<script>&"]
    assert found.rows[-1][0] == str(3 * MOST_ROWS - 1)


def test_a_run_and_its_designs(tmp_path):
    problem = loads(tiny()).with_changes({"title": "<img src=x>"})
    mesh = mesh_body(starting_body(problem.tubes), 8.0).mesh
    still = Fields(mesh, {"extend": 0.0 * mesh.points}, {"extend": np.ones(len(mesh.points))})
    run = pm.open_run(waving_run(tmp_path / "run", problem, 3, {0: still}).path)
    found = Tables(run._repr_html_())
    assert [row[0] for row in found.rows] == ["design", "0", "1", "2"] and "img" not in found.tags
    assert found.rows[1][1].endswith(" mm")
    found = Tables(run.best._repr_html_())
    assert {"wall", "fold", "curvature"} <= {row[0] for row in found.rows} and "img" not in found.tags
    assert "img" not in Tables(run.problem._repr_html_()).tags


def test_a_fit(tmp_path):
    stretch = np.linspace(1.05, 2.0, 12)
    rows = "".join(f"{a},{0.3 * (a - a**-2)}\n" for a in stretch)
    (tmp_path / "a.csv").write_text(f"stretch, nominal stress (MPa)\n{rows}")
    found = Tables(pm.fit_material(tmp_path / "a.csv", model="neo-hookean")._repr_html_())
    assert found.rows[1][0] == "neo-hookean" and found.rows[1][3] == "acceptable"
