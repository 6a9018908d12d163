"""Bounds by cases, of the vertices of Delta and of the sign of an s: sound for any multipliers, not to be forged."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from fractions import Fraction
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hull_plants import of_both_signs, turning
from proof_cases import Files, answer, claims, proven, steps_of, with_steps
from test_checker_on_trajectories import SAMPLES, Trajectory, array, exact

from svo.observers.polytope.box_program import BoxProgram
from svo.observers.window.chain import prover_of
from svo.observers.window.chain_starts import own_start
from svo.observers.window.prover import ChainProver
from tests.svo.detection.checkers import CHECK

# -- any multipliers, on runs in rationals ------------------------------------------------------------------------


class Inside(Trajectory):
    """Its Delta are also inside their bounds."""

    parts = 0.0, 0.5, 1.0


def value_of(d: list[float], z: Any) -> Fraction:
    return sum((Fraction(a) * Fraction(b) for a, b in zip(d, z.tolist(), strict=True)), Fraction(0))


def before(step: dict[str, Any], at: int) -> dict[str, Any]:
    """The step without rows that the state at its last sample takes part in."""
    length = at - step["first"]
    kept = [i for i, (k, *_) in enumerate(step["on_line"]) if k < length]
    line = np.array([float.fromhex(v) for v in step["line"]["hex"].split()]).reshape(-1, 3)
    outputs = np.array([float.fromhex(v) for v in step["on_output"]["hex"].split()]).reshape(length + 1, -1)
    outputs[-1] = 0.0
    more = {"on_line": [step["on_line"][i] for i in kept], "line": array(line[kept]), "on_output": array(outputs)}
    return step | more | {"on_sum": [], "sum": array(np.zeros((0, 1)))}


@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(60, 3000), marks=pytest.mark.slow)])
def test_bounds_at_all_vertices_hold_between_them(seeds: range) -> None:
    """The largest of the vertices' bounds, whose multipliers differ, is one of a run whose Delta is anything."""
    bounded = tight = 0
    for seed in seeds:
        run = Inside(seed)
        chain = run.chain()
        first, at = sorted(int(k) for k in run.rng.choice(SAMPLES, 2, replace=False))
        moved = [item[: run.n].any() for item in run.stacks[min(at - 1, len(run.stacks) - 1)][1:]]
        vertices = [*product(*(ends[: 1 + m] for ends, m in zip(run.delta.tolist(), moved, strict=True)))]
        cases = [before(run.step(chain, (first, at)), at) for _ in vertices]
        d = [*run.short(run.n), *np.zeros(run.columns - run.n)]
        bound = max(-exact(total) for total in chain._cases({"vertices": cases}, at, CHECK.Vec.of(d)))
        value = value_of(d, run.z[at])
        assert value <= bound, seed
        bounded, tight = bounded + bool(any(moved)), tight + (value == bound)
    assert bounded > len(seeds) // 4
    assert tight > len(seeds) // 100


@pytest.mark.parametrize("seeds", [range(60), pytest.param(range(60, 3000), marks=pytest.mark.slow)])
def test_a_bound_by_the_sign_of_an_s_holds_for_that_sign(seeds: range) -> None:
    held = 0
    for seed in seeds:
        run = Inside(seed)
        chain = run.chain()
        step = run.step(chain)
        samples = range(step["first"], step["last"] + 1)
        for k, q in [(j, q) for j in samples for q in range(len(chain.channels[j][0]))]:
            s = value_of(chain.channels[k][2][q], run.z[k])
            at, d = int(run.rng.integers(step["first"], step["last"] + 1)), run.few(run.columns).tolist()
            try:
                totals = [*chain._cases({"split": [k, q], "cases": [step, step]}, at, CHECK.Vec.of(d))]
            except CHECK.REFUSALS:  # a line that bounds p between the ends of s, and not at zero beyond them
                continue
            for sign, total in zip((1, -1), totals, strict=True):
                if sign * s <= 0:
                    held += 1
                    assert exact(total) <= -value_of(d, run.z[at]), seed
    assert held > len(seeds) // 4


# -- a proof that can be reckoned with in one's head --------------------------------------------------------------


def numbers(*values: float) -> dict[str, Any]:
    return array(np.array(values))


def window(first: int, last: int, *on_output: float) -> dict[str, Any]:
    on_output = on_output or (0.0,) * (last - first + 1)
    return {"first": first, "last": last, "on_start": numbers(), "on_output": array(np.array([on_output]).T)}


