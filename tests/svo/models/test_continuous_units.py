"""A continuous plant in other units, of states, inputs, disturbances and time, gives the same discrete model."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.models.discretisation import zero_order_hold
from svo.observers.zonotope.observer import ConstrainedZonotopeObserver
from tests.svo.observers.other_units import Units


def continuous(rng: np.random.Generator) -> dict[str, Any]:
    n, nu, nw = (int(rng.integers(low, 4)) for low in (1, 0, 1))
    A = rng.normal(size=(n, n)) * (rng.random((n, n)) < 0.7)
    items = [Uncertainty(A=0.1 * rng.normal(size=(n, n)), E=0.1 * rng.normal(size=(n, nw)), bounds=(-0.5, 1.0))]
    return {
        "A": A, "B": rng.normal(size=(n, nu)) if nu else None, "C": rng.normal(size=(2, n)), "Ts": 0.1,
        "E": rng.normal(size=(n, nw)), "a": rng.normal(size=n), "w": rng.uniform(0.1, 1.0, nw), "n": 0.1,
        "uncertainties": items, "remainder": rng.uniform(0.0, 0.1, n),
    }  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([(), "w", "all"]))
def test_powers_of_two_on_states_inputs_and_time_change_nothing(seed: int, varying: Any) -> None:
    rng = np.random.default_rng(seed)
    given_arrays = continuous(rng)
    plain = UncertainModel.from_continuous(**given_arrays, varying=varying)
    n, nu, nw = plain.n_states, plain.n_inputs, given_arrays["w"].size
    units = Units(*(rng.integers(-60, 61, size) for size in (n, nu, 2, nw)))
    time = int(rng.integers(-60, 61))
    scaled = dict(given_arrays)
    for name in ("A", "B", "C", "E", "a"):
        rate = 0 if name == "C" or scaled[name] is None else -time
        value = units.array(name, scaled[name])
        scaled[name] = None if value is None else np.ldexp(value, rate)
    item = given_arrays["uncertainties"][0]
    scaled["uncertainties"] = [
        Uncertainty(
            A=np.ldexp(units.array("A", item.A), -time), E=np.ldexp(units.array("E", item.E), -time), bounds=item.bounds
        )
    ]
    scaled |= {"Ts": np.ldexp(0.1, time), "w": np.ldexp(scaled["w"], units.w)}
    scaled |= {"n": np.ldexp([0.1, 0.1], units.y), "remainder": np.ldexp(scaled["remainder"], units.x)}
    other = UncertainModel.from_continuous(**scaled, varying=varying)
    widths = plain.bounds()[1].size
    assert other.n_disturbances == widths
    rows = np.concatenate([units.x, units.y])
    extra = np.zeros(widths - nw, dtype=int)  # of the remainder: their unit is that of their column
    columns = np.concatenate([units.x, units.u, [0], units.w, extra])
    ours, theirs = plain.stack(), other.stack()
    known = slice(0, n + nu + 1 + nw)
    np.testing.assert_array_equal(np.ldexp(ours, rows[:, None] - columns)[..., known], theirs[..., known])
    reach, its = (np.abs(m.stack()[0][:, n + nu + 1 + nw :]) @ m.bounds()[1][nw:] for m in (plain, other))
    np.testing.assert_array_equal(np.ldexp(reach, rows), its)


@pytest.mark.parametrize("A", [[[-1e6, 1e3], [2.0, -1e-3]], [[0.0, 1.0], [0.0, 0.0]]])
def test_what_floats_can_hold_is_the_nearest_float(A: Any) -> None:
    step, held = zero_order_hold(A, np.eye(len(A)), 1.0)
    if A[0][0] == 0.0:
        np.testing.assert_array_equal(step, [[1.0, 1.0], [0.0, 1.0]])
        np.testing.assert_array_equal(held, [[1.0, 0.5], [0.0, 1.0]])
    else:
        assert step[0, 1] == pytest.approx(1e3 * step[1, 1] / 1e6, rel=1e-2)


def test_what_floats_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="beyond all floats"):
        zero_order_hold([[1e4]], np.eye(1), 1.0)


@pytest.mark.parametrize("make", [WindowObserver, ConstrainedZonotopeObserver])
def test_powers_of_two_on_time_change_nothing_of_an_observer(make: Any) -> None:
    """Rates in other units of time, the same samples: sets, verdicts and the normal memory are equal bit for bit."""
    rng = np.random.default_rng(3)
    for time in (-37, 20):
        arrays = continuous(rng)
        faster = {k: None if v is None else np.ldexp(v, -time) for k, v in arrays.items() if k in "ABEa"}
        (item,) = arrays["uncertainties"]
        items = [Uncertainty(A=np.ldexp(item.A, -time), E=np.ldexp(item.E, -time), bounds=item.bounds)]
        one = UncertainModel.from_continuous(**arrays)
        two = UncertainModel.from_continuous(
            **(arrays | faster | {"uncertainties": items, "Ts": float(np.ldexp(arrays["Ts"], time))})
        )
        x0, u = rng.uniform(-1, 1, one.n_states), rng.normal(size=(10, one.n_inputs))
        log = one.simulate(x0, u, rng, corners=True)
        log.y[7:, 0] += 50.0
        box = HPolytope.box(x0 - 1.0, x0 + 1.0)
        a, b = make(one, box), make(two, box)
        here, there = a.run(log), b.run(log)
        assert here.verdicts == there.verdicts
        assert here.verdicts[-1] == "falsified"
        np.testing.assert_array_equal(here.lower, there.lower)
        np.testing.assert_array_equal(here.upper, there.upper)
        left, right = ({k: v for k, v in o.state_dict().items() if not k.startswith("seal.")} for o in (a, b))
        for name, value in left.items():
            assert np.asarray(value).tobytes() == np.asarray(right[name]).tobytes(), name
