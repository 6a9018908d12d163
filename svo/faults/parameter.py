"""Faults of parameters of nonlinear plants, and of equations that have a parameter for the size of the fault."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, expect_kind, is_finite_number
from svo.faults.profiles import Profile, check_profile
from svo.models.nonlinear import NonlinearModel


@options_by_name
@dataclass(frozen=True)
class ParameterFault(Shown):
    """A parameter of a nonlinear plant that moves: at time t it is its healthy value + magnitude profile.value(t).

    A fault that is no change of a parameter is one with equations of its own, in which a further parameter, 0 while
    healthy, is the size of the fault: any function of state, input, disturbance and that size.

    Parameters
    ----------
    parameter : str
        Its name: one of the plant's, or a new one of ``f`` or ``h``, which comes after the plant's.
    magnitude : float
        Change of the full fault, not zero.
    profile : Profile
        Shape in time.
    f, h : function, or mapping from rows to text, optional
        Equations of the faulty plant in place of its own, which they are at the healthy value. A mapping may have
        only the rows that change, if the plant's own is one.

    Raises
    ------
    TypeError, ValueError
        Naming the argument.
    """

    parameter: str
    magnitude: float
    profile: Profile
    _: KW_ONLY
    f: Any = None
    h: Any = None

    def __post_init__(self) -> None:
        expect_kind("parameter", self.parameter, str, "the name of a parameter")
        check_profile(self.profile)
        is_usable = is_finite_number(self.magnitude) and self.magnitude != 0
        expect(is_usable, "magnitude", self.magnitude, "a finite number, not zero")

    def delta(self, t: ArrayLike) -> Array:
        """Change of the parameter at times t [s], of the shape of t."""
        return self.magnitude * self.profile.value(t)

    def model(self, nominal: NonlinearModel) -> NonlinearModel:
        """The observer's model of this fault; it contains ``nominal`` and every intermediate size.

        The parameter is free at each sample, from its healthy bounds to those of the full fault.

        Raises
        ------
        TypeError
            For a model that is not nonlinear.
        ValueError
            If it has no such parameter, and no equations are given that bring one in.
        """
        expect_kind("nominal", nominal, NonlinearModel, "a NonlinearModel, which has parameters")
        low, high = self.healthy(nominal)
        bounds = (low + min(0.0, self.magnitude), high + max(0.0, self.magnitude))
        changes = {name: _merged(getattr(nominal, name), own) for name, own in self.equations.items()}
        still = tuple(name for name in nominal.kept if name != self.parameter)  # one that moves is not constant
        return nominal.replace(parameters={**nominal.parameters, self.parameter: bounds}, constant=still, **changes)

    @property
    def equations(self) -> dict[str, Any]:
        """Those of its own, by name."""
        return {name: own for name, own in (("f", self.f), ("h", self.h)) if own is not None}

    def healthy(self, nominal: NonlinearModel) -> tuple[float, float]:
        """Bounds of the parameter in a ``nominal`` model, without the fault."""
        known = nominal.parameters
        if self.parameter in known:
            low, high = np.broadcast_to(known[self.parameter], 2)
            return float(low), float(high)
        if not self.equations:
            close = get_close_matches(self.parameter, known, 1)
            hint = f"did you mean {close[0]!r}?" if close else f"expected one of {', '.join(known) or 'none'}"
            raise ValueError(f"parameter is {self.parameter!r}, which the model has not; {hint}, or give f or h")
        return 0.0, 0.0


def _merged(own: Any, changed: Any) -> Any:
    is_partial = isinstance(own, Mapping) and isinstance(changed, Mapping)
    return {**own, **changed} if is_partial else changed
