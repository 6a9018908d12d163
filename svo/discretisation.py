"""From continuous to discrete time, inputs and disturbances held over a sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import expm

from polytopes import HPolytope
from svo.checks import finite_array
from svo.uncertainty import Uncertainty

Array = NDArray[np.float64]
_ROUNDED_UP = 1e-9  # relative


def zero_order_hold(A: ArrayLike, B: ArrayLike, Ts: float) -> tuple[Array, Array]:
    """exp(A Ts) and int_0^Ts exp(A t) dt B, from one exponential of [[A B], [0 0]]."""
    A, B = np.asarray(A, dtype=float), np.asarray(B, dtype=float)
    n, m = B.shape
    joint = expm(np.block([[A, B], [np.zeros((m, n + m))]]) * Ts)
    return joint[:n, :n], joint[:n, n:]


def discretise(
    A: ArrayLike,
    B: ArrayLike | None,
    *,
    E: ArrayLike | None,
    a: ArrayLike | None,
    F: ArrayLike | None,
    w: Any,
    uncertainties: Sequence[Uncertainty],
    remainder: ArrayLike | None,
    Ts: float,
) -> dict[str, Any]:
    """Arguments of the discrete model of dx/dt = A x + B u + a + E w; see `UncertainModel.from_continuous`.

    Raises
    ------
    ValueError
        Naming the array, its shape and the expected one, or the ``remainder`` that is missing.
    """
    A = _square(A)
    n = len(A)
    given = {name: _of_rows(name, v, n) for name, v in (("B", B), ("a", a), ("E", E)) if v is not None}
    held = {name: zero_order_hold(A, v.reshape(n, -1), Ts)[1].reshape(v.shape) for name, v in given.items()}
    gamma = zero_order_hold(A, np.eye(n), Ts)[1]
    discrete = [_directions(gamma, u) for u in uncertainties]
    out: dict[str, Any] = {"A": zero_order_hold(A, np.zeros((n, 0)), Ts)[0], "B": None, "E": None, "a": None, **held}
    out |= {"F": F, "w": w, "uncertainties": discrete}
    if remainder is not None:
        return out | _with_remainder(w, out["E"], F, discrete, remainder, n)
    if any(getattr(u, name) is not None for u in uncertainties for name in ("A", "B", "a", "E")):
        raise ValueError(
            f"remainder is missing: give the bound ({n},) of what the first-order discretisation leaves out; bounds of "
            "|x| and |u| are enough to compute it (svo.discretisation.remainder_bound; in a TOML file "
            "remainder = {states = [...], inputs = [...]})"
        )
    return out


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
) -> Array:
    """What `UncertainModel.from_continuous` leaves out of a sample at most, for each Delta held over a sample.

    By variation of constants that is the sum of int_0^Ts exp(A (Ts - t)) Delta_i A_i (x(t) - x(0)) dt. Entry by entry
    |exp(A t)| <= exp(|A| t), and |x(t) - x(0)| <= t v with v a bound of |dx/dt| over the bounds of x, u, w and Delta.

    Parameters
    ----------
    A, B, E, a, w, uncertainties
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
    A = _square(A)
    n = len(A)
    if not (np.isfinite(Ts) and Ts > 0):
        raise ValueError(f"Ts is {Ts}; expected a positive sampling time in seconds")
    reach = {"A": _largest("x", x, n)}
    reach["B"] = _largest("u", u, 0 if B is None else np.shape(B)[-1])
    reach["E"] = np.maximum(*(np.abs(edge) for edge in _bounds(w, 0 if E is None else np.shape(E)[-1])))
    reach["a"] = np.ones(1)

    def rate(arrays: dict[str, Any], what: str = "") -> Array:
        """Largest absolute value of the terms of dx/dt that the arrays make."""
        total = np.zeros(n)
        for name, value in arrays.items():
            if value is not None:
                total += np.abs(_of_rows(f"{name}{what}".rstrip(), value, n).reshape(n, -1)) @ reach[name]
        return total

    speed, gain = rate({"A": A, "B": B, "a": a, "E": E}), np.zeros((n, n))
    for item in uncertainties:
        if any(callable(getattr(item, name)) for name in reach):
            raise ValueError("an array of an uncertainty is a function; remainder_bound takes constant arrays")
        largest = np.abs(item.bounds).max()
        speed += largest * rate({name: getattr(item, name) for name in reach}, f" of uncertainty {item.name}")
        if item.A is not None:
            gain += largest * np.abs(np.asarray(item.A, dtype=float))
    # int_0^Ts exp(|A| (Ts - t)) t dt is the last block of the first row of the exponential of a nilpotent extension.
    zero, one = np.zeros((n, n)), np.eye(n)
    joint = expm(np.block([[np.abs(A), one, zero], [zero, zero, one], [zero, zero, zero]]) * Ts)
    return joint[:n, 2 * n :] @ gain @ speed * (1.0 + _ROUNDED_UP)


