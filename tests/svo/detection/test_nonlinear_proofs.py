"""Alarms of nonlinear models, proven from the equations, checked by the program that is not of ours; forgeries."""

from __future__ import annotations

import json
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from proof_cases import Files, Made, answer, claims, proven, steps_of, with_steps
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import ArchitectureI, NonlinearModel, WindowObserver, find_plant, prove_chain
from svo.cli import app
from svo.detection.plant_record import observer_record
from svo.functions import sroot
from svo.logs.log import Log
from svo.observers import window_kernel
from svo.observers.window.chain_starts import own_start
from svo.observers.window.linearised_prover import LinearisedProver, _Run
from svo.observers.window.memory import Memory
from svo.observers.window.prover import ProvenChain
from svo.observers.window.window import Window
from svo.store.values import encode_value
from tests.svo.detection.checkers import CHECK, NONLINEAR
from tests.svo.models.nonlinear_plants import CASES, Case

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"


class Nonlinear(Made):
    """A plant of one nonlinear model."""

    def __init__(self, case: Case) -> None:
        super().__init__(case.model, horizon=6)
        self.case = case

    def bank(self, noise: str) -> ArchitectureI:
        start = HPolytope.box(self.case.x0 - self.case.spread, self.case.x0 + self.case.spread)
        return ArchitectureI(WindowObserver(self.model, start, horizon=self._horizon), {})


def run_of(case: Case, fails: int = 25) -> Log:
    """A log whose sensors jump; the noise is small beside it."""
    log = case.model.simulate(case.x0, case.inputs(fails + 8), np.random.default_rng(3))
    log.y[fails:] += 8.0 * case.model.noise + 0.02 * np.abs(log.y[fails:])
    return log


def growth() -> Case:
    """A map: x(k+1) = f(x(k))."""
    model = NonlinearModel(
        lambda x, u, w, p: [p[0] * x[0] * (1.0 - x[0]) + 0.1 * u[0] + w[0], 0.5 * x[1] + x[0] / (1.0 + x[0])],
        lambda x, w: [x[0] * x[0] + 0.5 * w[0], x[1]], states=["a", "b"], inputs=["u"], disturbances=["w"],
        parameters={"rate": (2.9, 3.1)}, constant=True, n=[0.01, 0.02], w=[0.01], continuous=False,
        valid=([0.0, -1.0], [1.2, 2.0]), largest=([0.1, 0.0], [1.0, 1.0]),
    )  # fmt: skip
    return Case(model, np.array([0.6, 0.5, 3.0]), np.array([0.05, 0.05, 0.1]), lambda k: [0.1 * np.sin(k)])


@pytest.fixture(scope="module")
def reactor(tmp_path_factory: pytest.TempPathFactory) -> Files:
    case = CASES["cstr"]()
    files = proven(Nonlinear(case), run_of(case), tmp_path_factory.mktemp("reactor"))
    assert files is not None
    return files


LONG = ("lorenz", "tank", "crane")  # of the processor's time


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in LONG else n for n in CASES if n != "cstr"]
)
def test_alarms_of_nonlinear_plants_are_proven(name: str, tmp_path: Path) -> None:
    case = CASES[name]()
    files = proven(Nonlinear(case), run_of(case), tmp_path)
    assert files is not None
    ((observer, sample, premises),) = claims(files)
    assert (observer, sample) == ("nominal", 25)
    assert any("physical" in premise for premise in premises) is (case.model.physical_range is not None)


def test_a_map_with_a_constant_parameter_is_proven(tmp_path: Path) -> None:
    case = growth()
    log = case.model.simulate(case.x0, case.inputs(20), np.random.default_rng(3))
    log.y[12:, 1] += 0.4
    files = proven(Nonlinear(case), log, tmp_path)
    assert files is not None
    ((_, _, premises),) = claims(files)
    assert "the equations hold where the state is in their range" in premises


def test_no_chain_begins_where_the_equations_may_not_hold(tmp_path: Path) -> None:
    """The checker takes nothing that is read of such states: of a physical range that is wider than the valid one."""
    model = NonlinearModel(
        lambda x, u: [u[0] - 0.2 * sroot(x[0])], lambda x: [x[0]], states=["h"], inputs=["Q"], n=[0.05], Ts=0.5,
        physical=([0], [20]), valid=([0], [9]),
    )  # fmt: skip
    case = Case(model, np.array([4.0]), np.array([0.1]), lambda k: [0.4])
    files = proven(Nonlinear(case), run_of(case, 12), tmp_path)
    assert files is not None
    ((_, sample, premises),) = claims(files)
    assert sample == 12
    assert "the equations hold where the state is in their range" in premises


