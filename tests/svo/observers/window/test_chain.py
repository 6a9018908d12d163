"""The proof from the first sample to the alarm."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import LateMeasurement, PolytopeObserver, UncertainModel, Uncertainty, WindowObserver, prove_chain
from svo.logs.log import Log
from svo.observers.window import prover
from svo.observers.window.window import Window
from tests.svo.observers.long_chains import long_chains
from tests.svo.observers.random_plants import random_plant


def check_every_bound_is_proven(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(16, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    y = log.y.copy()
    y[rng.random(y.shape) < 0.1] = np.nan
    y[12:] += 5.0 + 5.0 * np.abs(np.nan_to_num(y[12:]))  # nothing healthy explains this
    template = "box" if rng.random() < 0.6 else rng.normal(size=(1, model.n_states))
    horizon = int(rng.choice([1, 3, 5]))
    observer = WindowObserver(model, HPolytope.box(x0 - 0.5, x0 + 0.5), horizon=horizon, template=template)
    bad = Log(log.time, log.u, y)
    verdicts = observer.run(bad).verdicts
    chain = prove_chain(observer, bad)
    assert chain.unproven == ()
    first = verdicts.index("falsified") if "falsified" in verdicts else None
    assert chain.falsified_at == first
    assert chain.proven == (first is not None)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_every_bound_of_a_random_plant_is_proven(seed: int) -> None:
    check_every_bound_is_proven(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_every_bound_of_many_plants_is_proven(seed: int) -> None:
    check_every_bound_is_proven(seed)


def test_a_bound_that_is_too_tight_is_not_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    """Falsify the arrival sets by hand: the chain must notice, though every window proof still verifies."""
    model = UncertainModel([[0.9]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.1])
    rng = np.random.default_rng(0)
    log = model.simulate([0.2], np.zeros((30, 0)), rng)
    log.y[20:] += 3.0
    with long_chains():
        assert prove_chain(WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=3), log).proven
    honest = prover.BoundProver.arrival

    def check_after_cheating(self: prover.BoundProver, window: Window, program: int) -> None:
        if program == 0:
            window.memory.arrays["new_upper"][0] -= 1e-9
        honest(self, window, program)

    monkeypatch.setattr(prover.BoundProver, "arrival", check_after_cheating)
    with long_chains():
        chain = prove_chain(WindowObserver(model, HPolytope.box([-1.0], [1.0]), horizon=3), log)
    assert not chain.proven
    assert any("arrival bound 0" in what for what in chain.unproven)


def with_a_channel() -> tuple[WindowObserver, Log]:
    """A plant with one uncertainty of state and disturbance, and a log whose sensor jumps at sample 20."""
    model = UncertainModel(
        [[0.95, 0.1], [-0.1, 0.9]], None, np.eye(2), E=np.eye(2), w=[0.02, 0.02], n=[0.05, 0.05],
        uncertainties=[Uncertainty(A=[[0.0, 0.0], [0.2, 0.1]], E=[[0.0, 0.0], [0.3, -0.2]])],
    )  # fmt: skip
    log = model.simulate([0.3, -0.3], np.zeros((25, 0)), np.random.default_rng(1))
    y = log.y.copy()
    y[20:, 0] += 1.0
    return WindowObserver(model, HPolytope.box([-1, -1], [1, 1]), horizon=4), Log(log.time, log.u, y)


def test_bounds_of_channels_are_counted_and_proven() -> None:
    chain = prove_chain(*with_a_channel())
    assert chain.proven
    assert chain.falsified_at == 20
    assert chain.bounds >= 8  # two of the channel at each transition
    assert chain.certificate is not None
    assert chain.certificate.verify()


def test_a_bound_of_a_channel_that_is_too_tight_is_not_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = prover.BoundProver.channel

    def check_after_cheating(self: prover.BoundProver, window: Window, q: int, side: int, is_open: bool) -> None:
        memory, sign = window.memory, 1 - 2 * side
        memory.arrays["s_lower" if side else "s_upper"][memory.variables, q] -= sign * 1e-6
        honest(self, window, q, side, is_open)

    monkeypatch.setattr(prover.BoundProver, "channel", check_after_cheating)
    chain = prove_chain(*with_a_channel())
    assert not chain.proven
    for side in ("lower", "upper"):
        assert any(f"{side} bound of s of channel 0" in what for what in chain.unproven)


def test_a_healthy_log_proves_its_bounds_and_no_alarm() -> None:
    model = UncertainModel([[0.9]], None, [[1.0]], E=[[1.0]], w=[0.1], n=[0.1])
    log = model.simulate([0.2], np.zeros((20, 0)), np.random.default_rng(0))
    chain = prove_chain(WindowObserver(model, HPolytope.box([-1.0], [1.0])), log)
    assert (chain.proven, chain.falsified_at, chain.unproven) == (False, None, ())


def test_what_cannot_be_proven_is_refused() -> None:
    model = UncertainModel([[0.9]], None, [[1.0]], n=[0.1])
    log, start = Log(np.arange(4.0), np.zeros((4, 0)), np.zeros((4, 1))), HPolytope.box([-1.0], [1.0])
    with pytest.raises(TypeError, match="observer is a PolytopeObserver; expected a WindowObserver"):
        prove_chain(PolytopeObserver(model, start), log)  # type: ignore[arg-type]
    for taken, arrived in ((2, 4), (3, 2), (-1, 2)):
        late = LateMeasurement(arrived=arrived, taken=taken, y=np.zeros(1))
        with pytest.raises(ValueError, match=rf"late\[0\] was taken at sample {taken} .* 0 <= taken <= arrived <= 3"):
            prove_chain(WindowObserver(model, start), log, late=[late])
