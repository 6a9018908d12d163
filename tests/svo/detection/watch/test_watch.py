from __future__ import annotations

import io
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from benchmarks.live_view import follow
from svo import ConstrainedZonotopeObserver, PolytopeObserver, WindowObserver
from svo.cli import app
from svo.detection.detect import detect
from svo.detection.watch.follow import FileLines
from svo.detection.watch.lines import Notice
from svo.detection.watch.session import Session
from svo.detection.watch.view import LiveView, PlainView, view_of
from svo.detection.watch.watch import watch
from svo.isolation.alarms import Alarm, alarm_line, verify_alarms
from svo.logs.file import read_log
from svo.plant.description import read_description

CART = Path(__file__).parents[4] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")


def session_over(lines: list[str]) -> tuple[Session, list[Alarm]]:
    session = Session(read_description(CART), "stated", "log.csv")
    return session, [alarm for line in lines for alarm in session.feed(line)]


def test_it_says_what_detection_on_the_finished_log_says() -> None:
    plant = read_description(CART)
    found = detect(plant, read_log(LOG, plant.columns, plant.Ts), "stated")
    session, alarms = session_over(LOG.read_text().splitlines())
    status = session.status()
    assert status is not None
    assert (status.samples, status.time) == (80, 7.9)
    assert [(a.observer, a.sample, a.time) for a in alarms] == [
        (a.observer, a.sample, a.time) for a in sorted(found.alarms, key=lambda a: session.names.index(a.observer))
    ]
    assert status.verdict.alive == found.alive == tuple(status.boxes) == ("sensor",)
    assert status.verdict.isolated_at == found.record.isolated_at
    assert all(alarm.certificate.verify() for alarm in alarms)


def test_a_model_that_recovered_can_be_falsified_again(tmp_path: Path) -> None:
    """Two outliers, and a bank that forgets a falsification after five consistent samples."""
    path = tmp_path / "cart.toml"
    path.write_text(CART.read_text().partition("[faults.sensor]")[0] + "[bank]\nrecovery = 5\n")
    session = Session(read_description(path), "stated", "log.csv")
    lines = LOG.read_text().splitlines()
    for k in (20, 35):
        cells = lines[k + 1].split(",")
        lines[k + 1] = ",".join([*cells[:2], "9.0", *cells[3:]])
    alarms = [alarm for line in lines[:46] for alarm in session.feed(line)]
    assert [(alarm.observer, alarm.sample) for alarm in alarms] == [("nominal", 20), ("nominal", 35)]
    status = session.status()
    assert status is not None
    assert (status.verdict.state, dict(status.dead)) == ("nominal", {})
    assert all(alarm.certificate.verify() for alarm in alarms)


@pytest.mark.parametrize("kind", [WindowObserver, PolytopeObserver, ConstrainedZonotopeObserver])
def test_a_watch_goes_on_after_an_alarm_of_every_kind_of_observer(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    plant, screen, kept = read_description(CART), io.StringIO(), list[Alarm]()
    monkeypatch.setattr(type(plant), "_observer", lambda self, model: kind(model, self.initial))
    session, lines = Session(plant, "stated", "log.csv"), FileLines(LOG, until_end=True)
    watch(lines, session, PlainView(Console(file=screen, width=200), session), keep=kept.append, save=session.state)
    said = re.findall(r"its certificate over samples? ([0-9 to]+) (holds|DOES NOT)", screen.getvalue())
    assert [holds for _, holds in said] == ["holds"] * 2
    assert {window.split()[-1] for window, _ in said} == {str(alarm.sample) for alarm in kept}
    assert session.samples == 80


def test_the_bounds_are_those_of_the_observer_and_hold_the_true_state() -> None:
    lines = LOG.read_text().splitlines()
    session, _ = session_over(lines[:30])
    status = session.status()
    assert status is not None
    assert set(status.boxes) == {"nominal", "sensor", "motor"}
    truth = np.array([float(cell) for cell in lines[29].split(",")[3:]])
    for lower, upper in status.boxes.values():
        assert np.all((lower <= truth) & (truth <= upper))


def test_a_missing_measurement_and_a_blank_line_are_no_errors() -> None:
    header, first, second, *_ = LOG.read_text().splitlines()
    force, position = second.split(",")[1:3]
    session, _ = session_over([header, first, "", second.replace(f"{force},{position}", f"{force},")])
    status = session.status()
    assert status is not None
    assert (status.samples, status.verdict.state) == (2, "nominal")


HEADER = "time_s,force,position"


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["time_s,force"], "log.csv has no column 'position'"),
        (["time_s;force;position"], "is split by semicolons"),
        (['time_s,"force'], "line 1: is not a CSV text file"),
    ],
)
def test_a_log_that_begins_without_its_header_is_one_error(rows: list[str], expected: str) -> None:
    with pytest.raises(ValueError, match=expected):
        session_over(rows)


