"""Every operation of `polytopes` against its peers, on small, decimal, degenerate, uneven and large sets.

Run with ``OPENBLAS_NUM_THREADS=1 python -m benchmarks.polytope_peers``. All methods go from arrays to arrays and take
turns in one run; a time is the median of the turns, in CPU microseconds. SciPy is linprog, HalfspaceIntersection and
ConvexHull. Each answer is compared with exact rational arithmetic, and what is not right counts as "wrong" and not as a
time. Lines that are done are kept in ``polytope_peers.jsonl`` in the folder of ``--out`` (``build/benchmarks``), and a
run that was stopped goes on from there; ``polytope_peers.md`` there is the table of `docs/polytopes.md`. ``--fresh``
begins anew; ``--only`` takes the lines that have some words.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import warnings
from datetime import UTC, datetime
from pathlib import Path
from time import process_time_ns
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks import _set_instances as instances
from benchmarks import _set_peers as peers
from benchmarks._set_instances import Instance
from benchmarks._set_truth import judge

OUT = Path("build/benchmarks")
TURNS, TURN_NS, LONGEST_NS = 7, 2_000_000, 600_000_000  # of a method: turns, least time of one, most of all
LARGE = {
    "26 rows in R^3": ("vertices", "Minkowski sum"),
    "36 rows in R^3": ("rows to vertices to rows", "hull of a union"),
    "cube in R^10": ("vertices", "hull of points"),
    "cross-polytope in R^7": ("vertices", "redundancy"),
    "12 points of a cyclic polytope in R^5": ("hull of points",),
    "200 rows in R^6": ("support", "bounding box", "redundancy", "contains a set", "intersection not empty"),
}
TOO_LONG = {
    ("200 rows in R^6", "Parma"), ("200 rows in R^6", "polytope"), ("cross-polytope in R^7", "polytope"),
    ("cube in R^10", "polytope"),
}  # fmt: skip
LEFT_OUT = {  # thousands of sums of vertices: minutes in rationals; and a shadow with slivers that only rounding made
    ("projection", "turned cross-polytope in R^3"),
    ("Minkowski sum", "30 rows in R^4"),
    ("Minkowski sum", "units from 1e-6 to 1e3 in R^4"),
    ("Minkowski sum", "permutahedron in R^3"),
}
Line = dict[str, Any]


def lines() -> list[tuple[str, Instance]]:
    """Operations and instances, in the order of the table."""
    usual = [*instances.small(), *instances.decimal(), *instances.degenerate(), *instances.uneven()]
    return [
        *((o, case) for o in peers.OURS for case in usual if (o, case.name) not in LEFT_OUT),
        *((operation, case) for case in instances.large() for operation in LARGE[case.name]),
    ]


def measure(operation: str, case: Instance) -> Line:
    """Microseconds of each method, "wrong", or the name of an error."""
    right = judge(operation, case) if peers.PPL and (case.name, "Parma") not in TOO_LONG else None
    methods = {
        name: methods[operation]
        for name, methods in peers.LIBRARIES.items()
        if operation in methods and (case.name, name) not in TOO_LONG
    }
    found: dict[str, Any] = {}
    for name, method in methods.items():
        try:
            answer = method(case)
            found[name] = None if right is None or right(answer) else "wrong"
        except Exception as error:  # whatever another library raises, or returns instead, is its answer
            found[name] = type(error).__name__
    found.update(times({name: methods[name] for name, verdict in found.items() if verdict is None}, case))
    return {"operation": operation, "instance": case.name, "microseconds": found, "checked": right is not None}


def times(methods: dict[str, peers.Method], case: Instance) -> dict[str, float]:
    """Median of the turns of each method."""
    counts, once = {}, {}
    for name, method in methods.items():
        once[name] = min(spent(method, case, 1) for _ in range(2))
        counts[name] = max(1, TURN_NS // max(once[name], 1))
    turns: dict[str, list[float]] = {name: [] for name in methods}
    for k in range(TURNS):
        for name, method in methods.items():
            if k == 0 or once[name] * k < LONGEST_NS:
                turns[name].append(spent(method, case, counts[name]) / counts[name])
    return {name: 1e-3 * float(np.median(values)) for name, values in turns.items()}


def spent(method: peers.Method, case: Instance, count: int) -> int:
    """CPU nanoseconds of some calls."""
    begun = process_time_ns()
    for _ in range(count):
        method(case)
    return process_time_ns() - begun


def ratio(line: Line) -> tuple[float, str] | None:
    """Our time over that of the fastest peer that is right, and its name; None without one."""
    found = line["microseconds"]
    right = {name: time for name, time in found.items() if name != "ours" and isinstance(time, float)}
    if not right or not isinstance(found["ours"], float):
        return None
    best = min(right, key=lambda name: right[name])
    return found["ours"] / right[best], best


def shown(value: Any) -> str:
    """A time, or why there is none."""
    return "" if value is None else value if isinstance(value, str) else f"{value:.3g}"


def row(line: Line) -> list[str]:
    """Cells of a line of the table."""
    quotient = ratio(line)
    cells = [shown(line["microseconds"].get(name)) for name in peers.LIBRARIES]
    return [line["operation"], line["instance"], *cells, "" if quotient is None else f"{quotient[0]:.2f}"]


def columns() -> list[str]:
    """Heads of the table."""
    return ["operation", "instance", *peers.LIBRARIES, "ours / fastest right peer"]


def as_markdown(done: list[Line]) -> str:
    """The tables of the page: operations by instances, our time and the ratio; then the large instances, all times."""
    by_place = {(line["operation"], line["instance"]): line for line in done}
    groups = [[*instances.small(), *instances.decimal()], [*instances.degenerate(), *instances.uneven()]]
    tables = []
    for group in groups:
        names = [case.name for case in group]
        body = [[operation, *(cell(by_place.get((operation, name))) for name in names)] for operation in peers.OURS]
        tables.append(markdown(["operation", *names], body))
    tables.append(markdown(columns(), [row(line) for line in done if line["instance"] in LARGE]))
    return "\n".join(tables)


def cell(line: Line | None) -> str:
    """Our microseconds, the ratio and the initial of the peer, and the peers that are wrong."""
    if line is None:
        return ""
    quotient = ratio(line)
    wrong = "".join(name[0] for name, time in line["microseconds"].items() if isinstance(time, str))
    parts = [shown(line["microseconds"]["ours"]), "" if quotient is None else f"{quotient[0]:.2g} {quotient[1][0]}"]
    return ", ".join(part for part in [*parts, f"wrong: {wrong}" if wrong else ""] if part)


def markdown(head: list[str], body: list[list[str]]) -> str:
    """A table."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *body)) + "\n"


