"""The polytope engine against its peers: redundancy, projection, sums and hulls on the same seeded inputs.

Run with ``OPENBLAS_NUM_THREADS=1 python -m benchmarks.polytopes``: the times are CPU milliseconds, best of several
runs, and threads that wait would count.  Peers are cdd, HiGHS (one warm program per row), the Parma library (exact) and
the library polytope, each where it is installed and ends in reasonable time.  The agreement column is the largest
difference of support functions in 200 directions.  Fresh processes measure the import and the memory of a dense
projection.  The table goes to ``polytopes.txt`` and a picture to ``polytopes.png``, in the folder
``build/benchmarks`` or the one of ``--out``.
"""

import argparse
import importlib
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks.lp_kernel import random_polytope, seconds
from polytopes import HPolytope, conversions, convex_hull
from polytopes.highs import HighsProgram

Floats = NDArray[np.float64]
Result = HPolytope | None


@dataclass(frozen=True)
class Case:
    """One task: our way, the peers' ways, each returning the resulting set (or None if it is not comparable)."""

    name: str
    ours: Callable[[], HPolytope]
    peers: dict[str, Callable[[], Result]]


@dataclass(frozen=True)
class Timing:
    """Milliseconds of one method on one task, and its distance from ours."""

    case: str
    method: str
    milliseconds: float
    difference: float | None


def peer(name: str) -> Any:
    """A library, or None if it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


CDD, PPL, POLYTOPE = peer("cdd"), peer("ppl"), peer("polytope")


def sparse_polytope(variables: int, rows: int, nonzeros: int, seed: int = 0) -> HPolytope:
    """Rows with few nonzero entries, inside the box of half-width 2; `rows` counts the box."""
    rng = np.random.default_rng(seed)
    A = np.zeros((rows - 2 * variables, variables))
    for row in A:
        row[rng.choice(variables, nonzeros, replace=False)] = rng.standard_normal(nonzeros)
    A /= np.linalg.norm(A, axis=1)[:, None]
    axes = np.eye(variables)
    b = np.append(rng.uniform(0.5, 1.5, len(A)), np.full(2 * variables, 2.0))
    return HPolytope(np.vstack([A, axes, -axes]), b)


def redundancy(variables: int, rows: int) -> Case:
    """Minimal description of random rows; about half are redundant."""
    P = random_polytope(variables, rows, 0)
    peers: dict[str, Callable[[], Result]] = {"HiGHS, warm": lambda: by_highs(P)}
    if CDD:
        peers["cdd"] = lambda: without(P, CDD.redundant_rows(conversions.to_cdd(P)))
    if PPL and variables <= 4:
        peers["Parma (exact)"] = lambda: from_parma(parma(P))
    if POLYTOPE:
        peers["polytope"] = lambda: conversions.from_polytope(POLYTOPE.reduce(POLYTOPE.Polytope(P.A, P.b)))
    return Case(f"redundancy ({variables}, {rows})", lambda: HPolytope(P.A, P.b).remove_redundancy(), peers)


def projection(variables: int, keep: int, rows: int, nonzeros: int) -> Case:
    """Projection of sparse or dense rows on the first coordinates."""
    P = sparse_polytope(variables, rows, nonzeros)
    kept = range(keep)
    peers: dict[str, Callable[[], Result]] = {}
    if CDD:
        peers["cdd, Fourier-Motzkin"] = lambda: by_elimination(P, keep)
    if POLYTOPE and variables <= 6 and keep <= 3:  # minutes otherwise
        peers["polytope"] = lambda: by_polytope(P, keep)
    if variables <= 6:
        peers["Qhull on vertices"] = lambda: HPolytope(P.A, P.b).project(kept, method="vertices")
    name = f"projection R^{variables} -> R^{keep}, {rows} rows, {nonzeros} nonzeros"
    return Case(name, lambda: HPolytope(P.A, P.b).project(kept), peers)


def sum_with_box(variables: int, rows: int) -> Case:
    """Minkowski sum with a box."""
    P, Q = random_polytope(variables, rows, 0), HPolytope.box(np.full(variables, -0.1), np.full(variables, 0.2))
    peers: dict[str, Callable[[], Result]] = {}
    if CDD:
        peers["cdd"] = lambda: sum_by_cdd(P, Q)
    return Case(f"sum with a box ({variables}, {rows})", lambda: HPolytope(P.A, P.b).minkowski_sum(Q), peers)


def hull(variables: int, rows: int) -> Case:
    """Convex hull of four sets."""
    sets = [random_polytope(variables, rows, seed).affine_map(np.eye(variables), [0.5 * seed, 0, 0, 0])
            for seed in range(4)]  # fmt: skip
    peers: dict[str, Callable[[], Result]] = {}
    if CDD:
        peers["cdd"] = lambda: hull_by_cdd(sets)
    return Case(f"hull of 4 sets ({variables}, {rows})", lambda: convex_hull(sets), peers)


def by_highs(P: HPolytope) -> HPolytope:
    """One program per row in one warm-started model: the row relaxed, and left out for good if it is redundant."""
    program, keep = HighsProgram(P.A, P.b), []
    model = program._highs
    for i in range(P.b.size):
        model.changeRowBounds(i, -np.inf, P.b[i] + 1.0)
        if program.maximise(P.A[i]).value > P.b[i] + 1e-9:
            keep.append(i)
            model.changeRowBounds(i, -np.inf, P.b[i])
    return HPolytope(P.A[keep], P.b[keep])


def without(P: HPolytope, rows: set[int]) -> HPolytope:
    """P without some rows."""
    keep = [i for i in range(P.b.size) if i not in rows]
    return HPolytope(P.A[keep], P.b[keep])


def by_elimination(P: HPolytope, keep: int) -> HPolytope:
    """cdd's Fourier elimination, redundant rows removed after every variable."""
    matrix = conversions.to_cdd(P)
    for _ in range(P.dim - keep):
        matrix = CDD.fourier_elimination(matrix)
        CDD.matrix_canonicalize(matrix)
    return conversions.from_cdd(matrix)


