from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

from svo.detection.watch.timeline import Row, Timeline


def row(time: float, value: float = 0.0) -> Row:
    return Row(time, np.zeros(0), np.array([value]), f"at {time:g}")


def events(rows: Iterable[Row | float], finish: bool = True) -> list[tuple[str, float | int]]:
    """Kind and time of what rows come to; of a gap, its samples."""
    timeline, found = Timeline(0.1), []
    for item in rows:
        found += timeline.add(item if isinstance(item, Row) else row(item))
    if finish:
        found += timeline.finish()
    return [(event.kind, event.count if event.kind == "missing" else round(event.row.time, 6)) for event in found]


def samples(*times: float) -> list[tuple[str, float]]:
    return [("sample", time) for time in times]


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([5.0, 5.1, 5.1999, 5.3], samples(5.0, 5.1, 5.1999, 5.3)),
        # a gap is one once another row says so, or no other comes
        ([0.0, 0.1, 0.4, 0.5], [*samples(0.0, 0.1), ("missing", 2), *samples(0.4, 0.5)]),
        ([0.0, 0.1, 0.4, 0.6], [*samples(0.0, 0.1), ("missing", 2), *samples(0.4), ("missing", 1), *samples(0.6)]),
        ([0.0, 0.1, 0.4], [*samples(0.0, 0.1), ("missing", 2), *samples(0.4)]),
        ([0.0, 0.1, 5.1, 5.2], [*samples(0.0, 0.1), ("missing", 49), *samples(5.1, 5.2)]),
        ([0.0, 100.0, 200.0, 300.0], [*samples(0.0), ("bad", 100.0), ("bad", 200.0), ("bad", 300.0)]),  # milliseconds
        # one wrong time is a bad row and leaves its sample missing
        ([0.0, 0.1, 0.7, 0.3, 0.4], [*samples(0.0, 0.1), ("bad", 0.7), ("missing", 1), *samples(0.3, 0.4)]),
        ([0.0, 0.1, 900.0, 0.2, 0.3], [*samples(0.0, 0.1), ("bad", 900.0), *samples(0.2, 0.3)]),
        ([0.0, 0.1, 0.15, 0.2], [*samples(0.0, 0.1), ("bad", 0.15), *samples(0.2)]),
        ([0.0, 0.1, 0.25, 0.3, 0.4], [*samples(0.0, 0.1), ("bad", 0.25), ("missing", 1), *samples(0.3, 0.4)]),
        ([0.0, 0.1, row(0.1, 1.0), 0.2], [*samples(0.0, 0.1), ("bad", 0.1), *samples(0.2)]),
        ([0.0, 0.1, row(0.1, 1.0)], [*samples(0.0, 0.1), ("bad", 0.1)]),
        ([0.0, 0.1, 0.7, 0.35, 0.3, 0.4][:4], [*samples(0.0, 0.1), ("bad", 0.7), ("bad", 0.35)]),
        # rows that were read before
        ([0.0, 0.1, 0.0, 0.1, 0.2], [*samples(0.0, 0.1), ("repeat", 0.0), ("repeat", 0.1), *samples(0.2)]),
        ([0.0, 0.1, 0.1, 0.2], [*samples(0.0, 0.1), ("repeat", 0.1), *samples(0.2)]),
        # a clock that was started again
        ([7.0, 7.1, 0.0, 0.1], [*samples(7.0, 7.1), ("restart", 0.0), *samples(0.0, 0.1)]),
        ([7.0, 7.1, 0.0], [*samples(7.0, 7.1), ("bad", 0.0)]),
        ([7.0, 7.1, 9.15, 9.25], [*samples(7.0, 7.1), ("restart", 9.15), *samples(9.15, 9.25)]),
        ([999.0, 0.0, 0.1], [*samples(999.0), ("restart", 0.0), *samples(0.0, 0.1)]),
    ],
)
def test_what_rows_come_to(rows: list[Row | float], expected: list[tuple[str, float]]) -> None:
    assert events(rows) == expected


def test_a_run_that_begins_like_the_one_before_is_a_run_from_its_first_row_on() -> None:
    first = [row(0.1 * k) for k in range(20)]
    second = [row(0.1 * k, 0.0 if k < 5 else 1.0) for k in range(12)]
    found = events([*first, *second])
    assert found[20:25] == [("repeat", round(0.1 * k, 6)) for k in range(5)]
    assert found[25] == ("restart", 0.5)
    assert found[26:] == samples(*(round(0.1 * k, 6) for k in range(12)))


@pytest.mark.parametrize("length", [100, 6000])
def test_a_copy_of_the_whole_log_is_no_new_run(length: int) -> None:
    rows = [row(0.1 * k, float(k % 7)) for k in range(length)]
    found = events([*rows, *rows, row(0.1 * length)])
    assert [kind for kind, _ in found] == ["sample"] * length + ["repeat"] * length + ["sample"]


def test_random_glitches_cost_their_own_sample_only() -> None:
    """Of healthy rows, one in ten has a wrong time: all others are samples at their times, and nothing restarts."""
    for seed in range(50):
        rng = np.random.default_rng(seed)
        wrong = np.flatnonzero(rng.random(100) < 0.1)
        wrong = wrong[(wrong > 0) & (wrong < 99)]
        wrong = wrong[np.diff(wrong, prepend=-9) > 2]
        times = 0.1 * np.arange(100)
        given = times.copy()
        given[wrong] = rng.choice([1e3, -5.0, 0.05, 0.33], len(wrong)) + 0.1 * rng.integers(0, 50, len(wrong))
        found = events([row(time, float(k)) for k, time in enumerate(given)])
        kept = [time for kind, time in found if kind == "sample"]
        assert set(np.round(np.delete(times, wrong), 6)) <= set(kept), seed
        assert not any(kind == "restart" for kind, _ in found), seed
        gaps = sum(count for kind, count in found if kind == "missing")
        assert len(kept) + gaps == 100, seed


def test_a_saved_timeline_goes_on() -> None:
    rows = [row(0.1 * k) for k in range(30)]
    first, second = Timeline(0.1), Timeline(0.1)
    for item in rows:
        list(first.add(item))
    second.resume(first.state())
    assert [event.kind for item in (rows[3], rows[29], row(3.0)) for event in second.add(item)] == [
        "repeat",
        "repeat",
        "sample",
    ]
