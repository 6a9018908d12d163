"""The one loop over a log: who gets which input, and who may stop or go on."""

from itertools import islice
from typing import Any

import numpy as np
import pytest

from svo.logs.drive import drive
from svo.logs.log import Log

LOG = Log(
    time=np.arange(4.0),
    u=np.array([[10.0], [11.0], [12.0], [13.0]]),
    y=np.array([[0.0], [1.0], [np.nan], [3.0]]),
    schedule=np.array([5.0, 6.0, 7.0, 8.0]),
)


class Listener:
    """Answers with what it was told."""

    def update(self, y0: Any, u: Any = None, schedule: Any = None) -> tuple[Any, ...]:
        return "update", y0.item(), u.item(), schedule

    def step(self, u: Any, y: Any, u_next: Any = None, schedule: Any = None, **options: Any) -> tuple[Any, ...]:
        return u.item(), y.item(), u_next.item(), schedule, options


def test_a_step_is_driven_by_the_input_of_the_sample_before() -> None:
    first, *others = drive(Listener(), LOG)
    assert first == ("update", 0.0, 10.0, 5.0)
    assert others[0] == (10.0, 1.0, 11.0, 6.0, {})
    assert others[2] == (12.0, 3.0, 13.0, 8.0, {})


def test_it_stops_where_its_caller_does_and_goes_on_from_there() -> None:
    listener = Listener()
    assert list(map(repr, [*islice(drive(listener, LOG), 2), *drive(listener, LOG, start=2)])) == list(
        map(repr, drive(listener, LOG))
    )


def test_a_scheduler_hears_of_each_sample_in_turn_and_options_are_those_of_a_step() -> None:
    answers = list(drive(Listener(), LOG, scheduler=lambda y, u: float(u[0]) + 0.5, deadline=2.0))
    assert [answer[3] for answer in answers] == [10.5, 11.5, 12.5, 13.5]
    assert [answer[4] for answer in answers[1:]] == [{"deadline": 2.0}] * 3


@pytest.mark.parametrize(
    ("log", "error", "match"),
    [
        ([1.0], TypeError, "log is a list; expected an svo.Log"),
        (Log(time=np.zeros(0), u=np.zeros((0, 1)), y=np.zeros((0, 1))), ValueError, "log has no samples"),
    ],
)
def test_what_is_no_log_is_refused(log: Any, error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        list(drive(Listener(), log))
