"""Sets as constraints of other libraries, and as dicts that JSON holds without loss."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from polytopes.checks import Floats, whole_number
from polytopes.fractions_given import number_of_text
from polytopes.rows import Rows, Table

_PARTS = ("A", "b", "C", "d")


def as_dict(P: Rows) -> dict[str, Any]:
    """The rows as texts ``"numerator/denominator"``, each float exactly, and the dimension."""
    texts = [[_text(v) for v in part.ravel().tolist()] for part in P.table]
    n = P.dim
    rows = {name: [texts[k][i * n : (i + 1) * n] for i in range(len(P.table[k]))] for k, name in ((0, "A"), (2, "C"))}
    return {"dim": n, "A": rows["A"], "b": texts[1], "C": rows["C"], "d": texts[3]}


def table_from_dict(data: Mapping[str, Any]) -> Table:
    """Rows of what `as_dict` wrote; numbers may stand for themselves too.

    Raises
    ------
    ValueError
        If a part is missing, or an entry is no number, or one that no float equals.
    """
    if not isinstance(data, Mapping) or not {"dim", *_PARTS} <= set(data):
        raise ValueError(f"data has not all of dim, {', '.join(_PARTS)}; expected what to_dict writes.")
    n = whole_number("data['dim']", data["dim"], least=1)
    A, b, C, d = ([_numbers(f"data[{name!r}]", row) for row in data[name]] for name in _PARTS)
    for name, rows in (("A", A), ("C", C)):
        if any(len(np.atleast_1d(row)) != n for row in rows):
            raise ValueError(f"data[{name!r}] has rows of other lengths; expected {n} numbers in each, as dim says.")
    return np.array(A).reshape(-1, n), np.array(b).reshape(-1), np.array(C).reshape(-1, n), np.array(d).reshape(-1)


def _text(value: float) -> str:
    numerator, denominator = value.as_integer_ratio()
    return f"{numerator}/{denominator}"


def _numbers(where: str, entry: Any) -> Floats | float:
    if isinstance(entry, list | tuple):
        return np.array([_number(where, v) for v in entry])
    return _number(where, entry)


def _number(where: str, entry: Any) -> float:
    try:
        exact = number_of_text(entry) if isinstance(entry, str) else Fraction(entry)
        value = float(exact)
    except (ValueError, TypeError, ZeroDivisionError, OverflowError):
        raise ValueError(f"{where} holds {entry!r}; expected a number or 'numerator/denominator'.") from None
    if value != exact:
        raise ValueError(f"{where} holds {entry!r}, which no float equals; round it first.")
    return value


def linear_constraint(P: Rows) -> Any:
    """A `scipy.optimize.LinearConstraint` ``lower <= A x <= upper``, an equality with both bounds alike."""
    from scipy.optimize import LinearConstraint

    lower = np.concatenate([np.full(P.b.size, -np.inf), P.d])
    return LinearConstraint(np.vstack([P.A, P.C]), lower, np.append(P.b, P.d))


def cvxpy_constraints(P: Rows, x: Any) -> list[Any]:
    """Constraints ``A x <= b`` and ``C x == d`` on a cvxpy expression of shape (n,)."""
    shape = getattr(x, "shape", None)
    if shape != (P.dim,):
        raise ValueError(f"x has shape {shape}; expected a cvxpy expression of shape ({P.dim},).")
    return ([P.A @ x <= P.b] if P.b.size else []) + ([P.C @ x == P.d] if P.d.size else [])
