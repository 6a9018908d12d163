"""The LP kernel against warm HiGHS and SciPy: many linear programs over one polytope, same seeded inputs.

Run with ``python -m benchmarks.lp_kernel``.  Times are CPU microseconds per program, best of several repetitions of the
whole batch; the agreement column is the largest relative difference of the optimal values.
"""

from collections.abc import Callable
from dataclasses import dataclass
from time import process_time

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.optimize import linprog

from polytopes import HPolytope, kernel
from polytopes.highs import HighsProgram

Floats = NDArray[np.float64]
SIZES = ((4, 20), (4, 60), (4, 200), (6, 100), (8, 50), (8, 200), (12, 100), (12, 400))
PROGRAMS = 100


@dataclass(frozen=True)
class Row:
    """Microseconds per program for one size, and how far the answers differ."""

    variables: int
    rows: int
    kernel: float
    kernel_single: float
    highs: float
    scipy: float
    difference: float


def random_polytope(variables: int, rows: int, seed: int) -> HPolytope:
    """Unit normals at random, right-hand sides in [1/2, 3/2]: bounded, about half of the rows are facets."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((rows, variables))
    return HPolytope(A / np.linalg.norm(A, axis=1)[:, None], rng.uniform(0.5, 1.5, rows))


def seconds(task: Callable[[], object], repetitions: int) -> float:
    """Shortest CPU time of several runs (the machine may be busy)."""
    times = []
    for _ in range(repetitions):
        start = process_time()
        task()
        times.append(process_time() - start)
    return min(times)


def measure(variables: int, rows: int, seed: int = 0) -> Row:
    """All solvers on the same polytope and directions."""
    P = random_polytope(variables, rows, seed)
    directions = np.random.default_rng(seed + 1).standard_normal((PROGRAMS, variables))
    P.emptiness()
    reference = HighsProgram(P.A, P.b)
    values = np.array([reference.maximise(c).value for c in directions])
    ours = P.support(directions)
    difference = float(np.max(np.abs(ours - values) / np.abs(values)))
    few = directions[:10]
    per = 1e6 / PROGRAMS
    return Row(
        variables,
        rows,
        kernel=seconds(lambda: P.support(directions), 20) * per,
        kernel_single=seconds(lambda: [P.support(c) for c in few], 20) * 1e6 / len(few),
        highs=seconds(lambda: [reference.maximise(c) for c in directions], 3) * per,
        scipy=seconds(lambda: [linprog(-c, P.A, P.b, bounds=(None, None)) for c in few], 2) * 1e6 / len(few),
        difference=difference,
    )


DIRECTION = np.ones(4)
QUESTIONS: dict[str, Callable[[HPolytope], object]] = {
    "emptiness": HPolytope.emptiness,
    "support": lambda P: P.support(DIRECTION),
    "bounding box": HPolytope.bounding_box,
    "is bounded": HPolytope.is_bounded,
}


def measure_question(ask: Callable[[HPolytope], object]) -> tuple[float, float]:
    """Microseconds of a question to a new box in R^4, and to one that was asked before."""
    times = []
    for _ in range(20):
        boxes = [HPolytope.box(-DIRECTION, DIRECTION) for _ in range(100)]
        times.append([seconds(lambda boxes=boxes: [ask(P) for P in boxes], 1) for _ in range(2)])  # type: ignore[misc]
    first, again = (1e6 * min(column) / 100 for column in zip(*times, strict=True))
    return first, again


def measure_box(variables: int, rows: int) -> tuple[float, float, float]:
    """Microseconds from Python: construction, emptiness (with preparation) and the bounding box afterwards."""
    P = random_polytope(variables, rows, 0)
    P.emptiness()
    A, b = P.A.copy(), P.b.copy()
    construct = seconds(lambda: HPolytope(A, b), 200)
    decide = seconds(lambda: HPolytope(A, b).emptiness(), 200) - construct
    return 1e6 * construct, 1e6 * decide, 1e6 * seconds(P.bounding_box, 200)


def measure_box_in_kernel(variables: int, rows: int) -> tuple[float, float]:
    """Microseconds in compiled code: a largest ball, and the support along the axes."""
    program = random_polytope(variables, rows, 0).program
    AT, b, centre = program.AT, program.rhs, program.interior.point
    axes = np.vstack([np.eye(variables), -np.eye(variables)])
    ball = seconds(lambda: kernel.interior(AT, b, program.norms, np.zeros(variables), 10.0), 200)
    return 1e6 * ball, 1e6 * seconds(lambda: kernel.supports(AT, b, centre, axes), 200)


def main() -> None:
    """Measure and print."""
    table = Table(title=f"LP kernel, {PROGRAMS} directions over one polytope, CPU microseconds per program")
    for column in ("variables", "rows", "kernel", "kernel, one call each", "HiGHS, warm", "SciPy linprog",
                   "HiGHS / kernel", "SciPy / kernel", "largest difference"):  # fmt: skip
        table.add_column(column, justify="right")
    for variables, rows in SIZES:
        row = measure(variables, rows)
        table.add_row(
            str(variables), str(rows), f"{row.kernel:.2f}", f"{row.kernel_single:.1f}", f"{row.highs:.0f}",
            f"{row.scipy:.0f}", f"{row.highs / row.kernel:.0f}", f"{row.scipy / row.kernel:.0f}",
            f"{row.difference:.0e}",
        )  # fmt: skip
    console = Console(width=140)
    console.print(table)
    construct, decide, box = measure_box(4, 60)
    console.print(
        f"(4, 60), from Python: construction {construct:.0f} us, emptiness {decide:.0f} us, bounding box {box:.0f} us"
    )
    ball, axes = measure_box_in_kernel(4, 60)
    console.print(f"(4, 60), in the kernel: largest ball {ball:.0f} us, support along the axes {axes:.0f} us")
    asked = ("{} {:.1f} us ({:.1f})".format(name, *measure_question(ask)) for name, ask in QUESTIONS.items())
    console.print(f"a box in R^4, asked for the first time (and again): {', '.join(asked)}")


if __name__ == "__main__":
    main()
