"""A log is read back whatever dialect it is written in, and a damaged one is one error that names the file."""

from __future__ import annotations

import json
import random
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from svo.logs.dialect.guess import guessed_table
from svo.logs.dialect.read import read_dialect
from tests.svo.logs.dialect.carts import cart, reading

START = datetime(2025, 3, 14, 9, 15, tzinfo=UTC)
FORMATS = ["%d.%m.%Y %H:%M:%S,%f", "%m/%d/%Y %I:%M:%S.%f %p", "%Y%m%d %H%M%S.%f", "%d-%b-%y %H:%M:%S.%f"]


@dataclass
class Written:
    """A log in a random dialect, its table, and what must be read."""

    data: bytes
    table: str
    u: np.ndarray
    y: np.ndarray


def random_log(rng: random.Random) -> Written:
    """Numbers of few digits, so that each is read back to the bit; a third of the positions are missing."""
    count = rng.randint(3, 40)
    u = np.array([round(rng.uniform(-1, 1), 3) for _ in range(count)])
    y = np.array([round(rng.uniform(-3000, 3000), 1) for _ in range(count)])
    kind = [rng.choice(["reading", "reading", "text", "sentinel", "flag"]) for _ in range(count)]
    decimal = rng.choice([".", ","])
    separator = rng.choice([s for s in (";", "\t", "|", ",") if s != decimal])
    thousands = rng.choice([m for m in ("", "'", ".", ",") if m not in (decimal, separator)])

    def number(value: float, digits: int) -> str:
        text = f"{value:,.{digits}f}".replace(",", "T").replace(".", decimal)
        return text.replace("T", thousands)

    stamps, time, quoted = random_stamps(rng, count, decimal)
    rows = []
    for k in range(count):
        position = {"text": "---", "sentinel": number(-99999, 0), "flag": "0"}.get(kind[k], number(y[k], 1))
        rows.append([stamps[k], number(u[k], 3), position, "0" if kind[k] == "flag" else "1", "a note"])
    names = ["when", "Kraft [N]", "Weg", "ok", ""]
    order = rng.sample(range(5), 5)
    quote = '"' if quoted or rng.random() < 0.3 else ""
    lines = [separator.join(f"{quote}{row[i]}{quote}" for i in order) for row in [names, *rows]]
    keys = [
        f"separator = {json.dumps(separator)}",
        f'decimal = "{decimal}"',
        'missing = ["---"]',
        "sentinels = [-99999]",
    ]
    keys += [f"thousands = {json.dumps(thousands)}"] * bool(thousands)
    if rng.random() < 0.5:
        preamble = ["Export of today", "", "# 3 channels"][: rng.randint(1, 3)]
        keys.append(f"header = {len(preamble) + 1}")
        lines = preamble + lines
    if rng.random() < 0.5:
        lines.insert(len(lines) - rng.randint(1, count), "# a remark, in a line of its own; and so on")
        keys.append('skip = ["^#"]')
    if rng.random() < 0.3:
        lines += [separator * 4, ""]
    encoding = rng.choice(["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"])
    keys += [f'encoding = "{encoding}"'] * (encoding in ("cp1252", "utf-16-le"))
    end = rng.choice(["\n", "\r\n", "\r"])
    flag = 'valid = { column = "ok", good = [1] }'
    channels = f'force = {{ column = "Kraft [N]" }}\nposition = {{ column = "Weg", scale = 0.001, {flag} }}'
    table = "[log]\n" + "\n".join([*keys, time]) + f"\n[log.columns]\n{channels}\n"
    data = (end.join(lines) + end).encode(encoding)
    return Written(data, table, u, np.where(np.array(kind) == "reading", y, np.nan))


