"""Steps of proofs that were forged by thought: each would hold if one line of the checker were left out."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from proof_cases import claims, proven, steps_of, tiny, with_steps
from proof_edits import NOTHING
from test_terms_of_proofs import FACTORS, S_WITHIN, alarm_of, by_hand, s_within

Steps = list[dict[str, Any]]


def numbers(*values: float) -> dict[str, Any]:
    return {"shape": [len(values)], "hex": " ".join(value.hex() for value in values)}


def start(kind: str, sample: int = 0, at: float | None = None) -> dict[str, Any]:
    """A start; ``at`` the only state of the set that it assumes."""
    none = {"rows": {"shape": [0, 1], "hex": ""}, "lower": NOTHING, "upper": NOTHING}
    point = {} if at is None else {"set": {"box_lower": numbers(at), "box_upper": numbers(at)} | none}
    return {"step": "start", "sample": sample, "from": kind, "template": {"shape": [0, 1], "hex": ""}} | point


def bound(sample: int, side: str, value: float, first: int, last: int) -> dict[str, Any]:
    """Of the state, by no multipliers at all."""
    zeros = {"shape": [last + 1 - first, 1], "hex": " ".join("0" * (last + 1 - first))}
    where = {"sample": sample, "row": 0, "side": side, "value": value.hex()}
    return {"step": "x", "first": first, "last": last, "on_start": NOTHING, "on_output": zeros} | where


def with_line(alarm: dict[str, Any], *place: int, line: tuple[float, float, float]) -> dict[str, Any]:
    words = " ".join(value.hex() for value in line)
    return alarm | {"on_line": [list(place)], "line": {"shape": [1, 3], "hex": words}}


NO_FACTOR = FACTORS | {"functional": {"shape": [1, 3], "hex": "0 0 0"}}
S_IS_ZERO = [s_within("upper", 0.0), s_within("lower", 0.0)]
AROUND_FIVE = [bound(1, side, 5.0 + by, 0, 1) for side, by in (("lower", -0.2), ("upper", 0.2))]
ANYWHERE = {"physical": [numbers(-100.0), numbers(100.0)]}
# x0 in [-1, 1], x+ = x + w + 0.5 Delta x, |w| <= 0.1, |Delta| <= 1 or none, y = x + v, |v| <= 0.2
HEALTHY: dict[str, tuple[list[float], bool, Steps]] = {
    # 3 after 0 is none, but what is claimed is that the model holds from sample 2 on
    "samples before the start": ([0.0, 3.0, 3.0], False, [start("physical", 2), alarm_of(2, 1.0, -1.0, 0.0)]),
    # a bound that no row of its window is about
    "a bound after its window": ([0.9, 1.1], False, [bound(1, "upper", 0.0, 0, 0), alarm_of(1, -1.0, first=1)]),
    "a bound before its window": (
        [0.9, 1.1, 1.2], False, [bound(1, "upper", 0.0, 2, 2), alarm_of(2, -1.0, 0.0, first=1)],
    ),
    # p <= 0.5 turned round: p >= 0.5
    "a negative multiplier of a line": (
        [0.9, 0.5], True, [FACTORS, *S_WITHIN, with_line(alarm_of(1, -1.0, 1.0), 0, 0, 0, line=(-1.0, 0.0, 0.5))],
    ),
    # what an earlier start led to is forgotten with what it assumed
    "bounds of states of another start": (
        [0.9, 1.1], False, [start("assumed", at=5.0), *AROUND_FIVE, start("first"), alarm_of(1, 1.0, first=1)],
    ),
    "bounds of s of another start": (
        [0.9, 1.7], True, [start("assumed", at=0.0), FACTORS, *S_IS_ZERO, start("first"), alarm_of(1, 0.0, -1.0)],
    ),
    "bounds of s of other factors": ([0.9, 1.7], True, [NO_FACTOR, *S_IS_ZERO, FACTORS, alarm_of(1, 0.0, -1.0)]),
    "a set that is assumed, and is not": ([0.9, 1.1], False, [start("assumed"), alarm_of(1, 1.0, first=1)]),
}  # fmt: skip


@pytest.mark.parametrize("what", HEALTHY)
def test_of_a_healthy_run_nothing_is_proven(what: str, tmp_path: Path) -> None:
    y, uncertain, steps = HEALTHY[what]
    assert claims(by_hand(tmp_path, y, uncertain, steps, 0, ANYWHERE)) == []


def test_the_steps_that_are_forged_hold_where_they_are_in_place(tmp_path: Path) -> None:
    """They are refused for what is wrong with them, not for how they are written."""
    y, _, (_, *bounds, _, alarm) = HEALTHY["bounds of states of another start"]
    ((_, _, premises),) = claims(by_hand(tmp_path, y, False, [start("assumed", at=5.0), *bounds, alarm], 0))
    assert "ASSUMED at sample 0 (left by others' models): 5 to 5" in premises[0]
    y, _, (_, *steps, _, alarm) = HEALTHY["bounds of s of another start"]
    ((_, _, premises),) = claims(by_hand(tmp_path, y, True, [start("assumed", at=0.0), *steps, alarm], 0))
    assert "ASSUMED at sample 0 (left by others' models): 0 to 0" in premises[0]
    late = [start("physical"), alarm_of(2, 1.0, -1.0, 0.0)]
    ((_, _, premises),) = claims(by_hand(tmp_path, [0.0, 3.0, 3.0], False, late, 0, ANYWHERE))
    assert "from sample 0 on, where the state is in its physical range" in premises[0]
    below = [FACTORS, *S_WITHIN, with_line(alarm_of(1, -1.0, 1.0), 0, 0, 1, line=(1.0, 0.0, -0.5))]
    assert claims(by_hand(tmp_path, [0.9, -0.2], True, below, 0))  # p >= -0.5
    below[-1] |= {"on_line": [[0, 0, 1], [0, 1, 1]], "line": {"shape": [2, 3], "hex": "0x1p+0 0 -0x1p-1 0x1p+0 0 0"}}
    assert claims(by_hand(tmp_path, [0.9, -0.2], True, below, 0)) == []  # a line of a channel that there is not


@pytest.mark.parametrize("repeated", [slice(1, 3), slice(1, -1)])
def test_a_chain_without_its_alarm_is_refused(repeated: slice, tmp_path: Path) -> None:
    plant, log, _ = tiny()
    files = proven(plant, log, tmp_path)
    assert files is not None
    steps = steps_of(files[0])
    assert claims(files)
    forged = [steps[0], *deepcopy(steps[repeated]), *steps[1:]]
    assert claims((with_steps(files[0], forged), *files[1:])) == []
    assert claims((with_steps(files[0], [*steps, *steps[repeated]]), *files[1:])) == []
