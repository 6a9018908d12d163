"""Random nonlinear plants: expressions of all functions of a tape, with kinks, jumps, roots at zero and cuts."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, Signature
from typing import Any

import numpy as np

from svo import functions as sf
from svo.models.nonlinear import NonlinearModel
from tests.svo.models.nonlinear_plants import Case

SEED = 17
Node = Callable[[list[Any]], Any]

UNARY: dict[str, Callable[[Any], Any]] = {
    "sin": sf.sin, "cos": sf.cos, "tanh": sf.tanh, "abs": sf.abs, "sign": sf.sign, "sroot": sf.sroot,
    "square": lambda e: e**2, "cube": lambda e: e**3, "root at zero": lambda e: sf.sqrt(sf.abs(e)),
    "one-sided root": lambda e: sf.sqrt(sf.max(e, 0.0)), "log": lambda e: sf.log(0.5 + sf.abs(e)),
    "exp": lambda e: sf.exp(sf.min(e, 1.0)), "inverse": lambda e: 1.0 / (0.5 + e * e),
    "signed root": lambda e: sf.sign(e) * sf.sqrt(sf.abs(e)), "power": lambda e: (0.1 + sf.abs(e)) ** 0.7,
    "saturated": lambda e: sf.min(sf.max(e, -0.7), 0.7),
}  # fmt: skip
BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "add": lambda a, b: a + b, "subtract": lambda a, b: a - b, "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / (1.0 + b * b), "max": sf.max, "min": sf.min, "atan2": sf.atan2,
    "pieces": lambda a, b: sf.piecewise(a, [-0.3, 0.4], [b, 0.5 - a, a * b]),
}  # fmt: skip


def expression(rng: np.random.Generator, leaves: int, depth: int) -> Node:
    """A function of a list of so many numbers, arrays or expressions."""
    if depth == 0 or rng.random() < 0.15:
        j, factor, shift = int(rng.integers(leaves)), float(rng.uniform(-1.5, 1.5)), float(rng.uniform(-0.5, 0.5))
        return lambda z: factor * z[j] + shift
    if rng.random() < 0.5:
        one, inner = list(UNARY.values())[rng.integers(len(UNARY))], expression(rng, leaves, depth - 1)
        return lambda z: one(inner(z))
    two = list(BINARY.values())[rng.integers(len(BINARY))]
    left, right = expression(rng, leaves, depth - 1), expression(rng, leaves, depth - 1)
    return lambda z: two(left(z), right(z))


def random_plant(i: int, **changes: Any) -> Case:
    """Plant number i: one to four states, each pulled back to zero, so that the state stays bounded by itself.

    In two of five the first state is a level that runs out through a root and is never below zero. In discrete time it
    is a step of Euler's method.
    """
    rng = np.random.default_rng([SEED, i])
    n, nu, nw, np_ = int(rng.integers(1, 5)), *(int(v) for v in rng.integers(0, 3, 3))
    rates, gains, leaves = 10.0 ** rng.uniform(-0.3, 0.7, n), 10.0 ** rng.uniform(-0.5, 0.5, n), n + nu + nw + np_
    forces = [expression(rng, leaves, 3) for _ in range(n)]
    bounded = [(sf.tanh, sf.sin, UNARY["saturated"])[rng.integers(3)] for _ in range(n)]
    push = rng.uniform(-0.5, 0.5, (n, nw))
    plain = sorted(rng.choice(n, size=int(rng.integers(1, n + 1)), replace=False).tolist())
    readings = [expression(rng, leaves, 2) for _ in range(int(rng.integers(0, 3)))]
    is_level = bool(rng.random() < 0.4)

    def f(x: Any, u: Any, w: Any, p: Any) -> list[Any]:
        z = [*x, *u, *w, *p]
        rows = [
            -rates[j] * x[j] + gains[j] * bounded[j](forces[j](z)) + sum(push[j, k] * w[k] for k in range(nw))
            for j in range(n)
        ]
        if is_level:
            rows[0] = 0.6 + 0.5 * bounded[0](forces[0](z)) - rates[0] * sf.sqrt(x[0])
        return rows

    def h(x: Any, u: Any, w: Any, p: Any) -> list[Any]:
        z = [*x, *u, *w, *p]
        return [x[j] for j in plain] + [r(z) for r in readings]

    upper = 1.5 * (gains + 0.5 * np.abs(push).sum(axis=1)) / rates + 0.5
    lower = -upper
    if is_level:
        lower[0], upper[0] = 0.0, 3.0 * (1.1 / rates[0]) ** 2 + 1.0
    free = np.full(n, np.inf)
    physical = (np.where(np.arange(n) == 0, 0.0, -free), free) if is_level else None
    names = ["x", "u", "w", "p"]
    about, size_p = rng.uniform(-1.0, 1.0, np_).tolist(), (10.0 ** rng.uniform(-3, -0.5, np_)).tolist()
    parts = [[f"{a}{j}" for j in range(size)] for a, size in zip(names, (n, nu, nw, np_), strict=True)]
    slow, phase, size = rng.uniform(0.02, 0.3, nu), rng.uniform(0.0, 6.0, nu), rng.uniform(0.3, 1.5, nu)
    square = rng.random(nu) < 0.3
    Ts = float(10.0 ** rng.uniform(-2.0, -0.7))

    def after(x: Any, u: Any, w: Any, p: Any) -> list[Any]:
        moved = [x[j] + Ts * row for j, row in enumerate(f(x, u, w, p))]
        return [sf.max(moved[0], 0.0), *moved[1:]] if is_level else moved

    used = _of_used_arguments(f if changes.get("continuous", True) else after, h, nu, nw, np_)
    model = NonlinearModel(
        *used, states=parts[0], inputs=parts[1], disturbances=parts[2],
        parameters={name: (a, a + b) for name, a, b in zip(parts[3], about, size_p, strict=True)},
        Ts=Ts, n=10.0 ** rng.uniform(-3.0, -1.0, len(plain) + len(readings)),
        w=10.0 ** rng.uniform(-2.5, -0.5, nw), largest=(lower, upper), physical=physical, **changes,
    )  # fmt: skip

    def u(k: int) -> list[float]:
        wave = np.sin(slow * k + phase)
        return list(size * np.where(square, np.sign(wave), wave))

    x0 = 0.3 * rng.uniform(-1.0, 1.0, n) * upper
    if is_level:
        x0[0] = (0.6 / rates[0]) ** 2
    return Case(model, x0, 0.05 * upper * np.where(np.arange(n) == 0, 0.2, 1.0), u, smooth=False)


def _of_used_arguments(f: Any, h: Any, nu: int, nw: int, np_: int) -> tuple[Any, Any]:
    """The functions with the arguments for which the model has names."""
    names = ["x"] + [name for name, size in zip("uwp", (nu, nw, np_), strict=True) if size]
    head = dict.fromkeys("uwp", ())

    def with_names(function: Any) -> Any:
        def taken(**given: Any) -> Any:
            return function(**(head | given))

        taken.__signature__ = Signature([Parameter(n, Parameter.KEYWORD_ONLY) for n in names])  # type: ignore[attr-defined]
        return taken

    return with_names(f), with_names(h)
