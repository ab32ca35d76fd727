"""Several at once: in order, with their errors, none within another, none for nobody."""

from threading import Barrier, get_ident

import numpy as np
import pytest

from thrustd.core import threads
from thrustd.core.threads import each
from thrustd.identify.regression.kernel import run
from thrustd.identify.regression.stops import run_stops
from thrustd.model import stage

PATIENCE_S = 60.0


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "_processors", lambda: 2)


def test_two_run_at_once_and_answer_in_order(two: None) -> None:
    both = Barrier(2)

    def met(number: int) -> int:
        both.wait(PATIENCE_S)  # one after the other would wait for ever
        return number

    assert list(each(met, range(4))) == [0, 1, 2, 3]


def test_compiled_loops_of_the_ground_let_the_others_go_on() -> None:
    assert run.targetoptions["nogil"] and run_stops.targetoptions["nogil"] and stage._run_step.targetoptions["nogil"]
    assert not stage.run_chain.targetoptions.get("nogil")  # in flight a sample is too short to let go for


def test_what_is_asked_within_one_stays_in_its_thread(two: None) -> None:
    def within(_: int) -> set[int]:
        return set(each(lambda _: get_ident(), range(3)))

    assert all(len(idents) == 1 for idents in each(within, range(2)))


def test_an_error_is_the_callers(two: None) -> None:
    with pytest.raises(ZeroDivisionError):
        list(each(lambda n: 1 // n, (1, 0, 2)))


def test_who_stops_listening_ends_it(two: None) -> None:
    asked: list[int] = []
    for found in each(lambda n: asked.append(n) or n, range(1000)):
        if found == 0:
            break
    assert len(asked) < 1000


def test_what_numpy_ignores_for_the_caller_it_ignores_in_all(two: None, recwarn: pytest.WarningsRecorder) -> None:
    with np.errstate(all="ignore"):
        list(each(lambda n: np.log(np.zeros(n)), (1, 2)))
    assert not recwarn.list
