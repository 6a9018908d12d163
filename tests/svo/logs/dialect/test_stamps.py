"""Stamps become exact times."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from svo.logs.dialect.numbers import Marks
from svo.logs.dialect.rules import Times
from svo.logs.dialect.stamps import PICO, Stamps, moment, stamps_of


def stamps(*cells: str, rule: Times, decimal: str = ".") -> Stamps:
    return stamps_of(cells, lambda i: f"line {i + 1}", rule, Marks(decimal))


def seconds(cell: str, **rule: object) -> float:
    return stamps(cell, rule=Times(**rule)).picoseconds[0] / PICO  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("cell", "rule", "value"),
    [
        ("1.5", {}, 1.5),
        ("1500", {"unit": "ms"}, 1.5),
        ("15000000", {"unit": "100ns"}, 1.5),
        ("1500000000", {"unit": "ns"}, 1.5),
        ("0.025", {"unit": "min"}, 1.5),
        ("2", {"unit": "day", "scale": 1e-6}, 0.1728),
        ("0:01:02.5", {"format": "duration"}, 62.5),
        ("01:02", {"format": "duration"}, 62.0),
        ("1.02:03:04.5", {"format": "duration"}, 93784.5),
        ("0 days 00:00:00.100000", {"format": "duration"}, 0.1),
        ("-00:00:01", {"format": "duration"}, -1.0),
        ("0.1 sec", {"format": "duration"}, 0.1),
        ("2 min 3,5 s", {"format": "duration"}, 123.5),
        ("250 µs", {"format": "duration"}, 250e-6),
        ("PT1M0.5S", {"format": "duration"}, 60.5),
        ("1970-01-01T00:00:01.25Z", {"format": "iso"}, 1.25),
        ("1970-01-01 02:00:01,25+02:00", {"format": "iso"}, 1.25),
        ("1970-01-01 00:00:01", {"format": "iso"}, 1.0),
        ("01.01.1970 00:00:01,5", {"format": "%d.%m.%Y %H:%M:%S,%f"}, 1.5),
        ("01.01.1970 00:00:01", {"format": "%d.%m.%Y %H:%M:%S,%f"}, 1.0),
        ("1/1/1970 12:00:01.5 AM", {"format": "%m/%d/%Y %I:%M:%S.%f %p"}, 1.5),
    ],
)
def test_a_stamp_is_read_as_it_is_stated(cell: str, rule: dict[str, object], value: float) -> None:
    assert seconds(cell, **rule) == value


def test_nanoseconds_since_1970_lose_no_digit() -> None:
    first, second = stamps("1531943810861316819", "1531943810861316820", rule=Times(unit="ns")).picoseconds
    assert second - first == 1000
    cells = "2018-07-18T19:56:50.861316819Z", "2018-07-18T19:56:50.861316820Z"
    assert stamps(*cells, rule=Times(format="iso")).picoseconds == [first, second]
    rule = Times(format="%d/%m/%Y %H:%M:%S.%f", zone="UTC")
    cells = "18/07/2018 19:56:50.861316819", "18/07/2018 19:56:50.861316820"
    assert stamps(*cells, rule=rule).picoseconds == [first, second]


@given(st.integers(0, 4 * 10**18), st.sampled_from([("ns", 1000), ("100ns", 10**5), ("us", 10**6), ("ms", 10**9)]))
def test_whole_stamps_are_exact(stamp: int, unit: tuple[str, int]) -> None:
    assert stamps(str(stamp), rule=Times(unit=unit[0])).picoseconds == [stamp * unit[1]]


@pytest.mark.parametrize(
    ("cell", "rule", "words"),
    [
        ("14.03.2025 10:15:00,1", Times(), '"%d.%m.%Y %H:%M:%S,%f"'),
        ("2025-03-14T10:15:00.1Z", Times(), 'format = "iso"'),
        ("00:00:01.5", Times(), 'format = "duration"'),
        ("4/3/2025 10:15:00", Times(), "04 March 2025 or 03 April 2025"),
        ("14-Mar-25 10:15:00.000", Times(), '"%d-%b-%y %H:%M:%S.%f"'),
        ("4/3/2025", Times(format="iso"), '"%d/%m/%Y" or format = "%m/%d/%Y"'),
        ("50 rows exported", Times(), "skip"),
        ("", Times(format="iso"), "the empty cell"),
        ("soon", Times(format="duration"), "a duration"),
        ("12 parsecs", Times(format="duration"), "a duration"),
    ],
)
def test_a_stamp_that_is_none_says_what_it_may_be(cell: str, rule: Times, words: str) -> None:
    with pytest.raises(ValueError, match="line 1: ") as caught:
        stamps(cell, rule=rule)
    assert words in str(caught.value)


def test_some_dates_with_a_zone_and_some_without_are_an_error() -> None:
    with pytest.raises(ValueError, match="line 2: some dates say their zone and some do not"):
        stamps("2025-03-14T10:15:00Z", "2025-03-14T10:15:01", rule=Times(format="iso"))


def test_days_of_a_spreadsheet_are_local_dates() -> None:
    rule = Times(unit="day", epoch=datetime(1899, 12, 30), zone="Europe/Berlin")
    assert moment(stamps("45730.5", rule=rule).picoseconds[0]) == "2025-03-14 11:00:00"


# -- zones -----------------------------------------------------------------------------------------------------------

BERLIN = ZoneInfo("Europe/Berlin")


@given(st.integers(-7200, 7200), st.integers(60, 1800), st.integers(2, 12))
def test_local_time_over_the_end_of_summer_time_goes_on(start: int, step: int, rows: int) -> None:
    """Against the true times, whenever the log begins and however it steps, where they can be told."""
    change = datetime(2025, 10, 26, 1, tzinfo=UTC)
    true = [change + timedelta(seconds=start + k * step) for k in range(rows)]
    local = [time.astimezone(BERLIN).replace(tzinfo=None) for time in true]
    # All in the first or all in the second of the two hours: nobody can tell.
    inside = [abs((time - change).total_seconds() + 0.5) < 3600 for time in true]
    sides = {time < change for time in true}
    if all(inside) and len(sides) == 1:
        return
    rule = Times(format="iso", zone="Europe/Berlin")
    found = stamps(*(time.isoformat() for time in local), rule=rule)
    assert found.picoseconds == [round(time.timestamp()) * PICO for time in true]


def test_local_time_that_nobody_had_is_an_error() -> None:
    with pytest.raises(ValueError, match="line 1: there is no 2025-03-30 02:30:00 in Europe/Berlin"):
        stamps("2025-03-30 02:30:00", rule=Times(format="iso", zone="Europe/Berlin"))


def test_a_log_inside_the_hour_that_comes_twice_is_noted() -> None:
    found = stamps("2025-10-26 02:30:00", "2025-10-26 02:30:01", rule=Times(format="iso", zone="Europe/Berlin"))
    assert "taken for the first" in found.notes[0]
