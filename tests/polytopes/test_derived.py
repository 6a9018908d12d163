"""What follows from a set: computed once, kept with it, and for several sets at the same time."""

from __future__ import annotations

from threading import Barrier, Thread

from polytopes import HPolytope
from polytopes.derived import derived


class Thing:
    """Counts how often its property is computed; meets another thread there."""

    def __init__(self, meeting: Barrier) -> None:
        self.meeting, self.count = meeting, 0

    @derived
    def answer(self) -> int:
        """The answer."""
        self.count += 1
        self.meeting.wait(10.0)
        return 42


def test_two_threads_compute_at_once_and_each_value_is_kept() -> None:
    """Under one lock for all objects, as that of Python 3.11, the first would wait for the second for ever."""
    meeting = Barrier(2)
    things = [Thing(meeting), Thing(meeting)]
    threads = [Thread(target=lambda thing=thing: thing.answer) for thing in things]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20.0)
    assert [thing.answer for thing in things] == [42, 42]
    assert [thing.count for thing in things] == [1, 1]
    assert Thing.answer.__doc__ == "The answer."


def test_a_box_knows_its_bounds_from_the_start() -> None:
    box = HPolytope.box([0.0, 1.0], [1.0, 3.0])
    assert "as_box" in vars(box)
    lower, upper = box.bounding_box()
    assert (lower.tolist(), upper.tolist()) == ([0.0, 1.0], [1.0, 3.0])
    assert "program" not in vars(box)
