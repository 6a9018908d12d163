from __future__ import annotations

import io
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

from benchmarks.live_view import follow
from svo.alarms import Alarm, verify_alarms
from svo.cli import app
from svo.description import read_description
from svo.detect import detect
from svo.log_file import read_log
from svo.watch.lines import FileLines
from svo.watch.session import Session
from svo.watch.view import LiveView, PlainView, view_of
from svo.watch.watch import watch

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
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


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["time_s,force"], "log.csv has no column 'position'"),
        ([], ""),
        (
            ["time_s,force,position", "0.0,1,2", "0.3,1,2"],
            "line 3, column 'time_s': .*expected the model's sampling time",
        ),
        (["time_s,force,position", "0.0,1,2", "0.0,1,2"], "line 3, column 'time_s': .*expected increasing times"),
        (["time_s,force,position", "0.0,1,2", "", "0.1,x,2"], "line 4, column 'force': 'x' is not a finite number"),
        (["time_s,force,position", "0.0,1"], "line 2: 2 cells; expected 3"),
        (["time_s,force,position", '0.0,1,"2'], "line 2: is not a CSV text file"),
    ],
)
def test_a_bad_row_is_one_error_with_its_line(rows: list[str], expected: str) -> None:
    if not rows:
        assert session_over(rows)[0].status() is None
        return
    with pytest.raises(ValueError, match=expected):
        session_over(rows)


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


def test_a_bad_row_ends_the_command_with_one_line(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(LOG.read_text().replace("0.2,", "0.7,", 1))
    result = CliRunner().invoke(app, ["watch", str(CART), str(path), "--until-end"])
    assert result.exit_code == 1
    assert [line for line in result.stderr.splitlines() if line.startswith("error:")] == [
        result.stderr.splitlines()[-1]
    ]
    assert "Stopped by an error" in result.stdout
    assert "Traceback" not in result.output


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
        "true_speed [m/s]",
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
    for words in ("falsified at 5 s", "bounds by sensor", "true_speed [m/s]", "[-0.9714, 1.327]"):
        assert words in shown
    assert "…" not in shown


def test_at_100_hz_it_does_not_fall_behind() -> None:
    """Another process writes a flight of the Eclipse; the lag goes from its clock to ours."""
    live = follow(300, terminal=False)
    assert (live.status.samples, live.status.verdict.fault) == (300, "elevator")
    assert np.median(live.lags) < 0.05
    assert np.median(live.lags[-30:]) < 0.05  # nothing piles up
