"""Proofs from the plant to the alarm, checked by a program that shares no line with this project; and forged ones."""

from __future__ import annotations

import ast
import gzip
import hashlib
import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import nullcontext
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from checkers import CHECK, FOLDER
from proof_cases import Files, Made, answer, claims, proven, random_plant, steps_of, tiny, with_steps
from typer.testing import CliRunner

from svo import UncertainModel, Uncertainty, detect, find_plant, read_log, verify
from svo.cli import app
from svo.detection.plant_record import plant_record
from svo.store.packed_lines import members_of
from tests.svo.observers.long_chains import long_chains

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
REFUSALS = CHECK.REFUSALS


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Files, int]:
    plant, log, healthy = tiny()
    with long_chains():
        files = proven(plant, log, tmp_path_factory.mktemp("tiny"))
    assert files is not None
    return files, healthy


@pytest.fixture(scope="module")
def short_case(tmp_path_factory: pytest.TempPathFactory) -> tuple[Files, int]:
    """The same from the readings alone."""
    plant, log, healthy = tiny()
    files = proven(plant, log, tmp_path_factory.mktemp("short"))
    assert files is not None
    return files, healthy


# -- what is proven ---------------------------------------------------------------------------------------------------


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


# -- what is refused --------------------------------------------------------------------------------------------------


def edited(change: Callable[[list[Any]], Any]) -> Callable[[Files], Files]:
    def forge(files: Files) -> Files:
        steps = deepcopy(steps_of(files[0]))
        change(steps)
        return with_steps(files[0], steps), *files[1:]

    return forge


def of_kind(steps: list[Any], kind: str) -> list[Any]:
    return [step for step in steps if step.get("step") == kind]


def dropped(*kinds: str) -> Callable[[list[Any]], None]:
    return lambda steps: steps.__setitem__(slice(None), [s for s in steps if s.get("step") not in kinds])


def shifted(by: int) -> Callable[[list[Any]], None]:
    def change(steps: list[Any]) -> None:
        for step in steps[2:]:
            step |= {name: step[name] + by for name in ("sample", "first", "last") if name in step}

    return change


def tighter(kind: str) -> Callable[[list[Any]], None]:
    def change(steps: list[Any]) -> None:
        for step in of_kind(steps, kind):
            step["value"] = (float.fromhex(step["value"]) - (0.5 if step["side"] == "upper" else -0.5)).hex()

    return change


def earlier(steps: list[Any]) -> None:
    """The alarm said to be of a healthy sample."""
    steps[1] |= {"sample": 5, "time": (2.5).hex()}
    alarm = of_kind(steps, "alarm")[0]
    alarm |= {"last": 5, "first": 5 - alarm["last"] + alarm["first"]}


def with_line(side: int, *line: float) -> Callable[[list[Any]], None]:
    """The multiplier, slope and intercept of one more line in the proof of a healthy sample."""

    def change(steps: list[Any]) -> None:
        earlier(steps)
        alarm = of_kind(steps, "alarm")[0]
        alarm |= {"on_line": [[0, 0, side]], "line": {"shape": [1, 3], "hex": " ".join(v.hex() for v in line)}}

    return change


