"""What Python calls: compiled once, cached under the digest of all sources of the kernel."""

from typing import Any

import numpy as np
from numba import njit

from polytopes.kernel import elimination, facets, programs, scaling
from polytopes.kernel.sources import SOURCES

_interior, _supports, _irredundant = programs.interior, programs.supports, facets.irredundant
_eliminate, _exponents, _scaled = elimination.eliminate, scaling.exponents, scaling.scaled


def _compiled(sources: str) -> tuple[Any, ...]:
    @njit(cache=True)
    def interior(AT, b, norms, x0, cap):
        sources  # noqa: B018 - in the closure, so part of the cache's key
        return _interior(AT, b, norms, x0, cap)

    @njit(cache=True)
    def supports(AT, b, x0, directions):
        sources  # noqa: B018
        return _supports(AT, b, x0, directions)

    @njit(cache=True)
    def irredundant(AT, b, x0):
        sources  # noqa: B018
        return _irredundant(AT, b, x0, np.zeros(b.size, np.int64))

    @njit(cache=True)
    def eliminate(table, known, left, columns, inner, max_rows, cautious):
        sources  # noqa: B018
        return _eliminate(table, known, left, columns, inner, max_rows, cautious)

    @njit(cache=True)
    def exponents(rows, rhs):
        sources  # noqa: B018
        return _exponents(rows, rhs)

    @njit(cache=True)
    def scaled(rows, rhs):
        sources  # noqa: B018
        return _scaled(rows, rhs)

    return interior, supports, irredundant, eliminate, exponents, scaled


interior, supports, irredundant, eliminate, exponents, scaled = _compiled(SOURCES)
