"""Compiled kernel of the engine: dense linear programs of few variables, and what is made of many of them.

simplex      the primal simplex method in inequality form
programs     largest ball, support points
facets       redundancy of rows
elimination  Fourier-Motzkin elimination
entries      what Python calls
"""

from polytopes.kernel.elimination import FINISHED, OPEN, PAUSED, TOO_MANY
from polytopes.kernel.entries import eliminate, interior, irredundant, supports
from polytopes.kernel.simplex import AMBIGUOUS, LIMIT, OPTIMAL, STOPPED, UNBOUNDED

__all__ = [
    "AMBIGUOUS",
    "FINISHED",
    "LIMIT",
    "OPEN",
    "OPTIMAL",
    "PAUSED",
    "STOPPED",
    "TOO_MANY",
    "UNBOUNDED",
    "eliminate",
    "interior",
    "irredundant",
    "supports",
]
