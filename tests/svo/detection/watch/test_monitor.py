"""The loop of a watch: silence, signals, threads, what is stored before it is shown, a process that is killed."""

from __future__ import annotations

import io
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest
from rich.console import Console
from rotating_logger import Logger
from typer.testing import CliRunner

from svo import detect, read_log
from svo.cli import app
from svo.detection.watch.follow import FileLines
from svo.detection.watch.lines import Line
from svo.detection.watch.rows import RowReader
from svo.detection.watch.session import Session
from svo.detection.watch.silence import Silence
from svo.detection.watch.timeline import Timeline
from svo.detection.watch.view import PlainView
from svo.detection.watch.watch import watch
from svo.isolation.alarms import Alarm
from svo.plant.description import read_description

CART = Path(__file__).parents[4] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")
LINES = LOG.read_text().splitlines()
PLANT = read_description(CART)


def test_silence_is_said_once_and_again_when_data_return() -> None:
    now = [0.0]
    silence = Silence(5.0, clock=lambda: now[0])

    def says(seconds: float, has_data: bool) -> str | None:
        now[0] = seconds
        return silence.says(has_data)

    assert [says(t, False) for t in (0.0, 4.9)] == [None, None]
    assert says(5.0, False) == "no data for 5.0 s"
    assert [says(t, False) for t in (5.1, 60.0)] == [None, None]
    assert says(61.5, True) == "data again, after 61.5 s without any"
    assert [says(62.0, True), says(66.9, False)] == [None, None]
    assert says(67.0, False) == "no data for 5.0 s"


@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf"])
def test_a_silence_that_is_no_time_is_refused(value: str) -> None:
    result = CliRunner().invoke(app, ["watch", str(CART), str(LOG), "--silence", value])
    assert result.exit_code == 2
    assert "is not a finite number > 0" in result.stderr


def test_all_alarms_of_a_sample_are_stored_before_any_is_shown() -> None:
    stored: list[Alarm] = []

    class BrokenView(PlainView):
        def alarm(self, alarm: Alarm) -> None:
            raise UnicodeEncodeError("ascii", "体", 0, 1, "the terminal cannot say it")

    session = Session(PLANT, "stated", "log.csv")
    with pytest.raises(UnicodeEncodeError):
        watch(
            FileLines(LOG, until_end=True),
            session,
            BrokenView(Console(file=io.StringIO()), session),
            keep=stored.append,
        )
    assert [alarm.observer for alarm in stored] == ["nominal", "motor"]


def test_a_watch_in_a_thread_is_ended_by_its_event(tmp_path: Path) -> None:
    logger, stop, screen = Logger(tmp_path / "log.csv", LINES), Event(), io.StringIO()
    session, failed = Session(PLANT, "stated", "log.csv"), []
    lines = FileLines(tmp_path / "log.csv", until_end=False)
    handlers = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)

    def run() -> None:
        try:
            watch(lines, session, PlainView(Console(file=screen), session), stop=stop)
        except BaseException as error:
            failed.append(error)

    thread = Thread(target=run)
    thread.start()
    logger.write(80)
    wait_for(lambda: session.samples == 80)
    stop.set()
    thread.join(timeout=20.0)
    assert not thread.is_alive()
    assert failed == []
    assert screen.getvalue().splitlines()[-1].startswith("Interrupted: 80 samples")
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == handlers


def test_a_gap_of_a_million_samples_can_be_interrupted(tmp_path: Path) -> None:
    stop, session = Event(), Session(PLANT, "stated", "log.csv")
    (tmp_path / "log.csv").write_text(
        "\n".join([*LINES[:30], *(f"{100000 + 0.1 * k:.1f},0,0,0,0" for k in range(3))]) + "\n"
    )
    saved = []

    class StoppingView(PlainView):
        def show(self, status: Callable[[], Any], waiting: int) -> None:
            if session.samples > 100:
                stop.set()

    view = StoppingView(Console(file=io.StringIO()), session)
    watch(FileLines(tmp_path / "log.csv", until_end=True), session, view, stop=stop, save=lambda: saved.append(1))
    assert session.samples == 101
    assert not saved  # the state of before the gap stays


def test_a_state_that_cannot_be_saved_is_a_note() -> None:
    session, screen = Session(PLANT, "stated", "log.csv"), io.StringIO()

    def full() -> None:
        raise OSError(28, "No space left on device")

    view = PlainView(Console(file=screen, width=200), session)
    watch(FileLines(LOG, until_end=True), session, view, save=full)
    assert "note: the state could not be saved: No space left on device" in screen.getvalue()
    assert session.samples == 80


def test_a_thousand_rows_a_second_take_little_time(tmp_path: Path) -> None:
    """Following, reading and placing rows; 5000 of them, written 10 at a time."""
    path, found = tmp_path / "log.csv", 0
    path.write_text("time_s,force,position\n")
    lines, timeline = FileLines(path, until_end=False), Timeline(0.001)
    bad: list[str] = []
    reader = RowReader("log.csv", PLANT.columns, bad.append)
    begun = time.process_time()
    with path.open("a", buffering=1) as file:
        for k in range(0, 5000, 10):
            file.write("".join(f"{(k + i) / 1000!r},0.1,0.2\n" for i in range(10)))
            for item in lines.read(0.0) or []:
                assert isinstance(item, Line)
                row = reader.row(item)
                if row is not None:
                    found += sum(event.kind == "sample" for event in timeline.add(row))
    assert (found, bad) == (5000, [])
    assert time.process_time() - begun < 2.5  # half of the time that they would take to come


def wait_for(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.02)


def started(tmp_path: Path, said: Path) -> subprocess.Popen[bytes]:
    arguments = [CART, "log.csv", "--out", "out", "--state", "state", "--silence", "0.3"]
    with said.open("ab") as file:
        command = [sys.executable, "-m", "svo", "watch", *map(str, arguments)]
        return subprocess.Popen(command, cwd=tmp_path, stdout=file, stderr=subprocess.STDOUT)


def test_a_process_that_is_killed_and_started_again_loses_and_invents_nothing(tmp_path: Path) -> None:
    """kill -9 between two alarms' samples, a rotation while nobody watches, silence, and a clean end by SIGTERM."""
    logger, said = Logger(tmp_path / "log.csv", LINES), tmp_path / "said"
    logger.write(30)
    process = started(tmp_path, said)
    try:
        wait_for(lambda: b"no data for" in said.read_bytes())
        logger.write(22, half=5)  # both alarms
        wait_for(lambda: said.read_bytes().count(b"ALARM 5 s") == 2)
        assert b"data again, after" in said.read_bytes()
        process.kill()
        process.wait()
        logger.end_half()
        logger.rename()
        logger.write(80)
        process = started(tmp_path, said)
        wait_for(lambda: b"7.900 s  isolated: sensor" in said.read_bytes())
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=30) == 0
    finally:
        process.kill()
        process.wait()
    text = said.read_text()
    assert "Traceback" not in text
    assert "Interrupted: 80 samples" in text.splitlines()[-1]
    found = detect(PLANT, replace(read_log(LOG, PLANT), source="log.csv"))
    assert len((tmp_path / "out" / "alarms.jsonl").read_text().splitlines()) == len(found.alarms) == 2
    full = CliRunner().invoke(app, ["verify", str(tmp_path / "out" / "alarms.jsonl"), "--full", str(LOG)])
    assert full.exit_code == 0, full.output