def _largest(name: str, value: ArrayLike | None, size: int) -> Array:
    """Largest absolute values (size,)."""
    array = finite_array(name, np.zeros(0) if value is None else value)
    if array.shape != (size,) or (array < 0).any():
        raise ValueError(f"{name} is {array}; expected the largest absolute values, shape ({size},)")
    return array


def _square(A: ArrayLike) -> Array:
    array = finite_array("A", A)
    if array.ndim != 2 or array.shape[0] != array.shape[1]:
        raise ValueError(f"A has shape {array.shape}; expected a square matrix (n, n)")
    return array


def _of_rows(name: str, value: ArrayLike, n: int) -> Array:
    array = finite_array(name, value)
    if array.ndim != (1 if name[0] == "a" else 2) or len(array) != n:
        raise ValueError(f"{name} has shape {array.shape}; expected ({n},{'' if name[0] == 'a' else ' columns'})")
    return array


def _directions(gamma: Array, u: Uncertainty) -> Uncertainty:
    changed: dict[str, Any] = {}
    for name in ("A", "B", "a", "E"):
        value: Any = getattr(u, name)
        if callable(value):
            raise ValueError(f"{name} of an uncertainty is a function; from_continuous takes constant arrays")
        if value is not None:
            changed[name] = gamma @ _of_rows(f"{name} of uncertainty {u.name}".rstrip(), value, len(gamma))
    return replace(u, **changed)


def _with_remainder(
    w: Any, E: Array | None, F: ArrayLike | None, uncertainties: list[Uncertainty], remainder: ArrayLike, n: int
) -> dict[str, Any]:
    """One more disturbance a state, |w_new| <= remainder, for arrays that knew nothing of it."""
    width = finite_array("remainder", remainder)
    if width.shape not in ((), (n,)) or (width < 0).any():
        raise ValueError(f"remainder is {width} of shape {width.shape}; expected bounds >= 0 of shape ({n},)")
    width = np.broadcast_to(width, (n,))
    E = np.zeros((n, 0)) if E is None else E
    lower, upper = _bounds(w, E.shape[1])

    def pad(value: Any) -> Any:
        return None if value is None else np.hstack([np.asarray(value, dtype=float), np.zeros((len(value), n))])

    return {
        "E": np.hstack([E, np.eye(n)]),
        "F": pad(F),
        "w": (np.concatenate([lower, -width]), np.concatenate([upper, width])),
        "uncertainties": [replace(u, E=pad(u.E), F=pad(u.F)) for u in uncertainties],
    }


def _bounds(w: Any, nw: int) -> tuple[Array, Array]:
    """Bounds of the disturbances that w gives as (lower, upper) or half-widths."""
    if w is None and nw:
        raise ValueError(f"w is missing: E has {nw} columns, so give (lower, upper) or a half-width ({nw},)")
    if isinstance(w, HPolytope) or callable(w) or (isinstance(w, tuple) and any(callable(b) for b in w)):
        raise ValueError("w is a polytope or a function; from_continuous with a remainder takes bounds or half-widths")
    upper = finite_array("w", 0.0 if w is None else w[1] if isinstance(w, tuple) else w)
    lower = finite_array("w", w[0]) if isinstance(w, tuple) else -upper
    for bound in (lower, upper):
        if bound.shape not in ((), (nw,)):
            raise ValueError(f"w has a bound of shape {bound.shape}; expected ({nw},), the number of columns of E")
    return np.broadcast_to(lower, (nw,)), np.broadcast_to(upper, (nw,))
