"""What Python calls: compiled once, cached under the digest of all sources of the kernel."""

from typing import Any

from numba import njit

from polytopes.kernel import elimination, facets, programs
from polytopes.kernel.sources import SOURCES

_interior, _supports, _irredundant = programs.interior, programs.supports, facets.irredundant
_cheapest, _pruned, _step = elimination.cheapest, elimination.pruned, elimination.step


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
        return _irredundant(AT, b, x0)

    @njit(cache=True)
    def cheapest(table, columns):
        sources  # noqa: B018
        return _cheapest(table, columns)

    @njit(cache=True)
    def pruned(table, inner):
        sources  # noqa: B018
        return _pruned(table, inner)

    @njit(cache=True)
    def step(table, j, formed, inner):
        sources  # noqa: B018
        return _step(table, j, formed, inner)

    return interior, supports, irredundant, cheapest, pruned, step


interior, supports, irredundant, cheapest, pruned, step = _compiled(SOURCES)
