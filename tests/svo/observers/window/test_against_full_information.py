"""The window observer against the exact full-information program, on random plants."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty
from svo.observers.window.observer import WindowObserver
from svo.observers.window.setup import needs_next_input
from tests.svo.observers import oracle

SAMPLES = 7
# The observer's own slack is widened by every power of |A| in the window; to compare sets, leave only what the
# simulated data's rounding needs.
TINY = 1e-13
few = settings(max_examples=15, deadline=None)
seeds = st.integers(0, 2**32 - 1)


@dataclass
class Case:
    model: UncertainModel
    log: Log
    lower: np.ndarray
    upper: np.ndarray

    def observer(self, horizon: int | None, **options: Any) -> WindowObserver:
        return WindowObserver(self.model, HPolytope.box(self.lower, self.upper), horizon=horizon, **options)


def triangle(nw: int) -> HPolytope:
    """A simplex of disturbances that is no box."""
    return HPolytope(np.vstack([-np.eye(nw), np.ones((1, nw))]), np.append(np.full(nw, 0.05), 0.1))


def random_case(
    rng: np.random.Generator, uncertainties: Any = None, samples: int = SAMPLES, gentle: bool = False
) -> Case:
    """A run of a random plant: shared disturbances, feedthrough, schedule, polytopes, exact and missing sensors."""
    n, nu, ny, nw = (int(rng.integers(1, high)) for high in (5, 3, 4, 3))
    slope = 0.1 * rng.normal(size=(n, n)) if rng.random() < 0.4 else None
    A = rng.normal(size=(n, n))
    A *= rng.uniform(0.5, 1.1) / np.abs(np.linalg.eigvals(A)).max()
    if gentle:
        A, slope = 0.9 * A / np.linalg.norm(A, np.inf), None
    noise = rng.uniform(0.02, 0.1, ny) * (gentle | (rng.random(ny) < 0.8))
    extra: dict[str, Any] = {}
    if rng.random() < 0.5:
        extra["F"] = rng.normal(size=(ny, nw))
    if rng.random() < 0.5:
        extra |= {"D": rng.normal(size=(ny, nu)), "a": rng.normal(size=n), "c": rng.normal(size=ny)}
    model = UncertainModel(
        A if slope is None else (lambda s: A + s * slope),
        rng.normal(size=(n, nu)),
        rng.normal(size=(ny, n)),
        E=rng.normal(size=(n, nw)),
        w=triangle(nw) if rng.random() < 0.3 else rng.uniform(0.0, 0.1, nw),
        n=noise,
        schedule=None if slope is None else 0.0,
        uncertainties=() if uncertainties is None else uncertainties(rng, n, nu, ny),
        **extra,
    )
    schedule = None if slope is None else rng.uniform(-1, 1, samples)
    x0 = rng.uniform(-1, 1, n)
    log = model.simulate(x0, rng.normal(size=(samples, nu)), rng, corners=rng.random() < 0.5, schedule=schedule)
    y = log.y.copy()
    y[rng.random(y.shape) < 0.15] = np.nan
    return Case(model, replace(log, y=y), x0 - rng.uniform(0.1, 0.5, n), x0 + rng.uniform(0.1, 0.5, n))


def known_channels(rng: np.random.Generator, n: int, nu: int, ny: int) -> list[Uncertainty]:
    """One channel of the input alone and one whose s = x_0 + 100 keeps its sign; both reach state and output."""
    g, h = rng.normal(size=n), rng.normal(size=ny)
    u_row, x_row = rng.normal(size=nu), np.eye(n)[0]
    g2, h2 = 0.01 * rng.normal(size=n), 0.01 * rng.normal(size=ny)
    return [
        Uncertainty(B=np.outer(g, u_row), D=np.outer(h, u_row), bounds=(-0.05, 0.1)),
        Uncertainty(A=np.outer(g2, x_row), a=100 * g2, C=np.outer(h2, x_row), c=100 * h2, bounds=(-0.1, 0.02)),
    ]


def driven_channels(rng: np.random.Generator, n: int, nu: int, ny: int) -> list[Uncertainty]:
    """Two channels of the input that do not reach the output, one also of the state, and one that does without it.

    Where no D is, none of them is known in full before the sample after.
    """
    g, h, u_row, x_row = rng.normal(size=n), rng.normal(size=ny), 0.01 * rng.normal(size=nu), 0.01 * np.eye(n)[0]
    return [
        Uncertainty(B=np.outer(g, 10 * u_row), bounds=(-0.5, 1.0)),
        Uncertainty(C=np.outer(h, x_row), c=h, bounds=(-0.1, 0.02)),
        Uncertainty(A=np.outer(g, x_row), B=np.outer(g, u_row), a=g, bounds=(-0.2, 0.1)),
    ]


def open_channel(rng: np.random.Generator, n: int, nu: int, ny: int) -> list[Uncertainty]:
    """One channel whose s may have either sign."""
    g, h, f = rng.normal(size=n), rng.normal(size=ny), rng.normal(size=n)
    return [Uncertainty(A=np.outer(g, f), C=np.outer(h, f), bounds=(-0.1, 0.2))]


def answers(case: Case, horizon: int | None, **options: Any) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Verdict and box of each sample, up to the first falsification."""
    observer, log, out = case.observer(horizon, **options), case.log, []
    inputs = log.u if needs_next_input(case.model) else [None] * len(log)
    for k in range(len(log)):
        schedule = log.schedule_at(k)
        if k == 0:
            step = observer.update(log.y[0], u=inputs[0], schedule=schedule)
        else:
            step = observer.step(log.u[k - 1], log.y[k], u_next=inputs[k], schedule=schedule)
        out.append((step.verdict, *step.box))
        if step.verdict == "falsified":
            assert step.certificate.verify()
            break
    return out


