"""A watch that was killed goes on where it was, and refuses a state that is not its own."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from svo.detection.watch.follow import FileLines
from svo.detection.watch.session import Session, identity_of
from svo.detection.watch.state import resume_state, save_state
from svo.isolation.alarms import alarm_line
from svo.logs.file import write_log
from svo.plant import BankChoice, load_plant, resume_schedule, saved_schedule, schedule_of, with_bank
from svo.plant.description import read_description
from tests.svo.commands import svo

CART = Path(__file__).parents[4] / "docs" / "examples" / "cart.toml"
TEXT = CART.with_suffix(".csv").read_text()


def stream_of(session: Session, lines: list[str]) -> list[tuple[list[str], Any]]:
    """Alarms and boxes at each line."""
    found = []
    for line in lines:
        alarms = [alarm_line(alarm) for alarm in session.feed(line)]
        status = session.status()
        boxes = {} if status is None else {name: np.array(box).tolist() for name, box in status.boxes.items()}
        found.append((alarms, boxes))
    return found


@pytest.mark.parametrize("name", ["cart", "elevator"])
def test_a_session_goes_on_bit_for_bit_from_any_sample(tmp_path: Path, name: str) -> None:
    if name == "cart":
        plant: Any = read_description(CART)
        text = TEXT
    else:
        plant = load_plant(name)
        log = plant.simulate(
            next(iter(plant.faults)), plant.faults[next(iter(plant.faults))][0], plant.noise_sets[0], 0
        )
        write_log(tmp_path / "log.csv", log, plant.columns)
        text = (tmp_path / "log.csv").read_text()
    lines = text.splitlines()[:61]
    noise, source = plant.noise_sets[0], str(tmp_path / "log.csv")
    (tmp_path / "log.csv").touch()
    expected = stream_of(Session(plant, noise, source), lines)
    for cut in (0, 1, 2, 30, 61):
        first, second = (Session(plant, noise, source) for _ in range(2))
        found = stream_of(first, lines[:cut])
        follower = FileLines(tmp_path / "log.csv", until_end=False)
        about = identity_of(plant, noise, source)
        save_state(tmp_path / "state", first, follower, about)
        resume_state(tmp_path / "state", second, follower, about)
        follower.close()
        assert [*found, *stream_of(second, lines[cut:])] == expected
        assert (first.samples, second.samples) == (max(0, cut - 1), 60)


@pytest.mark.parametrize(("name", "models"), [("eclipse", "lpv"), ("missile", None), ("elevator", None)])
def test_a_schedule_goes_on_from_what_it_was(name: str, models: str | None) -> None:
    plant = with_bank(load_plant(name), BankChoice(models=models))
    rng = np.random.default_rng(0)
    y = rng.normal(size=(20, len(plant.columns.outputs)))
    y[rng.random(y.shape) < 0.3] = np.nan
    u = rng.normal(size=(20, len(plant.columns.inputs)))
    whole = plant.scheduler()
    expected = [np.copy(schedule_of(whole, *sample)) for sample in zip(y, u, strict=True)]
    for cut in (0, 1, 10):
        first, second = plant.scheduler(), plant.scheduler()
        for sample in zip(y[:cut], u[:cut], strict=True):
            schedule_of(first, *sample)
        resume_schedule(second, saved_schedule(first))
        found = [np.copy(schedule_of(second, *sample)) for sample in zip(y[cut:], u[cut:], strict=True)]
        assert np.array_equal(found, expected[cut:], equal_nan=True)


def test_the_command_goes_on_after_a_restart_without_saying_anything_twice(tmp_path: Path) -> None:
    log, out = tmp_path / "log.csv", tmp_path / "out"
    command = ("watch", CART, log, "--until-end", "--out", out, "--state", tmp_path / "state")
    cuts = [len(TEXT.partition("\n")[0]) + 1, 700, 1500, TEXT.index("\n5.0,") + 9, len(TEXT)]
    said = ""
    for cut in cuts:
        log.write_text(TEXT[:cut])
        result = svo(*command)
        assert result.exit_code == (0 if cut > cuts[0] else 1), result.output
        said += result.stdout
    assert said.count("ALARM 5 s") == 2
    assert "End of the input: 80 samples" in said
    whole = svo("watch", CART, log, "--until-end", "--out", tmp_path / "whole")
    assert whole.exit_code == 0
    assert (out / "alarms.jsonl").read_bytes() == (tmp_path / "whole" / "alarms.jsonl").read_bytes()
    again = svo(*command)  # nothing is new
    assert again.exit_code == 0
    assert "ALARM" not in again.stdout


@pytest.fixture
def state(tmp_path: Path) -> Path:
    (tmp_path / "log.csv").write_text(TEXT)
    path = tmp_path / "state"
    assert svo("watch", CART, tmp_path / "log.csv", "--until-end", "--state", path).exit_code == 0
    return path


def refusal(tmp_path: Path, plant: Path = CART, log: str = "log.csv") -> str:
    result = svo("watch", plant, tmp_path / log, "--until-end", "--state", tmp_path / "state")
    assert result.exit_code == 1, result.output
    assert "Traceback" not in result.output
    (error,) = [line for line in result.stderr.splitlines() if line.startswith("error:")]
    return str(error)


def test_only_a_state_is_replaced_on_demand(tmp_path: Path, state: Path) -> None:
    log, out, whole = tmp_path / "log.csv", tmp_path / "out", state.read_bytes()
    assert svo("watch", CART, log, "--until-end", "--out", out).exit_code == 0
    alarms = (out / "alarms.jsonl").read_bytes()
    result = svo("watch", CART, log, "--until-end", "--out", out, "--state", log, "--overwrite")
    assert result.exit_code == 1
    assert "log.csv is not the state of a watch" in result.stderr
    assert log.read_text() == TEXT
    assert (out / "alarms.jsonl").read_bytes() == alarms
    state.write_bytes(whole[:-9])
    assert svo("watch", CART, log, "--until-end", "--state", state, "--overwrite").exit_code == 0
    assert svo("watch", CART, log, "--until-end", "--state", state).exit_code == 0  # it goes on from it


def test_a_damaged_state_is_refused_and_stays(tmp_path: Path, state: Path) -> None:
    whole = state.read_bytes()
    rng = np.random.default_rng(0)
    for k in range(25):
        damaged = bytearray(whole)
        damaged[int(rng.integers(len(whole))) if k else 90] ^= 1 << int(rng.integers(8))
        state.write_bytes(bytes(damaged))
        message = refusal(tmp_path)
        assert "is damaged: its SHA-256 does not match" in message or "is not the state of a watch" in message
        assert state.read_bytes() == bytes(damaged)
    for cut in (0, 1, 50, len(whole) // 2, len(whole) - 1):
        state.write_bytes(whole[:cut])
        assert "state" in refusal(tmp_path)


@pytest.mark.parametrize("content", [b"hello\n", b"\x00" * 1000, b"svo-watch-state-2 00\n", b"PK\x03\x04"])
def test_a_foreign_file_is_refused_and_not_overwritten(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "log.csv").write_text(TEXT)
    (tmp_path / "state").write_bytes(content)
    assert "is not the state of a watch" in refusal(tmp_path)
    assert (tmp_path / "state").read_bytes() == content


def test_the_state_of_another_watch_is_refused(tmp_path: Path, state: Path) -> None:
    (tmp_path / "other.csv").write_text(TEXT)
    assert "it is that of another watch: log was" in refusal(tmp_path, log="other.csv")
    other = tmp_path / "other.toml"
    other.write_text(CART.read_text())
    assert "it is that of another watch: plant was 'cart.toml', now 'other.toml'" in refusal(tmp_path, plant=other)
    changed = tmp_path / "cart.toml"
    changed.write_text(CART.read_text().replace("horizon = 10", "horizon = 12"))
    assert "it is that of another watch: cart.toml was" in refusal(tmp_path, plant=changed)


def test_a_state_with_something_missing_in_it_is_refused(tmp_path: Path, state: Path) -> None:
    """As a future version, or a hand with a fresh digest, would write it."""
    import hashlib

    with np.load(io.BytesIO(state.read_bytes().partition(b"\n")[2])) as file:
        arrays = {name: file[name] for name in file.files}
    whole = json.loads(str(arrays["state.json"]))
    for part in ("session", "lines"):
        for key in whole[part]:
            broken = json.loads(json.dumps(whole))
            del broken[part][key]
            buffer = io.BytesIO()
            np.savez(buffer, **{**arrays, "state.json": np.array(json.dumps(broken))})
            content = buffer.getvalue()
            head = f"svo-watch-state-1 {hashlib.sha256(content).hexdigest()}\n".encode()
            state.write_bytes(head + content)
            assert "is not a state that this watch can go on from" in refusal(tmp_path), key


def test_a_scheduler_that_cannot_be_saved_is_one_error(registered_tank: str, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    assert svo("simulate", "tank", "--out", log).exit_code == 0
    result = svo("watch", "tank", log, "--until-end", "--state", tmp_path / "state")
    assert result.exit_code == 1
    assert "has no state_dict, so that a saved state could not go on" in " ".join(result.stderr.split())
