"""The tables of tolerances, and what is refused."""

import json

import numpy as np
import pytest
from texts import problem_text
from tiny import tiny
from typer.testing import CliRunner

from pneumorph.cli import app
from pneumorph.errors import ProblemError
from pneumorph.interface.design import starting_design
from pneumorph.interface.tolerance import read_tolerances
from pneumorph.output import thickening
from pneumorph.problem import Problem, load, loads
from pneumorph.problem.material import elastomer
from pneumorph.problem.sources import range_of

TASK = """
[[task]]
name = "extend"
pressure = { A = "20 kPa" }
objective = { motion = "extension" }
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("tolerance") / "tube.toml"
    path.write_text(loads(problem_text(TASK)).with_changes({"mesh.size": "8 mm"}).to_toml())
    return path


def test_the_command_prints_shares_that_add_up_and_writes_all_figures(file, tmp_path):
    out = tmp_path / "all.json"
    done = CliRunner().invoke(app, ["tolerance", str(file), "--wall", "0.2 mm", "--json", str(out)])
    assert done.exit_code == 0, done.output
    tables = [table.splitlines() for table in done.output.split("extend: ")[1:]]
    assert [table[0].partition(" ")[0] for table in tables] == ["extension", "volume"]
    for table in tables:
        rows = [line for line in table if line.endswith("%")]
        assert sum(int(row.split()[-2]) for row in rows) == pytest.approx(100, abs=len(rows))
    ((_, task),) = json.loads(out.read_text()).items()
    walls = [cause for cause in task["causes"] if cause["name"].startswith("rubber at")]
    assert [cause["tolerance"] for cause in walls] == [0.2] * 2
    assert task["deviation"][2] ** 2 == pytest.approx(
        sum((cause["tolerance"] * cause["by"][2]) ** 2 for cause in task["causes"])
    )


def test_forces_of_a_held_tip_and_volumes_have_tables(tmp_path):
    """A force in the sense that the task asks for, a volume in millilitres; motions that are held have none."""
    held = TASK.replace('{ motion = "extension" }', '{ kind = "blocked", motion = "-extension" }')
    path, out = tmp_path / "held.toml", tmp_path / "all.json"
    problem = loads(problem_text(f'{held}hold = {{ axial = "0.5 mm" }}\n')).with_changes({"mesh.size": "8 mm"})
    path.write_text(problem.to_toml())
    done = CliRunner().invoke(app, ["tolerance", str(path), "--json", str(out)])
    assert done.exit_code == 0, done.output
    heads = [line for line in done.output.splitlines() if line.startswith("extend: ")]
    ((_, task),) = json.loads(out.read_text()).items()
    force, volume = (task["quantities"].index(name) for name in ("push_extension", "volume_A"))
    assert [head.partition(" ±")[0] for head in heads] == [
        f"extend: force against shortening {-task['values'][force]:.4g}",
        f"extend: volume of A {1e-3 * task['values'][volume]:.4g}",
    ]
    assert f" ± {task['deviation'][force]:.2g} N (" in heads[0]
    assert f" ± {1e-3 * task['deviation'][volume]:.2g} ml (" in heads[1]
    down, up = task["solved"]["push_extension"]
    value, deviation = task["values"][force], task["deviation"][force]
    assert (down, up) == (pytest.approx(value - deviation, rel=0.02), pytest.approx(value + deviation, rel=0.02))
    assert "N per unit" in done.output and "ml per unit" in done.output
    assert abs(task["deviation"][2]) < 1e-9


def test_a_rubber_of_the_library_scatters_as_its_sources_do_and_is_solved_at_their_ends(tmp_path):
    text = problem_text(TASK, material='name = "Dragon Skin 10"')
    report = starting_design(loads(text).with_changes({"mesh.size": "8 mm"})).tolerance(wall="0 mm", shift="0 mm")
    causes = {cause.name: cause for cause in report.tasks["extend"].causes}
    low, high = range_of(elastomer("Dragon Skin 10"))
    assert causes["modulus of the rubber"].tolerance == pytest.approx(50 * np.log(high / low))
    assert causes["creep, cycles of the rubber"].tolerance == pytest.approx(5.0)
    ends = report.ends["extend"]
    assert list(ends) == [low, high]
    assert ends[high][2] == pytest.approx(report.tasks["extend"].motion[2], rel=1e-4) and ends[high][2] < ends[low][2]
    assert "measure your batch" in str(report)
    assert "43 kPa: " in str(report) and report.to_json()["extend"]["sources"][1]["shear_modulus_MPa"] == high


@pytest.mark.parametrize(
    ("given", "word"),
    [({"rubber": "20"}, "percentage"), ({"wall": "0.1"}, "unit"), ({"wall": "-1 mm"}, "negative"),
     ({"rubber": "90 %"}, "50 %"), ({"colour": "1 mm"}, "rubber, pressure"), ({"rubber": "nan %"}, "percentage")],
)  # fmt: skip
def test_what_is_no_tolerance_is_refused_by_name(given, word):
    with pytest.raises(ProblemError, match=word) as refused:
        read_tolerances(given)
    assert str(refused.value).startswith(next(iter(given)))


@pytest.mark.parametrize(
    ("name", "text", "hint"),
    [("wall", "0.1", "0.1 mm"), ("pressure", "one", "1 kPa"), ("tilt", "1 mm", "0.2 deg"), ("scale", "1", "0.3 %")],
)
def test_hints_show_values_that_a_workshop_has(name, text, hint):
    with pytest.raises(ProblemError) as refused:
        read_tolerances({name: text})
    assert str(refused.value).endswith(f'write e.g. "{hint}"')


def test_a_bad_value_is_refused_before_the_problem_is_read(tmp_path):
    done = CliRunner().invoke(app, ["tolerance", str(tmp_path / "none.toml"), "--wall", "0.1"])
    assert done.exit_code != 0 and "wall" in done.output and "none.toml" not in done.output


def test_the_usual_tilt_is_told_as_it_is_meant():
    assert f"{np.degrees(read_tolerances({}).tilt):.6g}" == "0.2"


def test_a_picture_of_another_format_is_refused_before_anything_is_solved(file, tmp_path):
    done = CliRunner().invoke(app, ["tolerance", str(file), "--picture", str(tmp_path / "rubber.bmp")])
    assert done.exit_code != 0
    assert "--picture" in done.output and "bmp" in done.output


def test_where_more_rubber_matters_is_drawn(file, tmp_path, monkeypatch):
    """With one range of colours to both sides; most of the tube's surface moves it less where it is thicker."""
    drawn = []

    def images(job):
        drawn.append(job)
        return [np.zeros((4, 4, 4)) for _ in job.panels]

    monkeypatch.setattr(thickening, "images", images)
    report = starting_design(load(file)).tolerance()
    path = report.picture(tmp_path / "rubber.png")
    assert path.exists()
    (job,) = drawn
    (panel,) = job.panels
    assert job.range[0] == -job.range[1] < 0.0 and job.colours.label.startswith("mm more")
    changes = report.thickening["extend"]["extension"]
    np.testing.assert_allclose(panel.shape.field, 10.0 * changes)
    assert np.count_nonzero(changes < 0.0) > np.count_nonzero(changes > 0.0)