def exact(case: Case, k: int, signs: Any, rounding: float) -> oracle.Box:
    return oracle.box(case.model, oracle.prefix(case.log, k + 1), case.lower, case.upper, signs, rounding)


def assert_contains(lower: np.ndarray, upper: np.ndarray, inner: oracle.Box, tolerance: float = 1e-8) -> None:
    """An inner box that is empty (exact sensors, rounded data) is contained in anything."""
    slack = tolerance * (1 + np.abs(lower).max() + np.abs(upper).max())
    assert (lower <= inner.lower + slack).all()
    assert (upper >= inner.upper - slack).all()


@few
@given(seed=seeds, kind=st.sampled_from([None, known_channels, driven_channels]))
def test_all_data_give_the_exact_box(seed: int, kind: Any) -> None:
    case = random_case(np.random.default_rng(seed), kind)
    signs = [oracle.signs_along(case.model, case.log)]
    steps = answers(case, None, eps=TINY)
    assert len(steps) == SAMPLES
    for k in (0, 1, SAMPLES // 2, SAMPLES - 1):
        verdict, lower, upper = steps[k]
        assert verdict == "consistent"
        assert_contains(lower, upper, exact(case, k, signs, rounding=0.0))
        # And hardly wider: a thin set magnifies the solvers' tolerances as it does this widening.
        wider = exact(case, k, signs, rounding=1e-7)
        assert_contains(wider.lower, wider.upper, oracle.Box(False, lower, upper), tolerance=1e-6)


@few
@given(
    seed=seeds, kind=st.sampled_from([None, known_channels, driven_channels, open_channel]), horizon=st.integers(1, 4)
)
def test_a_short_window_contains_the_exact_box_and_the_truth(seed: int, kind: Any, horizon: int) -> None:
    case = random_case(np.random.default_rng(seed), kind)
    signs = None if kind is open_channel else [oracle.signs_along(case.model, case.log)]
    steps = answers(case, horizon)
    assert len(steps) == SAMPLES
    for k, (verdict, lower, upper) in enumerate(steps):
        truth = case.log.x[k]
        slack = 1e-9 * (1 + np.abs(truth).max())
        assert verdict == "consistent"
        assert (lower <= truth + slack).all()
        assert (upper >= truth - slack).all()
    for k in (0, 1, 3) if kind is open_channel else (0, 2, SAMPLES - 1):
        assert_contains(*steps[k][1:], exact(case, k, signs, rounding=0.0))


@few
@given(seed=seeds, uncertain=st.booleans(), size=st.floats(0.05, 1.0))
def test_a_fault_is_found_with_the_sample_that_makes_the_program_empty(seed: int, uncertain: bool, size: float) -> None:
    rng = np.random.default_rng(seed)
    case = random_case(rng, known_channels if uncertain else None)
    y = case.log.y.copy()
    y[int(rng.integers(SAMPLES)) :, int(rng.integers(y.shape[1]))] += size * rng.choice([-1, 1])
    case = replace(case, log=replace(case.log, y=y))
    signs = [oracle.signs_along(case.model, case.log)]
    steps = answers(case, None)
    for k in range(SAMPLES):
        margin = oracle.margin(case.model, oracle.prefix(case.log, k + 1), case.lower, case.upper, signs)
        if abs(margin) < 1e-6:
            return  # too close to call for two solvers
        assert steps[k][0] == ("falsified" if margin > 0 else "consistent")
        if margin > 0:
            assert all(answer[0] == "consistent" for answer in answers(case, 2)[:k])
            return


@settings(max_examples=4, deadline=None)
@given(seed=seeds)
def test_a_long_run_stays_exact_while_the_memory_grows_and_the_ring_turns(seed: int) -> None:
    # Gentle: where powers of A grow over 36 samples, double precision is worth less than the tolerance below.
    case = random_case(np.random.default_rng(seed), samples=36, gentle=True)
    full, short = answers(case, None, eps=TINY), answers(case, 5)
    assert len(full) == len(short) == 36
    for k in (15, 16, 17, 35):
        inner = exact(case, k, None, rounding=0.0)
        assert_contains(*full[k][1:], inner)
        assert_contains(*short[k][1:], inner)
        wider = exact(case, k, None, rounding=1e-7)
        assert_contains(wider.lower, wider.upper, oracle.Box(False, *full[k][1:]), tolerance=1e-5)


@few
@given(seed=seeds, horizon=st.sampled_from([None, 1, 3]), size=st.floats(0.05, 1.0))
def test_an_open_channel_is_never_falsified_before_the_exact_program(seed: int, horizon: Any, size: float) -> None:
    rng = np.random.default_rng(seed)
    case = random_case(rng, open_channel)
    y = case.log.y.copy()
    y[SAMPLES // 2 :] += size
    case = replace(case, log=replace(case.log, y=y))
    steps = answers(case, horizon)
    if steps[-1][0] == "falsified":
        known = oracle.prefix(case.log, len(steps))
        assert oracle.margin(case.model, known, case.lower, case.upper) > -1e-9


@pytest.mark.slow
@settings(max_examples=500, deadline=None, derandomize=True)
@given(seed=seeds, kind=st.sampled_from([None, known_channels, driven_channels]))
def test_all_data_give_the_exact_box_on_many_plants(seed: int, kind: Any) -> None:
    test_all_data_give_the_exact_box.hypothesis.inner_test(seed, kind)