def test_the_commands_prove_the_two_tanks(tmp_path: Path) -> None:
    plant, log, out = EXAMPLES / "two_tanks.toml", EXAMPLES / "two_tanks.csv", tmp_path / "found"
    run = lambda *words: CliRunner().invoke(app, [str(word) for word in words])  # noqa: E731
    proof, described = tmp_path / "proof.jsonl.gz", tmp_path / "plant.json"
    assert run("detect", plant, log, "--out", out).exit_code == 0
    done = run("verify", out / "alarms.jsonl", "--full", log, "--write-proof", proof)
    assert done.exit_code == 0
    assert "2 of 2 alarms proven" in done.output
    assert run("describe", plant, "--out", described).exit_code == 0
    code, text = answer(proof, described, log)
    assert code == 0, text
    assert "2 of 2 alarms proven" in text
    assert "from sample 53 on, where the state is in its physical range" in text


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_eclipse_is_proven_by_its_equations(seed: int, tmp_path: Path) -> None:
    plant = find_plant("eclipse")
    for fault in ("elevator", "alpha", "dynamics"):
        (tmp_path / fault).mkdir()
        files = proven(plant, plant.simulate(fault, "soft", "quiet", seed), tmp_path / fault, noise="quiet")
        assert files is not None
        code, text = answer(*files)
        assert code == 0, text


# -- what is refused --------------------------------------------------------------------------------------------------

Steps = list[dict[str, Any]]


def of_kind(steps: Steps, kind: str) -> Steps:
    return [step for step in steps if step.get("step") == kind]


