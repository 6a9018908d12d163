"""Files of cddlib and lrs: H-representations (.ine) and V-representations (.ext), with exact numbers (Fukuda's format).

Every float is written as the fraction that it is.  What is read may be integers, fractions, or decimals, which stand
for themselves; a row of fractions is multiplied by their common denominator.  Where a file says that its numbers are
real, as cddlib in floats writes them, a row that is then no multiple of floats is that of the nearest floats.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from polytopes.exact_generators import integer_form
from polytopes.fractions_given import integers_of, nearest_row, number_of_text, primitive_row, row_of_floats
from polytopes.generators import in_integers
from polytopes.hpolytope import HPolytope
from polytopes.minkowski_weyl import ExactGenerators
from polytopes.outward import float_rows
from polytopes.rows import a_set
from polytopes.support import known_nonempty


def write_ine(P: HPolytope, path: str | Path) -> None:
    """Write the rows ``[b, -A]`` of a set, equalities in the linearity, as integers.

    Parameters
    ----------
    P : HPolytope
    path : str or Path
        Written anew.
    """
    rows = integer_form(*a_set(P, "P").table)
    both = [*rows.equalities.tolist(), *rows.inequalities.tolist()]
    table = [[row[-1], *(-v for v in row[:-1])] for row in both]
    _write(path, "H-representation", table, len(rows.equalities), P.dim)


def read_ine(path: str | Path) -> HPolytope:
    """Read a set from its rows.

    Raises
    ------
    ValueError
        If the file at `path` is no H-representation, or a row of it is no multiple of floats.
    """
    table, linear, n, kind = _read(path, "H-representation")
    to_row = nearest_row if kind == "real" else row_of_floats
    rows = np.array([to_row(f"{path}: row {i + 1}", row) for i, row in enumerate(table)]).reshape(len(table), n + 1)
    fixed = np.array([i in linear for i in range(len(table))], dtype=bool)
    rows[:, 1:] = 0.0 - rows[:, 1:]  # no negative zeros
    return HPolytope(rows[~fixed, 1:], rows[~fixed, 0], rows[fixed, 1:], rows[fixed, 0])


def write_ext(P: HPolytope, path: str | Path) -> None:
    """Write vertices, rays and lines of a set as exact fractions: rows ``[1, x]`` and ``[0, r]``, lines linear.

    Parameters
    ----------
    P : HPolytope
    path : str or Path
        Written anew.

    Raises
    ------
    UndecidedError
        If the double description passes 10 000 rays.
    """
    table: list[list[int | Fraction]] = []
    lines = 0
    if known_nonempty(a_set(P, "P")):
        found = in_integers(P)
        lines = len(found.lines)
        table = [[0, *map(int, row)] for row in [*found.lines.tolist(), *found.rays.tolist()]]
        table += [[1, *(Fraction(v, row[-1]) for v in row[:-1])] for row in found.vertices.tolist()]
    _write(path, "V-representation", table, lines, P.dim)


def read_ext(path: str | Path) -> HPolytope:
    """Read a set from its generators: rows that are exact where they are floats, and else rounded outward.

    A cone without a vertex has the origin as its vertex, as cddlib says.

    Raises
    ------
    ValueError
        If the file at `path` is no V-representation, or a row begins with something else than 0 and 1.
    UndecidedError
        If the double description passes 10 000 rows.
    """
    table, linear, n, _ = _read(path, "V-representation")
    parts: dict[str, list[list[int]]] = {"vertices": [], "rays": [], "lines": []}
    for i, row in enumerate(table):
        if row[0] not in (0, 1) or (row[0] == 1 and i in linear):
            raise ValueError(f"{path}: row {i + 1} begins with {row[0]}; expected 1 (a point) or 0 (a ray, a line).")
        if row[0] == 1:
            parts["vertices"].append(primitive_row([*row[1:], Fraction(1)]))
        elif any(row[1:]):
            parts["lines" if i in linear else "rays"].append(primitive_row(row[1:]))
    if not table:
        return HPolytope.empty(n)
    vertices = parts["vertices"] or [[0] * n + [1]]
    tables = ((vertices, n + 1), (parts["rays"], n), (parts["lines"], n))
    return HPolytope(*float_rows(ExactGenerators(*(integers_of(rows, width) for rows, width in tables))))


def _write(path: str | Path, kind: str, table: Sequence[Sequence[int | Fraction]], linear: int, n: int) -> None:
    """Rows, the first of them linear."""
    number = "integer" if all(isinstance(v, int) for row in table for v in row) else "rational"
    head = [kind] + ([f"linearity {linear} {' '.join(str(i + 1) for i in range(linear))}"] if linear else [])
    rows = [" ".join(map(str, row)) for row in table]
    Path(path).write_text("\n".join([*head, "begin", f"{len(table)} {n + 1} {number}", *rows, "end", ""]), "ascii")


def _read(path: str | Path, kind: str) -> tuple[list[list[Fraction]], set[int], int, str]:
    """The table of numbers, the linear rows counted from 0, the dimension, and the kind of numbers."""
    words = iter(Path(path).read_text("utf-8", errors="replace").split("\n"))
    stated, linear = "H-representation", set[int]()
    try:
        for line in words:
            first, *rest = line.split() or [""]
            if first.lower() in ("h-representation", "v-representation"):
                stated = first[0].upper() + first[1:].lower()
            elif first == "linearity":
                linear = {int(v) - 1 for v in rest[1:]}
                if len(linear) != int(rest[0]):
                    raise ValueError(f"linearity names {len(linear)} rows, and says {rest[0]}")
            elif first == "begin":
                break
        table, n, numbers = _table(words)
        if not linear <= set(range(len(table))):
            raise ValueError(f"linearity names row {max(linear) + 1} of {len(table)}")
    except (StopIteration, IndexError, ZeroDivisionError, ValueError) as error:
        raise ValueError(f"{path} is no file of cddlib: {str(error) or 'it ends before its rows do'}.") from None
    if stated != kind:
        other = "ine" if stated[0] == "H" else "ext"
        raise ValueError(f"{path} is a {stated}; expected a {kind}: try read_{other}.")
    return table, linear, n, numbers


def _table(lines: Iterator[str]) -> tuple[list[list[Fraction]], int, str]:
    size = next(lines).split()
    m, width = int(size[0]), int(size[1])
    if m < 0 or width < 2:
        raise ValueError(f"it says {m} rows of {width} numbers")
    numbers: list[Fraction] = []
    while len(numbers) < m * width:
        numbers += [number_of_text(v) for v in next(lines).split()]
    rest = next((line.split() for line in lines if line.split()), ["end"])
    if len(numbers) > m * width or rest[0] != "end":
        raise ValueError(f"there are more than {m} rows of {width} numbers")
    return [numbers[i * width : (i + 1) * width] for i in range(m)], width - 1, "".join(size[2:3])
