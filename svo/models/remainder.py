"""What the discretisation of an uncertain plant leaves out of a sample, in numbers to give to `from_continuous`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from svo.checks import Array
from svo.models.discretisation import check_constant, largest, left_out, vary_in
from svo.models.model import UncertainModel
from svo.models.uncertainty import Uncertainty


def remainder_bound(
    A: ArrayLike,
    B: ArrayLike | None,
    *,
    Ts: float,
    x: ArrayLike,
    u: ArrayLike | None = None,
    E: ArrayLike | None = None,
    a: ArrayLike | None = None,
    w: Any = None,
    uncertainties: Sequence[Uncertainty],
    varying: str | Sequence[str] = (),
) -> Array:
    """What `UncertainModel.from_continuous` leaves out of a sample at most, for the uncertainties.

    See `svo.models.discretisation.left_out` for the bound.

    Parameters
    ----------
    A, B, E, a, w, uncertainties, varying
        As for `UncertainModel.from_continuous`.
    Ts : float
        Sampling time [s].
    x, u : (n,), (nu,) arrays
        Largest |x| that the state has at any time (between the samples too), and largest |u|.

    Returns
    -------
    (n,) array

    Raises
    ------
    ValueError
        Naming the array, its shape and the expected one.
    """
    states = [Uncertainty(A=i.A, B=i.B, a=i.a, E=i.E, bounds=i.bounds, name=i.name) for i in uncertainties]
    n = max(1, len(np.atleast_1d(A)))  # no outputs are needed here
    arrays = {"A": A, "B": B, "C": np.zeros((0, n)), "E": E, "a": a, "w": w, "Ts": Ts, "uncertainties": states}
    check_constant(arrays)
    plant = UncertainModel(**arrays)
    return left_out(plant, largest("x", x, n), largest("u", u, plant.n_inputs), vary_in(plant, varying))
