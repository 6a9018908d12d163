"""The arithmetic of the checker of nonlinear models beside ball arithmetic, and transitions beside trajectories."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx, fmpz
from scipy.integrate import solve_ivp

from svo.detection.plant_record import observer_record, tape_record
from svo.models.nonlinear import NonlinearModel, Undecided
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.hints import PARTS, hinted
from svo.store.values import encode_value
from tests.svo.detection.checkers import CHECK, NONLINEAR
from tests.svo.functions.operations_in_balls import BITS
from tests.svo.functions.random_tapes import draw_tape, in_balls
from tests.svo.models.nonlinear_plants import CASES

ONE = arb(fmpz(NONLINEAR.ONE))
FUNCTIONS = {
    "exp": (lambda x: NONLINEAR.exp_at(x), arb.exp, 1.0),
    "log": (lambda x: NONLINEAR.log_at(abs(x)), lambda x: abs(x).log(), 1e250),
    "sqrt": (lambda x: NONLINEAR.root_at(abs(x)), lambda x: abs(x).sqrt(), 1e250),
    "sin": (lambda x: NONLINEAR.wave_at(x, 0), arb.sin, 1e8),
    "cos": (lambda x: NONLINEAR.wave_at(x, 1), arb.cos, 1e8),
    "tanh": (lambda x: NONLINEAR.RANGE[NONLINEAR.TANH]((x, x)), arb.tanh, 30.0),
    "atan2": (lambda x: NONLINEAR.angle_at(x, 3 * NONLINEAR.ONE), lambda x: arb.atan2(x, arb(3)), 1e30),
}


def in_units(value: int) -> arb:
    return arb(fmpz(value)) / ONE


def test_half_a_turn_is_not_below_pi() -> None:
    with ctx.workprec(BITS + 1000):
        assert arb.pi() < in_units(NONLINEAR.HALF_TURN) < arb.pi() + 2 / ONE


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_of_a_number_is_enclosed_within_a_few_units(name: str) -> None:
    function, exact, largest = FUNCTIONS[name]
    rng = np.random.default_rng(3)
    with ctx.workprec(BITS + 1000):
        for size in (1e-40, 1e-6, 1.0, 50.0, largest):
            for x in rng.normal(size=8) * size:
                units = NONLINEAR.ends(float(x))[0] or 1
                low, high = map(in_units, function(units))
                value = exact(in_units(units))
                assert low < value < high or low == value or high == value
                assert (high - low) * ONE < 8 * (1 + abs(value))


def examine(rng: np.random.Generator, boxes: int, points: int = 6) -> Counter[str]:
    """Rows of random tapes over random boxes, inside the forms and ranges there."""
    count: Counter[str] = Counter()
    for _ in range(boxes):
        tape = draw_tape(rng)
        middle = rng.normal(size=tape.variables) * 10.0 ** rng.integers(-2, 2)
        width = np.abs(rng.normal(size=tape.variables)) * rng.choice([0.0, 1e-12, 1e-3, 0.1, 1.0])
        box = NONLINEAR.box_of((middle - width).tolist(), (middle + width).tolist())
        free = int(rng.integers(0, tape.variables + 1))
        over = NONLINEAR.Over(box, free)
        try:
            forms = over.forms(NONLINEAR.Tape(tape_record(tape), tape.variables, len(tape.outputs)))
        except CHECK.Wrong:
            count["refused"] += 1
            continue
        for point in range(points):
            share = rng.integers(0, 2, len(box)) if point < 3 else rng.uniform(size=len(box))
            z = [low + int(s * 2**53) * (high - low) // 2**53 for s, (low, high) in zip(share, box, strict=True)]
            with ctx.workprec(BITS + 300):
                count += outside(tape, forms, over, box, z)
    return count


def outside(tape: Any, forms: Any, over: Any, box: Any, z: list[int]) -> Counter[str]:
    count: Counter[str] = Counter()
    for (k, g, rest, values, _), value in zip(forms, in_balls(tape, [in_units(v) for v in z]), strict=True):
        if value is None:
            continue
        count["points"] += 1
        moved = [in_units(v - NONLINEAR.middle(a)) for v, a in zip(z, box, strict=True)]
        left = value - in_units(k) - sum((in_units(x) * m for x, m in zip(g, moved, strict=False)), arb(0))
        for what, of, (low, high) in (("values", value, values), ("form", left, rest)):
            count[f"outside the {what}"] += bool(of < in_units(low) or of > in_units(high))
    return count


@pytest.mark.parametrize("boxes", [80, pytest.param(6000, marks=pytest.mark.slow)])
def test_forms_contain_the_rows_of_a_tape(boxes: int) -> None:
    found = examine(np.random.default_rng(5), boxes)
    assert found["points"] > 3 * boxes
    assert found["outside the values"] == found["outside the form"] == 0, found


def floor(value: int, bits: int = NONLINEAR.P) -> int:
    return value >> bits


INWARD = {
    "an upper end is rounded down": ("shifted_up", floor),
    "a series is taken as exact": ("around", lambda value, error=0: (value >> NONLINEAR.MORE, value >> NONLINEAR.MORE)),
    "a root is rounded down": ("root_at", lambda x, signed=False: (NONLINEAR.math.isqrt(abs(x) << NONLINEAR.P),) * 2),
    "a bend is left out": ("rest_at", lambda op, a, q: (0, 0)),
}


@pytest.mark.parametrize("what", INWARD)
def test_rounding_inward_is_seen(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, wrong = INWARD[what]
    monkeypatch.setattr(NONLINEAR, name, wrong)
    if name == "root_at":
        monkeypatch.setitem(NONLINEAR.RANGE, NONLINEAR.SQRT, NONLINEAR.rising(wrong))
    found = examine(np.random.default_rng(5), 60)
    assert found["outside the values"] + found["outside the form"] > 0


# -- transitions ------------------------------------------------------------------------------------------------------


def equations(model: NonlinearModel) -> Any:
    first = ArrivalSet.box(model.start_range.lower, model.start_range.upper)
    return NONLINEAR.Equations(observer_record("made", first, model, None), {"Ts": float(model.Ts).hex()})


def path_of(model: NonlinearModel, lower: Any, upper: Any, u: Any, found: Any) -> dict[str, Any]:
    shares, boxes = model.kernel.path(lower, upper, u, model.Ts, found.substeps)
    hints = hinted(model, boxes, u, (model.Ts / PARTS * shares).tolist())
    return {"substeps": shares.tolist(), "boxes": encode_value(hints)}


def left_out(line: Any, slopes: list[float], constant: float, box: list[Any]) -> float:
    """As the checker compares what is stated with what it has found."""
    gaps = [NONLINEAR.minus(g, NONLINEAR.ends(v)) for g, v in zip(line[0], slopes, strict=True)]
    middles = [NONLINEAR.at(NONLINEAR.middle(b)) for b in box]
    off = NONLINEAR.plus(NONLINEAR.minus(line[1], NONLINEAR.ends(constant)), NONLINEAR.dot(gaps, middles))
    spread = sum(NONLINEAR.sizes(g)[1] * NONLINEAR.radius(b) for g, b in zip(gaps, box, strict=True))
    return float((NONLINEAR.sizes(off)[1] + NONLINEAR.shifted_up(spread)) / NONLINEAR.ONE)


SMOOTH = ("cstr", "tank", "pendulum", "lorenz")


@pytest.mark.parametrize("name", CASES)
def test_what_a_transition_leaves_out_contains_trajectories_and_is_hardly_more_than_the_cores(name: str) -> None:
    rng = np.random.default_rng(7)
    case = CASES[name]()
    model = case.model
    of = equations(model)
    for scale in (0.3, 1.0):
        centre = case.x0 + 0.1 * scale * case.spread
        lower, upper = centre - scale * case.spread, centre + scale * case.spread
        u = np.array(case.u(3), dtype=float)
        try:
            found = model.transition(lower, upper, u)
        except Undecided:
            continue
        start = NONLINEAR.box_of(lower.tolist(), upper.tolist())
        lines, after = of.transition(start, u.tolist(), path_of(model, lower, upper, u, found))
        box = [*start, *of.w]
        stated = [[*found.A[i].tolist(), *found.E[i].tolist()] for i in range(len(lines))]
        R = np.array([left_out(line, stated[i], float(found.a[i]), box) for i, line in enumerate(lines)])
        assert (R <= found.R * (1.0 + 1.0 / 16.0)).all(), R / found.R
        if name in SMOOTH:
            _compare(model, found, R, after, (lower, upper), u, rng)


def _compare(model: Any, found: Any, R: Any, after: Any, box: Any, u: Any, rng: np.random.Generator) -> None:
    """Ends of trajectories are within what is found, but for the errors of their integration."""
    for _ in range(6):
        x = np.where(rng.random(model.n_states) < 0.5, *box)
        w = np.where(rng.random(len(model.flow.w.lower)) < 0.5, *model.flow.w)
        rate = lambda _, x, w=w: model.flow.tape.values(np.concatenate([x, w, u]))  # noqa: E731
        end = solve_ivp(rate, (0.0, model.Ts), x, rtol=1e-11, atol=1e-12).y[:, -1]
        assert (np.abs(end - found.A @ x - found.a - found.E @ w) <= R + 1e-8 * (1.0 + np.abs(end))).all()
        low, high = (np.array([a[i] / NONLINEAR.ONE for a in after]) for i in (0, 1))
        assert ((low - 1e-8 * (1.0 + np.abs(end)) <= end) & (end <= high + 1e-8 * (1.0 + np.abs(end)))).all()