def summary(done: list[Line]) -> str:
    """How many lines are how quick, and who is wrong."""
    quotients = [found[0] for found in map(ratio, done) if found is not None]
    wrong = {
        name: sum(isinstance(line["microseconds"].get(name), str) for line in done) for name in peers.LIBRARIES
    }
    slower = sum(value > 1.0 for value in quotients)
    return (
        f"{datetime.now(UTC):%d %B %Y}, load {os.getloadavg()[0]:.0f}: {len(done)} lines; slower than a peer that is "
        f"right on {slower} of {len(quotients)}, median ratio {np.median(quotients):.2f}.\n"
        f"Wrong or an error: {', '.join(f'{name} {count}' for name, count in wrong.items())}."
        + (f"\nNot installed: {', '.join(peers.MISSING)}." if peers.MISSING else "")
    )


def known_lines(path: Path) -> list[Line]:
    """The lines that an earlier run has left."""
    return [json.loads(text) for text in path.read_text().splitlines()] if path.exists() else []


def main(given: list[str] | None = None) -> None:
    """Measure what is missing, print, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the lines and of the table")
    parser.add_argument("--fresh", action="store_true", help="forget the lines of an earlier run")
    parser.add_argument("--only", default="", help="lines whose operation and instance have these words")
    options = parser.parse_args([] if given is None else given)
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "polytope_peers.jsonl"
    if options.fresh:
        path.unlink(missing_ok=True)
    kept = {(line["operation"], line["instance"]): line for line in known_lines(path)}
    wanted = [(operation, case) for operation, case in lines() if options.only in f"{operation}, {case.name}"]
    console = Console(width=150)
    with warnings.catch_warnings(), path.open("a") as file:
        warnings.simplefilter("ignore")  # of peers
        for operation, case in track(wanted, "lines", console=console, transient=True):
            if (operation, case.name) not in kept:
                line = kept[operation, case.name] = measure(operation, case)
                print(json.dumps(line), file=file, flush=True)
    done = [kept[operation, case.name] for operation, case in wanted]
    table = Table(*columns(), title="CPU microseconds, median of the turns")
    for line in done:
        table.add_row(*row(line))
    console.print(table)
    console.print(summary(done))
    (options.out / "polytope_peers.md").write_text(as_markdown(done))


if __name__ == "__main__":
    main(sys.argv[1:])
