"""Compiled kernel of the engine: dense linear programs of few variables, and what is made of many of them.

simplex      the primal simplex method in inequality form
programs     largest ball, support points
duality      bounds of the optima that no rounding undercuts
scaling      even units for rows and columns
facets       redundancy of rows
elimination  Fourier-Motzkin elimination
entries      what Python calls
"""

from polytopes.kernel.elimination import FINISHED, OPEN, PAUSED, TOO_MANY
from polytopes.kernel.entries import eliminate, exponents, interior, irredundant, scaled, supports
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
    "exponents",
    "interior",
    "irredundant",
    "scaled",
    "supports",
]
