"""Nothing overwrites, joins or deletes an alarm file that it did not write."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path

import pytest

from svo.detection.alarm_folder import watch_folder
from svo.detection.detect import detect
from svo.isolation.alarms import Alarm, alarm_line, verify_alarms
from svo.logs.file import read_log
from svo.plant.description import keep_description, read_description
from tests.svo.commands import one_line, svo

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")
PLANT = read_description(CART)
ABOUT = {"plant": "cart.toml", "noise": "stated", "log": "/log.csv"}


def content(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != ".svo-lock"
    }


@pytest.fixture(scope="module")
def found() -> tuple[Alarm, ...]:
    return detect(PLANT, read_log(LOG, PLANT.columns, PLANT.Ts), "stated").alarms


@pytest.mark.parametrize("name", ["alarms.jsonl", "verdict.json", "study.json", "watch.json", "comparison.csv"])
@pytest.mark.parametrize("kind", ["file", "link", "folder"])
def test_a_folder_with_results_of_any_command_is_refused_and_stays(tmp_path: Path, name: str, kind: str) -> None:
    out = tmp_path / "out"
    out.mkdir()
    if kind == "file":
        (out / name).write_text("kept\n")
    elif kind == "link":
        (out / name).symlink_to(tmp_path / "nothing")
    else:
        (out / name).mkdir()
    before = content(tmp_path)
    commands: list[tuple[str | Path, ...]] = [("detect", CART, LOG), ("watch", CART, LOG, "--until-end")]
    for command in commands:
        message = one_line(svo(*command, "--out", out))
        assert name in message
        assert "give another folder" in message or "symbolic link" in message
    with pytest.raises(ValueError, match="never overwritten"):
        detect(PLANT, read_log(LOG, PLANT.columns, PLANT.Ts)).save(out)
    assert content(tmp_path) == before
    assert not (tmp_path / "nothing").exists()


def test_detection_again_into_the_same_folder_is_refused(tmp_path: Path) -> None:
    assert svo("detect", CART, LOG, "--out", tmp_path / "out").exit_code == 0
    before = content(tmp_path)
    for command in ("detect", "watch"):
        message = one_line(svo(command, CART, LOG, "--out", tmp_path / "out"))
        assert "out holds results already (alarms.jsonl, verdict.json), and these are never overwritten" in message
    assert content(tmp_path) == before


def test_detection_beside_a_log_is_no_conflict(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_bytes(LOG.read_bytes())
    (tmp_path / "notes.txt").touch()
    assert svo("detect", CART, tmp_path / "log.csv", "--out", tmp_path).exit_code == 0


def test_detection_into_the_folder_of_a_study_is_refused(registered_tank: str, tmp_path: Path) -> None:
    out = tmp_path / "study"
    study = ("study", "tank", "--runs", "1", "--workers", "1", "--noise", "calm", "--fault", "gauge", "--out", out)
    assert svo(*study).exit_code == 0
    svo("simulate", "tank", "--out", tmp_path / "log.csv")
    before = content(out)
    for command in (("detect", "tank"), ("watch", "tank", "--until-end")):
        message = one_line(svo(command[0], "tank", tmp_path / "log.csv", *command[2:], "--out", out))
        assert "study.json" in message
    assert content(out) == before
    assert svo(*study, "--resume").exit_code == 0
    assert (out / "alarms.jsonl.gz").read_bytes() == before["alarms.jsonl.gz"]


def test_a_watch_that_is_started_again_keeps_its_alarms(tmp_path: Path) -> None:
    out, log = tmp_path / "out", tmp_path / "log.csv"
    log.write_bytes(LOG.read_bytes())
    command = ("watch", CART, log, "--until-end", "--out", out)
    assert svo(*command).exit_code == 0
    first = (out / "alarms.jsonl").read_bytes()
    assert len(first.splitlines()) == 2
    assert "alarms.jsonl keeps its 2 alarms of before" in svo(*command).stderr
    assert (out / "alarms.jsonl").read_bytes() == first  # the same samples again: the same alarms
    lines = LOG.read_text().splitlines()
    log.write_text("\n".join([lines[0], *lines[11:]]) + "\n")  # a later part of the log: other samples
    assert svo(*command).exit_code == 0
    both = (out / "alarms.jsonl").read_bytes()
    assert both.startswith(first)
    assert len(both.splitlines()) == 4
    assert all(check.ok for check in verify_alarms(out / "alarms.jsonl"))


def test_a_watch_of_something_else_does_not_join(tmp_path: Path) -> None:
    out, other = tmp_path / "out", tmp_path / "other.csv"
    other.write_bytes(LOG.read_bytes())
    assert svo("watch", CART, LOG, "--until-end", "--out", out).exit_code == 0
    before = content(out)
    message = one_line(svo("watch", CART, other, "--until-end", "--out", out))
    assert "out holds the alarms of another watch (log was " in message
    changed = tmp_path / "cart.toml"
    changed.write_text(CART.read_text().replace("n = [0.05]", "n = [0.06]"))
    message = one_line(svo("watch", changed, LOG, "--until-end", "--out", out))
    assert "cart.toml is another file than" in message
    for text in ("", "{", "[]", '{"format": "svo-watch-9"}', "\x00"):
        (out / "watch.json").write_text(text)
        assert "watch.json is not that of a watch" in one_line(svo("watch", CART, LOG, "--until-end", "--out", out))
    (out / "watch.json").write_bytes(before["watch.json"])
    assert content(out) == before


def test_two_watches_do_not_write_into_one_folder(tmp_path: Path, found: tuple[Alarm, ...]) -> None:
    with watch_folder(tmp_path / "out", ABOUT) as alarms:
        alarms.add(found[0])
        with pytest.raises(ValueError, match="is in use by process"), watch_folder(tmp_path / "out", ABOUT):
            pass
    with watch_folder(tmp_path / "out", ABOUT) as alarms:
        assert alarms.before == 1


def test_a_record_that_was_cut_is_set_aside_and_the_next_one_is_whole(tmp_path: Path, found: tuple[Alarm, ...]) -> None:
    with watch_folder(tmp_path, ABOUT) as alarms:
        alarms.add(found[0])
        alarms.add(found[1])
    whole = (tmp_path / "alarms.jsonl").read_bytes()
    for cut in (1, 100, len(alarm_line(found[1])) - 1):
        (tmp_path / "alarms.jsonl").write_bytes(whole[:-cut])
        (tmp_path / "alarms.cut").unlink(missing_ok=True)
        with watch_folder(tmp_path, ABOUT) as alarms:
            assert "was cut when it was written" in alarms.notes[0]
            alarms.add(found[1])
        assert (tmp_path / "alarms.jsonl").read_bytes() == whole
        assert (tmp_path / "alarms.cut").read_bytes() == alarm_line(found[1]).encode()[:-cut] + b"\n"


def test_a_disk_that_is_full_leaves_whole_records(
    tmp_path: Path, found: tuple[Alarm, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    with watch_folder(tmp_path, ABOUT) as alarms:
        alarms.add(found[0])
        before = (tmp_path / "alarms.jsonl").read_bytes()

        def full(descriptor: int) -> None:
            raise OSError(28, "No space left on device")

        monkeypatch.setattr("svo.detection.alarm_folder.os.fsync", full)
        with pytest.raises(OSError, match="No space left"):
            alarms.add(found[1])
        assert (tmp_path / "alarms.jsonl").read_bytes() == before
        monkeypatch.undo()
        alarms.add(found[1])
    assert len(verify_alarms(tmp_path / "alarms.jsonl")) == 2


def test_another_description_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "cart.toml").write_text("mine\n")
    with pytest.raises(ValueError, match=r"cart\.toml is another file than .*; give another folder"):
        keep_description(PLANT, tmp_path)
    assert "is another file than" in one_line(svo("detect", CART, LOG, "--out", tmp_path))
    assert content(tmp_path) == {"cart.toml": b"mine\n"}
    (tmp_path / "cart.toml").unlink()
    (tmp_path / "cart.toml").symlink_to(tmp_path / "elsewhere")
    keep_description(PLANT, tmp_path)
    assert not (tmp_path / "elsewhere").exists()
    assert (tmp_path / "cart.toml").read_bytes() == CART.read_bytes()


def test_what_a_watch_is_about_stands_beside_its_alarms(tmp_path: Path) -> None:
    assert svo("watch", CART, LOG, "--until-end", "--out", tmp_path).exit_code == 0
    about = json.loads((tmp_path / "watch.json").read_text())
    watched = {"plant": "cart.toml", "noise": "stated", "log": str(LOG.resolve())}
    assert about == {"format": "svo-watch-1", **watched, "cart.toml": sha256(CART.read_bytes()).hexdigest()}
