"""Write down what a core answers, and compare: ``python -m tests.oracle record FILE`` and ``... compare OLD NEW``.

The same questions (`tests.oracle.cases`), made by their seeds, are asked in both trees; a file holds the answers.
``--programs 1500 --chains 1200 --flights 15 --polytopes 20000`` says how many of each kind. ``replay OLD`` asks this
tree's core the questions of a file.
"""

from __future__ import annotations

import argparse
import pickle
from pathlib import Path
from typing import Any

import numpy as np

from tests.oracle.cases import KINDS, Answers
from tests.oracle.comparison import difference

COUNTS = {"program": 1500, "chain": 1200, "flight": 15, "polytope": 20_000}
Recording = dict[tuple[str, int], Answers]


def record(counts: dict[str, int], first: int = 0) -> Recording:
    """Answers to so many questions of each kind."""
    return {(kind, seed): KINDS[kind](seed) for kind, count in counts.items() for seed in range(first, first + count)}


def compare(old: Recording, new: Recording) -> int:
    """Print what differs, and how much of what agrees; the number of questions that do not."""
    failures = 0
    for kind in KINDS:
        keys = [key for key in old if key[0] == kind]
        found = {key: difference(kind, old[key], new[key]) for key in keys}
        wrong = {key: d for key, d in found.items() if d.what is not None}
        failures += len(wrong)
        shares = [d.apart for d in found.values() if d.what is None]
        samples = sum(a.size for key in keys for name, a in old[key].items() if name.endswith("verdicts"))
        bounds = sum(a.size for key in keys for a in old[key].values() if a.dtype.kind == "f")
        print(
            f"{kind}: {len(keys)} questions, {samples} samples, {bounds} bounds; {len(wrong)} differ; the others are "
            f"at most {max(shares, default=0.0):.2g} of a width wider, median {np.median(shares or [0.0]):.2g}"
        )
        for (_, seed), d in list(wrong.items())[:20]:
            print(f"  seed {seed}: {d.what}")
    return failures


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.oracle", description=__doc__)
    parser.add_argument("task", choices=("record", "replay", "compare"))
    parser.add_argument("files", nargs="+", type=Path)
    for kind, count in COUNTS.items():
        parser.add_argument(f"--{kind}s", type=int, default=count)
    options = parser.parse_args()
    if options.task == "record":
        counts = {kind: getattr(options, f"{kind}s") for kind in COUNTS}
        options.files[0].write_bytes(pickle.dumps(record(counts)))
        return
    recordings: list[Any] = [pickle.loads(path.read_bytes()) for path in options.files]
    if options.task == "replay":
        recordings.append({(kind, seed): KINDS[kind](seed) for kind, seed in recordings[0]})
    raise SystemExit(compare(*recordings) > 0)


main()
