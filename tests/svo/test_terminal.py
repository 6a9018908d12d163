"""What names of columns, faults and files can do to the terminal that shows them: nothing."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from rich.table import Table
from rich.text import Text

from svo.plant.registry import made_by
from svo.terminal import console, line, plain, safe_output
from tests.svo.commands import svo

CART = Path(__file__).parents[2] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")
ESCAPES = ["\x1b[31m", "\x1b]0;owned\x07", "\x9b2J", "\x08\x08", "\x7f", "\x00", "‮", "\u2028", "!"]
HOSTILE = "".join(ESCAPES).replace("\x00", "")  # a watch takes no line with NUL bytes for text


def assert_harmless(text: str) -> None:
    assert plain(text) == text


@pytest.fixture
def hostile(tmp_path: Path) -> tuple[Path, Path]:
    """The cart with hostile names of everything, and its log, in a folder of a hostile name."""
    folder = tmp_path / "logs\x1b[2J\x9b"
    folder.mkdir()
    escaped = json.dumps(HOSTILE)[1:-1].replace("\x7f", "\\u007f")
    text = CART.read_text()
    for name in ("position", "force", "m/s"):
        text = text.replace(f'"{name}"', f'"{name}{escaped}"')
    text = text.replace('title = "', f'title = "{escaped}').replace("faults.sensor]", f'faults."sensor{escaped}\\n"]')
    (folder / "cart.toml").write_text(text)
    header, rest = LOG.read_text().split("\n", 1)
    for name in ("position", "force"):
        header = header.replace(f",{name},", f',"{name}{HOSTILE}",')
    (folder / "log.csv").write_bytes(f"{header}\n{rest}".encode())
    return folder / "cart.toml", folder / "log.csv"


def test_detect_watch_and_verify_show_names_without_obeying_them(hostile: tuple[Path, Path], tmp_path: Path) -> None:
    plant, log = hostile
    results = [
        svo("detect", plant, log, "--out", tmp_path / "found\x1b[1m"),
        svo("detect", plant, log, "--json"),
        svo("watch", plant, log, "--until-end"),
        svo("calibrate", plant, log),
        svo("verify", tmp_path / "found\x1b[1m" / "alarms.jsonl", "--json"),
        svo("verify", tmp_path / "found\x1b[1m" / "alarms.jsonl", "--log", log),
    ]
    for result in results:
        assert result.exit_code == 0, result.output
        assert_harmless(result.output)
    assert "sensor\\u001b[31m" in results[0].stdout
    # A name cannot begin a line of its own.
    assert len(results[0].stdout.splitlines()) == 6
    assert json.loads(results[1].stdout)["alive"] == [f"sensor{HOSTILE}\n"]
    assert len(json.loads(results[4].stdout)) == 2


def test_errors_are_shown_without_being_obeyed(hostile: tuple[Path, Path]) -> None:
    plant, log = hostile
    results = [
        svo("detect", plant, f"{log}\x1b[31m"),
        svo("detect", CART, log),
        svo("detect", "eclipse", log),
        svo("detect", "cart\x1b[31m", log),
        svo("verify", log),
        svo("detect\x1b[31m"),
        svo("detect", plant, log, "more\x1b[31m"),
        svo("detect", plant, log, "--\x1b[31m"),
        svo("study", "eclipse\x1b[31m", "--out", "x"),
        svo("report", "\x1b[31m"),
        svo("simulate", "eclipse", "--out", "\x9b.csv\x1b"),
    ]
    for result in results:
        assert result.exit_code in (1, 2)
        assert_harmless(result.output)
    plant.write_text(plant.read_text().replace("horizon =", '"horizon\\u001b[31m" ='))
    wrong = svo("detect", plant, log)
    assert wrong.exit_code == 1
    assert_harmless(wrong.output)


def test_a_registered_plant_is_listed_without_being_obeyed(
    registered_tank: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made(loader: Any, name: str) -> Any:
        plant = made_by(loader, name)
        object.__setattr__(plant, "title", HOSTILE)
        return plant

    monkeypatch.setattr("svo.plant.registry.made_by", made)
    result = svo("plants")
    assert "\\u001b" in result.stdout
    assert_harmless(result.output)
    assert HOSTILE in [plant["title"] for plant in json.loads(svo("plants", "--json").stdout)]


def test_tables_are_plain_and_keep_their_own_colours() -> None:
    stream = io.StringIO()
    table = Table()
    table.add_column(Text(HOSTILE))
    table.add_row(Text(HOSTILE, style="red"))
    screen = console(width=200, force_terminal=True, color_system="standard")
    screen.file = stream
    screen.print(table)
    shown = stream.getvalue()
    assert shown.count("\\u001b[31m") == 2
    assert "\x1b[31m" in shown  # rich's own
    assert "\x07" not in shown
    assert "\x9b" not in shown


def test_text_that_is_shown_as_it_is() -> None:
    kept = "Füße 体 µ °\n\tzwei"
    assert plain(kept) == kept
    assert line(kept) == "Füße 体 µ °\\u000a\\u0009zwei"
    assert json.loads(plain(json.dumps(HOSTILE))) == HOSTILE


def test_what_a_terminal_cannot_say_ends_nothing(tmp_path: Path) -> None:
    plant = tmp_path / "cart.toml"
    plant.write_text(CART.read_text().replace("faults.sensor]", 'faults."Fühler 体"]').replace('"m"', '"体"'))
    environment = os.environ | {"PYTHONIOENCODING": "cp1252:strict"}
    for command in (("detect", "--out", "found"), ("watch", "--until-end", "--out", "watched")):
        arguments = [sys.executable, "-m", "svo", command[0], "cart.toml", LOG.resolve(), *command[1:]]
        done = subprocess.run(arguments, capture_output=True, cwd=tmp_path, env=environment, timeout=120)
        assert done.returncode == 0, done.stderr
        assert b"\\u4f53" in done.stdout
        assert len((tmp_path / command[-1] / "alarms.jsonl").read_text().splitlines()) == 2


@pytest.mark.skipif(shutil.which("sh") is None, reason="needs a shell")
def test_a_reader_that_has_had_enough_is_no_error(tmp_path: Path) -> None:
    for unbuffered, command in (("", f"detect {CART} {LOG} --out {tmp_path}/found"), ("1", "plants")):
        environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
        shell = f"{sys.executable} -m svo {command} | true"
        done = subprocess.run(["sh", "-c", shell], capture_output=True, text=True, env=environment, timeout=120)
        for words in ("Errno", "Traceback", "Exception", "error", "roken"):
            assert words not in done.stderr
    assert len((tmp_path / "found" / "alarms.jsonl").read_text().splitlines()) == 2


def test_another_broken_pipe_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "svo.plant.registered_plants", lambda: (_ for _ in ()).throw(BrokenPipeError(32, "Broken pipe"))
    )
    result = svo("plants")
    assert result.exit_code == 1
    assert "error: [Errno 32] Broken pipe" in result.stderr


def test_streams_are_as_before_after_it() -> None:
    before = sys.stdout, sys.stderr
    with safe_output():
        assert sys.stdout is not before[0]
    assert (sys.stdout, sys.stderr) == before
