"""Local time to UTC, through the hour that comes twice in autumn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from zoneinfo import ZoneInfo


def to_utc(
    dates: Sequence[datetime], rests: Sequence[int], where: Callable[[int], str], zone: str, in_order: bool = True
) -> tuple[list[datetime], list[str]]:
    """Dates of UTC (without a zone), and notes, from local ones in the order of their rows.

    The hour that comes twice is taken for the first one until time goes back inside it, then for the second one; a log
    that begins in it and leaves it without going back was in the second one.

    Parameters
    ----------
    dates : sequence of datetime
    rests : sequence of int
        What is to be added to each, less than a microsecond.
    where : callable
        Says where a date stands.
    zone : str
        IANA name.
    in_order : bool
        Rows are in order of time, which tells the two hours apart.

    Raises
    ------
    ValueError
        For a local time that does not exist, and for one that exists twice if rows are in no order.
    """
    info = ZoneInfo(zone)
    twice = [_comes_twice(date, info, where, i) for i, date in enumerate(dates)]
    if not in_order and any(twice):
        i = twice.index(True)
        raise ValueError(
            f"{where(i)}: {dates[i]} comes twice in {zone}, and rows in no order do not say which of both it is; "
            'expected rows in order of time (no order = "sort"), or stamps of UTC'
        )
    folds = [0] * len(dates)
    for i in range(1, len(dates)):
        if twice[i] and twice[i - 1]:
            folds[i] = folds[i - 1] or int((dates[i], rests[i]) < (dates[i - 1], rests[i - 1]))
    left = next((i for i, double in enumerate(twice) if not double), len(dates))
    notes = []
    if left == len(dates) and left and not any(folds):
        notes.append(f"all times are in the hour that comes twice in {zone}; they are taken for the first one")
    elif not any(folds[:left]):
        folds[:left] = [1] * left
    placed = (date.replace(tzinfo=info, fold=fold) for date, fold in zip(dates, folds, strict=True))
    return [date.astimezone(UTC).replace(tzinfo=None) for date in placed], notes


def _comes_twice(date: datetime, info: ZoneInfo, where: Callable[[int], str], i: int) -> bool:
    first = date.replace(tzinfo=info, fold=0)
    if first.utcoffset() == date.replace(tzinfo=info, fold=1).utcoffset():
        return False
    if first.astimezone(UTC).astimezone(info).replace(tzinfo=None) != date:
        raise ValueError(f"{where(i)}: there is no {date} in {info.key}, where the clock goes forward; another zone?")
    return True
