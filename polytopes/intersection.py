"""The intersection ``{x : x in P and x in Q}``."""

import numpy as np

from polytopes.rows import Rows, Table


def rows_of_both(P: Rows, Q: Rows) -> Table:
    """Rows A, b, C, d of both sets, those of P first; nothing rounded."""
    if not (P.d.size or Q.d.size):
        return np.concatenate([P.A, Q.A]), np.concatenate([P.b, Q.b]), P.C, P.d
    inequalities = np.vstack([P.A, Q.A]), np.concatenate([P.b, Q.b])
    return *inequalities, np.vstack([P.C, Q.C]), np.concatenate([P.d, Q.d])


def rows_in_common(P: Rows, Q: Rows) -> Rows:
    """The same as a set of rows, which is not looked at again."""
    if P.d.size or Q.d.size:
        return Rows(*rows_of_both(P, Q))
    (n, m, A, b), (_, k, A2, b2) = P.in_core, Q.in_core
    return Rows.from_core((n, m + k, A + A2, b + b2))
