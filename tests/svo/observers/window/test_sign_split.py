"""Programs split by the signs of s: exact against the union over all patterns of signs, and proven when empty."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polytopes import HPolytope
from svo import ArchitectureI, UncertainModel, Uncertainty, WindowObserver
from svo.detection.bank_alarms import alarms_of
from svo.detection.chains import verify_chains
from svo.isolation.alarms import Alarm, verify_alarms, write_alarms
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.observers.window.chain import prover_of
from svo.observers.window.chain_starts import own_start
from svo.observers.window.prover import ChainProver
from svo.observers.window.sign_split import SplitCertificate
from tests.svo.observers import oracle
from tests.svo.observers.random_plants import random_plant
from tests.svo.observers.window.test_against_full_information import (
    Case,
    answers,
    assert_contains,
    exact,
    open_channel,
    random_case,
)
from tests.svo.observers.window.window_system import judge

seeds = st.integers(0, 2**32 - 1)
SAMPLES, ENOUGH = 4, 10_000


def gentle_case(seed: int) -> Case:
    return random_case(np.random.default_rng(seed), open_channel, samples=SAMPLES, gentle=True)


@settings(max_examples=4, deadline=None, derandomize=True)
@given(seeds)
def test_enough_cells_give_the_exact_box(seed: int) -> None:
    case = gentle_case(seed)
    hull, split = answers(case, None, eps=1e-13), answers(case, None, eps=1e-13, sign_split=ENOUGH)
    for k in (1, SAMPLES - 1):
        verdict, lower, upper = split[k]
        assert verdict == "consistent"
        assert_contains(lower, upper, exact(case, k, None, rounding=0.0))
        wider = exact(case, k, None, rounding=1e-7)
        assert_contains(wider.lower, wider.upper, oracle.Box(False, lower, upper), tolerance=1e-6)
        assert_contains(*hull[k][1:], oracle.Box(False, lower, upper))


def test_a_split_is_tighter_than_the_hull_and_fewer_cells_lie_between() -> None:
    widths = []
    for seed in range(8):
        case = gentle_case(seed)
        ends = [answers(case, None, sign_split=cells)[-1] for cells in (0, 3, ENOUGH)]
        widths.append([float((upper - lower).sum()) for _, lower, upper in ends])
    total = np.sum(widths, axis=0)
    assert total[2] < total[0] * (1 - 1e-4)
    assert total[2] <= total[1] * (1 + 1e-9)
    assert total[1] <= total[0] * (1 + 1e-9)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seeds)
def test_truth_stays_inside_with_any_number_of_cells(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model = random_plant(rng, largest=3)
    x0 = rng.uniform(-1.0, 1.0, model.n_states)
    log = model.simulate(x0, rng.normal(size=(10, model.n_inputs)), rng, corners=bool(rng.random() < 0.5))
    observer = WindowObserver(model, HPolytope.box(x0 - 1.0, x0 + 1.0), horizon=3, sign_split=int(rng.integers(1, 12)))
    for k, step in enumerate(drive(observer, log)):
        assert step.verdict == "consistent"
        assert log.x is not None
        lower, upper = step.box
        room = 1e-12 * (1.0 + np.abs(log.x[k]))
        assert (lower - room <= log.x[k]).all()
        assert (log.x[k] <= upper + room).all()


def split_alarm() -> SplitCertificate:
    spread = Uncertainty(A=[[0.0, 0.0], [1.0, 0.0]], bounds=(-1.0, 1.0))
    model = UncertainModel([[1.0, 0.0], [0.0, 0.0]], None, np.eye(2), n=[0.2, 0.01], uncertainties=[spread])
    verdicts = {}
    for cells in (0, ENOUGH):
        observer = WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]), horizon=4, sign_split=cells)
        observer.update([np.nan, np.nan])
        observer.step(None, [np.nan, 0.9])  # |x| >= 0.89
        verdicts[cells] = observer.step(None, [0.0, np.nan])  # |x| <= 0.2
    assert verdicts[0].verdict == "consistent"
    assert verdicts[ENOUGH].verdict == "falsified"
    certificate = verdicts[ENOUGH].certificate
    assert isinstance(certificate, SplitCertificate)
    return certificate


def test_an_alarm_that_only_the_signs_give_is_proven_cell_by_cell() -> None:
    certificate = split_alarm()
    assert certificate.verify()
    assert len(certificate.cells) > 1
    for cell in certificate.cells:
        assert judge(cell) == "empty"


def test_a_split_proof_states_that_it_rests_on_the_largest_set() -> None:
    spread = Uncertainty(A=[[0.0, 0.0], [1.0, 0.0]], bounds=(-1.0, 1.0))
    largest = ([-1.0, -1.0], [1.0, 1.0])
    model = UncertainModel(
        [[1.0, 0.0], [0.0, 0.0]], None, np.eye(2), n=[0.2, 0.01], uncertainties=[spread], largest=largest
    )
    observer = WindowObserver(model, HPolytope.box(*largest), horizon=4, sign_split=ENOUGH)
    observer.lose_set()
    observer.update([np.nan, np.nan])
    observer.step(None, [np.nan, 0.9])
    certificate = observer.step(None, [0.0, np.nan]).certificate
    assert isinstance(certificate, SplitCertificate)
    assert certificate.verify()
    assert "the largest set at sample 5, where the set started again" in certificate.premise(7)


def test_a_split_proof_needs_every_cell_and_the_same_data() -> None:
    certificate = split_alarm()
    for i in range(len(certificate.cells)):
        assert not replace(certificate, cells=certificate.cells[:i] + certificate.cells[i + 1 :]).verify()
    assert not replace(certificate, s_upper=certificate.s_upper + 0.1).verify()
    assert not replace(certificate, s_lower=certificate.s_lower[:-1]).verify()
    head = certificate.cells[0]
    other = replace(head, samples=(*head.samples[:-1], replace(head.samples[-1], slack=0.5 * head.samples[-1].slack)))
    assert not replace(certificate, cells=(other, *certificate.cells[1:])).verify()
    assert not replace(certificate, cells=()).verify()


def test_a_saved_split_alarm_keeps_its_proof() -> None:
    spread = Uncertainty(A=[[0.0, 0.0], [1.0, 0.0]], bounds=(-1.0, 1.0))
    model = UncertainModel([[1.0, 0.0], [0.0, 0.0]], None, np.eye(2), n=[0.2, 0.01], uncertainties=[spread])
    observer = WindowObserver(model, HPolytope.box([-1.0, -1.0], [1.0, 1.0]), horizon=4, sign_split=ENOUGH)
    observer.step(None, [np.nan, 0.9])
    observer.step(None, [0.0, np.nan])
    again = WindowObserver.from_state_dict(model, observer.state_dict())
    assert again.sign_split == ENOUGH
    step = again.step(None, [0.0, 0.0])
    assert step.verdict == "falsified"
    assert step.certificate is not None
    assert step.certificate.verify()


def test_a_split_alarm_on_disk_is_verified_again(tmp_path: Path) -> None:
    path = tmp_path / "alarms.jsonl"
    write_alarms(path, [Alarm("spread", 2, 2.0, split_alarm(), {})])
    (check,) = verify_alarms(path)
    assert check.ok


class SplitPlant:
    """As much of a plant as `verify_chains` asks for: its bank splits by signs."""

    def scheduler(self) -> Callable[..., None]:
        return lambda *_: None

    def bank(self, noise: str) -> ArchitectureI:
        spread = Uncertainty(A=[[0.0, 0.0], [1.0, 0.0]], bounds=(-1.0, 1.0))
        model = UncertainModel([[1.0, 0.0], [0.0, 0.0]], None, np.eye(2), n=[0.2, 0.01], uncertainties=[spread])
        return ArchitectureI(WindowObserver(model, HPolytope.box([-1, -1], [1, 1]), horizon=4, sign_split=ENOUGH), {})


@pytest.mark.parametrize(("last", "by_hulls"), [([0.0, np.nan], False), ([3.0, np.nan], True)])
def test_a_chain_is_proven_over_hulls_or_split_by_signs(last: list[float], by_hulls: bool, tmp_path: Path) -> None:
    y = np.array([[np.nan, np.nan], [np.nan, 0.9], last])
    log, plant = Log(time=np.arange(3.0), u=np.zeros((3, 0)), y=y), SplitPlant()
    alarms = alarms_of(plant.bank("").run(log), log, {"plant": "split", "noise": ""})
    write_alarms(tmp_path / "alarms.jsonl", alarms)
    (check,) = verify_chains(tmp_path / "alarms.jsonl", log, plant)  # type: ignore[arg-type]
    assert check.ok
    assert "proven from the first sample" in check.reason
    observer = plant.bank("").observers["nominal"]
    start = observer.first_set
    assert start is not None
    prover = prover_of(observer, start, log, 0, own_start(None, start))
    assert isinstance(prover, ChainProver)
    assert (prover.over_hulls(2) is not None) is by_hulls
    found = prover.by_signs(2)
    assert found is not None
    assert found.certificate is not None
    assert found.certificate.verify()


def test_a_step_with_a_deadline_keeps_the_hull() -> None:
    case = gentle_case(3)
    boxes = []
    for cells in (0, ENOUGH):
        observer = case.observer(4, sign_split=cells)
        observer.update(case.log.y[0], case.log.u[0])
        for k in range(1, SAMPLES):
            step = observer.step(case.log.u[k - 1], case.log.y[k], case.log.u[k], deadline=10.0)
            assert step.verdict == "consistent"
        observer.sign_split = 0  # the box is no part of the step
        boxes.append(step.box)
    np.testing.assert_allclose(boxes[0], boxes[1], rtol=0.0, atol=1e-12)


def test_a_bad_number_of_cells_is_named() -> None:
    with pytest.raises(ValueError, match="sign_split is -1; expected a number of cells"):
        WindowObserver(UncertainModel([[1.0]], None, [[1.0]]), HPolytope.box([-1.0], [1.0]), sign_split=-1)