def scaled(kind: str, name: str, factor: float, add: float = 0.0) -> Callable[[Steps], None]:
    """An array of a step of the middle of the proof with other numbers."""

    def change(steps: Steps) -> None:
        found = of_kind(steps, kind)
        array = found[len(found) // 2][name]
        array["hex"] = " ".join((float.fromhex(w) * factor + add).hex() for w in array["hex"].split(" "))

    return change


def of_another_sample(kind: str, *names: str) -> Callable[[Steps], None]:
    def change(steps: Steps) -> None:
        found = of_kind(steps, kind)
        for name in names:
            found[3][name] = found[-1][name]

    return change


def narrowed(steps: Steps) -> None:
    """A box that a trajectory leaves."""
    box = of_kind(steps, "transition")[4]["boxes"]
    numbers = np.array([float.fromhex(w) for w in box["hex"].split(" ")]).reshape(box["shape"])
    middle = numbers.mean(axis=1, keepdims=True)
    box["hex"] = " ".join(float(v).hex() for v in (middle + 0.8 * (numbers - middle)).ravel())


def dropped(which: Callable[[dict[str, Any]], bool]) -> Callable[[Steps], None]:
    return lambda steps: steps.__setitem__(slice(None), [s for s in steps if not which(s)])


def tighter(steps: Steps) -> None:
    step = of_kind(steps, "x")[-1]
    step["value"] = (float.fromhex(step["value"]) - (1e-3 if step["side"] == "upper" else -1e-3)).hex()


FORGED: dict[str, Callable[[Steps], None]] = {
    "a remainder of a transition is too small": scaled("transition", "R", 0.5),
    "a remainder of a transition is zero": scaled("transition", "R", 0.0),
    "a matrix is another": scaled("transition", "A", 1.01),
    "a constant is another": scaled("transition", "a", 1.0, 0.01),
    "what w does is left out": scaled("transition", "E", 0.0),
    "the matrices are of another sample": of_another_sample("transition", "A", "a", "E", "R"),
    "the boxes are of another sample": of_another_sample("transition", "boxes"),
    "a box does not hold the trajectory": narrowed,
    "a box is a point": scaled("transition", "boxes", 0.0, 1.0),
    "a substep is missing": lambda steps: of_kind(steps, "transition")[2].update(substeps=[2048]),
    "a substep is negative": lambda steps: of_kind(steps, "transition")[2].update(substeps=[8192, -4096]),
    "an output has another slope": scaled("output", "C", 1.01),
    "an output has another constant": scaled("output", "c", 1.0, 1.0),
    "a transition is missing": dropped(lambda s: s.get("step") == "transition" and s["sample"] == 24),
    "outputs are missing": dropped(lambda s: s.get("step") == "output"),
    "boxes are missing": lambda steps: of_kind(steps, "transition")[2].pop("boxes"),
    "no bounds of states": dropped(lambda s: s.get("step") == "x"),
    "states within less": tighter,
    "a step is of a sample after the log": lambda steps: of_kind(steps, "transition")[2].update(sample=10**6),
}


@pytest.mark.parametrize("what", FORGED)
def test_a_forged_linearisation_is_refused(reactor: Files, what: str) -> None:
    steps = deepcopy(steps_of(reactor[0]))
    FORGED[what](steps)
    assert claims((with_steps(reactor[0], steps), *reactor[1:])) == []


def test_the_reactor_is_proven(reactor: Files) -> None:
    assert [claim[:2] for claim in claims(reactor)] == [("nominal", 25)]


def changed(model: Callable[[dict[str, Any]], None], files: Files) -> Files:
    plant = json.loads(files[1].read_text())
    model(plant["observers"]["nominal"])
    path = files[1].with_name("changed.json")
    path.write_text(json.dumps(plant))
    return files[0], path, files[2]


OTHER_MODELS = (
    "wider w", "more noise", "varying", "narrower valid", "a map", "another function",
    "a remainder of its own", "nothing is left out", "rows on what is left out", "varying what is left out",
)  # fmt: skip


@pytest.mark.parametrize("what", OTHER_MODELS)
def test_a_proof_of_another_model_is_refused(reactor: Files, what: str) -> None:
    def change(record: dict[str, Any]) -> None:
        told = record["equations"]
        if what == "wider w":
            record["w_upper"]["hex"] = " ".join(["0x1.0p+4", *record["w_upper"]["hex"].split(" ")[1:]])
        elif what == "more noise":
            record["noise"]["hex"] = (5.0).hex()
        elif what == "varying":
            told["varying"] = [0, 1]
        elif what == "narrower valid":
            told["valid"] = [{"shape": [2], "hex": f"0 {low.hex()}"} for low in (340.0, 350.0)]
        elif what == "a remainder of its own":  # which proofs of outputs would not count
            record["remainder"] = {"shape": [1, 1], "hex": (1e-9).hex()}
        elif what == "nothing is left out":  # remainders would then be multiplied by zero
            record["w_upper"]["hex"] = " ".join([*record["w_upper"]["hex"].split(" ")[:2], "0", "0"])
        elif what == "rows on what is left out":
            told_rows = {"rows": {"shape": [1, 4], "hex": f"0 0 {(1.0).hex()} 0"}}
            record["w_rows"] = told_rows | {end: {"shape": [1], "hex": "0"} for end in ("lower", "upper")}
        elif what == "varying what is left out":
            told["varying"] = [2]
        elif what == "a map":
            told["continuous"] = False
        else:
            told["f"]["op"] = [12 if op == 9 else op for op in told["f"]["op"]]

    assert claims(changed(change, reactor)) == []


def test_what_varies_counts_once(reactor: Files) -> None:
    plant = json.loads(reactor[1].read_text())
    record, bounds = plant["observers"]["nominal"], []
    for varying in ([0], [0, 0]):
        record["equations"]["varying"] = varying
        model = NONLINEAR.Linearised(record, plant, CHECK.Log(reactor[2], plant["columns"]), 0).model
        bounds.append([*model.output([(0, 1), (NONLINEAR.ONE, 400 * NONLINEAR.ONE)], [300.0])])
        assert [*model.varies] == [0]
    assert bounds[0] == bounds[1]


# -- alarms that just are some, of models alone -----------------------------------------------------------------------


def drifting(name: str, seed: int) -> tuple[WindowObserver, Log, int | None]:
    """An observer, a log of which a sensor drifts, some readings missing, and the sample at which it is falsified."""
    case, rng = CASES[name](), np.random.default_rng(seed)
    log = case.model.simulate(case.x0, case.inputs(45), rng)
    y, j = log.y.copy(), seed % log.y.shape[1]
    y[15:, j] += case.model.noise[j] * rng.uniform(0.1, 0.5) * np.arange(30)
    if seed % 3 == 0:
        y[rng.random(y.shape) < 0.1] = np.nan
    start = HPolytope.box(case.x0 - case.spread, case.x0 + case.spread)
    observer, bad = WindowObserver(case.model, start, horizon=6), Log(log.time, log.u, y)
    return observer, bad, observer.run(bad).falsified_at


def is_checked(found: ProvenChain, observer: WindowObserver, log: Log, at: int, **plant: Any) -> bool:
    """Whether the checker takes the steps of a chain."""
    first = observer.first_set
    assert first is not None
    told = SimpleNamespace(u=log.u.tolist(), y=log.y.tolist(), time=log.time.tolist())
    record = observer_record("made", first, observer.model, None)
    chain = NONLINEAR.Linearised(record, {"Ts": float(observer.model.Ts).hex(), **plant}, told, at)
    try:
        for step in found.steps:
            chain.take(json.loads(json.dumps(step)))
    except CHECK.REFUSALS:
        return False
    return bool(found.steps[-1]["step"] == "alarm")


def chain_of(observer: WindowObserver, log: Log, at: int) -> ProvenChain | None:
    first = observer.first_set
    assert first is not None
    begun = own_start(observer.model.start_range, first, observer.largest_at)
    return LinearisedProver(observer.model, log, 0, begun).prove(at)


# Of each, what was once not proven, or refused: wide sets, boxes of several substeps, an alarm that is just one.
@pytest.mark.parametrize(
    ("name", "seed"),
    [("pendulum", 7), ("cstr", 10), ("three tanks", 3), ("crane", 2)]
    + [pytest.param(name, seed, marks=pytest.mark.slow) for name in CASES for seed in range(20, 40)],
)
def test_a_drift_that_is_just_found_is_proven(name: str, seed: int) -> None:
    observer, log, at = drifting(name, seed)
    if at is None:
        return
    found = chain_of(observer, log, at)
    assert found is not None
    assert is_checked(found, observer, log, at)


def test_a_bound_of_the_newest_state_that_is_too_tight_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    observer, log, at = drifting("pendulum", 7)
    assert at is not None
    honest = Memory.solve

    def solve(self: Memory, task: int, program: int, *limits: int) -> Any:
        found = honest(self, task, program, *limits)
        if task == window_kernel.NEWEST and program % 2 == 0:
            self.arrays["now_upper"][program // 2] -= 1e-6
        return found

    monkeypatch.setattr(Memory, "solve", solve)
    found = chain_of(observer, log, at)
    assert found is None or is_checked(found, observer, log, at)


def test_a_set_to_go_on_from_that_is_too_tight_is_not_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    observer, log, at = drifting("pendulum", 7)
    assert at is not None
    honest = _Run.arrival

    def arrival(self: _Run, window: Window, program: int) -> None:
        if program == 0:
            window.memory.arrays["new_upper"][0] -= 1e-6
        honest(self, window, program)

    monkeypatch.setattr(_Run, "arrival", arrival)
    first = observer.first_set
    assert first is not None
    prover = LinearisedProver(observer.model, log, 0, own_start(None, first))
    assert prover.prove(at) is None
    assert "is not proven" in prover.reason


def test_a_chain_of_an_observer_alone_is_proven() -> None:
    observer, log, at = drifting("pendulum", 7)
    check = prove_chain(observer, log)
    assert check.proven
    assert check.falsified_at == at
    assert check.given == ("the first set",)


def test_samples_at_times_of_their_own_are_proven_by_these() -> None:
    case, rng = CASES["pendulum"](), np.random.default_rng(2)
    times = np.cumsum(rng.uniform(0.02, 0.08, 40))
    x, rows = case.x0, []
    for k in range(40):
        rows.append(x)
        rate = lambda _, x: case.model.flow.tape.values(np.concatenate([x, [0.02], [1.0]]))  # noqa: E731
        x = solve_ivp(rate, (0.0, times[min(k + 1, 39)] - times[k]), x, rtol=1e-9).y[:, -1] if k < 39 else x
    y = np.array(rows)[:, :1] + 0.002 * np.arange(40)[:, None]
    log = Log(times, np.ones((40, 1)), y, events=True)
    observer = WindowObserver(case.model, HPolytope.box(case.x0 - case.spread, case.x0 + case.spread), horizon=6)
    at = observer.run(log).falsified_at
    assert at is not None
    found = chain_of(observer, log, at)
    assert found is not None
    intervals = np.diff(times)
    assert is_checked(found, observer, log, at, intervals=encode_value(intervals))
    assert not is_checked(found, observer, log, at, intervals=encode_value(1.1 * intervals))
    assert not is_checked(found, observer, log, at)
