"""Every term of what a proof is checked by counts, in plants that can be reckoned with in one's head."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from proof_cases import Files, Made, claims, with_steps
from proof_edits import NOTHING

from svo import UncertainModel, Uncertainty
from svo.detection.plant_record import plant_record


def alarm_of(last: int, *on_output: float, first: int = 0) -> dict[str, Any]:
    """An alarm with these multipliers of the only output."""
    readings = {"shape": [len(on_output), 1], "hex": " ".join(m.hex() for m in on_output)}
    return {"step": "alarm", "first": first, "last": last, "on_start": NOTHING, "on_output": readings}


def s_within(side: str, value: float) -> dict[str, Any]:
    nothing = {"first": 0, "last": 0, "on_start": NOTHING, "on_output": {"shape": [1, 1], "hex": "0"}}
    return {"step": "s", "sample": 0, "channel": 0, "side": side, "value": value.hex()} | nothing


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