def random_stamps(rng: random.Random, count: int, decimal: str) -> tuple[list[str], str, bool]:
    """Stamps of 10 Hz, the key that says what they are, and whether they need quotes."""
    at = [START + timedelta(milliseconds=100 * k) for k in range(count)]
    kind = rng.choice(["iso", "format", "s", "ms", "us", "ns", "day", "duration"])
    if kind == "iso":
        return [time.isoformat() for time in at], 'time = { column = "when", format = "iso" }', True
    if kind == "duration":
        return [f"{k / 10} sec" for k in range(count)], 'time = { column = "when", format = "duration" }', True
    if kind == "format":
        form, zone = rng.choice(FORMATS), rng.choice(["Europe/Berlin", "America/New_York", "UTC"])
        texts = [time.astimezone(ZoneInfo(zone)).strftime(form) for time in at]
        return texts, f'time = {{ column = "when", format = "{form}", zone = "{zone}" }}', True
    if kind == "day":
        texts = [f"{1.5 + k / 864000:.12f}".replace(".", decimal) for k in range(count)]
        return texts, 'time = { column = "when", unit = "day" }', decimal == ","
    per = {"s": 1, "ms": 1000, "us": 10**6, "ns": 10**9}[kind]
    begin = round(START.timestamp()) * per
    texts = [str(begin + k * per // 10) if kind != "s" else f"{begin + k / 10:.1f}" for k in range(count)]
    return [text.replace(".", decimal) for text in texts], f'time = {{ column = "when", unit = "{kind}" }}', True


@pytest.mark.parametrize("seed", range(120))
def test_a_log_is_read_back_from_any_dialect(seed: int, tmp_path: Path) -> None:
    log = random_log(random.Random(seed))
    (tmp_path / "log.dat").write_bytes(log.data)
    found = reading(tmp_path / "log.dat", log.table, tmp_path).log
    np.testing.assert_array_equal(found.u[:, 0], log.u)
    np.testing.assert_array_equal(found.y[:, 0], log.y * 0.001)
    np.testing.assert_allclose(found.time, 0.1 * np.arange(log.u.size), atol=1e-12)


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Cut, changed, doubled, shuffled, or something else altogether."""
    changed = bytearray(data)
    at = rng.randrange(len(changed))
    match rng.randrange(6):
        case 0:
            del changed[at:]
        case 1:
            for _ in range(rng.randint(1, 6)):
                changed[rng.randrange(len(changed))] = rng.randrange(256)
        case 2:
            del changed[at : at + rng.randrange(300)]
        case 3:
            changed[at:at] = changed[at : at + rng.randrange(300)]
        case 4:
            lines = bytes(changed).split(b"\n")
            lines.insert(
                rng.randrange(len(lines)), rng.choice([b'"', b";" * 40, b"\0\0", b"nan", b"1e999;1e999", b"\xff\xfe"])
            )
            return b"\n".join(lines)
        case _:
            return rng.randbytes(rng.randrange(2000))
    return bytes(changed)


@pytest.mark.parametrize("seed", range(10))
def test_a_damaged_log_is_one_error_that_names_it_or_still_a_log(seed: int, tmp_path: Path) -> None:
    rng, errors = random.Random(seed), list[str]()
    log = random_log(rng)
    plant, path = cart(tmp_path, log.table), tmp_path / "log.dat"
    assert plant.dialect is not None
    for _ in range(40):
        path.write_bytes(damaged(log.data, rng))
        try:
            read_dialect(path, plant.columns, plant.Ts, plant.dialect)
        except ValueError as error:
            errors.append(str(error))
        try:
            cart(tmp_path, guessed_table(path, plant.columns, plant.Ts))  # what is proposed is a table
        except ValueError as error:
            errors.append(str(error))
    assert len(errors) > 20
    assert not [error for error in errors if not error.startswith(str(path))]


@pytest.mark.parametrize(
    "content", [b"", b"\n", b"t,f,p\n", b"\xff\xfe", b"\xff", b"\0" * 100, bytes(range(256)), b"PK\3\4"]
)
def test_what_is_no_log_at_all_is_one_error(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "log.dat").write_bytes(content)
    with pytest.raises(ValueError, match=r"log\.dat"):
        reading(tmp_path / "log.dat", '[log]\ntime = { column = "t" }\n', tmp_path)


@pytest.mark.parametrize("stamp", ["1e9", "9e30", "1e300"])
def test_a_stamp_far_from_all_others_makes_no_grid(stamp: str, tmp_path: Path) -> None:
    (tmp_path / "log.dat").write_text(f"t,force,position\n0,1,2\n0.1,1,2\n{stamp},1,2\n", encoding="utf-8")
    table = '[log]\ntime = { column = "t" }\n[log.columns]\nforce = { missing = "hold" }\n'
    with pytest.raises(ValueError, match=r"log\.dat, line 4"):
        reading(tmp_path / "log.dat", table, tmp_path)
