"""The Cartesian product ``{(x, y) : x in P, y in Q}``."""

import numpy as np

from polytopes.rows import Rows, Table


def product(P: Rows, Q: Rows) -> Table:
    """Rows A, b, C, d of the product: those of both, nothing rounded."""
    A = np.vstack([np.hstack([P.A, np.zeros((P.b.size, Q.dim))]), np.hstack([np.zeros((Q.b.size, P.dim)), Q.A])])
    C = np.vstack([np.hstack([P.C, np.zeros((P.d.size, Q.dim))]), np.hstack([np.zeros((Q.d.size, P.dim)), Q.C])])
    return A, np.concatenate([P.b, Q.b]), C, np.concatenate([P.d, Q.d])
