"""Problems with a further chamber, and its images under the symmetry of the body."""

import pytest
from texts import EXTEND, problem_text

from pneumorph.errors import ProblemError
from pneumorph.problem import loads, with_further_chamber

FREE = EXTEND.replace('"60 kPa"', '{ start = "30 kPa", min = "0 kPa", max = "60 kPa" }')
MIRRORS = 'symmetry = { mirror = ["xz", "yz"] }'
LIMITS = '[limits]\nwall = "1 mm"\n'


def body(task=EXTEND, symmetry=MIRRORS):
    return loads(problem_text(task + LIMITS, radius=14, chambers=(("A", 3, "0 mm", "0 mm"),), body=symmetry))


def added(problem, place, radius=2.0):
    further = with_further_chamber(problem, place, radius, {"extend": 0.06}, (0.0, 0.06))
    return {chamber.name: chamber for chamber in further.body.chamber[1:]}, further


def test_a_chamber_has_images_in_mirror_planes():
    chambers, _ = added(body(), (6.0, 6.5, 8.0))
    assert sorted(each.center for each in chambers.values()) == [(-6.0, -6.5), (-6.0, 6.5), (6.0, -6.5), (6.0, 6.5)]
    assert list(chambers) == ["B", "C", "D", "E"]
    assert {each.span for each in chambers.values()} == {(6.0, 10.0)}


def test_a_chamber_near_a_mirror_plane_is_in_it():
    chambers, _ = added(body(), (8.0, 0.7, 8.0))
    assert sorted(each.center for each in chambers.values()) == [(-8.0, 0.0), (8.0, 0.0)]


def test_images_along_the_axis():
    chambers, _ = added(body(symmetry='symmetry = { mirror = ["xy"] }'), (8.0, 0.0, 6.0))
    assert sorted(each.span for each in chambers.values()) == [(4.0, 8.0), (16.0, 20.0)]


def test_its_pressure_is_designed_where_others_are():
    _, fixed = added(body(), (8.0, 0.0, 8.0))
    assert not fixed.task[0].pressure["B"].free
    assert fixed.task[0].pressure["B"].start == pytest.approx(0.06)
    _, designed = added(body(FREE), (8.0, 0.0, 8.0))
    assert (designed.task[0].pressure["B"].min, designed.task[0].pressure["B"].max) == (0.0, pytest.approx(0.06))


def test_images_may_have_pressures_of_their_own():
    def pressures(place):
        return {"extend": 0.06 if place[0] < 0.0 else 0.0}

    further = with_further_chamber(body(), (-6.0, 6.5, 8.0), 2.0, pressures, (0.0, 0.06))
    starts = {each.center[0]: further.task[0].pressure[each.name].start for each in further.body.chamber[1:]}
    assert starts == {-6.0: pytest.approx(0.06), 6.0: 0.0}


def test_there_must_be_room():
    with pytest.raises(ProblemError, match=r"body.chamber"):
        added(body(), (4.0, 0.0, 8.0))
