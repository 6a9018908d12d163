"""Forged alarms and proofs: thousands of edits with right digests, and what is accepted judged by an exact oracle.

    python -m benchmarks.forgery --edits 10000 --target checker --out forged/checker.jsonl

Targets: ``plain`` (svo verify of a record alone: is its claim true of its own numbers?), ``log`` (with log and plant:
of theirs?), ``full`` and ``checker`` (does a trajectory of the plant explain the log up to the alarm?). What is
accepted is *false* if a trajectory in fractions explains what the claim says that none does (`_exact_witness`), or if
two programs would read two files in it; else it is *still true*. A stopped run goes on with the edits that OUT lacks.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks._forged_alarms import Full, Plain, WithLog
from benchmarks._forged_proofs import Checked

BATCH, SEED = 100, 20_261_129
Judge = Callable[[np.random.Generator, Path], tuple[str, str]]
TARGETS: dict[str, Callable[[], Judge]] = {"plain": Plain, "log": WithLog, "full": Full, "checker": Checked}


def judged(judge: Judge, edits: range, seed: int) -> dict[str, Any]:
    """Counts of what came of edits, by kind; and the seeds of those that were accepted and are false."""
    counts: dict[str, Counter[str]] = {}
    holes: list[Any] = []
    with tempfile.TemporaryDirectory() as folder:
        for number in edits:
            kind, what = judge(np.random.default_rng([seed, number]), Path(folder))
            counts.setdefault(kind, Counter())[what.partition(":")[0]] += 1
            if what.startswith("false"):
                holes.append([number, kind, what])
    return {"counts": {kind: dict(found) for kind, found in counts.items()}, "holes": holes}


def run(target: str, edits: int, out: Path | None, seed: int = SEED) -> tuple[Counter[str], list[Any], float]:
    """All edits, those that ``out`` has already not again: counts, what was wrongly accepted, seconds of CPU."""
    known = (
        {} if out is None or not out.exists() else {r["from"]: r for r in map(json.loads, out.read_text().splitlines())}
    )
    judge: Judge | None = None
    for begin in range(0, edits, BATCH):
        if begin in known:
            continue
        judge = judge or TARGETS[target]()
        begun = process_time()
        found = judged(judge, range(begin, min(edits, begin + BATCH)), seed)
        known[begin] = {"from": begin, "seconds": process_time() - begun, **found}
        if out is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            with out.open("a") as file:
                file.write(json.dumps(known[begin]) + "\n")
            print(f"\r{target}: {min(edits, begin + BATCH)} of {edits}", end="", file=sys.stderr, flush=True)
    chosen = [known[begin] for begin in range(0, edits, BATCH)]
    total: Counter[str] = Counter()
    for record in chosen:
        for found in record["counts"].values():
            total.update(found)
    return total, [hole for record in chosen for hole in record["holes"]], sum(record["seconds"] for record in chosen)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--edits", type=int, default=500)
    parser.add_argument("--target", choices=[*TARGETS, "all"], default="all")
    parser.add_argument("--out", type=Path, help="JSON lines of what is done; with all targets, a folder of them")
    parser.add_argument("--seed", type=int, default=SEED)
    given = parser.parse_args()
    for target in TARGETS if given.target == "all" else [given.target]:
        out = given.out and (given.out / f"{target}.jsonl" if given.target == "all" else given.out)
        counts, holes, seconds = run(target, given.edits, out, given.seed)
        told = ", ".join(f"{count} {what}" for what, count in sorted(counts.items()))
        print(f"\r{target}: {given.edits} edits, seed {given.seed}: {told}; {seconds / 60:.1f} CPU minutes")
        for hole in holes[:20]:
            print(f"    FALSE: {hole}")


if __name__ == "__main__":
    main()
