"""One door for numbers: everything that takes arrays against everything that is no array of real numbers."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy import signal, sparse
from scipy.io import savemat

import polytopes
import svo
from polytopes import HPolytope
from svo import (
    ArchitectureI,
    ConstrainedZonotopeObserver,
    Log,
    PolytopeObserver,
    UncertainModel,
    Uncertainty,
    WindowObserver,
    design_input,
    distinguishability,
)
from svo.baselines import GaussianModel, InnovationFilter
from svo.faults import ActuatorFault, PlantFault, Ramp, SensorFault, Step
from svo.indices import detection_indices
from svo.interval import GainBounds, IntervalDetector, IntervalPredictor, NoiseCharacterization
from svo.models.discretisation import zero_order_hold
from svo.models.remainder import remainder_bound
from svo.models.schedule_table import ScheduleTable
from svo.plant import Column, Columns
from svo.residual_tests import CUSUM, StaticThreshold

HOUSE = tuple(str(Path(package.__file__ or "").parent) for package in (svo, polytopes))
PARTS: dict[str, Any] = {
    "A": [[0.5, 0.1], [0.0, 0.6]], "B": [[1.0], [0.5]], "C": [[1.0, 0.0], [0.0, 1.0]], "E": [[0.1], [0.2]],
    "w": [0.5], "D": [[0.1], [0.2]], "F": [[0.1], [0.3]], "n": [0.1, 0.2], "a": [0.1, 0.2], "c": [0.3, 0.1],
}  # fmt: skip
MODEL = UncertainModel(PARTS["A"], PARTS["B"], PARTS["C"], E=PARTS["E"], w=PARTS["w"], n=PARTS["n"])
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
DIRECTION = Uncertainty(A=[[0.1, 0.0], [0.0, 0.0]])
TIME, U, Y = np.array([0.0, 1.0, 2.0]), np.array([[0.1], [0.2], [0.3]]), np.array([[0.1, 0.2], [0.3, 0.4], [0.2, 0.1]])
COLUMNS = Columns(inputs=(Column("u", "1"),), outputs=(Column("y", "1"),))


def window(**options: Any) -> WindowObserver:
    return WindowObserver(MODEL, START, horizon=2, **options)


def started(observer: Any) -> Any:
    observer.update(y0=[0.0, 0.0])
    return observer


def missing_first() -> Any:
    observer = window()
    observer.update(y0=[np.nan, np.nan])
    return observer


def scheduled(array: Any) -> Any:
    return UncertainModel(lambda s: array, None, [[1.0, 0.0]], schedule=0.5)


def along(schedule: Any) -> Any:
    model = UncertainModel(lambda s: np.eye(2) * s, None, [[1.0, 0.0]], schedule=0.5)
    return model.along(schedule)


def simulated(x0: Any = (0.0, 0.0), u: Any = U) -> Log:
    return MODEL.simulate(x0, u, np.random.default_rng(0))


def interval_detector() -> IntervalDetector:
    noise = NoiseCharacterization.from_records(np.sin(np.arange(50.0)), 5)
    return IntervalDetector(IntervalPredictor(GainBounds(0.5, 0.1), (0.0, 1.0)), noise, 0.5)


def frame(y: Any) -> Any:
    pandas = pytest.importorskip("pandas")
    return Log.from_dataframe(pandas.DataFrame({"time_s": TIME, "u": U[:, 0], "y": pandas.Series(y)}), COLUMNS, 1.0)


class Case(NamedTuple):
    """A call with one argument, a value that it takes, and whether entries of it may be missing."""

    call: Callable[[Any], Any]
    good: Any
    may_miss: bool = False


CASES: dict[str, Case] = {f"model {k}": Case(lambda v, k=k: UncertainModel(**PARTS | {k: v}), PARTS[k]) for k in PARTS}
CASES |= {
    f"uncertainty {k}": Case(lambda v, k=k: UncertainModel(**PARTS, uncertainties=[Uncertainty(**{k: v})]), PARTS[k])
    for k in "ABaECDcF"
}
CASES |= {
    f"continuous {k}": Case(lambda v, k=k: UncertainModel.from_continuous(**PARTS | {"Ts": 0.1, k: v}), PARTS[k])
    for k in PARTS
}
CASES |= {
    f"state space {k}": Case(
        lambda v, k=k: UncertainModel.from_statespace(
            type("Foreign", (), {**{m: PARTS[m] for m in "ABCD"}, "dt": 0.1, k: v})()
        ),
        PARTS[k],
    )
    for k in "ABCD"
}
for kind in (WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver):
    label, make = kind.__name__, lambda kind=kind: kind(MODEL, START)
    CASES |= {
        f"{label} update y": Case(lambda v, make=make: make().update(v), Y[0], True),
        f"{label} step y": Case(lambda v, make=make: started(make()).step([0.1], v), Y[0], True),
        f"{label} step u": Case(lambda v, make=make: started(make()).step(v, [0.0, 0.0]), U[0]),
    }
CASES |= {
    "w lower": Case(lambda v: MODEL.replace(w=(v, [0.5])), [-0.5]),
    "w upper": Case(lambda v: MODEL.replace(w=([-0.5], v)), [0.5]),
    "bounds of Delta": Case(lambda v: Uncertainty(A=PARTS["A"], bounds=v), [-1.0, 1.0]),
    "a function of the schedule": Case(scheduled, PARTS["A"]),
    "schedule of along": Case(along, [0.5, 0.6]),
    "schedule of stack_over": Case(
        lambda v: UncertainModel(lambda s: np.eye(2) * s, None, [[1.0, 0.0]], schedule=0.5).stack_over(v), [0.5, 0.6]
    ),
    "table points": Case(lambda v: ScheduleTable(v, [[1.0], [2.0]]), [0.0, 1.0]),
    "table values": Case(lambda v: ScheduleTable([0.0, 1.0], v), [1.0, 2.0]),
    "simulate x0": Case(lambda v: simulated(x0=v), [0.0, 0.1]),
    "simulate u": Case(lambda v: simulated(u=v), U),
    "zero_order_hold": Case(lambda v: zero_order_hold(v, PARTS["B"], 0.1), PARTS["A"]),
    "remainder_bound x": Case(
        lambda v: remainder_bound(PARTS["A"], None, Ts=0.1, x=v, uncertainties=[DIRECTION]), [1.0, 2.0]
    ),
    "remainder": Case(
        lambda v: UncertainModel.from_continuous(PARTS["A"], None, PARTS["C"], Ts=0.1, remainder=v), [0.1, 0.2]
    ),
    "template": Case(lambda v: window(template=v), [[1.0, 1.0]]),
    "late y": Case(lambda v: missing_first().late_update(v, 0), Y[0], True),
    "directions": Case(lambda v: started(window()).step([0.1], [0.0, 0.0]).support(v), [[1.0, 1.0]]),
    "bank update y": Case(lambda v: ArchitectureI(window(), {}).update(v), Y[0], True),
    "bank step y": Case(lambda v: started(ArchitectureI(window(), {})).step([0.1], v), Y[0], True),
    "bank step u": Case(lambda v: started(ArchitectureI(window(), {})).step(v, [0.0, 0.0]), U[0]),
    "log time": Case(lambda v: Log(v, U, Y), TIME),
    "log u": Case(lambda v: Log(TIME, v, Y), U),
    "log y": Case(lambda v: Log(TIME, U, v), Y, True),
    "log x": Case(lambda v: Log(TIME, U, Y, x=v), Y, True),
    "log schedule": Case(lambda v: Log(TIME, U, Y, schedule=v), TIME),
    "sensor fault y": Case(lambda v: SensorFault(0, "bias", 0.1, Step()).corrupt(TIME, v), Y, True),
    "sensor fault t": Case(lambda v: SensorFault(0, "bias", 0.1, Step()).corrupt(v, Y), TIME),
    "actuator fault u": Case(lambda v: ActuatorFault(0, "loss", 0.5, Step()).corrupt(TIME, v), U),
    "actuator fault held": Case(
        lambda v: ActuatorFault(0, "locking", None, Step(), travel=(-1.0, 1.0)).corrupt(TIME, U, held=v), [0.1]
    ),
    "travel": Case(lambda v: ActuatorFault(0, "locking", None, Step(), travel=v), [-1.0, 1.0]),
    "profile": Case(lambda v: Ramp(0.0, 1.0).value(v), TIME),
    "plant fault x": Case(
        lambda v: PlantFault(DIRECTION, 1.0, Step()).perturbation(MODEL, 1.0, v, [0.1], [0.0]), [0.1, 0.2]
    ),
    "distinguish u": Case(lambda v: distinguishability(MODEL, MODEL, 2, initial=START, u=v), U),
    "design reference": Case(lambda v: designed(reference=v), U),
    "design lower limit": Case(lambda v: designed(limits=(v, [1.0])), [-1.0]),
    "design weight": Case(lambda v: designed(weight=v), [1.0]),
    "gain bounds": Case(lambda v: GainBounds(v, 0.1), [0.5, 0.6]),
    "predictor u": Case(lambda v: IntervalPredictor(GainBounds(0.5, 0.1), (0.0, 1.0)).step(v), np.array(0.5)),
    "detector y": Case(lambda v: interval_detector().update(v), [0.1], True),
    "detector u": Case(lambda v: interval_detector().step(v, 0.1), [0.1]),
    "noise record": Case(lambda v: NoiseCharacterization.from_records([v], 2), np.sin(np.arange(20.0)), True),
    "residual": Case(lambda v: CUSUM(change=1.0, threshold=5.0).run(v), [0.1, 0.2], True),
    "online residual": Case(
        lambda v: StaticThreshold(mean=0.0, sigma=1.0, nu=3.0).start().step(v), np.array(0.1), True
    ),
    "indices time": Case(lambda v: detection_indices(v, np.array([False, True, True]), 1.0), TIME),
    "kalman y": Case(lambda v: InnovationFilter(GaussianModel(MODEL, START)).start().update(v), Y[0], True),
    "data frame": Case(frame, Y[:, 0], True),
    "initial": Case(lambda v: HPolytope.box(v, [1.0, 1.0]), [-1.0, -1.0]),
}


def designed(reference: Any = None, limits: Any = ([-1.0], [1.0]), weight: Any = None) -> Any:
    plant = MODEL.replace(c=[5.0, 5.0])
    return design_input(plant, MODEL, 2, initial=START, limits=limits, reference=reference, weight=weight)


def with_unit(good: Any) -> Any:
    class Quantity(np.ndarray):
        unit = "m"

    return np.asarray(good, dtype=float).view(Quantity)


def in_pieces(good: Any) -> Any:
    array = np.asarray(good, dtype=float)
    return [array.tolist(), [array.tolist()]]


BAD: dict[str, Callable[[Any], Any]] = {
    "masked": lambda g: np.ma.masked_array(g, mask=np.ones(np.shape(g), dtype=bool)),
    "complex": lambda g: np.asarray(g) + 0.2j,
    "complex64": lambda g: np.asarray(g).astype(np.complex64),
    "text": lambda g: np.asarray(g).astype(str),
    "bytes": lambda g: np.asarray(g).astype("S8"),
    "timedelta": lambda g: np.asarray(g, dtype=float).astype(int).astype("timedelta64[s]"),
    "datetime": lambda g: np.asarray(g, dtype=float).astype(int).astype("datetime64[s]"),
    "objects": lambda g: np.full(np.shape(g), object()),
    "a set": lambda g: {1.0, 2.0},
    "a dict": lambda g: {"value": g},
    "a record": lambda g: np.zeros(np.shape(g), dtype=[("x", float)]),
    "sparse": lambda g: sparse.csr_matrix(np.atleast_2d(np.asarray(g, dtype=float))),
    "with a unit": with_unit,
    "ragged": in_pieces,
    "beyond floats": lambda g: np.full(np.shape(g), 10**400, dtype=object).tolist(),
    "no float": lambda g: np.full(np.shape(g), 2**53 + 1),
    "missing": lambda g: np.full(np.shape(g), np.nan),
    "infinite": lambda g: np.full(np.shape(g), np.inf),
    "one axis more": lambda g: np.asarray(g, dtype=float)[None],
}
MISSING = ("masked", "missing")
MAY_HAVE_AN_AXIS_MORE = (
    "profile", "gain bounds", "detector y", "detector u", "table values", "schedule of stack_over",
    "design lower limit", "data frame",
)  # fmt: skip
IN_A_FRAME = ("complex", "text", "timedelta", "datetime", "objects", "no float")


def is_wrong(case: Case, kind: str, name: str) -> bool:
    if kind in MISSING:
        return not case.may_miss
    if kind == "one axis more":  # what broadcasts, or may be one of several things
        return name not in MAY_HAVE_AN_AXIS_MORE
    return name != "data frame" or kind in IN_A_FRAME


def refusal(call: Callable[[], Any]) -> str:
    """ "ours" if a call ends in an error that our own code raised and that says what was expected."""
    try:
        call()
    except (TypeError, ValueError) as error:
        frames = traceback.extract_tb(error.__traceback__)
        told = any(word in str(error) for word in ("expected", "Expected", "Round it first"))
        own = frames[-1].filename.startswith(HOUSE) and told
        return "ours" if own else f"{type(error).__name__} in {frames[-1].name}: {error}"
    return "taken"


@pytest.mark.parametrize("name", CASES)
def test_what_is_no_array_of_real_numbers_is_refused(name: str) -> None:
    case, found = CASES[name], []
    case.call(case.good)
    for kind, spoil in BAD.items():
        if not is_wrong(case, kind, name):
            continue
        answer = refusal(lambda spoil=spoil: case.call(spoil(case.good)))
        if answer != "ours":
            found.append(f"{kind}: {answer}")
    assert not found


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.may_miss])
def test_a_masked_reading_is_a_missing_one(name: str) -> None:
    case = CASES[name]
    mask = np.arange(np.size(case.good)).reshape(np.shape(case.good)) == np.size(case.good) - 1
    case.call(np.ma.masked_array(np.where(mask, -9999.0, case.good), mask=mask))


@pytest.mark.parametrize("kind", [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver])
def test_masked_readings_give_the_set_of_missing_ones(kind: Any) -> None:
    masked, missing = started(kind(MODEL, START)), started(kind(MODEL, START))
    a = masked.step([0.1], np.ma.masked_array([0.1, -9999.0], mask=[False, True]))
    b = missing.step([0.1], [0.1, np.nan])
    assert np.array_equal(a.box, b.box)
    assert Log(TIME, U, np.ma.masked_equal(np.where(Y == 0.4, -9999.0, Y), -9999.0)).y[1, 1] != -9999.0


def forms(good: Any) -> dict[str, Any]:
    pandas = pytest.importorskip("pandas")
    array = np.asarray(good, dtype=float)
    found: dict[str, Any] = {"list": array.tolist(), "big-endian": array.astype(">f8")}
    if array.ndim:
        strided = np.repeat(array, 2, axis=-1)[..., ::2]
        found |= {"tuple of arrays": tuple(array), "strided": strided, "Fortran": np.asfortranarray(array)}
    if array.ndim == 2:
        found |= {"matrix": np.matrix(array), "frame": pandas.DataFrame(array)}
    if array.ndim == 1:
        found |= {"series": pandas.Series(array)}
    return found


@pytest.mark.filterwarnings("ignore:the matrix subclass")
@pytest.mark.parametrize("name", [name for name in CASES if not name.startswith(("data", "design"))])
def test_other_forms_of_the_same_numbers_are_taken(name: str) -> None:
    for label, form in forms(CASES[name].good).items():
        if name.startswith(("model w", "continuous w")) and label == "tuple of arrays":
            continue  # a tuple of two is (lower, upper)
        CASES[name].call(form)


def test_the_form_changes_no_bit() -> None:
    boxes = []
    for form in (list, np.array, lambda v: np.repeat(v, 2)[::2], lambda v: np.asarray(v, dtype=">f8")):
        observer = started(window())
        boxes.append(np.array(observer.step(form([0.1]), form([0.2, 0.3])).box))
    assert all(np.array_equal(box, boxes[0]) for box in boxes)


NUMBERS: dict[str, Callable[[Any], Any]] = {
    "Ts": lambda v: MODEL.replace(Ts=v),
    "Ts of from_continuous": lambda v: UncertainModel.from_continuous([[-1.0]], None, [[1.0]], Ts=v),
    "eps": lambda v: window(eps=v),
    "deadline": lambda v: started(window()).step([0.1], [0.0, 0.0], deadline=v),
    "bank deadline": lambda v: started(ArchitectureI(window(), {})).step([0.1], [0.0, 0.0], deadline=v),
    "magnitude": lambda v: SensorFault(0, "bias", v, Step()),
    "loss": lambda v: ActuatorFault(0, "loss", v, Step()),
    "frequency": lambda v: ActuatorFault(0, "oscillatory-solid", 0.1, Step(), frequency_hz=v),
    "start": Step,
    "duration": lambda v: Ramp(0.0, v),
    "pole": lambda v: IntervalDetector(interval_detector().predictor, interval_detector().noise, v),
    "initial radius": lambda v: IntervalPredictor(GainBounds(0.5, 0.1), (0.0, v)),
    "sigma": lambda v: StaticThreshold(mean=0.0, sigma=v, nu=3.0),
    "schedule of a table": ScheduleTable([0.0, 1.0], [1.0, 2.0]),
}


@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_number_is_refused(name: str) -> None:
    NUMBERS[name](0.5)
    NUMBERS[name](np.float32(0.5))
    wrong = (float("nan"), 0.5j, np.complex64(0.5), "0.5", None, np.ma.masked, [0.5, 0.5], np.timedelta64(1, "s"))
    for value in (*wrong, 10**400):
        if value is None and "deadline" in name:
            continue
        with pytest.raises((TypeError, ValueError), match=r"expected|needs|Round it first"):
            NUMBERS[name](value)


@pytest.mark.parametrize("kind", [WindowObserver, PolytopeObserver])
@pytest.mark.parametrize("value", [True, 2.0, "3", 0, -1, 1j])
def test_counts_are_whole_numbers(kind: Any, value: Any) -> None:
    with pytest.raises((TypeError, ValueError), match=r"horizon is .*expected an integer"):
        kind(MODEL, START, horizon=value)


def test_a_complex_system_of_a_library_is_refused() -> None:
    rotating = signal.StateSpace([[0.9 + 0.2j, 0], [0, 0.9 - 0.2j]], [[1], [1]], [[1, 1]], [[0]], dt=0.1)
    with pytest.raises(TypeError, match="A of sys has dtype complex128; expected real numbers"):
        UncertainModel.from_statespace(rotating)


@pytest.mark.parametrize(
    ("value", "kind"),
    [
        (np.array([[1.0 + 1j]]), "complex"),
        (sparse.csc_matrix([[1.0]]), "sparse"),
        (np.array(["one"]), "text"),
        ({"value": 1.0}, "struct"),
    ],
)
def test_a_variable_of_a_file_that_holds_no_real_numbers_is_not_left_out(tmp_path: Path, value: Any, kind: str) -> None:
    """Left out, B would be no input at all."""
    savemat(tmp_path / "plant.mat", {"A": [[0.5]], "B": value, "C": [[1.0]], "other": value})
    with pytest.raises(ValueError, match=f"variable 'B' is .*{kind}.*expected real numbers"):
        UncertainModel.from_mat(tmp_path / "plant.mat", Ts=0.1)
