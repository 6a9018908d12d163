"""What the arguments of a nonlinear model say: names, bounds, which parameters are states, what varies in a sample."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import expect, expect_kind, finite_array, sizes
from svo.models.nonlinear.flow import Span


def names_of(what: str, given: Any) -> tuple[str, ...]:
    """The names that an argument lists."""
    is_list = isinstance(given, Sequence) and not isinstance(given, str)
    if not is_list or not all(isinstance(name, str) for name in given):
        raise TypeError(f"{what} is {given!r:.80}; expected a list of names")
    return tuple(given)


def bounds_of(w: Any, disturbances: Sequence[str], parameters: Any) -> Span:
    """Bounds of disturbances, then parameters."""
    nw = len(disturbances)
    if w is None:
        expect(nw == 0, "w", w, f"bounds of the {nw} disturbances: (lower, upper), or a half-width vector ({nw},)")
        w = np.zeros(0)
    if isinstance(w, tuple) and len(w) == 2:
        lower, upper = (finite_array(f"w[{i}]", end, (nw,)) for i, end in enumerate(w))
    else:
        upper = sizes("w", w, nw)
        lower = -upper
    expect_kind("parameters", parameters, Mapping, "a mapping from names to (lower, upper)")
    names_of("parameters", list(parameters))
    given = {name: (ends, ends) if np.ndim(ends) == 0 else ends for name, ends in parameters.items()}
    ends = [finite_array(f"parameters[{name!r}]", end, (2,)) for name, end in given.items()]
    p = np.array(ends, dtype=float).reshape(-1, 2)
    span = Span(np.concatenate([lower, p[:, 0]]), np.concatenate([upper, p[:, 1]]))
    names = [*disturbances, *parameters]
    for name, low, high in zip(names, *span, strict=True):
        if low > high:
            raise ValueError(f"{name} is between {low} and {high}; expected lower <= upper")
    return span


def kept_of(constant: Any, parameters: Sequence[str], is_range: NDArray[np.bool_]) -> tuple[str, ...]:
    """The parameters that are constant and not known."""
    expect_kind("constant", constant, (bool, str, Sequence), "True, a name of a parameter, or a list of names")
    chosen = ([*parameters] if constant else []) if isinstance(constant, bool) else constant
    names = names_of("constant", [chosen] if isinstance(chosen, str) else chosen)
    for name in names:
        known = f"any of the parameters {', '.join(parameters)}" if parameters else "nothing, there is no parameter"
        expect(name in parameters, "constant", name, known)
    return tuple(name for name, free in zip(parameters, is_range, strict=True) if free and name in names)


def varying_of(varying: Any, disturbances: Sequence[str], parameters: Sequence[str]) -> NDArray[np.bool_]:
    """Of each disturbance, then each parameter, whether it may change inside a sample."""
    expect_kind("varying", varying, (str, Sequence), "a name, or a list of names")
    chosen = [varying] if isinstance(varying, str) else list(varying)
    groups = {"all": [*disturbances, *parameters], "w": disturbances, "p": parameters}
    names = {name: [name] for name in groups["all"]}
    known = groups | names  # a name of a disturbance or a parameter comes before that of a group
    for name in chosen:
        if name not in known:
            raise ValueError(f"varying names {name!r}; expected any of {', '.join(known)}")
    moves = {member for name in chosen for member in known[name]}
    return np.array([name in moves for name in groups["all"]], dtype=bool)