def by_polytope(P: HPolytope, keep: int) -> HPolytope:
    """`polytope.projection`, its own choice of method."""
    return conversions.from_polytope(POLYTOPE.projection(POLYTOPE.Polytope(P.A, P.b), np.arange(1, keep + 1)))


def generators_by_cdd(P: HPolytope) -> Floats:
    """Rows (1, v), one per vertex."""
    return np.array(CDD.copy_generators(CDD.polyhedron_from_matrix(conversions.to_cdd(P))).array)


def rows_by_cdd(generators: Floats) -> HPolytope:
    """The hull of rows (1, v)."""
    matrix = CDD.matrix_from_array(generators.tolist(), rep_type=CDD.RepType.GENERATOR)
    return conversions.from_cdd(CDD.copy_inequalities(CDD.polyhedron_from_matrix(matrix)))


def hull_by_cdd(sets: list[HPolytope]) -> HPolytope:
    """Generators of every set, and the rows of all of them."""
    return rows_by_cdd(np.vstack([generators_by_cdd(P) for P in sets]))


def sum_by_cdd(P: HPolytope, Q: HPolytope) -> HPolytope:
    """The rows of all sums of vertices."""
    sums = generators_by_cdd(P)[:, None, 1:] + generators_by_cdd(Q)[:, 1:]
    return rows_by_cdd(np.insert(sums.reshape(-1, P.dim), 0, 1.0, axis=1))