FORGED: dict[str, Callable[[Files], Files]] = {
    "another observer": edited(lambda steps: steps[1].__setitem__("observer", "sensor")),
    "another noise set": edited(lambda steps: steps[0].__setitem__("noise", "none")),
    "another time": edited(lambda steps: steps[1].__setitem__("time", (99.0).hex())),
    "samples shifted": edited(shifted(1)),
    "samples shifted back": edited(shifted(-1)),
    "a healthy sample": edited(earlier),
    "a healthy sample, claimed": edited(lambda steps: steps[1].update({"sample": 5, "time": (2.5).hex()})),
    "no bounds of states": edited(dropped("x")),
    "no bounds of channels": edited(dropped("s")),
    "no start": edited(dropped("start")),
    "no alarm": edited(dropped("alarm")),
    "no steps": edited(lambda steps: steps.__setitem__(slice(1, None), [])),
    "states within less": edited(tighter("x")),
    "channels within less": edited(tighter("s")),
    "the largest set": edited(lambda steps: of_kind(steps, "start")[0].__setitem__("from", "largest")),
    "signs turned": edited(
        lambda steps: of_kind(steps, "alarm")[0]["on_output"].__setitem__(
            "hex", " ".join(w[1:] if w[0] == "-" else "-" + w if w != "0" else w
                            for w in of_kind(steps, "alarm")[0]["on_output"]["hex"].split())
        )
    ),
    "a line that cuts": edited(with_line(0, 1024.0, 0.0, -1024.0)),
    "a line below that cuts": edited(with_line(1, 1024.0, 0.0, 1024.0)),
    "a line the wrong way round": edited(with_line(0, -1024.0, 0.0, 1024.0)),
    "a line that is infinite": edited(with_line(0, 1.0, 0.0, float("-inf"))),
    "a step of no kind": edited(lambda steps: steps.insert(3, {"step": "trust me"})),
    "a list": edited(lambda steps: steps.insert(3, [])),
}  # fmt: skip


def alarm_of(last: int, *on_output: float, first: int = 0) -> dict[str, Any]:
    """An alarm with these multipliers of the only output."""
    readings = {"shape": [len(on_output), 1], "hex": " ".join(m.hex() for m in on_output)}
    return {"step": "alarm", "first": first, "last": last, "on_start": NOTHING, "on_output": readings}


def s_within(side: str, value: float) -> dict[str, Any]:
    nothing = {"first": 0, "last": 0, "on_start": NOTHING, "on_output": {"shape": [1, 1], "hex": "0"}}
    return {"step": "s", "sample": 0, "channel": 0, "side": side, "value": value.hex()} | nothing


NOTHING = {"shape": [0], "hex": ""}
FACTORS = {
    "step": "channels", "sample": 0, "owner": [1],
    "gain": {"shape": [1, 2], "hex": "0x1.0p+0 0"}, "functional": {"shape": [1, 3], "hex": "0x1.0p-1 0 0"},
}  # fmt: skip
S_WITHIN, S_IS_ZERO = ([s_within("upper", end), s_within("lower", -end)] for end in (0.5, 0.0))
SHORT = {
    # x0 in [-1, 1], x1 = x0 + w + 0.5 Delta x0, |w| <= 0.1, |Delta| <= 1, y = x + v, |v| <= 0.2: readings up to 1.2 and
    # 1.8 are healthy. Each proof would hold if the term that it is named after were left out.
    "noise": ([1.1], 0, [alarm_of(0, -1.0)]),
    "the box of w": ([0.9, 1.25], 0, [alarm_of(1, 0.0, -1.0)]),
    "the range of p": ([0.9, 1.7], 1, [FACTORS, *S_WITHIN, alarm_of(1, 0.0, -1.0)]),
    "what no factors hold": ([0.9, 1.7], 1, [alarm_of(1, 0.0, -1.0)]),
    "where the first set is": ([0.9, 1.3], 0, [alarm_of(1, -1.0, first=1)]),
    "the bounds of s": ([0.9, 1.7], 1, [FACTORS, *S_IS_ZERO, alarm_of(1, 0.0, -1.0)]),
}


@pytest.mark.parametrize("term", SHORT)
def test_no_term_is_left_out(term: str, tmp_path: Path) -> None:
    y, uncertain, steps = SHORT[term]
    assert claims(by_hand(tmp_path, y, bool(uncertain), steps, start=1 if "first set" in term else 0)) == []
    further = [value + 2.0 for value in y]  # which no term explains
    assert claims(by_hand(tmp_path, further, bool(uncertain), steps, 0)) or "first set" in term or "bounds of s" in term


