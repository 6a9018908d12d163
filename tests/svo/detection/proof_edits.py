"""Edits of the steps of a proof."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from typing import Any

from proof_cases import Files, steps_of, with_steps

NOTHING = {"shape": [0], "hex": ""}  # an array


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