def chain_of(y: list[float], steps: list[dict[str, Any]], delta: tuple[float, float] = (0.0, 1.0)) -> bool:
    """Whether steps are proven of x(k+1) = Delta x(k), y = x + v, |v| <= 0.25, |x(0)| <= 1."""
    nothing = {"rows": array(np.zeros((0, 1))), "lower": numbers(), "upper": numbers()}
    record = {
        "n": 1, "inputs": 0, "outputs": 1, "disturbances": 0, "delta": array([delta]), "noise": array([[0.25]]),
        "matrices": {"stacks": array([[[[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 0.0]]]])},
        "w_lower": array(np.zeros((1, 0))), "w_upper": array(np.zeros((1, 0))),
        "w_rows": {"rows": array(np.zeros((0, 0))), "lower": numbers(), "upper": numbers()},
        "first": {"box_lower": numbers(-1.0), "box_upper": numbers(1.0)} | nothing, "physical": None, "largest": None,
    }  # fmt: skip
    log = CHECK.Log.__new__(CHECK.Log)
    log.time, log.u, log.y = [float(k) for k in range(len(y))], [[]] * len(y), [[v] for v in y]
    chain = CHECK.Chain(CHECK.Model(record), log, len(y) - 1)
    try:
        chain.take({"step": "start", "sample": 0, "from": "first", "template": array(np.zeros((0, 1)))})
        for step in steps:
            chain.take(step)
    except CHECK.REFUSALS:
        return False
    return True


def x_is(side: str, value: float, **how: Any) -> dict[str, Any]:
    return {"step": "x", "sample": 1, "row": 0, "side": side, "value": value.hex()} | how


READ = window(0, 1, -1.0, 0.0)  # x(0) >= y - 0.25, where Delta is 1
FREE = window(0, 1)  # at Delta = 0 nothing is needed


def test_a_bound_at_every_vertex_is_one() -> None:
    """x(0) >= 0.5 by its reading, so x(1) >= 0; no other step says so: the factors' rest is as large as x."""
    assert chain_of([0.75, 0.0], [x_is("lower", 0.0, vertices=[FREE, READ])])
    assert chain_of([0.75, 0.0], [x_is("lower", 0.5, vertices=[READ, window(0, 1, -2.0, 0.0)])], (1.0, 2.0))
    assert not chain_of([0.75, 0.0], [x_is("lower", 2.0**-20, vertices=[FREE, READ])])
    assert not chain_of([0.75, 0.0], [x_is("lower", 0.0, **READ)])


@pytest.mark.parametrize(
    "cases",
    [
        [FREE],  # a vertex left out
        [READ],
        [],
        [FREE, READ, FREE],
        [READ, FREE],  # one's multipliers for the other
        [FREE, window(0, 1)],
        [window(1, 1), window(1, 1)],  # of another window, in which nothing is known of the state
        [FREE, READ | {"first": 0, "last": 0}],  # one that ends before
        {"split": [0, 0], "cases": [FREE, READ]},  # of no channel
    ],
)
def test_vertices_that_are_not_all_or_not_these_prove_nothing(cases: Any) -> None:
    assert not chain_of([0.75, 0.0], [x_is("lower", 0.0, vertices=cases)])
    assert not chain_of([0.75, 0.0], [x_is("lower", 0.0, **(cases if isinstance(cases, dict) else {"cases": cases}))])


def test_a_reading_after_the_transition_is_no_row_of_a_vertex() -> None:
    """x(1) is at least 0.6: at Delta = 0 that says 0 >= 0.6 and proves anything; of what is between it does not."""
    after = window(0, 1, 0.0, -64.0)
    y = [0.75, 0.85]
    assert not chain_of(y, [x_is("lower", 2.0, vertices=[after, READ])])
    assert not chain_of(y, [x_is("lower", 0.0, vertices=[after, READ])])
    later = window(0, 2, 0.0, 0.0, -64.0)  # x(2) is no more one of its rows
    assert not chain_of([*y, 0.85], [x_is("lower", 0.0, vertices=[later, READ])])


def test_vertices_are_of_a_bound_and_of_no_alarm() -> None:
    alarm = {"step": "alarm", "vertices": [window(0, 1, 0.0, 1.0), window(0, 1, 0.0, 1.0)]}
    assert not chain_of([0.0, -9.0], [alarm])
    assert chain_of([0.0, -9.0], [{"step": "alarm", **window(0, 1, 0.0, 1.0)}])