def by_hand(
    folder: Path, y: list[float], uncertain: bool, steps: list[Any], start: int, further: dict[str, Any] | None = None
) -> Files:
    """A proof of these steps, of a plant that can be reckoned with in one's head and of which ``further`` is known."""
    more = {"uncertainties": [Uncertainty(A=[[0.5]])]} if uncertain else {}
    plant = Made(UncertainModel([[1.0]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.2], Ts=1.0, **more))
    last = steps[-1]["last"]
    head = {"format": "svo-proof-1", "plant": "made", "noise": "stated"}
    chain = {"step": "chain", "observer": "nominal", "sample": last, "time": float(last).hex()}
    begin = {"step": "start", "sample": start, "from": "first", "template": {"shape": [0, 1], "hex": ""}}
    record = plant_record(plant, "stated")
    record["observers"]["nominal"] |= further or {}
    (folder / "plant.json").write_text(json.dumps(record))
    rows = "".join(f"{float(k)},{'' if np.isnan(value) else value}\n" for k, value in enumerate(y))
    (folder / "log.csv").write_text("time_s,y0\n" + rows)
    proof = with_steps(folder / "proof", [head, chain, begin, *steps])
    return proof, folder / "plant.json", folder / "log.csv"


def with_sum(column: int, samples: int, bound: float, remainder: float) -> dict[str, Any]:
    ends = {"shape": [2], "hex": f"{(-bound).hex()} {bound.hex()}"}
    sums = [{"column": column, "samples": samples, "ends": ends}]
    return {"sums": sums, "remainder": {"shape": [1, 1], "hex": remainder.hex()}}


@pytest.mark.parametrize(
    ("y", "bound", "remainder", "holds"),
    [
        # x0 = x1 = x2 but for w, |x0| <= 1, |w| <= 0.1: the sum of the outputs is at most 3.3
        ([1.1, 1.3, 1.3], 0.3, 0.0, True),  # 3.7 > 3.3 + 0.3, though each reading has its noise of 0.2
        ([1.1, 1.3, 1.3], 0.5, 0.0, False),
        ([1.1, 1.3, 1.3], 0.3, 0.03, True),  # 3.7 > 3.6 + 3 * 0.03
        ([1.1, 1.3, 1.3], 0.3, 0.04, False),
        ([1.1, np.nan, 1.45], 0.1, 0.0, True),  # 2.55 > 2.2 + 0.1 + 0.2: one is missing
        ([1.1, np.nan, 1.45], 0.2, 0.0, False),
    ],
)
def test_the_checker_takes_sums_of_readings(
    tmp_path: Path, y: list[float], bound: float, remainder: float, holds: bool
) -> None:
    alarm = alarm_of(2, 0.0, 0.0, 0.0) | {"on_sum": [[0, 2]], "sum": {"shape": [1, 1], "hex": "-0x1.0p+0"}}
    known = with_sum(0, 3, bound, remainder)
    found = claims(by_hand(tmp_path, y, False, [alarm], 0, known))
    assert bool(found) is holds
    outside = alarm | {"on_sum": [[0, 1]]}
    assert claims(by_hand(tmp_path, y, False, [outside], 0, known)) == []


@pytest.mark.parametrize(("lower", "upper", "holds"), [(-9.0, 0.3, True), (-0.3, 9.0, False)])
def test_a_sum_of_noise_has_two_ends(tmp_path: Path, lower: float, upper: float, holds: bool) -> None:
    """The noise is what a reading has more than its output, 0.4 at least over the three samples."""
    alarm = alarm_of(2, 0.0, 0.0, 0.0) | {"on_sum": [[0, 2]], "sum": {"shape": [1, 1], "hex": "-0x1.0p+0"}}
    sums = [{"column": 0, "samples": 3, "ends": {"shape": [2], "hex": f"{lower.hex()} {upper.hex()}"}}]
    assert bool(claims(by_hand(tmp_path, [1.1, 1.3, 1.3], False, [alarm], 0, {"sums": sums}))) is holds