def test_how_many_castings_balloon_is_told_and_where_they_do_within_a_deviation_none_is_solved():
    table = loads(tiny()).model_dump(mode="json", exclude_none=True)
    table["material"] = {"model": "neo-hookean", "shear_modulus": "0.25 MPa", "bulk_modulus": "2 MPa"}
    table["material"] |= {"density": "1 g/cm^3", "compressible": True, "scatter": 0.3}
    table["body"]["chamber"][0]["radius"] = "5.5 mm"
    design = starting_design(Problem.model_validate(table))
    rough = design.tolerance(rubber="40 %")
    assert not rough.doubts
    found = rough.ballooning["extend"]
    assert 0.16 < found.probability < 0.5 and not rough.solved["extend"] and not rough.second["extend"]
    assert "by first derivatives alone" in str(rough)
    assert f"about {100 * found.probability:.0f} % of castings" in str(rough)
    assert rough.to_json()["extend"]["ballooning"]["probability"] == found.probability
    # Where fewer do, castings off by one deviation have states.
    fine = design.tolerance(rubber="15 %")
    assert 0.0 < fine.ballooning["extend"].probability < 0.1
    assert "by first derivatives alone" not in str(fine)
    assert fine.solved["extend"]["extension"].up > fine.tasks["extend"].motion[2]
    # A measured rubber does not silence it: walls and cores vary too.
    assert "extend" in design.tolerance(rubber="1 %").ballooning
