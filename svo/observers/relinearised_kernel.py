"""The core's loop over samples of a nonlinear plant (`core/relinearised`): each linearised, then taken by a window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from polytopes import native
from polytopes.native import Address, Entries, Given, Integer, Real
from svo.checks import Array
from svo.models import NormalForm
from svo.models.nonlinear import Linearisation, Span, Undecided
from svo.models.nonlinear.plant_kernel import PlantKernel
from svo.observers.window_kernel import UNLIMITED, told

_follow = native.function(
    "fdi_relinearised_follow", *[Address] * 2, Given, Entries, Address, Integer, *[Address] * 4, Real, Integer,
    Address, *[Entries] * 2, returns=Integer,
)  # fmt: skip

TAKEN, WITHOUT_ROOM, BOX_WITHOUT_ROOM, NOT_MOVED, NOT_MEASURED = range(5)  # as in `core/relinearised/follow.c`


class PlantSamples(NamedTuple):
    """Samples of a log, in the user's units, as C-contiguous floats.

    Attributes
    ----------
    u, u_next, y : (k, nu), (k, nu), (k, ny) arrays
        What drives the transition to each sample, its own input or zeros, and its measurement.
    T : (k,) array
        Seconds of each transition.
    """

    u: Array
    u_next: Array
    y: Array
    T: Array

    def after(self, first: int) -> PlantSamples:
        """Those from one of them on."""
        return PlantSamples(*(array[first:] for array in self))


class Followed(NamedTuple):
    """How samples went.

    Attributes
    ----------
    done : int
        How many are simply consistent.
    end : int
        How they end.
    told : (code, verdict, program)
        What `window_kernel.take` says of the sample after them, if it is taken.
    why : Undecided or None
        Why there is no transition to it.
    """

    done: int
    end: int
    told: tuple[int, int, int]
    why: Undecided | None


class Carried(NamedTuple):
    """What is carried from sample to sample besides the window.

    Attributes
    ----------
    box : Span
        Of the newest state.
    now, before : Linearisation
        Of the newest sample, without a transition, and of the one before it.
    """

    box: Span
    now: Linearisation
    before: Linearisation

    def to_core(self) -> Array:
        """In the order of the core, with the scratch that it needs."""
        rows, n = self.now.rows.ravel(), len(self.box.lower)
        room = np.empty(4 * n + rows.size)
        return np.concatenate([*self.box, rows, self.now.n, self.before.rows.ravel(), self.before.n, room])

    def read(self, given: Array) -> Carried:
        """The same from what the core has left."""
        n, size = len(self.box.lower), self.now.rows.size + len(self.now.n)
        now, before = (self.now.read(given[2 * n + at : 2 * n + at + size]) for at in (0, size))
        return Carried(Span(given[:n].copy(), given[n : 2 * n].copy()), now, before)


def units_of(form: NormalForm) -> Array:
    """What leads from the user's units to a window's normal form, and its constant bounds, as the core reads them."""
    model = form.model
    w_lower, w_upper, _ = model.bounds(model.schedule)
    infinite, physical = np.full(model.n_states, np.inf), model.physical_range
    ends = (-infinite, infinite) if physical is None else (physical.lower, physical.upper)
    factor = form.exponents.factor.ravel()
    return np.concatenate([form.x, factor, 1.0 / form.u, 1.0 / form.y, w_lower, w_upper, *ends])


def follow(
    window: int,
    plant: PlantKernel,
    units: Array,
    carried: Array,
    samples: PlantSamples,
    eps: float,
    boxes: Array | None,
) -> Followed:
    """Samples in turn, until one is not simply consistent, of which the caller concludes the rest.

    Parameters
    ----------
    window : int
        Address of its block.
    plant : PlantKernel
    units, carried : arrays
        As `units_of` and `Carried.to_core` give them; what is carried is changed.
    samples : PlantSamples
    eps : float
        As of the window.
    boxes : (k, 2, n) array, optional
        Filled with the boxes of the samples that are consistent.
    """
    result, why = np.zeros(2, dtype=np.int64), np.zeros(8)
    data, to_boxes = (native.address(array) for array in samples), None if boxes is None else native.address(boxes)
    done = _follow(
        window, plant.address, units, carried, native.scratch(plant.room), len(samples.T), *data, eps, UNLIMITED,
        to_boxes, result, why,
    )  # fmt: skip
    end = int(result[0])
    return Followed(int(done), end, told(int(result[1])), plant.undecided(why) if end == NOT_MOVED else None)