@pytest.mark.parametrize(("bound", "holds"), [(0.05, True), (0.14, True), (0.16, False)])
def test_the_checker_takes_sums_of_disturbances(tmp_path: Path, bound: float, holds: bool) -> None:
    # after two steps x is at most 1.2, or 1 + the bound of the sum; the reading says at least 1.15
    alarm = alarm_of(2, 0.0, 0.0, -1.0) | {"on_sum": [[0, 1]], "sum": {"shape": [1, 1], "hex": "0x1.0p+0"}}
    files = by_hand(tmp_path, [1.0, 1.1, 1.35], False, [alarm], 0, with_sum(1, 2, bound, 0.0))
    assert bool(claims(files)) is holds


def of_readings(change: Callable[[dict[str, Any]], None]) -> Callable[[Files], Files]:
    return edited(lambda steps: change(of_kind(steps, "start")[0]))


def halved(end: str) -> Callable[[dict[str, Any]], None]:
    """The box less wide on one side: y is at sample 3 near 4, within 0.2."""

    def change(start: dict[str, Any]) -> None:
        words = [float.fromhex(start[name]["hex"]) for name in ("lower", "upper")]
        start[end]["hex"] = (0.5 * sum(words)).hex()

    return change


FORGED_READINGS: dict[str, Callable[[Files], Files]] = {
    "a lower end": of_readings(halved("lower")),
    "an upper end": of_readings(halved("upper")),
    "no inverse": of_readings(lambda start: start["inverse"].update({"shape": [1, 0, 1], "hex": ""})),
    "an inverse of nothing": of_readings(lambda start: start["inverse"].update(hex="0")),
    "half an inverse": of_readings(lambda start: start["inverse"].update(hex=(0.5).hex())),
    "an inverse turned": of_readings(lambda start: start["inverse"].update(hex=(-1.0).hex())),
    "another sample": of_readings(lambda start: start.update(sample=start["sample"] - 1)),
    "a first set": of_readings(lambda start: start.update({"from": "first"})),
    "a physical range": of_readings(lambda start: start.update({"from": "physical"})),
    "samples shifted": edited(shifted(-1)),
    "a healthy sample": edited(earlier),
    "a healthy sample, claimed": edited(lambda steps: steps[1].update({"sample": 6, "time": (3.0).hex()})),
}


@pytest.mark.parametrize("what", FORGED)
def test_a_forged_proof_is_refused(case: tuple[Files, int], what: str) -> None:
    assert claims(case[0])
    assert claims(FORGED[what](case[0])) == []


@pytest.mark.parametrize("what", FORGED_READINGS)
def test_a_forged_proof_by_readings_is_refused(short_case: tuple[Files, int], what: str) -> None:
    assert claims(short_case[0])
    assert claims(FORGED_READINGS[what](short_case[0])) == []


def test_a_proof_of_other_readings_is_refused(case: tuple[Files, int], tmp_path: Path) -> None:
    proof, plant, log = case[0]
    lines = log.read_text().splitlines()
    healthy = tmp_path / "healthy.csv"
    cells = [line.split(",") for line in lines[1:]]
    healthy.write_text("\n".join([lines[0], *(",".join([*row[:-1], cells[0][-1]]) for row in cells)]) + "\n")
    assert claims((proof, plant, healthy)) == []
    empty = tmp_path / "missing.csv"
    empty.write_text("\n".join([lines[0], *(",".join([*row[:-1], ""]) for row in cells)]) + "\n")
    assert claims((proof, plant, empty)) == []


