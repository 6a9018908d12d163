"""The choices inside the polytope engine: which method projects, and redundancy by programs against Qhull's dual hull.

Run with ``python -m benchmarks.polytope_methods``.  Times are CPU milliseconds, best of several runs, on random rows.
Qhull's dual hull is timed alone: its answer would have to be confirmed by programs to be exact.
"""

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial import ConvexHull

from benchmarks.lp_kernel import random_polytope
from benchmarks.polytopes import shortest, sparse_polytope
from polytopes import HPolytope, ProjectionLimitError
from polytopes.redundancy import irredundant

PROJECTIONS = (  # variables, kept, rows, nonzeros in a row
    (8, 4, 50, 2), (8, 3, 40, 3), (5, 3, 40, 3), (5, 3, 40, 5), (6, 2, 40, 6), (6, 3, 60, 6), (6, 4, 40, 6),
    (6, 4, 60, 6), (7, 3, 40, 7), (7, 4, 30, 7), (8, 4, 30, 8),
)  # fmt: skip
METHODS = ("auto", "fourier-motzkin", "convex-hull", "vertices")
REDUNDANCIES = ((2, 500), (2, 1000), (2, 5000), (3, 500), (3, 2000), (3, 4000), (4, 200), (4, 800), (4, 2000), (5, 800))


def projection(P: HPolytope, kept: int, method: str) -> str:
    """Time of one method; nothing where it has too many rows or vertices."""
    if method == "vertices" and P.dim > 6 and P.b.size > 40:
        return "-"
    rows = 3000 if method == "fourier-motzkin" else 20_000
    try:
        return f"{1e3 * shortest(lambda: HPolytope(P.A, P.b).project(range(kept), method=method, max_rows=rows)):.2f}"
    except ProjectionLimitError:
        return "-"


def redundancy(variables: int, rows: int, tangent: bool) -> tuple[float, float]:
    """Our minimal rows of random rows, or of rows tangent to a ball, and Qhull's dual hull of them."""
    P = random_polytope(variables, rows, 0)
    program = HPolytope(P.A, np.ones(rows)).program if tangent else P.program
    AT, b, centre = program.AT, program.rhs, program.interior.point
    dual = (AT / (b - centre @ AT)).T
    return 1e3 * shortest(lambda: irredundant(AT, b, centre)), 1e3 * shortest(lambda: ConvexHull(dual))


def main() -> None:
    """Measure and print."""
    console = Console(width=120)
    methods = Table("projection", *METHODS, title="Projection, CPU milliseconds")
    for variables, kept, rows, nonzeros in PROJECTIONS:
        P = sparse_polytope(variables, rows, nonzeros)
        name = f"R^{variables} -> R^{kept}, {rows} rows, {nonzeros} nonzeros"
        methods.add_row(name, *(projection(P, kept, method) for method in METHODS))
    console.print(methods)
    dual = Table("variables, rows", "programs", "dual hull", "tangent: programs", "tangent: dual hull",
                 title="Redundancy, CPU milliseconds")  # fmt: skip
    for variables, rows in REDUNDANCIES:
        times = [*redundancy(variables, rows, False)]
        times += redundancy(variables, rows, True) if rows <= 2000 else [np.nan, np.nan]
        dual.add_row(f"{variables}, {rows}", *(f"{time:.2f}" for time in times))
    console.print(dual)


if __name__ == "__main__":
    main()