@pytest.mark.parametrize(
    ("rows", "expected", "samples", "missing"),
    [
        (["0.0,0,0", "", "0.1,x,0", "0.2,0,0"], "line 4, column 'force': 'x' is not a finite number", 3, 1),
        (["0.0,0,0", "0.1,0,x", "0.2,0,0"], "line 3, column 'position': 'x' is not a finite number", 3, 1),
        (["0.0,0,0", "0.1,,0", "0.2,0,0"], "line 3, column 'force': the cell is empty or NaN", 3, 1),
        (["0.0,0,0", "0.1,0,inf", "0.2,0,0"], "line 3, column 'position': 'inf' is not a finite number", 3, 1),
        (["0.0,0,0", "0.1,0", "0.2,0,0"], "line 3: 2 cells; expected 3", 3, 1),
        (["0.0,0,0", '0.1,0,"0', "0.2,0,0"], "line 3: is not a CSV text file", 3, 1),
        (["0.0,0,0", "%%%", "0.2,0,0", "0.3,0,0"], "line 3: 1 cells; expected 3", 4, 1),
        (["0.0,0,0", "x,0,0", "0.2,0,0"], "line 3, column 'time_s': 'x' is not a finite number", 3, 1),
        (["0.0,0,0", "0.7,0,0", "0.2,0,0"], "line 3, column 'time_s': .*expected the model's sampling time", 3, 1),
        (["0.0,0,0", "0.0,0,0.1", "0.1,0,0"], "line 3, column 'time_s': .*expected increasing times", 2, 0),
        (["0.0,0,0", "100,0,0", "200,0,0"], "divide it by 1000", 1, 0),
    ],
)
def test_a_bad_line_is_reported_and_its_readings_are_missing(
    rows: list[str], expected: str, samples: int, missing: int
) -> None:
    session, alarms = session_over([HEADER, *rows])
    for event in session.finish():
        list(session.take(event))
    bad = [note for note in session.take_notes() if note.startswith("bad line")]
    assert re.search(expected, bad[0]), bad
    assert "log.csv" in bad[0]
    assert (session.samples, session.counts.missing, alarms) == (samples, missing, [])


def test_bad_lines_are_all_counted_and_reported_ever_less_often() -> None:
    session, _ = session_over([HEADER, "0.0,1,2", *["x"] * 1000])
    reported = [int(note.split()[2].rstrip(":")) for note in session.take_notes()]
    assert reported == [*range(1, 11), 16, 32, 64, 128, 256, 512]
    assert session.counts.bad == 1000


def test_bad_lines_change_nothing_but_their_own_readings() -> None:
    """The alarms are those of the log in which these readings are missing."""
    lines = LOG.read_text().splitlines()
    for seed in range(20):
        rng = np.random.default_rng(seed)
        damaged, missing = list(lines), list(lines)
        for k in rng.choice(np.arange(2, 81), 8, replace=False):
            time, force, position, *rest = lines[k].split(",")
            missing[k] = ",".join([time, force, "", *rest])
            damaged[k] = ",".join([time, force, rng.choice(["x", "1e999", "--", "NaN0", f"{position}_0"]), *rest])
        right, wrong = (session_over(text)[1] for text in (missing, damaged))
        assert [alarm_line(alarm) for alarm in wrong] == [alarm_line(alarm) for alarm in right]