def test_a_set_that_is_assumed_is_a_premise_that_is_printed(case: tuple[Files, int]) -> None:
    steps = deepcopy(steps_of(case[0][0]))
    start = of_kind(steps, "start")[0]
    ends = {end: {"shape": [1], "hex": (-1.0 if "lower" in end else 1.0).hex()} for end in ("box_lower", "box_upper")}
    none = {"rows": {"shape": [0, 1], "hex": ""}, "lower": NOTHING, "upper": NOTHING}
    start |= {"from": "assumed", "set": ends | none}
    ((_, _, premises),) = claims((with_steps(case[0][0], steps), *case[0][1:]))
    assert "ASSUMED at sample 0 (left by others' models): -1 to 1" in premises[0]
    zero = {"shape": [1], "hex": "0"}
    row = {"rows": {"shape": [1, 1], "hex": "0x1.8p+0"}, "lower": zero, "upper": zero}
    of_kind(steps, "start")[0]["set"] |= row
    for step in steps[3:]:
        if step.get("first") == 0:
            step["on_start"] = zero
    ((_, _, premises),) = claims((with_steps(case[0][0], steps), *case[0][1:]))
    assert premises[0].endswith("-1 to 1; [1.5] x: 0 to 0")


def mutated(steps: list[Any], rng: np.random.Generator) -> list[Any]:
    """A few entries of some steps changed, steps lost, doubled or exchanged."""
    steps = deepcopy(steps)
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(1, len(steps)))
        match int(rng.integers(6)):
            case 0:
                del steps[at]
            case 1:
                steps.insert(int(rng.integers(1, len(steps))), deepcopy(steps[at]))
            case _:
                change_entry(steps[at], rng)
        if len(steps) < 2:
            break
    return steps


def change_entry(step: dict[str, Any], rng: np.random.Generator) -> None:
    name = str(rng.choice(sorted(step)))
    value = step[name]
    if isinstance(value, dict):
        key = str(rng.choice(sorted(value)))
        inner = value[key]
        if isinstance(inner, dict):
            change_entry(value, rng)
        elif isinstance(inner, str) and inner:
            words = inner.split(" ")
            words[int(rng.integers(len(words)))] = other_number(rng)
            value[key] = " ".join(words)
        else:
            value[key] = [int(rng.integers(0, 4)) for _ in range(int(rng.integers(0, 3)))]
    elif isinstance(value, int):
        step[name] = int(rng.integers(-1, 12))
    elif isinstance(value, str) and value.lstrip("-").startswith("0x"):
        step[name] = other_number(rng)
    else:
        step[name] = rng.choice(["x", "s", "upper", "lower", "first", "largest", "nominal", "other"]).item()


def other_number(rng: np.random.Generator) -> str:
    return str(
        rng.choice([float(rng.normal(0.0, 10.0 ** rng.uniform(-3, 3))).hex(), "0", "inf", "nan", "-0x1.0p+1000"])
    )


def forge_at_random(case: tuple[Files, int], seeds: range) -> int:
    """How many random edits are still accepted, all of them with claims that are true."""
    files, healthy = case
    right, still_true = steps_of(files[0]), 0
    for seed in seeds:
        changed = mutated(right, np.random.default_rng(seed))
        for observer, sample, premises in claims((with_steps(files[0], changed), *files[1:])):
            assert observer == "nominal", seed
            assert sample > healthy, seed  # up to there the model itself made the readings
            assert premises, seed
            still_true += 1
    return still_true


def test_random_edits_prove_nothing_that_is_not_so(case: tuple[Files, int], short_case: tuple[Files, int]) -> None:
    assert forge_at_random(case, range(200)) < 200
    assert forge_at_random(short_case, range(200)) < 200


@pytest.mark.slow
def test_ten_thousand_random_edits_prove_nothing_that_is_not_so(
    case: tuple[Files, int], short_case: tuple[Files, int]
) -> None:
    assert forge_at_random(case, range(10_000)) < 10_000
    assert forge_at_random(short_case, range(10_000)) < 10_000


def test_what_cannot_be_written_is_refused_with_its_reason(tmp_path: Path) -> None:
    text = (CART.parent / "two_tanks.toml").read_text(encoding="utf-8")
    (plant := tmp_path / "tanks.toml").write_text(text.replace("[model]", "[model]\njitter = 0.01", 1))
    done = CliRunner().invoke(app, ["describe", str(plant), "--out", str(tmp_path / "plant.json")])
    assert done.exit_code == 1
    assert "no observer of a model with exact stamps" in " ".join(done.output.split())
