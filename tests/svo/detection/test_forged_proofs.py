"""Proofs that were edited: the checker proves nothing by them that is not so."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from proof_cases import Files, claims, steps_of, with_steps
from proof_edits import NOTHING, dropped, edited, of_kind


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
