"""Faults of nonlinear plants: a plant's equations with other readings, with other inputs, or with further terms.

The size of a fault is a parameter after those of the plant, an unknown deflection a disturbance after its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from svo.checks import Array, finite_array
from svo.models import UncertainModel, Uncertainty
from svo.models.nonlinear import NonlinearModel
from svo.models.nonlinear.tracing import OfVectors

Bounds = tuple[float, float]
Model = TypeVar("Model", UncertainModel, NonlinearModel)


class Vectors(NamedTuple):
    """What the equations of a plant are of."""

    x: Any
    w: Any
    p: Any
    u: Any


Law = Callable[[Callable[[Vectors], list[Any]], Vectors, Any, Any], Iterable[Any]]
"""Rows from a plant's own, the plant's vectors, the further disturbances and the further parameters."""


def unchanged(own: Callable[[Vectors], list[Any]], z: Vectors, v: Any, d: Any) -> Iterable[Any]:
    """The plant's own rows."""
    return own(z)


def rewritten(
    nominal: NonlinearModel,
    *,
    dynamics: Law = unchanged,
    outputs: Law = unchanged,
    disturbances: Mapping[str, Bounds] | None = None,
    parameters: Mapping[str, Bounds] | None = None,
    noise: Array | None = None,
) -> NonlinearModel:
    """The plant with other equations, made of its own."""
    nw, npar = nominal.n_disturbances, len(nominal.parameters)
    taken = [*nominal.states, *nominal.inputs, *nominal.disturbances, *nominal.parameters]
    v = {_fresh(name, taken): ends for name, ends in (disturbances or {}).items()}
    d = {_fresh(name, taken): ends for name, ends in (parameters or {}).items()}
    every, sizes = (*nominal.disturbances, *v), {**nominal.parameters, **d}
    symbols = nominal.symbols._replace(w=every, p=tuple(sizes))

    def of(own: OfVectors, law: Law) -> OfVectors:
        plain = lambda z: list(own(**z._asdict()))  # noqa: E731
        of_all = lambda x, w, p, u: law(plain, Vectors(x, w[:nw], p[:npar], u), w[nw:], p[npar:])  # noqa: E731
        return OfVectors(of_all, symbols)

    f, h = nominal.equations
    low, high = (np.append(end[:nw], [e[i] for e in v.values()]) for i, end in enumerate(nominal.flow.w))
    return nominal.replace(
        f=of(f, dynamics) if dynamics is not unchanged else nominal.f,
        h=of(h, outputs) if outputs is not unchanged else nominal.h,
        disturbances=every, w=(low, high), parameters=sizes, constant=nominal.kept,
        n=nominal.noise if noise is None else noise,
    )  # fmt: skip


def scaled_readings(where: Sequence[int], target: float | None) -> Law:
    """Law of outputs that are (1 + d) y, or with a target (1 - d) y + d target."""

    def law(own: Callable[[Vectors], list[Any]], z: Vectors, v: Any, d: Any) -> list[Any]:
        rows = own(z)
        for i in where:
            rows[i] = rows[i] * (1.0 + d[0]) if target is None else rows[i] + d[0] * (target - rows[i])
        return rows

    return law


def with_inputs(achieved: Callable[[list[Any], Any, Any], None]) -> Law:
    """Law of a plant whose inputs are not what was commanded: ``achieved`` changes a list of them, given v and d."""

    def law(own: Callable[[Vectors], list[Any]], z: Vectors, v: Any, d: Any) -> list[Any]:
        u = list(z.u)
        achieved(u, v, d)
        return own(z._replace(u=np.array(u, dtype=object)))

    return law


def with_terms(nominal: NonlinearModel, direction: Uncertainty) -> tuple[Law, Law]:
    """Laws of a plant with d (A x + B u + a + E w) in dx/dt, or x(k+1), and d (C x + D u + c + F w) in its output."""
    columns = {"x": len(nominal.states), "u": nominal.n_inputs, "1": 1, "w": nominal.n_disturbances}
    return tuple(  # type: ignore[return-value]
        _added(_blocks(direction, names, rows, columns))
        for names, rows in (("ABaE", len(nominal.states)), ("CDcF", nominal.n_outputs))
    )


def _blocks(direction: Uncertainty, names: str, rows: int, columns: Mapping[str, int]) -> dict[str, Array]:
    """The blocks that there are, by what they multiply."""
    found = {}
    for name, (what, count) in zip(names, columns.items(), strict=True):
        value = getattr(direction, name)
        if callable(value):
            raise ValueError(f"{name} of the direction is a function of a schedule, which a nonlinear model has not")
        if value is not None:
            shape = (rows,) if what == "1" else (rows, count)
            found[what] = finite_array(f"{name} of the direction", value, shape).reshape(rows, count)
    return found


def _added(blocks: Mapping[str, Array]) -> Law:
    if not any(block.any() for block in blocks.values()):
        return unchanged

    def law(own: Callable[[Vectors], list[Any]], z: Vectors, v: Any, d: Any) -> list[Any]:
        rows = own(z)
        known = {"x": z.x, "u": z.u, "1": [1.0], "w": z.w}
        for i in range(len(rows)):
            used = [(what, j) for what, block in blocks.items() for j in np.flatnonzero(block[i]).tolist()]
            terms = [blocks[what][i, j] * known[what][j] for what, j in used]
            rows[i] = rows[i] + d[0] * sum(terms) if terms else rows[i]
        return rows

    return law


def _fresh(name: str, taken: list[str]) -> str:
    """A name that nothing has yet, which is taken then: faults of a pair may be called alike."""
    found, count = name, 2
    while found in taken:
        found, count = f"{name} ({count})", count + 1
    taken.append(found)
    return found
