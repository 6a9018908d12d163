"""The proofs of the alarms of a run, from their first sets on, as one packed file: `docs/proof_format.md`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from svo.isolation import Alarm
from svo.store import write_whole
from svo.store.packed_lines import packed

FORMAT = "svo-proof-1"


class Chain(NamedTuple):
    """The proof of one alarm.

    Attributes
    ----------
    alarm : Alarm
    steps : list of dict
        As `ProofSteps` has them.
    """

    alarm: Alarm
    steps: list[dict[str, Any]]


def write_proof(path: Path, chains: Sequence[Chain]) -> None:
    """Write the proofs of alarms of one run."""
    source = chains[0].alarm.source
    head = {"format": FORMAT, **{key: source[key] for key in ("plant", "noise", "architecture") if key in source}}
    lines = [head, *(line for chain in chains for line in _lines(chain))]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    write_whole(path, lambda file: file.write_bytes(packed(text.encode())))


def _lines(chain: Chain) -> Iterator[dict[str, Any]]:
    alarm = chain.alarm
    yield {"step": "chain", "observer": alarm.observer, "sample": alarm.sample, "time": float(alarm.time).hex()}
    yield from chain.steps
