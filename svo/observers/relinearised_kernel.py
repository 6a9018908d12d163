"""The core's loop over samples of a nonlinear plant (`core/relinearised`): each linearised, then taken by a window."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from polytopes import native
from polytopes.native import Address, Given, Integer, Real
from svo.checks import Array
from svo.models import NormalForm
from svo.models.nonlinear import Linearisation, NonlinearModel, Span, Undecided
from svo.models.nonlinear.plant_kernel import PlantKernel
from svo.observers.window_kernel import UNLIMITED, told

_move = native.function(
    "fdi_relinearised_move", *[Address] * 2, Given, *[Address] * 2, Given, Real, Integer, Address, returns=Integer
)
_follow = native.function(
    "fdi_relinearised_follow", *[Address] * 2, Given, *[Address] * 2, Integer, *[Given] * 4, Real, Integer,
    *[Address] * 3, returns=Integer,
)  # fmt: skip

TAKEN, WITHOUT_ROOM, BOX_WITHOUT_ROOM, NOT_MOVED, NOT_MEASURED = range(5)  # as in `core/relinearised/follow.c`


class PlantSamples(NamedTuple):
    """Samples that follow each other, in the user's units.

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


class Carried:
    """What is carried from sample to sample besides the window, where the core changes it.

    Parameters
    ----------
    model : NonlinearModel

    Attributes
    ----------
    box, now, before : Span, Linearisation, Linearisation
        As `svo.observers.window.relinearised.Relinearised` has them, whether there are such samples or not.
    result, why : (2,) int, (8,) arrays
        How the last call ended.
    address : int
    to_result : tuple of int
        Addresses of ``result`` and ``why``.
    """

    def __init__(self, model: NonlinearModel) -> None:
        n, ny = model.n_states, model.n_outputs
        rows = n + ny, model.n_inputs + 1 + model.carrier.n_disturbances + n
        self._shape, self._nu = rows, model.n_inputs
        size = rows[0] * rows[1]
        self._lengths = [n, n, size, ny, size, ny, 4 * n + size, 2, 8]  # the third from behind is scratch
        self._block = np.zeros(sum(self._lengths))
        self._find()

    def __getstate__(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("_shape", "_nu", "_lengths", "_block")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ |= state
        self._find()

    def _find(self) -> None:
        self.address = native.address(self._block)
        low, high, now, now_noise, before, noise, _, result, self.why = np.split(
            self._block, np.cumsum(self._lengths[:-1])
        )
        self.result = result.view(np.int64)
        self.to_result = native.address(self.result), native.address(self.why)
        self.box = Span(low, high)
        self.now = Linearisation(now.reshape(self._shape), now_noise, self._nu)
        self.before = Linearisation(before.reshape(self._shape), noise, self._nu)


def units_of(form: NormalForm) -> Array:
    """What leads from the user's units to a window's normal form, and its constant bounds, as the core reads them."""
    model = form.model
    w_lower, w_upper, _ = model.bounds(model.schedule)
    infinite, physical = np.full(model.n_states, np.inf), model.physical_range
    ends = (-infinite, infinite) if physical is None else (physical.lower, physical.upper)
    factor = form.exponents.factor.ravel()
    return np.concatenate([form.x, factor, 1.0 / form.u, 1.0 / form.y, w_lower, w_upper, *ends])


def move(
    window: int, plant: PlantKernel, units: Array, carried: Carried, u: Array, T: float
) -> tuple[int, Undecided | None]:
    """The transition from the newest sample over a time T, where a window reads it: how it ends, why there is none."""
    end = _move(
        window, plant.address, units, carried.address, native.scratch(plant.room), u, T, UNLIMITED, carried.to_result[1]
    )
    return end, plant.undecided(carried.why) if end == NOT_MOVED else None


def follow(
    window: int,
    plant: PlantKernel,
    units: Array,
    carried: Carried,
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
    units : array
        As `units_of` gives it.
    carried : Carried
    samples : PlantSamples
    eps : float
        As of the window.
    boxes : (k, 2, n) array, optional
        Filled with the boxes of the samples that are consistent.
    """
    to_boxes = None if boxes is None else native.address(boxes)
    done = _follow(
        window, plant.address, units, carried.address, native.scratch(plant.room), len(samples.T), *samples, eps,
        UNLIMITED, to_boxes, *carried.to_result,
    )  # fmt: skip
    end, of_next = carried.result.tolist()
    return Followed(done, end, told(of_next), plant.undecided(carried.why) if end == NOT_MOVED else None)