def test_directions_take_the_place_of_bounds_that_were_proven() -> None:
    low = x_is("lower", 0.0, vertices=[FREE, READ])
    alarm = {"step": "alarm", "first": 1, "last": 1, "on_start": numbers(), "on_output": array([[1.0]])}
    assert chain_of([0.75, -0.5], [low, alarm])
    rows = {"step": "directions", "sample": 1, "rows": array([[-2.0]])}
    assert not chain_of([0.75, -0.5], [low, rows, alarm | {"on_start": numbers(0.0)}])  # forgotten
    own = x_is("upper", 0.0, vertices=[FREE, window(0, 1, -2.0, 0.0)]) | {"row": 1}  # -2 x(1) <= 0
    top = x_is("upper", 2.0, **FREE)
    by_row = [rows, own, top, alarm | {"on_start": numbers(0.5)}]
    assert chain_of([0.75, -0.5], by_row)
    assert not chain_of([0.75, -0.5], [rows, top, alarm | {"on_start": numbers(0.5)}])  # not proven
    other = {"step": "directions", "sample": 1, "rows": array([[-1.0]])}  # -x(1) <= 0 is not what was proven
    assert not chain_of([0.75, -0.5], [rows, own, other, top, alarm | {"on_start": numbers(1.0)}])


# s(0) = x(0) is between -1 and 1, and p = Delta s is in [-1, 1]
BOTH = array([[1.0, 0.0]])
FACTORS = {"step": "channels", "sample": 0, "owner": [1], "gain": BOTH, "functional": BOTH}
S = [{"step": "s", "sample": 0, "channel": 0, "side": side, "value": value.hex()} | window(0, 0)
     for side, value in (("lower", -1.0), ("upper", 1.0))]  # fmt: skip


def by_line(side: int, slope: float) -> dict[str, Any]:
    """p >= slope s: a line below, with the reading of x(0) if the slope is not zero."""
    return window(0, 1, -slope, 0.0) | {"on_line": [[0, 0, side]], "line": array([[1.0, slope, 0.0]])}


def test_a_bound_for_either_sign_is_one() -> None:
    """x(1) = Delta x(0): for s <= 0 it is at least s >= 0.5 - ..., here from the reading; for s >= 0 at least 0."""
    right = {"split": [0, 0], "cases": [by_line(1, 1.0), by_line(1, 0.0)]}
    y = [0.75, 0.0]
    assert chain_of(y, [FACTORS, *S, x_is("lower", 0.0, **right)])
    assert not chain_of(y, [FACTORS, *S, x_is("lower", 2.0**-20, **right)])
    assert not chain_of(y, [FACTORS, *S, x_is("lower", 0.0, **by_line(1, 0.0))])  # no line at both signs
    for cases in (right["cases"][::-1], right["cases"][:1], right["cases"][1:], [by_line(1, 0.0)] * 2, []):
        assert not chain_of(y, [FACTORS, *S, x_is("lower", 0.0, split=[0, 0], cases=cases)])
    nested = {"split": [0, 0], "cases": [right, right]}  # a sign within a sign
    assert chain_of(y, [FACTORS, *S, x_is("lower", 0.0, **nested)])


def test_a_sign_holds_in_its_case_alone() -> None:
    right = {"split": [0, 0], "cases": [by_line(1, 1.0), by_line(1, 0.0)]}
    first = x_is("lower", 0.0, **right)
    assert not chain_of([0.75, 0.0], [FACTORS, *S, first, first | by_line(1, 0.0) | {"split": [0, 1]}])
    whole = {name: value for name, value in (first | by_line(1, 0.0)).items() if name not in ("split", "cases")}
    assert not chain_of([0.75, 0.0], [FACTORS, *S, first, whole])  # after it s is of either sign again


# -- alarms of polytope observers -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def hulls(tmp_path_factory: pytest.TempPathFactory) -> Files:
    files = proven(*turning(12), tmp_path_factory.mktemp("hulls"))
    assert files is not None
    return files


