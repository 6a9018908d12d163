"""A last line without its end is no sample, in every command that reads a CSV file."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from svo.logs.columns import LogNote
from svo.logs.file import read_log
from svo.logs.log import Log
from svo.plant.description import read_description
from tests.svo.commands import svo

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
TEXT = CART.with_suffix(".csv").read_text()
PLANT = read_description(CART)


def log_of(path: Path, data: bytes) -> tuple[Log, list[str]]:
    path.write_bytes(data)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        log = read_log(path, PLANT.columns, PLANT.Ts)
    return log, [str(note.message) for note in caught]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_wherever_a_log_is_cut_its_complete_lines_are_the_log(tmp_path: Path, end: str, mark: bytes) -> None:
    lines = TEXT.splitlines()
    lines[0] += ",bemerkung"
    lines = [lines[0], *(f"{text},Füße 体" for text in lines[1:])]
    whole = read_log(CART.with_suffix(".csv"), PLANT.columns, PLANT.Ts)
    data = mark + "".join(text + end for text in lines[:6]).encode()
    first = data.index(end.encode(), data.index(b"\n" if "\n" in end else b"\r") + 1) + len(end)
    for cut in range(first, len(data) + 1):
        log, notes = log_of(tmp_path / "log.csv", data[:cut])
        complete = data[:cut].count(end[:1].encode()) - 1
        assert len(log) == complete
        assert np.array_equal(log.y, whole.y[:complete])
        rest = data[:cut].replace(b"\r", b"\n").rpartition(b"\n")[2]
        assert len(notes) == (1 if rest else 0)
        assert all(f"log.csv: the last line ({complete + 2}) has no end and was left out" in text for text in notes)


@pytest.mark.parametrize(
    "tail", [b"4.7,0.694,2", b"4.7,0.694,2.638", b"4.7,0.694", b"4.", b"\x00" * 100, b"4.7,0.6\xc3"]
)
def test_a_tail_without_an_end_is_named_and_left_out_by_every_command(tmp_path: Path, tail: bytes) -> None:
    log = tmp_path / "log.csv"
    kept = "".join(text + "\n" for text in TEXT.splitlines()[:48])
    log.write_bytes(kept.encode() + tail)
    for command in ("detect", "calibrate"):
        result = svo(command, CART, log)
        assert result.exit_code == 0, result.output
        assert f"note: {log}: the last line (49) has no end and was left out, since it may be cut" in result.stderr
    assert "No fault: the nominal model explains all 47 samples" in svo("detect", CART, log).stdout


@pytest.mark.filterwarnings("ignore::svo.logs.columns.LogNote")
def test_no_cell_of_a_healthy_log_can_be_cut_into_an_alarm(tmp_path: Path) -> None:
    healthy = "".join(text + "\n" for text in TEXT.splitlines()[:49])
    last = healthy.rstrip("\n").rpartition("\n")[2]
    for cut in range(1, len(last)):
        (tmp_path / "log.csv").write_text(healthy[: -cut - 1])
        found = json.loads(svo("detect", CART, tmp_path / "log.csv", "--json").stdout)
        assert (found["samples"], found["state"]) == (47, "nominal")


def test_proofs_leave_the_cut_line_out_too(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text(TEXT)
    assert svo("detect", CART, log, "--out", tmp_path / "found").exit_code == 0
    alarms = tmp_path / "found" / "alarms.jsonl"
    log.write_text(TEXT[:-3])
    for option in ("--log", "--full"):
        result = svo("verify", alarms, option, log)
        assert result.exit_code == 0, result.output
        assert "the last line (81) has no end" in result.stderr
    at_alarm = TEXT[: TEXT.index("\n5.0,") + 15]
    log.write_text(at_alarm)
    assert "sample" in svo("verify", alarms, "--log", log).stderr  # the alarm's sample is not one of this log


def test_a_log_with_nothing_but_a_cut_line_has_no_sample(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text(TEXT.partition("\n")[0] + "\n0.0,0.0,-0.03")
    result = svo("detect", CART, log)
    assert result.exit_code == 1
    assert "error:" in result.stderr
    assert "has a header but no samples" in result.stderr
    assert "the last line (2) has no end" in result.stderr
    with pytest.warns(LogNote, match="has no end"), pytest.raises(ValueError, match="no samples"):
        read_log(log, PLANT.columns, PLANT.Ts)
