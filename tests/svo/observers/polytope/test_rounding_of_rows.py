"""Without a slack for the data (eps = 0) every row still holds the state to the last bit: its own rounding is in it."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from polytopes import HPolytope
from svo import PolytopeObserver, UncertainModel, Uncertainty


def exactly(values: object) -> np.ndarray:
    """Floats as fractions."""
    array = np.asarray(values, dtype=float)
    return np.array([Fraction(v) for v in array.ravel().tolist()], dtype=object).reshape(array.shape)


def on_the_bound(base: Fraction, noise: float, sign: int) -> float:
    """The float nearest to the end of a reading's interval, and in it."""
    y = float(base + sign * Fraction(noise))
    return y if abs(Fraction(y) - base) <= Fraction(noise) else float(np.nextafter(y, -sign * np.inf))


@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize("seed", range(30))
def test_readings_on_the_bound(seed: int, uncertain: bool) -> None:
    rng = np.random.default_rng(seed)
    n, nu, ny = (int(v) for v in rng.integers(1, 4, 3))
    C, D, c, noise = rng.normal(size=(ny, n)), rng.normal(size=(ny, nu)), rng.normal(size=ny), rng.random(ny)
    x, u, ends = rng.normal(size=n), 100.0 * rng.normal(size=nu), (-0.3, 0.7)
    parts = {"C": rng.normal(size=(ny, n)), "D": rng.normal(size=(ny, nu)), "c": rng.normal(size=ny)}
    deltas = [Uncertainty(**parts, bounds=ends)] if uncertain else []
    model = UncertainModel(np.eye(n), np.zeros((n, nu)), C, D=D, c=c, n=noise, uncertainties=deltas)
    base = exactly(C) @ exactly(x) + exactly(D) @ exactly(u) + exactly(c)
    if uncertain:
        own = exactly(parts["C"]) @ exactly(x) + exactly(parts["D"]) @ exactly(u) + exactly(parts["c"])
        base = base + Fraction(ends[seed % 2]) * own
    y = [on_the_bound(v, e, int(rng.choice([-1, 1]))) for v, e in zip(base, noise, strict=True)]
    step = PolytopeObserver(model, HPolytope.box(x - 2.0, x + 2.0), eps=0.0).update(y, u=u)
    assert step.verdict == "consistent"
    P = step.set
    assert (exactly(P.A) @ exactly(x) <= exactly(P.b)).all()
    assert len(P.C) == 0


@pytest.mark.parametrize("disturbed", [False, True])
@pytest.mark.parametrize("seed", range(12))
def test_a_point_moves_as_floats_round_it(seed: int, disturbed: bool) -> None:
    """An equality moved with its rounding: the true state was beside it, and a healthy plant could be falsified."""
    rng = np.random.default_rng(seed)
    A, B, a, E = rng.normal(size=(2, 2)), rng.normal(size=(2, 2)), rng.normal(size=2), rng.normal(size=(2, 1))
    moved = {"E": E, "w": [1.0]} if disturbed else {}
    model = UncertainModel(A, B, [[1.0, 1.0]], a=a, n=[1.0], **moved)
    x = rng.normal(size=2)
    observer, state = PolytopeObserver(model, HPolytope.box(x, x), eps=0.0), exactly(x)
    step = observer.update([np.nan], u=np.zeros(2))
    for _ in range(5):
        u, w = rng.normal(size=2), Fraction(int(rng.integers(-1, 2))) if disturbed else Fraction(0)
        step = observer.step(u, [np.nan])
        state = exactly(A) @ state + exactly(B) @ exactly(u) + exactly(a) + exactly(E)[:, 0] * w
        P = step.set
        assert (exactly(P.A) @ state <= exactly(P.b)).all()
        assert (exactly(P.C) @ state == exactly(P.d)).all()
