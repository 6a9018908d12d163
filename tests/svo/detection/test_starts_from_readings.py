"""A box that readings alone prove holds the state of the run, with every bound at a corner; so do the prover's."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from test_checker_on_trajectories import CHECK, SAMPLES, Trajectory, array, exact

from svo import UncertainModel
from svo.models.state_range import StateRange
from svo.observers.window.chain_starts import Start, from_readings, own_start
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.prover import ChainProver
from tests.svo.observers.random_plants import random_plant


def inverse_of(run: Trajectory) -> Any:
    """About a left inverse (n, m, ny) of the observability matrix without Delta, zero where nothing was read."""
    response, rows, used = np.eye(run.n), [], int(run.rng.integers(1, SAMPLES + 1))
    for k in range(used):
        stack = run.stacks[min(k, len(run.stacks) - 1)][0]
        rows.append(np.where(np.isnan(run.y[k])[:, None], 0.0, stack[run.n :, : run.n] @ response))
        response = stack[: run.n, : run.n] @ response
    inverse = np.linalg.pinv(np.vstack(rows)).reshape(run.n, used, run.ny)
    inverse *= 1.0 + 0.01 * run.rng.normal(size=inverse.shape) * run.rng.integers(2)
    return np.where(np.isnan(run.y[:used]), 0.0, inverse)


def proven_box(run: Trajectory, chain: Any, inverse: Any) -> tuple[Any, Any]:
    """As near to what the checker takes as an iteration comes, from both sides of the state."""
    step = {"first": 0, "last": inverse.shape[1] - 1, "on_start": {"shape": [0], "hex": ""}}
    low, high = run.x[0] - 1.0, run.x[0] + 1.0
    for _ in range(10):
        wide = [CHECK.up(CHECK.READ_WITHIN * size) for size in CHECK.largest(low, high)]
        chain.start = 0, CHECK.Set([[-v for v in wide], wide])
        ends = []
        for i in range(run.n):
            for side in (-1, 1):
                d = [float(side * (i == j)) for j in range(run.columns)]
                total = chain._total(step, 0, CHECK.Vec.of(d), (side * inverse[i]).tolist())
                ends.append(side * float(-exact(total)))
        low, high = np.nextafter(ends[::2], -math.inf), np.nextafter(ends[1::2], math.inf)
        if not np.isfinite((low, high)).all() or max(abs(low).max(), abs(high).max()) > 1e30:
            break
    return low, high


def accepted(chain: Any, low: Any, high: Any, inverse: Any) -> bool:
    nothing = {"template": {"shape": [0, chain.model.n], "hex": ""}}
    box = {"lower": array(low), "upper": array(high), "inverse": array(inverse)}
    try:
        chain.take({"step": "start", "sample": 0, "from": "readings"} | nothing | box)
    except CHECK.Wrong:
        return False
    return True


@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 1000), marks=pytest.mark.slow)])
def test_a_box_that_readings_prove_holds_the_state(seeds: range) -> None:
    taken = 0
    for seed in seeds:
        run = Trajectory(seed)
        chain, inverse = run.chain(), inverse_of(run)
        chain.take({"step": "start", "sample": 0, "from": "first", "template": array(np.zeros((0, run.n)))})
        low, high = proven_box(run, chain, inverse)
        room = (high - low) * run.rng.uniform(-0.2, 0.2, (6, 2, run.n)) * run.rng.integers(0, 2, (6, 2, run.n))
        for a, b in [(0.0, 0.0), *room]:
            if accepted(chain, low + a, high + b, inverse):
                assert (low + a <= run.x[0]).all(), seed
                assert (run.x[0] <= high + b).all(), seed
                taken += 1
    assert taken > len(seeds) / 2


@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 600), marks=pytest.mark.slow)])
def test_the_box_that_the_prover_finds_holds_the_state(seeds: range) -> None:
    found = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        model = random_plant(rng, largest=3)
        x0 = rng.uniform(-1.0, 1.0, model.n_states)
        log = model.simulate(x0, rng.normal(size=(16, model.n_inputs)), rng, corners=bool(seed % 2))
        assert log.x is not None
        log.y[rng.random(log.y.shape) < 0.1] = np.nan
        of = ModelOnLog(model, ArrivalSet.box(x0 - 1.0, x0 + 1.0), log)
        for sample in (0, 5):
            start = from_readings(of, sample, 15)
            if start is not None:
                assert (start.set.box_lower <= log.x[sample]).all(), seed
                assert (log.x[sample] <= start.set.box_upper).all(), seed
                found += 1
    assert found > len(seeds) / 2


@pytest.mark.parametrize(("largest_at", "since", "kind"), [
    (None, 0, "first"), (None, 3, None), (2, 0, "largest"), (2, 3, "largest"), (-1, 3, None), (-1, 0, "first"),
])  # fmt: skip
def test_an_observer_began_with_a_set_that_the_model_states_or_with_one_that_was_given(
    largest_at: int | None, since: int, kind: str | None
) -> None:
    largest, first = StateRange(np.array([-9.0]), np.array([9.0])), ArrivalSet.box(np.zeros(1), np.ones(1))
    start = own_start(largest, first, largest_at, since)
    assert (start and start.kind) == kind
    if start is not None:
        assert start.sample == (since + 2 if kind == "largest" else 0)
        assert start.set.box_upper == (9.0 if kind == "largest" else 1.0)


@pytest.mark.parametrize("begun", [None, 0, 297])
@pytest.mark.parametrize("since", [0, 290])
def test_no_chain_begins_before_its_model_is_claimed_to_hold(since: int, begun: int | None) -> None:
    """The nearest first, each twice as far; at last where its observer began, or the readings of there."""
    rng = np.random.default_rng(0)
    model = UncertainModel([[0.9]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.1], Ts=1.0)
    first = ArrivalSet.box(np.zeros(1), np.ones(1))
    of = ModelOnLog(model, first, model.simulate([0.5], np.zeros((301, 0)), rng))
    own = None if begun is None else Start("assumed", begun, first)
    found = [(start.kind, start.sample) for start in ChainProver(of, since, own).starts(300)]
    earliest = since if begun is None else begun
    last = ("readings", since) if begun is None else ("assumed", begun)
    nearer = [("readings", 300 - before) for before in (4, 8, 16, 32, 64, 128, 256) if 300 - before > earliest]
    assert found == [*nearer, last]
