"""State-space systems of other libraries."""

from __future__ import annotations

from typing import Any, NamedTuple

from svo.checks import Array, finite_array, real_number


class StateSpace(NamedTuple):
    """Matrices, D being None where it is zero, and the sampling time [s] of the model to be made of them."""

    A: Array
    B: Array
    C: Array
    D: Array | None
    Ts: float
    is_continuous: bool


def state_space(sys: Any, Ts: float | None) -> StateSpace:
    """The matrices of a ``control.StateSpace``, a system of ``scipy.signal`` or an object with A, B, C, D and dt.

    dt is 0 for continuous time, True or the sampling time [s] for discrete time.

    Raises
    ------
    TypeError
        If it has no such matrices, or they are complex or no numbers.
    ValueError
        If its dt is None, which leaves open whether it is continuous (but for scipy, where it means that); or if Ts is
        missing, or not the sampling time that the system has.
    """
    from scipy.signal import dlti, lti

    dt = getattr(sys, "dt", None)
    if isinstance(sys, lti | dlti):
        sys = sys.to_ss()
        dt = 0 if dt is None else dt
    if not all(hasattr(sys, name) for name in "ABCD"):
        raise TypeError(f"sys is a {type(sys).__name__}; expected a state-space system with A, B, C, D and dt")
    if dt is None:
        raise ValueError("sys has dt = None; expected 0 (continuous), True or the sampling time: set sys.dt")
    A, B, C, D = (finite_array(f"{name} of sys", getattr(sys, name)) for name in "ABCD")
    feedthrough = D if D.any() else None
    if dt is not True and (own := real_number("dt of sys", dt, least=0.0)):
        if Ts not in (None, own):
            raise ValueError(f"Ts is {Ts} but the system is discrete with dt = {own}; resample it, or leave Ts out")
        return StateSpace(A, B, C, feedthrough, own, is_continuous=False)
    if Ts is None:
        raise ValueError(f"Ts is missing: the system has dt = {dt!r}, so its sampling time must be given")
    return StateSpace(A, B, C, feedthrough, Ts, is_continuous=dt is not True)
