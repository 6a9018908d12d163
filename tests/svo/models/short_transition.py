"""A transition as the core hands it to a window: its rows in few digits, and bounds of the next state."""

from __future__ import annotations

import numpy as np

from polytopes import native
from polytopes.native import Address, Entries, Given, Integer, Real
from svo import NonlinearModel
from svo.checks import Array
from svo.models.nonlinear import Linearisation, Span

_moved = native.function(
    "fdi_plant_moved", Address, Address, *[Given] * 2, *[Entries] * 2, Given, Real, *[Entries] * 2, returns=Integer
)


def moved(model: NonlinearModel, known: Span, box: Span, u: Array) -> tuple[Linearisation, Span]:
    """From the states in both boxes, or in the first if none is in both; Undecided if there is none."""
    kernel, told = model.kernel, np.empty(8)
    found = Linearisation.empty(model.n_states, len(model.flow.varying), model.n_outputs, model.n_inputs)
    left = Span(box.lower.copy(), box.upper.copy())
    if _moved(kernel.address, native.scratch(kernel.room), *known, *left, u, model.Ts, found.rows, told):
        raise kernel.undecided(told)
    return found, left
