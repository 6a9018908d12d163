"""Small files that would take long, or much memory, at their word: each ends soon, with one error."""

from __future__ import annotations

import gzip
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from proof_cases import proven, steps_of, tiny

from svo import detect, find_plant, read_log
from svo.isolation.alarm_record import digest_of_record
from svo.isolation.alarms import alarm_line

SECONDS, KILOBYTES = 1.0, 500_000
COSTS = Path(__file__).with_name("costs.py")
CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
ZEROS = {"shape": [500_000, 1], "hex": " ".join(["0"] * 500_000)}
Bombs = dict[str, dict[str, bytes]]


def packed(text: bytes) -> bytes:
    return gzip.compress(text, 1, mtime=0)


def of_json(valid: str) -> Iterator[tuple[str, bytes]]:
    """What a line, or the only object of a file, may be."""
    yield "digits", valid.replace(": ", ": " + "9" * 10**6, 1).encode()
    yield "nested lists", b'{"format": ' + b"[" * 10**6
    yield "nested tables", b'{"a":' * 10**6 + b"1" + b"}" * 10**6
    yield "lists of nothing", b'{"format": [' + b"[]," * 300_000 + b"[]]}"
    yield "entries", json.dumps({str(i): i for i in range(100_000)}).encode()
    yield "the same entry", b"{" + b'"a": 0, ' * 10**5 + b'"a": 0}'
    yield "text", json.dumps({"format": "x" * 10**6}).encode()


def of_lines(line: bytes) -> Iterator[tuple[str, bytes]]:
    """What a packed file may be."""
    yield "spaces", packed(b" " * 2**20) * 500
    yield "blank lines", packed(b"\n" * 2**20) * 500
    yield "one line", packed(b'{"a": "' + b"x" * 2**26)
    yield "empty members", packed(b"") * 10**5
    yield "small members", packed(b" ") * 10**6
    yield "cut", packed(line)[:-9]
    yield "bytes behind", packed(line) + b"\x1f\x8b" * 10**5
    yield "nothing", b""


def proofs(steps: list[Any]) -> Bombs:
    lines = [json.dumps(step).encode() for step in steps]
    begin, end = b"\n".join(lines[:3]) + b"\n", b"\n" + b"\n".join(lines[3:])
    start, alarm = dict(steps[2]), dict(steps[-1])
    wide = {"step": "x", "sample": 0, "row": 0, "side": "upper", "value": "0", "first": 0, "last": 9}
    far = "0x1.fffffffffffffp+1023 0x0.0000000000001p-1022"
    length = alarm["last"] - alarm["first"] + 1
    odd = {"shape": [length, 1], "hex": " ".join((far.split() * length)[:length])}
    claims = {
        "shapes": wide | {"on_start": {"shape": [2**31, 0], "hex": ""}, "on_output": {"shape": [2**31, 0], "hex": ""}},
        "template": start | {"template": {"shape": [2**40, 1], "hex": ""}},
        "set": start | {"from": "assumed", "set": {"rows": ZEROS, "box_lower": ZEROS, "box_upper": ZEROS}},
        "window": wide | {"last": 2**53 - 1, "on_start": {"shape": [0], "hex": ""}, "on_output": ZEROS},
        "channels": {"step": "channels", "sample": 0, "owner": [1] * 300_000, "gain": ZEROS, "functional": ZEROS},
        "lines": alarm | {"on_line": [[0, 0, 0]] * 100_000, "line": {"shape": [100_000, 3], "hex": ZEROS["hex"]}},
        "sums": alarm | {"on_sum": [[0, 0]] * 100_000, "sum": {"shape": [100_000, 1], "hex": ZEROS["hex"]}},
        "exponents": alarm | {"on_output": odd},
        "inverse": start | {"from": "readings", "inverse": {"shape": [1, 500_000, 1], "hex": ZEROS["hex"]}},
    }
    found = {name: packed(begin + json.dumps(step).encode() + end) for name, step in claims.items()}
    found |= {name: packed(begin + content + end) for name, content in of_json(lines[3].decode())}
    found |= dict(of_lines(begin))
    found["repeated steps"] = packed(begin + (lines[3] + b"\n") * 10**5 + end)
    return {f"proof, {name}": {"proof.jsonl.gz": content} for name, content in found.items()}


def plants(text: str) -> Bombs:
    record = json.loads(text)
    found = dict(of_json(text))
    (name,) = record["observers"]
    for key in ("n", "inputs", "outputs", "disturbances"):
        for size in (10**8, 10**30, *([0] if key in ("n", "outputs") else [])):
            nothing = {"shape": [0, size], "hex": ""}
            more = {key: size, "noise": nothing, "matrices": {"stacks": {"shape": [0, 1, size, size], "hex": ""}}}
            changed = record | {"observers": {name: record["observers"][name] | more}}
            found[f"{key} {size:.0e}"] = json.dumps(changed).encode()
    changed = record | {"observers": {name: record["observers"][name] | {"delta": ZEROS}}}
    found["long delta"] = json.dumps(changed).encode()
    found["many observers"] = json.dumps(record | {"observers": dict.fromkeys(map(str, range(10**5)), 0)}).encode()
    return {f"plant, {name}": {"plant.json": content} for name, content in found.items()}


