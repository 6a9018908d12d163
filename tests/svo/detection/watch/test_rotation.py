"""However a log is rotated, cut in pieces and watched from a saved state, the alarms are those of the whole log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from rotating_logger import Logger

from svo import detect, read_log
from svo.detection.alarm_folder import watch_folder
from svo.detection.watch.follow import FileLines
from svo.detection.watch.session import Session, identity_of
from svo.detection.watch.state import resume_state, save_state
from svo.isolation.alarms import alarm_line
from svo.plant.description import read_description

CART = Path(__file__).parents[4] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")
LINES = LOG.read_text().splitlines()
PLANT = read_description(CART)


def expected() -> list[str]:
    found = detect(PLANT, replace(read_log(LOG, PLANT), source="log.csv"))
    return sorted(alarm_line(alarm) for alarm in found.alarms)


EXPECTED = expected()


@dataclass
class Watch:
    """A watch that polls when it is told to, and can be killed."""

    folder: Path
    notes: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.log, self.state = self.folder / "log.csv", self.folder / "state"
        self.identity = identity_of(PLANT, "stated", str(self.log))
        self.begin()

    def begin(self) -> None:
        self.lines = FileLines(self.log, False, clock=lambda: 0.0)
        self.session = Session(PLANT, "stated", str(self.log))
        if self.state.exists():
            resume_state(self.state, self.session, self.lines, self.identity)

    def poll(self, reads: int = 1000) -> None:
        """Read until nothing comes."""
        with watch_folder(self.folder / "alarms", self.identity) as folder:
            for _ in range(reads):
                found = self.lines.read(0.0)
                if not found:
                    break
                for item in found:
                    for alarm in self.session.feed(item):
                        folder.add(alarm)
        self.notes += self.session.take_notes()

    def save(self) -> None:
        if not self.session.waits:
            save_state(self.state, self.session, self.lines, self.identity)

    def kill(self) -> None:
        """What was done since the last state is forgotten; the alarms are not."""
        self.lines.close()
        self.begin()

    def alarms(self) -> list[str]:
        return sorted((self.folder / "alarms" / "alarms.jsonl").read_text().splitlines(keepends=True))


WAYS: dict[str, Callable[[Logger], None]] = {
    "rename": lambda logger: logger.rename(),
    "rename with the old one written on": lambda logger: logger.rename_late(),
    "copytruncate": lambda logger: logger.copytruncate(),
    "copytruncate, longer at once": lambda logger: logger.copytruncate_and_fill(60),
    "replaced by a shorter file": lambda logger: logger.replace(3),
    "replaced by a longer file": lambda logger: logger.replace(45),
    "written anew with the same beginning": lambda logger: logger.write_anew(12),
    "a file of the last rows": lambda logger: logger.keep_the_last(10, 4),
    "deleted and made again": lambda logger: (logger.delete(), logger.write_anew(0)),  # type: ignore[func-returns-value]
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("kills", [False, True])
def test_no_way_of_rotation_loses_or_invents_an_alarm(tmp_path: Path, way: str, kills: bool) -> None:
    logger = Logger(tmp_path / "log.csv", LINES)
    watch = Watch(tmp_path)
    logger.write(30)
    watch.poll()
    watch.save()
    if way.startswith("written anew"):
        logger.write(7)
    if kills:
        watch.poll()
    WAYS[way](logger)
    if kills:
        watch.kill()
    watch.poll()
    logger.write(80)
    watch.poll()
    assert watch.alarms() == EXPECTED
    counts = watch.session.counts
    assert (watch.session.samples, counts.missing, counts.bad, counts.runs) == (80, 0, 0, 1)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("seed", range(5))
def test_random_rotation_and_restarts(tmp_path: Path, seed: int, end: str) -> None:
    rng = np.random.default_rng([seed, len(end), ord(end[0])])
    logger = Logger(tmp_path / "log.csv", LINES, end)
    watch = Watch(tmp_path)
    while not logger.is_done:
        logger.write(int(rng.integers(0, 12)), int(rng.integers(0, 20)))
        watch.poll(int(rng.integers(0, 3)))
        if rng.random() < 0.3:
            watch.save()
        elif rng.random() < 0.5:
            watch.kill()
        if rng.random() < 0.4:
            logger.end_half()
            watch.poll()
            watch.save()  # what a replaced file had is nowhere any more
            list(WAYS.values())[rng.integers(len(WAYS))](logger)
            watch.poll(int(rng.integers(0, 3)))
            if rng.random() < 0.3:
                watch.kill()
            watch.poll()
            watch.save()
    watch.poll()
    assert watch.alarms() == EXPECTED
    counts = watch.session.counts
    assert (watch.session.samples, counts.missing, counts.bad, counts.runs) == (80, 0, 0, 1)


def test_what_a_copy_took_away_is_read_from_the_copy(tmp_path: Path) -> None:
    """Rows that were written but not read when the log was cut."""
    logger = Logger(tmp_path / "log.csv", LINES)
    watch = Watch(tmp_path)
    logger.write(20)
    watch.poll()
    logger.write(15, half=4)
    logger.end_half()
    logger.copytruncate()
    logger.write(80)
    watch.poll()
    assert watch.alarms() == EXPECTED
    assert any("its rest is read from" in note and "log.csv.1" in note for note in watch.notes)


def test_a_log_that_was_rotated_while_nobody_watched_is_read_to_its_end(tmp_path: Path) -> None:
    logger = Logger(tmp_path / "log.csv", LINES)
    watch = Watch(tmp_path)
    logger.write(20, half=5)
    watch.poll()
    watch.save()
    logger.write(25)
    logger.rename()
    logger.write(80)
    watch.kill()
    watch.poll()
    assert watch.alarms() == EXPECTED


def test_what_is_lost_for_good_is_a_gap_and_is_said(tmp_path: Path) -> None:
    logger = Logger(tmp_path / "log.csv", LINES)
    watch = Watch(tmp_path)
    logger.write(20)
    watch.poll()
    logger.write(3)
    logger.truncate_and_fill(5)  # the three rows are nowhere any more
    watch.poll()
    status = watch.session.status()
    assert status is not None
    assert (status.samples, status.counts.missing, status.counts.held, status.counts.runs) == (28, 3, 3, 1)
    assert any("3 samples have no row; their readings are missing" in note for note in watch.notes)
    logger.write(80)
    watch.poll()
    assert len(watch.alarms()) == len(EXPECTED)


def test_a_log_without_a_file_is_waited_for_and_said_once(tmp_path: Path) -> None:
    logger = Logger(tmp_path / "log.csv", LINES)
    watch = Watch(tmp_path)
    logger.write(20)
    watch.poll()
    logger.delete()
    for _ in range(5):
        watch.poll()
    assert [note for note in watch.notes if "it is waited for" in note] == [
        f"{tmp_path / 'log.csv'}: No such file or directory; it is waited for"
    ]


def test_a_half_line_that_is_cut_by_a_rotation_is_one_bad_line(tmp_path: Path) -> None:
    """Its second half begins the new file, and is not taken for a row or a header."""
    logger = Logger(tmp_path / "log.csv", LINES)
    watch = Watch(tmp_path)
    logger.write(20, half=7)
    watch.poll()
    logger.copytruncate()
    watch.poll()
    logger.write(80)
    watch.poll()
    status = watch.session.status()
    assert status is not None
    assert (status.samples, status.counts.missing, status.counts.bad) == (80, 1, 2)
    assert len(watch.alarms()) == len(EXPECTED)