def test_a_gap_of_time_is_samples_without_readings() -> None:
    """The alarms are those of the log in which the rows stand without readings, the input held."""
    lines = LOG.read_text().splitlines()
    gap, filled = [*lines[:21], *lines[25:]], list(lines)
    force = lines[20].split(",")[1]
    for k in range(21, 25):
        filled[k] = ",".join([lines[k].split(",")[0], force, "", "", ""])
    (first, found), (second, expected) = session_over(gap), session_over(filled)
    assert [(a.observer, a.sample) for a in found] == [(a.observer, a.sample) for a in expected]
    assert first.samples == second.samples == 80
    assert (first.counts.missing, first.counts.held) == (4, 4)
    assert all(alarm.certificate.verify() for alarm in found)


def test_a_repeated_header_is_no_row() -> None:
    lines = LOG.read_text().splitlines()
    session, alarms = session_over([*lines[:30], lines[0], *lines[30:]])
    assert (session.samples, session.counts.bad, len(alarms)) == (80, 0, 2)


def test_a_new_file_may_have_its_columns_in_another_order_or_no_header() -> None:
    lines = LOG.read_text().splitlines()
    turned = [",".join(reversed(line.split(","))) for line in lines]
    for second in ([turned[0], *turned[41:]], lines[41:]):
        session, alarms = session_over(lines[:41])
        session.feed(Notice("a new file", new_file=True))
        alarms += [alarm for line in second for alarm in session.feed(line)]
        assert (session.samples, session.counts.bad, len(alarms)) == (80, 0, 2)


def test_a_new_file_with_a_wrong_header_is_not_read_under_the_old_one() -> None:
    lines = LOG.read_text().splitlines()
    session, _ = session_over(lines[:41])
    session.feed(Notice("a new file", new_file=True))
    turned = [",".join(reversed(line.split(","))) for line in lines]
    for line in [turned[0].replace("position", "place"), *turned[41:60]]:
        assert session.feed(line) == []
    assert (session.samples, session.counts.bad) == (40, 20)
    for line in [lines[0], *lines[60:]]:  # and a right one makes it good
        session.feed(line)
    assert (session.samples, session.counts.missing) == (80, 19)


def test_a_clock_that_is_started_again_is_a_new_run() -> None:
    """The second run has the alarms of the first, as if it had been watched alone."""
    lines = LOG.read_text().splitlines()
    cells = [line.split(",") for line in lines[1:]]
    second = [",".join([time, force, repr(float(position) + 0.0001), *rest]) for time, force, position, *rest in cells]
    session, alarms = session_over([*lines, *second])
    alone, expected = session_over([lines[0], *second])
    assert [alarm_line(alarm) for alarm in alarms[2:]] == [alarm_line(alarm) for alarm in expected]
    assert session.counts.runs == 2
    assert any("the clock went from 7.9 s to" in note and "a new run begins" in note for note in session.take_notes())
    status, other = session.status(), alone.status()
    assert status is not None
    assert other is not None
    assert status.verdict.alive == other.verdict.alive


def test_a_sample_that_a_bank_refuses_does_not_end_the_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = LOG.read_text().splitlines()
    session, _ = session_over(lines[:20])
    step = type(session._bank).step
    refused = []

    def refuse_once(bank: Any, *arguments: Any, **named: Any) -> Any:
        if not refused:
            refused.append(True)
            raise ValueError("u is too large")
        return step(bank, *arguments, **named)

    monkeypatch.setattr(type(session._bank), "step", refuse_once)
    for line in lines[20:]:
        session.feed(line)
    assert (session.counts.bad, session.counts.runs) == (1, 2)
    assert any("log.csv, line 21: u is too large" in note for note in session.take_notes())