def logs(text: str) -> Bombs:
    header, *rows = text.splitlines()
    lines = {
        "columns": [header + "," * 10**6, *rows],
        "cell": [header, rows[0] + "9" * 10**6, *rows[1:]],
        "quote": [header, '"' + "x" * 10**6, *rows],
        "exponent": [header, rows[0].replace(",", ",1e999999999,", 1), *rows[1:]],
        "blank": [header, *[""] * 10**5],
    }
    found = {name: "\n".join(all_of_them) + "\n" for name, all_of_them in lines.items()}
    found["one line"] = header * 10**5
    found["no text"] = "\x00" * 10**6
    return {f"log, {name}": {"log.csv": content.encode()} for name, content in found.items()}


def alarms(line: str) -> Bombs:
    record = json.loads(line)
    found = dict(of_json(line)) | dict(of_lines(line.encode()))

    def spoiled(*way: str, value: Any) -> bytes:
        changed = json.loads(line)
        part = changed
        for key in way[:-1]:
            part = part[int(key) if isinstance(part, list) else key]
        part[way[-1]] = value
        return json.dumps(changed | {"sha256": digest_of_record(changed)}).encode()

    found["shapes"] = spoiled("certificate", "samples", "0", "y", value={"shape": [2**53, 2**53], "hex": "0"})
    found["zeros"] = spoiled("certificate", "samples", "0", "y", value=ZEROS)
    found["stacks"] = spoiled("matrices", "stacks", value={"shape": [500_000, 1, 1, 1], "hex": ZEROS["hex"]})
    table = {"points": ZEROS, "stacks": ZEROS, "schedule": ZEROS}
    found["a table"] = spoiled("matrices", value=table)
    samples = [record["certificate"]["samples"][0]] * 2000
    found["samples"] = spoiled(
        "certificate", value=record["certificate"] | {"samples": samples, "first": 0, "last": 1999}
    )
    found["rows"] = spoiled("certificate", "arrival", value=dict.fromkeys(record["certificate"]["arrival"], ZEROS))
    return {f"alarms, {name}": {"alarms.jsonl": content} for name, content in found.items()}


def costs(folder: Path, program: str, bombs: Bombs) -> list[tuple[str, float, int, str]]:
    """What each took, in place of the files of the folder ``valid``."""
    made = []
    for i, (name, files) in enumerate(bombs.items()):
        copy = folder / f"{i} {name}"
        shutil.copytree(folder / "valid", copy)
        for file, content in files.items():
            (copy / file).write_bytes(content)
        made.append(str(copy))
    command = [sys.executable, str(COSTS), program, str(folder / "valid"), *made]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ)
    assert done.returncode == 0, done.stderr
    found = [tuple(json.loads(line)) for line in done.stdout.splitlines()]
    assert len(found) == len(bombs) + 1, done.stderr
    assert "NOT" not in found[0][3], found[0]
    assert "proven in exact" in found[0][3] or found[0][3].startswith("PROVEN"), found[0]
    return found[1:]


def expect_little(found: list[tuple[str, float, int, str]]) -> None:
    for name, seconds, kilobytes, answer in found:
        assert not answer.startswith("PROVEN"), name
        assert "1 of 1 alarms proven" not in answer, name
        assert 0 < len(answer) < 1000, name
        assert seconds < SECONDS, (name, seconds)
        assert kilobytes < KILOBYTES, (name, kilobytes)


def test_the_checker_is_not_kept_busy(tmp_path: Path) -> None:
    plant, log, _ = tiny()
    folder = tmp_path / "valid"
    folder.mkdir()
    files = proven(plant, log, folder)
    assert files is not None
    bombs = proofs(steps_of(files[0])) | plants(files[1].read_text()) | logs(files[2].read_text())
    expect_little(costs(tmp_path, "checker", bombs))


@pytest.fixture
def cart(tmp_path: Path) -> tuple[Path, str]:
    plant = find_plant(str(CART))
    log = read_log(CART.with_suffix(".csv"), plant)
    line = alarm_line(detect(plant, log, noise="stated").alarms[0])
    (tmp_path / "valid").mkdir()
    (tmp_path / "valid" / "alarms.jsonl").write_text(line)
    shutil.copy(CART, tmp_path / "valid")
    shutil.copy(CART.with_suffix(".csv"), tmp_path / "valid" / "log.csv")
    return tmp_path, line


@pytest.mark.slow  # the shorter list of tests/svo/isolation/test_alarm_format.py is in the default run
@pytest.mark.parametrize("program", ["plain", "log", "full"])
def test_verify_is_not_kept_busy(cart: tuple[Path, str], program: str) -> None:
    folder, line = cart
    bombs = alarms(line) | (logs((folder / "valid" / "log.csv").read_text()) if program != "plain" else {})
    expect_little(costs(folder, program, bombs))