def first_reason_is_windows(seed: int) -> bool:
    """Whether no window over hulls proves what the polytope observer found."""
    plant, log = turning(seed)
    observer = plant.bank("stated").observers["nominal"]
    at, start = observer.run(log).falsified_at, observer.first_set
    prover = prover_of(observer, start, log, 0, own_start(None, start))._windows  # type: ignore[union-attr]
    assert isinstance(prover, ChainProver)
    return at is not None and prover.over_hulls(at) is None


@pytest.mark.parametrize("seed", [5, *(pytest.param(s, marks=pytest.mark.slow) for s in range(60) if s != 5)])
def test_alarms_of_hulls_are_proven(seed: int, tmp_path: Path) -> None:
    """Also with an uncertain output, which seeds that are odd have."""
    files = proven(*turning(seed), tmp_path)
    if files is None:
        return
    code, text = answer(*files)
    assert code == 0, text
    assert any("vertices" in step for step in steps_of(files[0])) is first_reason_is_windows(seed)


@pytest.mark.parametrize("seed", [38, *(pytest.param(s, marks=pytest.mark.slow) for s in range(120) if s != 38)])
def test_alarms_that_a_split_by_signs_gives_are_proven(seed: int, tmp_path: Path) -> None:
    """Seeds 7, 38, 81 and 111 by a split, of which that of 38 has four cells; the others by hulls."""
    files = proven(*of_both_signs(seed), tmp_path)
    if files is None:
        return
    code, text = answer(*files)
    assert code == 0, text
    (alarm,) = (step for step in steps_of(files[0]) if step.get("step") == "alarm")
    assert ("split" in alarm) is (seed in (7, 38, 81, 111))
    if seed == 38:
        for forge in (one_sign, exchanged_signs, first_sign_for_both):
            assert claims(edited(files, lambda steps, forge=forge: forge(steps[-1]))) == []  # type: ignore[misc]


def one_sign(alarm: dict[str, Any]) -> None:
    alarm["cases"].pop()


def exchanged_signs(alarm: dict[str, Any]) -> None:
    alarm["cases"] = alarm["cases"][::-1]


def first_sign_for_both(alarm: dict[str, Any]) -> None:
    alarm["cases"] = alarm["cases"][:1] * 2


def edited(files: Files, change: Callable[[list[Any]], None]) -> Files:
    steps = deepcopy(steps_of(files[0]))
    change(steps)
    return with_steps(files[0], steps), *files[1:]


def each_bound(change: Callable[[dict[str, Any]], Any]) -> Callable[[list[Any]], None]:
    return lambda steps: [change(step) for step in steps if "vertices" in step] and None


def exchange(step: dict[str, Any]) -> None:
    step["vertices"] = step["vertices"][::-1]


def nearer(step: dict[str, Any]) -> None:
    value, sign = float.fromhex(step["value"]), 1.0 if step["side"] == "upper" else -1.0
    step["value"] = (value - sign * 1e-3 * (1.0 + abs(value))).hex()


FORGED: dict[str, Callable[[list[Any]], None]] = {
    "a vertex left out": each_bound(lambda step: step["vertices"].pop()),
    "the first vertex left out": each_bound(lambda step: step["vertices"].pop(0)),
    "vertices exchanged": each_bound(exchange),
    "one vertex twice": each_bound(lambda step: step.update(vertices=[step["vertices"][0]] * 2)),
    "no vertices": each_bound(lambda step: step.update(step.pop("vertices")[0])),
    "bounds nearer": each_bound(nearer),
    "no directions": lambda steps: steps.__setitem__(slice(None), [s for s in steps if s.get("step") != "directions"]),
    "an alarm before": lambda steps: steps[1].update(sample=11, time=(11.0).hex()),
}


@pytest.mark.parametrize("what", FORGED)
def test_a_forged_proof_by_hulls_is_refused(hulls: Files, what: str) -> None:
    assert claims(hulls)
    assert claims(edited(hulls, FORGED[what])) == []


def test_a_bound_that_its_multipliers_do_not_prove_is_no_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    plant, log = turning(12)
    observer = plant.bank("stated").observers["nominal"]
    at, start = observer.run(log).falsified_at, observer.first_set
    prover = prover_of(observer, start, log, 0, own_start(None, start))
    assert at is not None
    assert prover.prove(at) is not None
    honest = BoxProgram._about
    monkeypatch.setattr(BoxProgram, "_about", lambda self, form, m: honest(self, form, m) - 1e-9)
    assert prover.prove(at) is None
    assert "nor is one of hulls over the vertices of Delta" in prover.reason