def test_the_command_reads_a_file_to_its_end_and_keeps_alarms_that_verify(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["watch", str(CART), str(LOG), "--until-end", "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert (
        "ALARM 5 s: nominal is falsified; its certificate over samples 40 to 50 holds in exact arithmetic"
        in result.stdout
    )
    assert "isolated: sensor" in result.stdout.splitlines()[-1]
    checks = verify_alarms(tmp_path / "alarms.jsonl", read_log(LOG, read_description(CART).columns, 0.1))
    assert [check.ok for check in checks] == [True, True]
    full = CliRunner().invoke(app, ["verify", str(tmp_path / "alarms.jsonl"), "--full", str(LOG)])
    assert full.exit_code == 0, full.output


def test_the_command_reads_standard_input_to_its_end() -> None:
    command = [sys.executable, "-m", "svo", "watch", str(CART), "-"]
    done = subprocess.run(command, input=LOG.read_text(), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1].startswith("End of the input: 80 samples")


def test_a_bad_row_is_a_note_and_the_command_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(LOG.read_text().replace("0.2,", "0.7,", 1))
    result = CliRunner().invoke(app, ["watch", str(CART), str(path), "--until-end"])
    assert result.exit_code == 0, result.output
    assert f"note: bad line 1: {path}, line 4, column 'time_s': time goes from 0.1 s to 0.7 s" in result.stdout
    assert "80 samples, 1 of them without a reading, 1 with an input taken to be held, 1 bad lines" in result.stdout
    assert "isolated: sensor" in result.stdout.splitlines()[-1]


def test_a_line_without_its_end_is_no_sample_at_the_end_of_a_watch(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(LOG.read_text()[: LOG.read_text().index("\n4.7,")] + "\n4.7,0.694,2")
    result = CliRunner().invoke(app, ["watch", str(CART), str(path), "--until-end"])
    assert result.exit_code == 0
    assert f"note: {path}: the last line (49) has no end and was left out" in result.stdout
    assert "ALARM" not in result.stdout
    assert "End of the input: 47 samples" in result.stdout


@pytest.mark.parametrize("text", ["", "\n\n", "time_s,force,position\n"])
def test_a_log_that_ends_without_a_sample_is_an_error(tmp_path: Path, text: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    result = CliRunner().invoke(app, ["watch", str(CART), str(path), "--until-end"])
    assert result.exit_code == 1
    assert f"error: {path} ended without a sample; expected a header line" in result.stderr


def test_an_interrupt_is_a_clean_end(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(LOG.read_text())
    command = [sys.executable, "-m", "svo", "watch", str(CART), str(path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    seen = ""
    while "isolated" not in seen:
        seen = process.stdout.readline()
        assert seen
    process.send_signal(signal.SIGINT)
    rest, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert rest.splitlines()[-1].startswith("Interrupted: ")
    assert rest.splitlines()[-1].endswith("isolated: sensor.")


def test_in_a_terminal_there_is_a_table_with_models_units_and_alarms() -> None:
    screen = io.StringIO()
    console = Console(file=screen, force_terminal=True, width=140, color_system=None)
    session = Session(read_description(CART), "stated", "log.csv")
    view = view_of(console, session)
    assert isinstance(view, LiveView)
    lines = FileLines(LOG, until_end=True)
    watch(lines, session, view)
    shown = screen.getvalue()
    for words in (
        "speed [m/s]",
        "falsified at 5 s",
        "isolated: sensor",
        "ALARM 5 s: motor",
        "waiting for the first",
    ):
        assert words in shown
    assert isinstance(view_of(Console(file=io.StringIO()), session), PlainView)


def test_a_narrow_terminal_shows_the_bounds_below_the_models() -> None:
    screen = io.StringIO()
    session, _ = session_over(LOG.read_text().splitlines())
    view = LiveView(Console(file=screen, force_terminal=True, width=50, color_system=None), session)
    view.close(session.status(), "End")
    shown = screen.getvalue()
    for words in ("falsified at 5 s", "bounds by sensor", "speed [m/s]", "[-0.9714, 1.327]"):
        assert words in shown
    assert "…" not in shown


def test_at_100_hz_it_does_not_fall_behind() -> None:
    """Another process writes a flight of the Eclipse; the lag goes from its clock to ours."""
    live = follow(300, terminal=False)
    assert (live.status.samples, live.status.verdict.fault) == (300, "elevator")
    assert np.median(live.lags[-30:]) < 1.0  # of 3 s: nothing piles up; lags themselves are of `benchmarks`
