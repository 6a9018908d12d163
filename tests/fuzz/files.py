"""Descriptions and logs that somebody's editor, logger or disk has been at."""

from __future__ import annotations

import warnings
from functools import cache
from pathlib import Path

import numpy as np

from svo.detection.detect import detect
from svo.logs.file import read_log
from svo.logs.log import Log
from svo.models.mat import read_arrays
from svo.plant.description import read_description
from tests.fuzz.bytes_of import damaged
from tests.fuzz.outcome import ROOT, WrongError

CART = ROOT / "docs" / "examples" / "cart.toml"
HEALTHY_ROWS = 12
NASTY = [
    "", "0", "-1", "1e999", "nan", "-inf", "1e-320", "9" * 400, "9" * 5000, "0x10", "true", "'text'", "[]", "{}",
    "[[]]", "[[1.0]]", "[1, 2, 3]", "[[1, 2], [3]]", "1979-05-27T07:32:00Z", "[" * 3000, "\"\\u001b[31m\"", "'../../x'",
    "[nan]", "[1e308, 1e308]", "{ x = 1 }", "[[1e200, 1e200], [1e200, 1e200]]", "'position'", "2", "-0.0", "1_000",
]  # fmt: skip


@cache
def cart_text() -> str:
    return CART.read_text(encoding="utf-8")


@cache
def healthy_log() -> Log:
    """A few samples of the cart within all its bounds."""
    plant = read_description(CART)
    model = plant.bank("stated").observers["nominal"].model
    return model.simulate([0.0, 0.0], np.full((HEALTHY_ROWS, 1), 0.5), np.random.default_rng(4))


def healthy_csv() -> str:
    log = healthy_log()
    rows = [
        f"{t!r},{u!r},{y!r}"
        for t, u, y in zip(log.time.tolist(), log.u[:, 0].tolist(), log.y[:, 0].tolist(), strict=True)
    ]
    return "\n".join(["time_s,force,position", *rows, ""])


def description(rng: np.random.Generator, folder: Path) -> None:
    """A description with lines lost, doubled, moved, or with other values; used on a healthy log if accepted."""
    lines = cart_text().split("\n")
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(lines)))
        match int(rng.integers(6)):
            case 0:
                del lines[at]
            case 1:
                lines.insert(at, lines[int(rng.integers(len(lines)))])
            case 2 | 3:
                key = lines[at].partition("=")[0] if "=" in lines[at] else f"key{at}"
                lines[at] = f"{key}= {NASTY[int(rng.integers(len(NASTY)))]}"
            case 4:
                lines[at] = damaged(lines[at].encode(), rng).decode("utf-8", "replace")
            case _:
                lines = lines[:at]
        lines = lines or [""]
    path = folder / "cart.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    plant = read_description(path)
    log = healthy_log()
    if plant.Ts == 0.1:
        detect(plant, log, "stated")


def csv_log(rng: np.random.Generator, folder: Path) -> None:
    """A healthy CSV after accidents that change no digit must raise no alarm, and be read as it stands."""
    text = healthy_csv()
    exact = True
    for _ in range(int(rng.integers(1, 4))):
        text, kept = _accident(text, rng)
        exact = exact and kept
    path = folder / "log.csv"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    plant = read_description(CART)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        log = read_log(path, plant.columns, plant.Ts)
    found = detect(plant, log, "stated")
    if exact and found.alarms:
        raise WrongError(f"alarm at {found.alarms[0].time} s on healthy readings: {text!r:.300}")
    known = {float(cell) for cell in healthy_csv().replace("\n", ",").split(",")[3:] if cell}
    read = np.concatenate([log.time, log.u.ravel(), log.y.ravel()])
    strange = [value for value in read[~np.isnan(read)].tolist() if value not in known]
    if exact and strange:
        raise WrongError(f"{strange[0]} was read, which stands nowhere: {text!r:.300}")


def _accident(text: str, rng: np.random.Generator) -> tuple[str, bool]:
    """One accident, and whether every digit that is left is one of the healthy log's numbers in its own place."""
    lines = text.split("\n")
    at = int(rng.integers(len(lines)))
    match int(rng.integers(12)):
        case 0:
            return text[: int(rng.integers(len(text) + 1))], True  # cut anywhere
        case 1:
            return "\ufeff" + text, True
        case 2:
            return text.replace("\n", "\r\n"), True
        case 3:
            return "\n".join([*lines[:at], "", *lines[at:]]), True
        case 4:
            return "\n".join([*lines[:at], "\0" * 5, *lines[at:]]), True
        case 5:
            cells = lines[at].split(",")
            odd = ["", "nan", "NaN", " ", "---", "1e999", "0x1", "\x1b[2J"]
            cells[int(rng.integers(len(cells)))] = odd[int(rng.integers(len(odd)))]
            return "\n".join([*lines[:at], ",".join(cells), *lines[at + 1 :]]), True
        case 6:
            return "\n".join([*lines[:at], *lines[at + 1 :]]), True
        case 7:
            return "\n".join([*lines[:at], lines[at], *lines[at:]]), True
        case 8:
            return text.replace(",", str(rng.choice([";", "\t", "|"]))), True
        case 9:
            return text.replace("time_s", str(rng.choice(["time", "t", "", "position", "zeit\x07"])), 1), True
        case 10:
            return text + "0" * int(rng.integers(1, 100_000)), True
        case _:
            return damaged(text.encode("utf-8", "surrogateescape"), rng).decode("utf-8", "surrogateescape"), False


@cache
def _mat_files() -> list[bytes]:
    """A few that are right, in both versions and with what else MATLAB keeps in them."""
    from io import BytesIO

    from scipy.io import savemat
    from scipy.sparse import csc_matrix

    log = healthy_log()
    columns = {"time_s": log.time, "force": log.u[:, 0], "position": log.y[:, 0]}
    models = {"A": np.eye(2), "B": np.ones((2, 1)), "C": np.ones((1, 2))}
    made = []
    for content, options in (
        (columns, {}),
        (columns, {"do_compression": True}),
        (columns, {"format": "4"}),
        (columns | {"notes": {"a": [1, "x"]}, "cells": np.array([{"b": 1}], dtype=object)}, {"do_compression": True}),
        (models, {"do_compression": True}),
        (models | {"S": csc_matrix(np.eye(3)), "z": 1 + 2j}, {}),
    ):
        file = BytesIO()
        savemat(file, content, **options)
        made.append(file.getvalue())
    return made


def mat_file(rng: np.random.Generator, folder: Path) -> None:
    """A damaged MAT file, read as a log and as a model."""
    choices = _mat_files()
    path = folder / "log.mat"
    path.write_bytes(damaged(choices[int(rng.integers(len(choices)))], rng))
    plant = read_description(CART)
    if rng.random() < 0.5:
        read_arrays(path)
    else:
        read_log(path, plant.columns, plant.Ts)


@cache
def _parquet_file() -> bytes:
    from io import BytesIO

    import pyarrow as pa
    import pyarrow.parquet as pq

    log = healthy_log()
    file = BytesIO()
    pq.write_table(pa.table({"time_s": log.time, "force": log.u[:, 0], "position": log.y[:, 0]}), file)
    return file.getvalue()


def parquet_log(rng: np.random.Generator, folder: Path) -> None:
    """A damaged Parquet log."""
    path = folder / "log.parquet"
    path.write_bytes(damaged(_parquet_file(), rng))
    plant = read_description(CART)
    read_log(path, plant.columns, plant.Ts)
