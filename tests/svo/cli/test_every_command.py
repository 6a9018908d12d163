"""What holds for every command: help that is whole, one rule for what exists, figures as JSON, colours."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest
import typer.main

from svo.cli import app
from svo.cli import progress as progress_module
from svo.cli.output import print_json
from tests.svo.commands import svo

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
CART, LOG = EXAMPLES / "cart.toml", EXAMPLES / "cart.csv"
COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]
PRINTS_NO_FIGURES = {"report"}


@pytest.mark.parametrize("width", ["80", "60", "200"])
@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_is_whole_at_any_width(command: str, width: str) -> None:
    words = [command] if command else []
    result = svo(*words, "--help", env={"COLUMNS": width})
    assert result.exit_code == 0
    assert result.stdout == svo(*words, "-h", env={"COLUMNS": width}).stdout
    text = re.sub(r"\[ARGS\]\.\.\.", "", result.stdout)
    assert "…" not in text
    assert "..." not in text
    if width == "80":
        assert max(map(len, result.stdout.splitlines())) <= 80
    plain = " ".join(text.split())
    for parameter in COMMANDS[command].params if command else ():
        if getattr(parameter, "help", None):
            assert " ".join(parameter.help.split()) in plain
    if not command:
        for name, one in COMMANDS.items():
            assert f"{name} {' '.join(one.help.split(chr(10) * 2)[0].split())}" in plain


def options_of(command: str) -> dict[str, Any]:
    return {name: parameter for parameter in COMMANDS[command].params for name in parameter.opts}


@pytest.mark.parametrize("command", COMMANDS)
def test_the_same_options_are_everywhere(command: str) -> None:
    options = options_of(command)
    assert ("--overwrite" in options) == ("--out" in options)
    assert "--json" in options or command in PRINTS_NO_FIGURES
    assert all(parameter.help for parameter in COMMANDS[command].params if parameter.name != "help")


def test_the_version_is_that_of_the_distribution() -> None:
    assert svo("--version").stdout == f"svo {version('svo-fdi')}\n"


@pytest.mark.parametrize(
    ("shell", "words"), [("bash", "complete_bash"), ("zsh", "complete_zsh"), ("fish", "complete_fish")]
)
def test_shells_complete_commands_and_options(shell: str, words: str) -> None:
    environment = {
        **os.environ, "_SVO_COMPLETE": words, "COMP_WORDS": "svo de", "COMP_CWORD": "1",
        "_TYPER_COMPLETE_ARGS": "svo de", "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }  # fmt: skip
    start = "import sys; sys.argv = ['svo']; from svo.cli import app; app(prog_name='svo')"
    ran = subprocess.run([sys.executable, "-c", start], env=environment, capture_output=True, text=True, check=False)
    assert "detect" in ran.stdout
    assert "design-input" in ran.stdout
    assert "watch" not in ran.stdout


# -- what exists is not overwritten ------------------------------------------------------------------------


def figures(result: Any) -> Any:
    """What a command printed as JSON, without tokens that JSON has not."""
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout, parse_constant=lambda token: pytest.fail(f"{token} is no JSON"))


def simulate(out: Path) -> list[str]:
    return ["simulate", "tank", "--noise", "calm", "--out", str(out / "log.csv")]


def detection(out: Path) -> list[str]:
    return ["detect", str(CART), str(LOG), "--out", str(out)]


def study(out: Path) -> list[str]:
    return ["study", "tank", "--runs", "1", "--workers", "1", "--fault", "gauge", "--noise", "calm", "--out", str(out)]


def refused(result: Any) -> str:
    assert result.exit_code == 1, result.output
    (message,) = [text for text in result.stderr.splitlines() if text.startswith("error: ")]
    return str(message)


def content(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.parametrize("command", [simulate, detection, study])
def test_what_exists_is_replaced_only_on_demand(
    registered_tank: str, tmp_path: Path, command: Callable[[Path], list[str]]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    first = figures(svo(*command(out), "--json"))
    assert first
    before = content(out)
    assert "--overwrite" in refused(svo(*command(out)))
    assert content(out) == before
    again = figures(svo(*command(out), "--json", "--overwrite"))
    if command is study:  # its figures have times of computation among them
        first, again = first["configuration"], again["configuration"]
    assert again == first
    assert set(content(out)) == set(before)


@pytest.mark.parametrize("command", [detection, study])
def test_only_results_of_the_same_command_are_replaced(
    registered_tank: str, tmp_path: Path, command: Callable[[Path], list[str]]
) -> None:
    other = study if command is detection else detection
    assert svo(*other(tmp_path)).exit_code == 0
    before = content(tmp_path)
    assert str(tmp_path) in refused(svo(*command(tmp_path), "--overwrite"))
    assert content(tmp_path) == before


def test_a_description_of_models_replaces_nothing_else(tmp_path: Path) -> None:
    for source in (CART, LOG):
        (path := tmp_path / source.name).write_bytes(content := source.read_bytes())
        read = [path] if source is CART else [CART, "--log", path]
        assert "is not overwritten" in refused(svo("describe", *read, "--out", path, "--overwrite"))
        assert path.read_bytes() == content
    assert f"there is no folder {tmp_path / 'no'}" in refused(
        svo("describe", CART, "--out", tmp_path / "no" / "a.json")
    )
    for _ in range(2):
        assert svo("describe", CART, "--out", tmp_path / "plant.json", "--overwrite").exit_code == 0


def test_files_of_somebody_else_in_a_study_are_not_removed(registered_tank: str, tmp_path: Path) -> None:
    assert svo(*study(tmp_path)).exit_code == 0
    (tmp_path / "thesis.tex").write_text("mine")
    before = content(tmp_path)
    assert "thesis.tex, which is none of its files" in refused(svo(*study(tmp_path), "--overwrite"))
    assert content(tmp_path) == before
    assert "both given" in refused(svo(*study(tmp_path), "--overwrite", "--resume"))


def test_a_changed_description_is_replaced_with_the_alarms_that_are_about_it(tmp_path: Path) -> None:
    (plant := tmp_path / "my.toml").write_text(CART.read_text())
    out = tmp_path / "out"
    assert svo("detect", plant, LOG, "--out", out).exit_code == 0
    plant.write_text(CART.read_text().replace("n = [0.05]", "n = [0.06]"))
    assert "--overwrite" in refused(svo("detect", plant, LOG, "--out", out))
    assert svo("detect", plant, LOG, "--out", out, "--overwrite").exit_code == 0
    assert (out / "my.toml").read_text() == plant.read_text()
    assert svo("verify", out / "alarms.jsonl", "--log", LOG).exit_code == 0


def test_a_watch_begins_anew_on_demand(tmp_path: Path) -> None:
    (log := tmp_path / "log.csv").write_text(LOG.read_text())
    watch = ("watch", CART, log, "--until-end", "--out", tmp_path / "out")
    assert svo(*watch).exit_code == 0
    alarms = (tmp_path / "out" / "alarms.jsonl").read_text()
    assert alarms
    other = ("watch", CART, LOG, "--until-end", "--out", tmp_path / "out")
    assert "another watch" in refused(svo(*other))
    assert svo(*other, "--overwrite").exit_code == 0
    assert (tmp_path / "out" / "alarms.jsonl").read_text().count("\n") == alarms.count("\n")


# -- figures ---------------------------------------------------------------------------------------------


def test_figures_are_json_without_words_that_json_has_not(capsys: pytest.CaptureFixture[str]) -> None:
    print_json({"a": [float("nan"), 1.0, (float("inf"),)], "b": {"c": -float("inf")}, "d": "NaN"})
    assert json.loads(capsys.readouterr().out) == {"a": [None, 1.0, [None]], "b": {"c": None}, "d": "NaN"}


def test_commands_print_json_and_nothing_else(registered_tank: str, tmp_path: Path) -> None:
    assert svo("detect", CART, LOG, "--out", tmp_path).exit_code == 0
    healthy = tmp_path / "healthy.csv"
    healthy.write_text("".join(LOG.read_text().splitlines(keepends=True)[:30]))
    for command in (
        ("plants",), ("detect", CART, LOG), ("verify", tmp_path / "alarms.jsonl"), ("calibrate", CART, healthy),
        ("import", LOG, "--toml", CART, "--out", tmp_path / "log.parquet"),
    ):  # fmt: skip
        assert figures(svo(*command, "--json"))


def test_a_watch_tells_a_program_what_happens() -> None:
    lines = svo("watch", CART, LOG, "--until-end", "--json").stdout.splitlines()
    events = [json.loads(line, parse_constant=lambda token: pytest.fail(token)) for line in lines]
    assert {event["event"] for event in events} >= {"alarm", "end"}
    alarms = [event for event in events if event["event"] == "alarm"]
    found = figures(svo("detect", CART, LOG, "--json"))
    assert {alarm["observer"]: alarm["time_s"] for alarm in alarms} == found["falsified_s"]
    assert all(alarm["proven"] for alarm in alarms)
    assert (events[-1]["state"], events[-1]["fault"]) == (found["state"], found["fault"])


def test_a_line_about_proofs_needs_proofs(tmp_path: Path) -> None:
    result = svo("detect", CART, LOG, "--out", tmp_path / "fault")
    assert f"Alarms with certificates: {tmp_path / 'fault' / 'alarms.jsonl'}; verdict: " in result.stdout
    (healthy := tmp_path / "log.csv").write_text("".join(LOG.read_text().splitlines(keepends=True)[:40]))
    result = svo("detect", CART, healthy, "--out", tmp_path / "healthy")
    assert "larms" not in result.stdout
    assert f"Verdict: {tmp_path / 'healthy' / 'verdict.json'}" in result.stdout


# -- files that are not there ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command",
    [
        ("detect", CART, "none.csv"), ("calibrate", CART, "none.csv"), ("verify", "none.jsonl"), ("report", "none"),
        ("detect", "none.toml", LOG), ("detect", CART, "log.xls"), ("detect", CART, "locked.csv"),
        ("watch", CART, "folder.csv", "--until-end"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_read_is_told_before_anything_slow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: tuple[Any, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "locked.csv").write_bytes(b"\xff\xfe\x00")
    work = "svo.plant.description.plant.DescribedPlant.bank"
    monkeypatch.setattr(work, lambda *_: pytest.fail("work was begun"))
    assert command[1 if command[0] in ("verify", "report") else 1 + (command[1] == CART)] in refused(svo(*command))


# -- terminals -------------------------------------------------------------------------------------------


def in_terminal(*arguments: str | Path, **environment: str) -> str:
    """What a command prints into a terminal."""
    reader, terminal = pty.openpty()
    command = [sys.executable, "-m", "svo", *map(str, arguments)]
    variables = {k: v for k, v in os.environ.items() if k not in ("NO_COLOR", "FORCE_COLOR")}
    variables |= {"TERM": "xterm-256color", "COLUMNS": "100", **environment}
    with subprocess.Popen(command, stdout=terminal, stderr=terminal, stdin=terminal, env=variables) as process:
        os.close(terminal)
        text = b""
        while True:
            try:
                new = os.read(reader, 65536)
            except OSError:  # the other end was closed
                break
            if not new:
                break
            text += new
        assert process.wait() == 0, text
    os.close(reader)
    return text.decode()


COLOUR = re.compile(r"\x1b\[(?:\d+;)*(?:3[0-8]|4[0-8]|9[0-7]|10[0-7])(?:;\d+)*m")


def test_colours_are_for_terminals_whose_user_wants_them() -> None:
    watch = ("watch", CART, LOG, "--until-end")
    assert COLOUR.search(in_terminal(*watch))
    assert not COLOUR.search(in_terminal(*watch, NO_COLOR="1"))
    assert "\x1b" not in svo(*watch).stdout


def test_a_bar_comes_after_two_seconds_and_only_in_a_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(progress_module, "SECONDS_BEFORE_BAR", 0.05)
    own = progress_module._bar
    monkeypatch.setattr(progress_module, "_bar", lambda counted: shown.append(str(counted)) or own(counted))
    with progress_module.progress("Samples") as update, progress_module.busy("Proving"):
        update(1, 2)
    assert not shown
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    from time import sleep

    with progress_module.progress("Samples") as update:
        update(1, 2)
    assert not shown
    with progress_module.progress("Samples") as update:
        update(1, 2)
        sleep(0.3)
        update(2, 2)
    assert shown == ["True"]
    capsys.readouterr()
