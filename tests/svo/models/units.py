"""A nonlinear plant in other units: states, inputs, disturbances and readings times powers of two."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from inspect import Parameter, Signature, signature
from typing import Any

import numpy as np

from svo.checks import Array
from tests.svo.models.nonlinear_plants import Case

LARGEST = 30  # exponent of a unit


def in_other_units(case: Case, rng: np.random.Generator) -> Case:
    """The same plant with each state, input, disturbance, parameter and reading in a unit of its own."""
    model, sizes = case.model, ["n_states", "n_inputs", "n_disturbances", "n_outputs"]
    x, u, w, y = (np.exp2(rng.integers(-LARGEST, LARGEST + 1, getattr(model, size))) for size in sizes)
    p = np.exp2(rng.integers(-LARGEST, LARGEST + 1, len(model.parameters)))
    units = {"u": u, "w": w, "p": p}

    def scaled(function: Callable[..., Any], rows: Array) -> Callable[..., Any]:
        names = [q.name for q in signature(function).parameters.values() if q.default is Parameter.empty]

        def value(**given: Any) -> Any:
            plain = {
                name: [v / s for v, s in zip(vector, units.get(name, x), strict=True)] for name, vector in given.items()
            }
            found = function(**plain)
            found = found if isinstance(found, list | tuple) else [found]
            return [row * s for row, s in zip(found, rows, strict=True)]

        value.__signature__ = Signature([Parameter(name, Parameter.KEYWORD_ONLY) for name in names])  # type: ignore[attr-defined]
        return value

    def ends(given: Any) -> Any:
        return None if given is None else tuple(np.asarray(end) * x for end in given)

    low, high = model.flow.w
    nd = len(w)
    bounds = {name: (a * s, b * s) for name, a, b, s in zip(model.parameters, low[nd:], high[nd:], p, strict=True)}
    made = model.replace(
        f=scaled(model.f, x), h=scaled(model.h, y), n=model.noise * y, w=(low[:nd] * w, high[:nd] * w),
        parameters=bounds, **{name: ends(getattr(model, name)) for name in ("physical", "valid", "largest")},
    )  # fmt: skip
    control = case.control
    return replace(
        case, model=made, x0=case.x0 * x, spread=case.spread * x,
        u=lambda k: (np.array(case.u(k), dtype=float) * u).tolist(),
        control=None if control is None else lambda v: control(v / y[:, None]) * u[:, None],
        normal=None if case.normal is None else (case.normal[0] * x, case.normal[1] * x),
    )  # fmt: skip
