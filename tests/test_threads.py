"""Parts of work on the threads of the process."""

import threading

import pytest

from pneumorph.threads import each


@pytest.mark.usefixtures("three_threads")
def test_results_are_in_the_order_of_the_parts() -> None:
    done: list[int] = []

    def work(part: int) -> int:
        done.append(part)
        return part**2

    assert each(work, range(200)) == [part**2 for part in range(200)]
    assert sorted(done) == list(range(200))
    assert each(work, []) == []


@pytest.mark.usefixtures("three_threads")
def test_several_threads_work_at_a_time() -> None:
    together = threading.Barrier(3)

    def work(part: int) -> int:
        together.wait(timeout=30.0)
        return part

    assert each(work, range(6)) == list(range(6))


@pytest.mark.usefixtures("three_threads")
def test_parts_may_have_parts() -> None:
    def work(part: int) -> int:
        return sum(each(lambda inner: part * inner, range(20)))

    assert each(work, range(20)) == [190 * part for part in range(20)]


@pytest.mark.usefixtures("three_threads")
def test_an_error_of_a_part_is_raised_and_no_part_goes_on_after_it() -> None:
    begun, ended = [], []

    def work(part: int) -> None:
        begun.append(part)
        if part == 5:
            raise ValueError("the fifth part")
        ended.append(part)

    with pytest.raises(ValueError, match="fifth part"):
        each(work, range(50))
    assert sorted(ended) == sorted(set(begun) - {5})
