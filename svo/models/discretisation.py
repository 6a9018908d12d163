"""From continuous to discrete time: what is exact where inputs are held, and a bound of what the rest leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from svo.checks import Array, expect, finite_array, positive_number
from svo.models.held import Varying, which_vary
from svo.models.inside_sample import departure, exponential, growth, kept
from svo.models.stack import STATE_BLOCKS

Plant: TypeAlias = Any  # an `svo.UncertainModel` in continuous time: the model imports this file, not the other way

_ROUNDED_UP = 1e-9  # relative: more than what sums of numbers >= 0, fewer than a million, lose to rounding


def zero_order_hold(A: ArrayLike, B: ArrayLike, Ts: float) -> tuple[Array, Array]:
    """exp(A Ts) and int_0^Ts exp(A t) dt B, from one exponential of [[A B], [0 0]]; the nearest floats.

    Raises
    ------
    ValueError
        If they are beyond all floats.
    """
    A, B = finite_array("A", A, ("n", "n")), finite_array("B", B, ("n", "m"))
    n, m = B.shape
    seconds = positive_number("Ts", Ts, "sampling time in seconds")
    joint = exponential(np.block([[A, B], [np.zeros((m, n + m))]]), seconds)
    if not np.isfinite(joint).all():
        raise ValueError(f"a transition of {seconds:g} s (Ts, or dt) is beyond all floats; expected a shorter one")
    return joint[:n, :n], joint[:n, n:]


def check_constant(arrays: Mapping[str, Any]) -> None:
    """Of the arguments of a continuous plant, before their shapes are looked at."""
    owners = [("", arrays), *((" of an uncertainty", vars(item)) for item in arrays.get("uncertainties", ()))]
    for owner, given in owners:
        for name in STATE_BLOCKS:
            if callable(given.get(name)):
                raise ValueError(f"{name}{owner} is a function; from_continuous takes constant arrays")


def vary_in(plant: Plant, varying: Any) -> Varying:
    """What varies inside a sample of a continuous plant."""
    given = (plant.names or {}).get("disturbances")
    w_names = [""] * plant.n_disturbances if given is None else given
    return which_vary(varying, w_names, [item.name for item in plant.uncertainties])


def left_out(plant: Plant, x: Array, u: Array, vary: Varying) -> Array:
    """A bound (n,) of what a sample leaves out, for a plant whose arrays, all constant, are those of continuous time.

    By variation of constants a Delta_i that is held leaves out int_0^Ts exp(A (Ts - t)) Delta_i A_i (x(t) - x(0)) dt.
    |exp(A t)| <= exp(M t) entry by entry (`svo.models.inside_sample.growth`), and |x(t) - x(0)| <= t v with v a bound
    of |dx/dt| over the bounds of x, u, w and Delta. A Delta_i, or a w that it multiplies, that varies inside the sample
    is replaced by its mean there, which leaves out as much as `svo.models.inside_sample.departure` of the directions
    times the radius, and |Gamma E_i| times both radii where both vary (a covariance).
    """
    n, nw = plant.n_states, plant.n_disturbances
    lower, upper, _ = bounds_in(plant)
    reach = np.concatenate([x, u, [1.0], np.maximum(np.abs(lower), np.abs(upper))])
    parts = plant.stack(plant.schedule)[:, :n]
    ends = np.array([item.bounds for item in plant.uncertainties]).reshape(-1, 2)
    largest = np.concatenate([[1.0], np.abs(ends).max(axis=1)])
    terms = largest[:, None, None] * np.abs(parts)
    speed, gain = terms.sum(axis=0) @ reach, terms[1:, :, :n].sum(axis=0)
    gamma = zero_order_hold(parts[0, :, :n], np.eye(n), plant.Ts)[1]
    total = growth(parts[0, :, :n], plant.Ts) @ (gain @ speed)
    for part, (low, high), moves in zip(parts[1:], ends, vary.delta, strict=True):
        amount = (high - low) / 2 * reach if moves else np.zeros_like(reach)
        products = np.array([d * w for d in (low, high) for w in (lower, upper)]).reshape(4, nw)
        radius = np.ptp(products, axis=0) / 2 if moves else max(abs(low), abs(high)) * (upper - lower) / 2
        amount[reach.size - nw :][vary.w] = radius[vary.w]
        used = (amount > 0) & part.any(axis=0)
        if used.any():
            held = gamma @ part[:, used]
            total += departure(parts[0, :, :n], part[:, used], held, plant.Ts) @ amount[used]
        if moves:
            both = np.where(vary.w, (high - low) / 2 * (upper - lower) / 2, 0.0)
            total += np.abs(gamma @ part[:, reach.size - nw :]) @ both
    return total * (1.0 + _ROUNDED_UP)


def wandering(plant: Plant, which: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
    """The disturbances ``which`` of a continuous plant, where they vary inside a sample.

    Returns
    -------
    (n, k) array, (n,) array, (n,) array
        Directions of their means over a sample, what their centres add beside that, and a bound of the rest.
    """
    lower, upper, _ = bounds_in(plant)
    A, E = plant.block("A"), plant.block("E")[:, which]
    common = kept(A, E, plant.Ts)
    centre, radius = (lower + upper)[which] / 2, (upper - lower)[which] / 2 * (1.0 + _ROUNDED_UP)
    shift = (zero_order_hold(A, E, plant.Ts)[1] - common) @ centre
    return common, shift, departure(A, E, common, plant.Ts) @ radius * (1.0 + _ROUNDED_UP)


def bounds_in(plant: Plant) -> tuple[Array, Array, Array]:
    """Constant bounds of w (nw,), (nw,) and noise."""
    edges = plant.w if isinstance(plant.w, tuple) else ()
    if plant.disturbance_polytope is not None or any(callable(edge) for edge in edges):
        raise ValueError("w is a polytope or a function; what is left out needs bounds or half-widths")
    return plant.bounds(plant.schedule)


def largest(name: str, value: ArrayLike | None, size: int) -> Array:
    """Largest absolute values (size,)."""
    array = finite_array(name, np.zeros(0) if value is None else value)
    expect(
        array.shape == (size,) and not (array < 0).any(), name, array, f"the largest absolute values, shape ({size},)"
    )
    return array
