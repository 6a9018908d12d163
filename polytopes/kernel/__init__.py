"""Compiled kernel of the engine: dense linear programs of few variables, and what is made of many of them.

simplex      the primal simplex method in inequality form
programs     largest ball, support points
facets       redundancy of rows
elimination  one step of Fourier-Motzkin
entries      what Python calls
"""

from polytopes.kernel.entries import cheapest, interior, irredundant, pruned, step, supports
from polytopes.kernel.simplex import AMBIGUOUS, LIMIT, OPTIMAL, STOPPED, UNBOUNDED

__all__ = [
    "AMBIGUOUS",
    "LIMIT",
    "OPTIMAL",
    "STOPPED",
    "UNBOUNDED",
    "cheapest",
    "interior",
    "irredundant",
    "pruned",
    "step",
    "supports",
]
