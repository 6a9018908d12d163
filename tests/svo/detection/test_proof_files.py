"""Proofs from the plant to the alarm, checked by a program that shares no line with this project."""

from __future__ import annotations

import ast
import gzip
import hashlib
import json
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from proof_cases import Files, answer, proven, random_plant, steps_of
from proof_edits import of_kind
from typer.testing import CliRunner

from svo import detect, find_plant, read_log, verify
from svo.cli import app
from svo.store.packed_lines import members_of
from tests.svo.detection.checkers import CHECK, FOLDER
from tests.svo.observers.long_chains import long_chains

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"


@pytest.mark.parametrize(("name", "others"), [("svo_check", set()), ("svo_check_nonlinear", {"svo_check"})])
def test_the_checker_is_short_files_of_the_standard_library(name: str, others: set[str]) -> None:
    text = (FOLDER / f"{name}.py").read_text(encoding="utf-8")
    assert text.count("\n") < 500
    names = {
        (alias.name if isinstance(node, ast.Import) else node.module or "").partition(".")[0]
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert names <= sys.stdlib_module_names | others


@pytest.mark.parametrize("seed", [2, 7, 9, *(pytest.param(s, marks=pytest.mark.slow) for s in range(40) if s > 9)])
def test_the_checker_proves_what_full_proves(seed: int, tmp_path: Path) -> None:
    """Schedules, rows on w, templates, uncertainties of any rank, ranges."""
    for is_long in (False, True):
        (folder := tmp_path / str(is_long)).mkdir()
        with long_chains() if is_long else nullcontext():
            plant, log = random_plant(seed)
            files = proven(plant, log, folder)
        if files is None:
            return
        code, text = answer(*files)
        assert code == 0, text
        n, steps = plant.model.n_states, steps_of(files[0])
        assert next(s for s in steps if s.get("step") == "start")["template"]["shape"] == [seed % 2, n]
        assert any(s.get("row", 0) >= n for s in steps) is (is_long and bool(seed % 2))  # bounds along it
        assert ("given that the first set of the model holds the state at sample 0" in text) is is_long
        assert ("where the readings alone say where the state is" in text) is not is_long
        assert ("AXIOM" in text) is bool(seed % 2)
        assert ("physical range" in text) is (seed % 5 == 0)


def test_the_commands_write_what_the_checker_takes(tmp_path: Path) -> None:
    log, out = CART.with_suffix(".csv"), tmp_path / "found"
    run = lambda *words: CliRunner().invoke(app, [str(word) for word in words])  # noqa: E731
    proof, plant = tmp_path / "proof.jsonl.gz", tmp_path / "plant.json"
    assert run("detect", CART, log, "--out", out).exit_code == 0
    assert run("verify", out / "alarms.jsonl", "--full", log, "--write-proof", proof).exit_code == 0
    told = run("describe", CART, "--out", plant)
    code, text = answer(proof, plant, log)
    assert (told.exit_code, code) == (0, 0)
    digest, of_log = (hashlib.sha256(path.read_bytes()).hexdigest() for path in (plant, log))
    assert f"(sha256 {digest})" in " ".join(told.output.split())
    assert f"{plant} (sha256 {digest})" in text
    assert f"{log} (sha256 {of_log})" in text
    assert "2 of 2 alarms proven" in text
    written = proof.read_bytes()
    again = run("verify", out / "alarms.jsonl", "--full", log, "--write-proof", proof)
    assert again.exit_code == 0  # and nothing is left to write
    assert proof.read_bytes() == written
    assert run("verify", out / "alarms.jsonl", "--write-proof", tmp_path / "other.gz").exit_code == 1
    assert "without --full" in run("verify", out / "alarms.jsonl", "--write-proof", tmp_path / "other.gz").output


def test_an_interrupted_proof_is_gone_on_with_and_nothing_in_it_is_believed(tmp_path: Path) -> None:
    log, plant = CART.with_suffix(".csv"), find_plant(str(CART))
    found, proof = detect(plant, read_log(log, plant)), tmp_path / "proof.jsonl.gz"
    done: list[tuple[int, int]] = []

    def stop(*at: int) -> None:
        done.append((at[0], at[1]))
        if at[0] == 1 and len(done) == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        verify(found, full=True, write_proof=proof, progress=stop)
    assert len(of_kind(steps_of(proof), "alarm")) == 1
    first = proof.read_bytes()
    proof.write_bytes(first + gzip.compress(b"{")[:-3])  # the second chain was cut off as it was written
    assert verify(found, full=True, write_proof=proof, progress=stop).ok
    assert done == [(1, 2), (1, 2), (2, 2)]
    assert proof.read_bytes().startswith(first)
    assert len(of_kind(steps_of(proof), "alarm")) == 2
    whole, written = steps_of(proof), proof.read_bytes()
    begun = len(next(members_of(proof))[0])
    for end in (0, 7, begun, begun + 30, len(first) + 30, len(written) - 1):
        proof.write_bytes(written[:end])  # also within the first line, after it, and within the first chain
        assert verify(found, full=True, write_proof=proof).ok
        assert proof.read_bytes() == written
    for content in (b"other", gzip.compress(b"{}\n"), first + gzip.compress(b'{"step": "alarm"}\n')):
        (other := tmp_path / "other").write_bytes(content)
        with pytest.raises(ValueError, match="give another name"):
            verify(found, full=True, write_proof=other)
        assert other.read_bytes() == content
    assert steps_of(proof) == whole


def test_a_proof_of_another_log_loses_nothing_though_it_was_cut_off(tmp_path: Path) -> None:
    log, plant = CART.with_suffix(".csv"), find_plant(str(CART))
    data, proof = read_log(log, plant), tmp_path / "proof.jsonl.gz"
    assert verify(detect(plant, data), full=True, write_proof=proof).ok
    proof.write_bytes(content := proof.read_bytes()[:-9])
    other = detect(plant, replace(data, y=data.y + 1e-3 * (np.arange(len(data)) > 30)[:, None]))
    with pytest.raises(ValueError, match=r"another proof of .*; give another name"):
        verify(other, full=True, write_proof=proof)
    assert proof.read_bytes() == content


def test_a_proof_of_more_alarms_than_these_is_kept(tmp_path: Path) -> None:
    log, plant = CART.with_suffix(".csv"), find_plant(str(CART))
    found, proof = detect(plant, read_log(log, plant)), tmp_path / "proof.jsonl.gz"
    assert verify(found, full=True, write_proof=proof).ok
    content = proof.read_bytes()
    with pytest.raises(ValueError, match="proofs of other alarms than these; give another name"):
        verify(replace(found, alarms=found.alarms[:1]), full=True, write_proof=proof)
    assert proof.read_bytes() == content


def test_a_scheduled_plant_is_described_with_its_log(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["describe", "eclipse", "--models", "lpv", "--noise", "quiet", "--out", str(tmp_path / "plant.json")]
    )
    assert done.exit_code == 1
    assert "scheduled" in done.output
    assert "give the log" in done.output


@pytest.mark.slow
def test_the_eclipse_is_proven(tmp_path: Path) -> None:
    plant = find_plant("eclipse", models="lpv")
    for seed, fault in ((3, "elevator"), (4, "alpha"), (5, "dynamics")):
        (tmp_path / fault).mkdir()
        log = plant.simulate(fault, "soft", "quiet", seed)
        files = proven(plant, log, tmp_path / fault, noise="quiet")
        assert files is not None
        code, text = answer(*files)
        assert code == 0, text


def test_a_file_that_is_another_is_named(case: tuple[Files, int], tmp_path: Path) -> None:
    (proof, plant, log), _ = case
    (other := tmp_path / "other.csv").write_text("time_s,y\n0,1\n")
    for files, word in (
        ((other, plant, log), other),
        ((proof, other, log), other),
        ((proof, plant, other), "one column each"),
    ):
        code, text = answer(*files)
        assert code == 1
        assert text.startswith("NOT PROVEN: ")
        assert str(word) in text
        assert len(text.splitlines()) == 1


@pytest.mark.parametrize("at", [1, 2, 5, -1])
def test_the_first_line_that_does_not_follow_is_named(case: tuple[Files, int], at: int, tmp_path: Path) -> None:
    steps = steps_of(case[0][0])
    line = range(1, len(steps) + 1)[at - 1 if at > 0 else at]
    plant = json.loads(case[0][1].read_text())
    log = CHECK.Log(case[0][2], plant["columns"])
    for change in (b"{", b"[]", b'"\xe9"', b'{"step": "trust me", "sample": 0}', b'{"a": 1, "a": 2}'):
        lines = [json.dumps(step).encode() for step in steps]
        lines[line - 1] = change
        (path := tmp_path / "changed").write_bytes(b"\n".join(lines) + b"\n")
        with pytest.raises(CHECK.Wrong, match=f"^line {line}: "):
            CHECK.check(path, plant, log)
    code, text = answer(path, *case[0][1:])
    assert (code, text) == (1, f"NOT PROVEN: {path}: line {line}: an entry stands twice in an object\n")


def test_names_that_a_terminal_cannot_say_are_no_reason_to_fail(case: tuple[Files, int], tmp_path: Path) -> None:
    (name := tmp_path / "\u03b4.csv").write_bytes(case[0][2].read_bytes())
    command = [sys.executable, "-I", "-X", "utf8=0", str(FOLDER / "svo_check.py"), str(case[0][0]), "--model"]
    done = subprocess.run(
        [*command, str(case[0][1]), "--log", str(name)], capture_output=True, check=False, env={"LC_ALL": "C"}
    )
    assert done.returncode == 0, done.stderr
    assert b"1 of 1 alarms proven" in done.stdout


def test_what_cannot_be_written_is_refused_with_its_reason(tmp_path: Path) -> None:
    text = (CART.parent / "two_tanks.toml").read_text(encoding="utf-8")
    (plant := tmp_path / "tanks.toml").write_text(text.replace("[model]", "[model]\njitter = 0.01", 1))
    done = CliRunner().invoke(app, ["describe", str(plant), "--out", str(tmp_path / "plant.json")])
    assert done.exit_code == 1
    assert "no observer of a model with exact stamps" in " ".join(done.output.split())
