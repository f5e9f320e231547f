"""Files of tension tests: what is read from them, and one line for what cannot be."""

import numpy as np
import pytest

from pneumorph.errors import ProblemError
from pneumorph.problem.tension import read_tension

POINTS = [(1.0, 0.0), (1.5, 0.2), (1.2, 0.1), (2.0, 0.3), (2.5, 0.4)]


def written(path, header, points, separator=","):
    path.write_text("\n".join([header, *(separator.join(map(str, point)) for point in points)]) + "\n")
    return path


@pytest.mark.parametrize(
    ("header", "strain", "stress", "separator"),
    [
        ("stretch, nominal_stress_MPa", lambda s: s, 1.0, ","),
        ("Engineering Strain;Engineering Stress (kPa)", lambda s: s - 1, 1e3, ";"),
        ("strain_%\tstress [Pa]", lambda s: 100 * (s - 1), 1e6, "\t"),
        ("# a remark\nstretch,stress N/mm^2", lambda s: s, 1.0, ","),
    ],
)
def test_columns_and_units(tmp_path, header, strain, stress, separator):
    points = [(strain(a), stress * b) for a, b in POINTS]
    stretch, found = read_tension(written(tmp_path / "a.csv", header, points, separator))
    order = np.argsort([a for a, _ in POINTS])
    assert stretch == pytest.approx(np.array(POINTS)[order, 0])
    assert found == pytest.approx(np.array(POINTS)[order, 1])


def test_other_columns_are_left_alone(tmp_path):
    points = [(9, a - 1, 99, a, b) for a, b in POINTS]
    header = "Time (s);True Strain;True Stress (MPa);stretch;nominal stress (MPa)"
    assert read_tension(written(tmp_path / "a.csv", header, points, ";"))[0].max() == 2.5


@pytest.mark.parametrize(
    ("header", "points", "words"),
    [
        ("stretch, stress", POINTS, "has no unit"),
        ("stretch, stress_bar", POINTS, '"bar" is not a known unit'),
        ("length, stress_MPa", POINTS, "has no column for stretch or strain"),
        ("stretch, force_N", POINTS, "has no column for nominal stress"),
        ("stretch, strain, stress_MPa", [(*p, 1) for p in POINTS], "more than one column"),
        ("stretch, stress_MPa", [*POINTS, (3.0, "much")], 'line 7: "much" is not a number'),
        ("stretch, stress_MPa", [*POINTS, (3.0,)], "line 7: column 2 is empty"),
        ("stretch, stress_MPa", [*POINTS, (3.0, "nan")], "line 7"),
        ("stretch, stress_MPa", POINTS[:3], "has 3 points"),
        ("stretch, stress_MPa", [(a - 1, b) for a, b in POINTS], "is not positive; is the column a strain?"),
        ("stretch, stress_MPa", [(a / 9, b) for a, b in POINTS], "no stretch is above 1"),
        ("stretch, stress_MPa", [(a, -b) for a, b in POINTS], "no stress is positive"),
        ("", [], "is empty"),
    ],
)
def test_one_line_for_what_is_wrong(tmp_path, header, points, words):
    path = written(tmp_path / "a.csv", header, points)
    with pytest.raises(ProblemError) as caught:
        read_tension(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and "\n" not in message and words in message


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ProblemError, match="there is no such file"):
        read_tension(tmp_path / "none.csv")
