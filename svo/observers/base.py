"""What every observer answers at a sample."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, Protocol

from polytopes import HPolytope
from svo.checks import Array

VerdictName = Literal["consistent", "falsified", "undecided"]


class Step(Protocol):
    """The answer of an observer at one sample.

    Attributes
    ----------
    verdict : {"consistent", "falsified", "undecided"}
        "falsified" only with a certificate that has been checked in exact arithmetic.
    reason : str or None
        Why a verdict is "undecided", where it is known: "outgrown" (the set has grown beyond all bounds of use in a gap
        of the measurements, and what came back does not yet bound the state), "outside the physical range" (of all that
        the data allow, without a proof), "a reading is too large" (for a polytope, which then goes on without it).
    certificate : object with ``verify()``, or None
    seconds : float
        Wall time of the call.
    box : (lower, upper)
        Bounds of the current state; infinite while the set is outgrown, NaN once the model is falsified.
    set : HPolytope
        The template set of the current state; empty once the model is falsified.
    support(directions) : (k,) array
        Outer bounds of d'x over the current state, for directions (k, n); -inf once the model is falsified.
    """

    @property
    def verdict(self) -> VerdictName: ...

    @property
    def certificate(self) -> Any: ...

    @property
    def seconds(self) -> float: ...

    @property
    def reason(self) -> str | None: ...

    @property
    def box(self) -> tuple[Array, Array]: ...

    @property
    def set(self) -> HPolytope: ...

    def support(self, directions: Any) -> Array: ...


class Observer(Protocol):
    """The protocol that isolation banks use; every observer of the package has it."""

    model: Any

    def update(self, y0: Any, u: Any = None, schedule: Any = None) -> Step:
        """A measurement without a transition (the first one)."""
        ...

    @property
    def step(self) -> Callable[..., Step]:
        """Called as step(u, y, u_next=None, schedule=None): one transition driven by u, then the measurement y.

        It may take a ``deadline`` in seconds besides.
        """
        ...

    def reset(self, set: HPolytope) -> None:
        """Forget all data and start again from a set of states."""
        ...

    def warm_up(self) -> float:
        """Compile whatever a step needs; returns the seconds that it took."""
        ...