def parma(P: HPolytope) -> Any:
    """P as a polyhedron of the Parma library, floats as rationals (denominators are powers of two)."""
    x = [PPL.Variable(j) for j in range(P.dim)]
    system = PPL.Constraint_System()
    for row, value in zip(P.A, P.b, strict=True):
        ratios = [v.as_integer_ratio() for v in [*row.tolist(), float(value)]]
        common = max(q for _, q in ratios)
        *coefficients, constant = [p * (common // q) for p, q in ratios]
        system.insert(sum(c * v for c, v in zip(coefficients, x, strict=True)) <= constant)
    return PPL.C_Polyhedron(system)


def from_parma(polyhedron: Any) -> HPolytope:
    """The minimal rows of a polyhedron, rounded."""
    rows = [[int(c) for c in (*row.coefficients(), row.inhomogeneous_term())]
            for row in polyhedron.minimized_constraints()]  # fmt: skip
    table = np.array([[v / max(map(abs, row)) for v in row] for row in rows])
    return HPolytope(-table[:, :-1], table[:, -1])


def shortest(task: Callable[[], object]) -> float:
    """Shortest CPU time in seconds of a run, of as many as fit in half a second (at most 40)."""
    once = seconds(task, 1)
    more = min(40, int(0.5 / once))
    return min(once, seconds(task, more)) if more else once


def measure(case: Case) -> list[Timing]:
    """Every method on one task."""
    ours = case.ours()
    directions = np.random.default_rng(0).standard_normal((200, ours.dim))
    reference = ours.support(directions)
    timings = [Timing(case.name, f"this engine ({ours.b.size} rows)", 1e3 * shortest(case.ours), None)]
    for method, task in case.peers.items():
        result = task()
        difference = None if result is None else float(np.max(np.abs(result.support(directions) - reference)))
        timings.append(Timing(case.name, method, 1e3 * shortest(task), difference))
    return timings


def results_table(timings: list[Timing]) -> Table:
    """All timings, peers as multiples of ours."""
    table = Table(title="Polytope engine and peers, CPU milliseconds")
    for column in ("task", "method", "milliseconds", "ratio", "largest difference"):
        table.add_column(column, justify="left" if column in ("task", "method") else "right")
    own: dict[str, float] = {}
    for t in timings:
        first = t.case not in own
        own.setdefault(t.case, t.milliseconds)
        difference = "" if t.difference is None else f"{t.difference:.0e}"
        ratio = "" if first else f"{t.milliseconds / own[t.case]:.1f}"
        table.add_row(t.case if first else "", t.method, f"{t.milliseconds:.2f}", ratio, difference)
    return table


def draw(timings: list[Timing], path: Path) -> None:
    """Points of all timings on a logarithmic axis."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(9.0, 0.28 * len(timings) + 1.0), layout="constrained")
    colors = ["tab:blue" if t.difference is None else "tab:gray" for t in timings]
    names = [f"{t.case}: {t.method}" for t in timings]
    ax.scatter([t.milliseconds for t in timings], range(len(timings)), c=colors, zorder=2)
    ax.set_yticks(range(len(timings)), names)
    ax.grid(axis="x", color="0.85")
    ax.set_xscale("log")
    ax.set_xlabel("CPU milliseconds")
    ax.invert_yaxis()
    figure.savefig(path, dpi=80)
    plt.close(figure)


def fresh(code: str) -> str:
    """What a fresh interpreter prints."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


IMPORT = "from time import process_time; t = process_time(); import polytopes; print(process_time() - t)"
MEMORY = """
import resource, tracemalloc
from benchmarks.polytopes import sparse_polytope
P = sparse_polytope(6, 40, 6)
sparse_polytope(5, 20, 5).project(range(3))
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
P.project(range(4))
grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
tracemalloc.start()
sparse_polytope(6, 40, 6).project(range(4))
print(f"{tracemalloc.get_traced_memory()[1] / 2**20:.1f} MB allocated, {grown / 2**10:.0f} MB added to the process")
"""


def costs_of_a_process() -> str:
    """Import and memory, each in a fresh process."""
    imported = min(float(fresh(IMPORT)) for _ in range(3))
    return (
        f"import polytopes: {imported:.2f} s of CPU time\n"
        f"memory of a projection R^6 -> R^4, 40 dense rows: {fresh(MEMORY)}"
    )


OUT = Path("build/benchmarks")


def main(out: Path = OUT) -> None:
    """Measure, print, and write the table and its picture to a folder."""
    cases = [
        *(redundancy(n, 200) for n in (4, 6, 8)),
        projection(8, 4, 50, 2),
        projection(5, 3, 40, 5),
        projection(6, 3, 40, 6),
        projection(6, 4, 40, 6),
        sum_with_box(4, 50),
        hull(4, 50),
    ]
    timings = [timing for case in cases for timing in measure(case)]
    console = Console(width=140, record=True)
    console.print(results_table(timings))
    console.print(costs_of_a_process())
    out.mkdir(parents=True, exist_ok=True)
    (out / "polytopes.txt").write_text(console.export_text())
    draw(timings, out / "polytopes.png")
    print(f"written to {out}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=OUT, help="folder for the table and the picture")
    main(parser.parse_args().out)
