"""State-space systems of other libraries."""

from __future__ import annotations

from typing import Any, NamedTuple

from svo.checks import Array, finite_array, real_number


class StateSpace(NamedTuple):
    """Matrices and dt: 0 for continuous time, True or the sampling time [s] for discrete time."""

    A: Array
    B: Array
    C: Array
    D: Array
    dt: float | bool


def state_space(sys: Any) -> StateSpace:
    """The matrices of a ``control.StateSpace``, a system of ``scipy.signal`` or an object with A, B, C, D and dt.

    Raises
    ------
    TypeError
        If it has no such matrices, or they are complex or no numbers.
    ValueError
        If its dt is None, which leaves open whether it is continuous (but for scipy, where it means that).
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
    return StateSpace(A, B, C, D, dt if dt is True else real_number("dt of sys", dt, least=0.0))
