"""What counts as detected and as isolated: only what begins at or after the first faulty sample."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from svo import Log
from svo.detectors.detector import NOBODY, Detection, Setting
from svo.studies.comparison.run import Condition, compare_run

K, FIRST, TS = 20, 10, 0.1
LOG = Log(time=TS * np.arange(K), u=np.zeros((K, 1)), y=np.zeros((K, 1)))


@dataclass(frozen=True)
class Says:
    """Says what it is told; names[k] is None, "a" or "b"."""

    alarm: np.ndarray
    names: list = field(default_factory=lambda: [None] * K)
    name: str = "says"
    faults: tuple[str, ...] = ("a", "b")

    def prepare(self, log):
        return log

    def run(self, setting, prepared, isolate=True):
        named = np.array([NOBODY if name is None else self.faults.index(name) for name in self.names])
        return Detection(self.alarm, named)


def judged(alarm, names=None):
    at = np.zeros(K, dtype=bool)
    for first, stop in alarm:
        at[first:stop] = True
    said = [None] * K
    for name, first, stop in names or []:
        said[first:stop] = [name] * (stop - first)
    return compare_run(Says(at, said), Setting(1.0), LOG, Condition("bounded", "a", "step", FIRST * TS), 0)


@pytest.mark.parametrize(
    ("alarm", "false_alarm", "first"),
    [
        ([(10, 20)], False, 0.1),
        ([(13, 20)], False, 0.4),
        ([(9, 20)], True, None),
        ([(3, 20)], True, None),
        ([(3, 5), (12, 14)], True, 0.3),
        ([(9, 11), (15, 20)], True, 0.6),
        ([], False, None),
    ],
)
def test_an_alarm_counts_if_it_begins_at_the_fault_or_after_it(alarm, false_alarm, first):
    run = judged(alarm)
    assert run.false_alarm == false_alarm
    assert run.first_alarm_s == (None if first is None else pytest.approx(first))


@pytest.mark.parametrize(
    ("names", "isolated_as", "delay"),
    [
        ([("a", 10, 20)], "a", 0.1),
        ([("a", 5, 20)], None, None),  # it stood before the fault, right by chance
        ([("a", 9, 20)], None, None),
        ([("b", 5, 20)], None, None),
        ([("b", 5, 12), ("a", 12, 20)], "a", 0.3),
        ([("a", 5, 12), ("b", 12, 20)], "b", None),
        ([("a", 5, 10), ("a", 14, 20)], "a", 0.5),
        ([("b", 11, 13), ("a", 13, 20)], "b", None),
        ([], None, None),
    ],
)
def test_an_isolation_counts_if_it_begins_at_the_fault_or_after_it(names, isolated_as, delay):
    run = judged([(10, 20)], names)
    assert run.isolated_as == isolated_as
    assert run.isolation_delay_s == (None if delay is None else pytest.approx(delay))
