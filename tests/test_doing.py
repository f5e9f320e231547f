"""What is done is said where nothing else has been, by the thread that computes, and only where somebody asks."""

from concurrent.futures import ThreadPoolExecutor

import pytest
from tiny import tiny

from pneumorph import doing
from pneumorph.analysis import analyse_body
from pneumorph.interface.design import starting_design
from pneumorph.interrupts import stop_if_asked
from pneumorph.problem import loads


@pytest.fixture
def lines(monkeypatch):
    """What is said, wherever it may be."""
    found: list[str] = []
    monkeypatch.setattr(doing, "EVERY", 0.0)
    doing.announce(found.append)
    yield found
    doing.announce(None)


def test_from_the_whole_to_its_part(lines):
    with doing.doing("checking"), doing.doing("meshing"):
        stop_if_asked()
    stop_if_asked()
    assert [line.partition(" (")[0] for line in lines] == ["checking, meshing", "still working"]


def test_nothing_is_said_soon_after_a_line(lines, monkeypatch):
    monkeypatch.setattr(doing, "EVERY", 1e9)
    with doing.doing("meshing"):
        stop_if_asked()
    assert lines == []


def test_other_threads_say_nothing(lines):
    def work():
        with doing.doing("aside"):
            stop_if_asked()

    with ThreadPoolExecutor(1) as threads:
        threads.submit(work).result()
    assert lines == [] and doing.words() == ""


def test_an_analysis_says_what_it_does(lines):
    problem = loads(tiny())
    analyse_body(problem, starting_design(problem).body)
    said = {line.partition(" (")[0] for line in lines}
    assert any(each.startswith("meshing") for each in said)
    assert any("near " in each and "kPa" in each for each in said)
