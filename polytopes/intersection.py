"""The intersection ``{x : x in P and x in Q}``."""

import numpy as np

from polytopes.rows import Rows, Table


def rows_of_both(P: Rows, Q: Rows) -> Table:
    """Rows A, b, C, d of both sets, those of P first; nothing rounded."""
    if not (P.d.size or Q.d.size):
        return np.concatenate([P.A, Q.A]), np.concatenate([P.b, Q.b]), P.C, P.d
    inequalities = np.vstack([P.A, Q.A]), np.concatenate([P.b, Q.b])
    return *inequalities, np.vstack([P.C, Q.C]), np.concatenate([P.d, Q.d])
