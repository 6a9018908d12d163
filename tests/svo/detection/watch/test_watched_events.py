"""``svo watch`` of a log that keeps its own times: each row is an event, to the alarms that ``svo detect`` finds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from svo import detect, read_log, verify
from svo.detection.watch.session import Session
from svo.detection.watch.timeline import EventTimeline
from svo.isolation import Alarm, write_alarms
from svo.plant.description import DescribedPlant
from tests.svo.detection.watch.test_timeline import row, samples
from tests.svo.logs.dialect.test_events import FILES, PLANT, folder_of, plant

pytestmark = pytest.mark.filterwarnings("ignore::svo.logs.columns.LogNote")


def table(folder: Path, broken_from: float = np.inf) -> list[str]:
    """The rows of one run in which a sensor that is not read has an empty cell."""
    found = read_log(folder_of(folder / "run", broken_from), plant(folder, FILES))
    cell = lambda value: "" if np.isnan(value) else f"{value!r}"  # noqa: E731
    rows = zip(found.time.tolist(), found.u[:, 0].tolist(), found.y.tolist(), strict=True)
    return ["time_s,force,position,speed", *(f"{t!r},{u!r},{cell(y[0])},{cell(y[1])}" for t, u, y in rows)]


def watched(session: Session, lines: list[str]) -> list[Alarm]:
    alarms = [alarm for line in lines for alarm in session.feed(line)]
    return alarms + [alarm for event in session.finish() for some in session.take(event) for alarm in some]


def in_file(alarms: list[Alarm], path: Path) -> bytes:
    write_alarms(path, alarms)
    return path.read_bytes()


def test_rows_lead_to_the_alarms_of_the_whole_log(tmp_path: Path) -> None:
    lines, cart = table(tmp_path, broken_from=3000.0), plant(tmp_path)
    idle = [*lines[:20], lines[19].split(",")[0] + "5," + lines[19].split(",")[1] + ",,", *lines[20:]]  # no event
    (tmp_path / "log.csv").write_text("\n".join(idle) + "\n", encoding="utf-8")
    log = read_log(tmp_path / "log.csv", cart)
    found = detect(cart, log)
    session = Session(cart, "stated", str(tmp_path / "log.csv"))
    alarms = watched(session, idle)
    assert found.alarms
    assert in_file(alarms, tmp_path / "watched.jsonl") == in_file(list(found.alarms), tmp_path / "found.jsonl")
    assert session.samples == len(log)
    assert session.counts.missing == session.counts.bad == session.counts.held == 0
    assert verify(tmp_path / "watched.jsonl", log, plant=cart).ok


def test_it_goes_on_from_a_saved_state_bit_for_bit(tmp_path: Path) -> None:
    lines, cart = table(tmp_path, broken_from=3000.0), plant(tmp_path)
    whole = watched(Session(cart, "stated", "log.csv"), lines)
    first, second = (Session(cart, "stated", "log.csv") for _ in range(2))
    early = [alarm for line in lines[:60] for alarm in first.feed(line)]
    arrays, rest = first.state()
    second.resume(arrays, rest)
    late = watched(second, lines[60:])
    assert in_file([*early, *late], tmp_path / "a.jsonl") == in_file(whole, tmp_path / "b.jsonl")


def test_one_wrong_time_is_a_bad_row_and_no_gap(tmp_path: Path) -> None:
    lines, cart = table(tmp_path), plant(tmp_path)
    cells = lines[30].split(",")
    broken = [*lines[:30], ",".join(["9e4", *cells[1:]]), *lines[31:]]
    session = Session(cart, "stated", "log.csv")
    assert watched(session, broken) == []
    assert (session.counts.bad, session.counts.runs, session.samples) == (1, 1, len(lines) - 2)


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ([0.0, 0.01, 0.35, 0.36], samples(0.0, 0.01, 0.35, 0.36)),
        ([0.0, 20.0, 45.0, 80.0], samples(0.0, 20.0, 45.0, 80.0)),  # rare events: each confirms the one before
        ([0.0, 900.0, 0.2, 0.3], [*samples(0.0), ("bad", 900.0), *samples(0.2, 0.3)]),
        ([7.0, 7.1, 0.0, 0.05], [*samples(7.0, 7.1), ("restart", 0.0), *samples(0.0, 0.05)]),
        ([7.0, 7.1, 0.0, 7.3], [*samples(7.0, 7.1), ("bad", 0.0), *samples(7.3)]),
        ([0.0, 0.1, 0.25, 0.1, 0.3], [*samples(0.0, 0.1, 0.25), ("repeat", 0.1), *samples(0.3)]),
    ],
)
def test_what_rows_come_to(times: list[float], expected: list[tuple[str, float]]) -> None:
    timeline, found = EventTimeline(0.1), []
    for time in times:
        found += timeline.add(row(time))
    found += timeline.finish()
    assert [(event.kind, round(event.row.time, 6)) for event in found] == expected


def test_readings_whose_stamp_is_off_need_the_inputs_that_follow(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"jitter.*svo detect"):
        Session(_with_jitter(tmp_path), "stated", "log.csv")


def _with_jitter(folder: Path) -> DescribedPlant:
    return plant(folder, text=PLANT.replace("w = [0.1]", "w = [0.1]\njitter = 0.01"))
