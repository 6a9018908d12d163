"""The command line: in this process, and as a user's shell starts it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

from svo.cli import app
from tests.fuzz import files, records
from tests.fuzz.limits import BYTES, Limit, most_memory
from tests.fuzz.outcome import ROOT, WrongError

WORDS = [
    "",
    "-1",
    "0",
    "1",
    "nan",
    "inf",
    "1e999",
    "9" * 400,
    "text",
    "eclipse",
    "cart.toml",
    "log.csv",
    "nowhere.csv",
    ".",
    "/",
    "../x",
    "\x1b[31m",
    "ä",
    "--json",
    "--help",
    "--out",
    "out",
    "--noise",
    "quiet",
    "stated",
    "--fault",
    "--profile",
    "--seed",
    "--runs",
    "--workers",
    "--log",
    "--full",
    "alarms.jsonl",
    "--until-end",
    "--horizon",
    "3",
    "--size",
    "--architecture",
    "II",
]
COMMANDS = [
    "detect",
    "verify",
    "calibrate",
    "plants",
    "distinguish",
    "simulate",
    "report",
    "design-input",
    "watch",
    "--version",
]


def _arguments(rng: np.random.Generator, folder: Path) -> list[str]:
    """A command with words that may or may not belong to it, in a folder with a model, a log and alarms."""
    (folder / "cart.toml").write_text(files.cart_text(), encoding="utf-8")
    (folder / "log.csv").write_text(files.healthy_csv(), encoding="utf-8")
    (folder / "alarms.jsonl").write_text("\n".join(records._cart()[3]), encoding="utf-8")
    command = str(rng.choice(COMMANDS))
    words = [str(rng.choice(WORDS)) for _ in range(int(rng.integers(0, 4)))]
    if command in ("detect", "calibrate", "watch") and rng.random() < 0.7:
        words = ["cart.toml", "log.csv", *words]
    if command == "verify" and rng.random() < 0.7:
        words = ["alarms.jsonl", *words]
    if command == "watch":
        words.append("--until-end")
    return [command, *words]


def options(rng: np.random.Generator, folder: Path) -> None:
    """Words in any order, in this process."""
    arguments = _arguments(rng, folder)
    here = os.getcwd()
    os.chdir(folder)
    try:
        done = CliRunner().invoke(app, arguments)
    finally:
        os.chdir(here)
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    if done.exit_code not in (0, 1, 2):
        raise WrongError(f"exit code {done.exit_code}: svo {' '.join(arguments)}")


def command(rng: np.random.Generator, folder: Path) -> None:
    """The real command, in a process of its own, on files of the other kinds or with words in any order."""
    arguments = _arguments(rng, folder)
    match int(rng.integers(3)):
        case 0:
            _keep(files.description, rng, folder)
            arguments = ["detect", "cart.toml", "log.csv"]
        case 1:
            _keep(files.csv_log, rng, folder)
            arguments = ["detect", "cart.toml", "log.csv", "--json"]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    process = subprocess.Popen(
        [sys.executable, "-m", "svo", *arguments], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
    )  # fmt: skip
    errors, most = watched(process, f"svo {' '.join(arguments)}")
    if b"Traceback" in errors or process.returncode not in (0, 1, 2):
        raise WrongError(f"svo {' '.join(arguments)} ended with {process.returncode}: {errors[-300:]!r}")
    if most > BYTES:
        raise WrongError(f"{most / BYTES:.2f} GB: svo {' '.join(arguments)}")


def watched(process: subprocess.Popen[bytes], what: str) -> tuple[bytes, int]:
    """What a command wrote to its errors, and the most memory that it held, in bytes.

    Of the process itself while it runs: what the system says of children that have ended is the most of all of them,
    and counts what their parent held when it started them.
    """
    most, limit = 0, Limit(process.pid)
    while True:
        try:
            return process.communicate(timeout=0.05)[1], most
        except subprocess.TimeoutExpired:
            most = max(most, most_memory(process.pid))
        if limit.passed():
            process.kill()
            process.communicate()
            raise WrongError(f"{limit}: {what}")


def _keep(kind: object, rng: np.random.Generator, folder: Path) -> None:
    """Leave behind the files of a case of another kind, whatever became of the case itself."""
    try:
        kind(rng, folder)  # type: ignore[operator]
    except Exception:
        return
