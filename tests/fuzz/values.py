"""Calls of the public face with what people hand over by mistake."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

import svo
from polytopes import HPolytope, convex_hull
from svo import UncertainModel, Uncertainty, WindowObserver
from svo.faults import ActuatorFault, PlantFault, Ramp, SensorFault, Step
from svo.indices import detection_indices
from svo.interval import IntervalPredictor, NoiseCharacterization
from svo.logs.log import Log
from svo.residual_tests import CUSUM, GLR, SPRT, StaticThreshold, StudentT
from tests.fuzz.outcome import WrongError

BOX = HPolytope.box([-1.0, -1.0], [1.0, 1.0])


def model(**changes: Any) -> UncertainModel:
    given: dict[str, Any] = {
        "A": [[0.9, 0.1], [0.0, 0.8]], "B": [[0.0], [1.0]], "C": [[1.0, 0.0]], "E": [[0.0], [1.0]], "w": [0.1],
        "n": [0.1], "Ts": 0.1,
    }  # fmt: skip
    return UncertainModel(**(given | changes))


def observer(**options: Any) -> WindowObserver:
    return WindowObserver(model(), **({"initial": BOX, "horizon": 3} | options))


def stepped(y: Any, u: Any, **rest: Any) -> Any:
    one = observer()
    one.update([0.0])
    step = one.step(u, y, **rest)
    if step.verdict == "consistent" and not np.isfinite(np.array(step.box)).all():
        raise WrongError(f"a box that is not finite is called consistent: u {u!r:.80}, y {y!r:.80}")
    return step


def faulty(fault: Callable[[], Any]) -> Any:
    return fault().model(model())


ARRAYS: list[Callable[[Any], Any]] = [
    lambda v: model(A=v),
    lambda v: model(B=v),
    lambda v: model(C=v),
    lambda v: model(E=v),
    lambda v: model(w=v),
    lambda v: model(n=v),
    lambda v: model(Ts=v),
    lambda v: model(a=v),
    lambda v: model(c=v),
    lambda v: model(D=v),
    lambda v: model(F=v),
    lambda v: model(w=(v, v)),
    lambda v: model(uncertainties=[Uncertainty(A=v)]),
    lambda v: model(uncertainties=[Uncertainty(A=[[0.1, 0.0], [0.0, 0.0]], bounds=v)]),
    lambda v: model(names=v),
    lambda v: UncertainModel.from_continuous(v, None, [[1.0]], Ts=0.1, n=[0.1]),
    lambda v: UncertainModel.from_continuous([[-1.0]], None, [[1.0]], Ts=v, n=[0.1]),
    lambda v: model().simulate(v, np.zeros((3, 1)), np.random.default_rng(0)),
    lambda v: model().simulate([0.0, 0.0], v, np.random.default_rng(0)),
    lambda v: model().simulate([0.0, 0.0], np.zeros((3, 1)), v),
    lambda v: observer(initial=v),
    lambda v: observer(horizon=v),
    lambda v: observer(template=v),
    lambda v: observer(eps=v),
    lambda v: observer(sign_split=v),
    lambda v: observer().update(v),
    lambda v: stepped(v, [0.0]),
    lambda v: stepped([0.0], v),
    lambda v: stepped([0.0], [0.0], deadline=v),
    lambda v: stepped([0.0], [0.0]).support(v),
    lambda v: observer().run(v),
    lambda v: WindowObserver(v, BOX),
    lambda v: svo.ConstrainedZonotopeObserver(model(), BOX, max_generators=v),
    lambda v: svo.PolytopeObserver(model(), BOX, horizon=1, max_facets=v),
    lambda v: svo.ArchitectureI(v, {"a": observer()}),
    lambda v: svo.ArchitectureI(observer(), v),
    lambda v: svo.ArchitectureI(observer(), {"a": observer()}, debounce=v),
    lambda v: svo.ArchitectureI(observer(), {"a": observer()}).load_state_dict(v),
    lambda v: svo.ScheduleTable(v, np.zeros((2, 2))),
    lambda v: svo.ScheduleTable([0.0, 1.0], v),
    lambda v: svo.distinguishability(model(), model(A=v), 3, initial=BOX),
    lambda v: svo.calibrate(model(), v, BOX),
    lambda v: Log(time=v, u=np.zeros((3, 1)), y=np.zeros((3, 1))),
    lambda v: Log(time=[0.0, 0.1, 0.2], u=v, y=np.zeros((3, 1))),
    lambda v: Log(time=[0.0, 0.1, 0.2], u=np.zeros((3, 1)), y=v),
    lambda v: HPolytope(v, [1.0, 1.0]),
    lambda v: HPolytope([[1.0, 0.0], [0.0, 1.0]], v),
    lambda v: HPolytope.box(v, [1.0, 1.0]),
    lambda v: HPolytope.box([-1.0, -1.0], v),
    lambda v: HPolytope.from_vertices(v),
    lambda v: HPolytope.empty(v),
    lambda v: HPolytope.whole_space(v),
    lambda v: BOX.support(v),
    lambda v: BOX.contains(v),
    lambda v: BOX.project(v),
    lambda v: BOX.affine_map(v),
    lambda v: BOX.affine_map(np.eye(2), v),
    lambda v: BOX.preimage(v),
    lambda v: BOX.intersection(v),
    lambda v: BOX.minkowski_sum(v),
    lambda v: BOX.pontryagin_difference(v),
    lambda v: BOX.product(v),
    lambda v: BOX.outer_template(v),
    lambda v: BOX.outer_reduce(v),
    lambda v: BOX.equals(v),
    lambda v: convex_hull(v),
    lambda v: convex_hull([BOX, v]),
    lambda v: faulty(lambda: SensorFault(0, "bias", magnitude=v, profile=Step(1.0))),
    lambda v: faulty(lambda: ActuatorFault(0, "loss", magnitude=v, profile=Step(1.0))),
    lambda v: faulty(lambda: PlantFault(v, 1.0, Step(1.0))),
    lambda v: Step(v),
    lambda v: Ramp(v, v),
    lambda v: detection_indices(v, [False, True], 0.1),
    lambda v: detection_indices([0.0, 0.1], v, 0.1),
    lambda v: StaticThreshold(mean=v),
    lambda v: CUSUM(mean=v, change=1.0, threshold=1.0),
    lambda v: SPRT(mean=v, sigma=1.0),
    lambda v: GLR(mean=v, sigma=1.0),
    lambda v: StudentT(mean=v, samples=0.01),
    lambda v: IntervalPredictor(v, 0.1),
    lambda v: NoiseCharacterization(v),
]


def nasty(rng: np.random.Generator) -> Any:
    """Something that is rarely what a function of sets and models expects."""
    shape = tuple(int(rng.integers(0, 4)) for _ in range(int(rng.integers(0, 4))))
    numbers = np.round(rng.normal(size=shape), 1)
    choices: list[Callable[[], Any]] = [
        lambda: numbers,
        lambda: numbers.tolist(),
        lambda: numbers * 10.0 ** float(rng.integers(-320, 309)),
        lambda: numbers * np.nan,
        lambda: np.where(rng.random(shape) < 0.3, np.inf, numbers),
        lambda: np.ma.masked_array(numbers, mask=rng.random(shape) < 0.4),
        lambda: numbers + 1j,
        lambda: numbers.astype(str),
        lambda: numbers.astype(object),
        lambda: numbers.astype("timedelta64[s]"),
        lambda: numbers > 0,
        lambda: np.asfortranarray(numbers),
        lambda: numbers.astype(np.float32),
        lambda: numbers.astype(np.int8),
        lambda: numbers[..., ::-1] if shape else numbers,
        lambda: None,
        lambda: True,
        lambda: 0,
        lambda: -1,
        lambda: 1,
        lambda: 2,
        lambda: 10**400,
        lambda: 2**63,
        lambda: float("nan"),
        lambda: float("inf"),
        lambda: -0.0,
        lambda: 5e-324,
        lambda: "text",
        lambda: b"bytes",
        lambda: {},
        lambda: {"a": 1},
        lambda: {0: 1},
        lambda: set(),
        lambda: [],
        lambda: [[]],
        lambda: [[1.0], [1.0, 2.0]],
        lambda: object(),
        lambda: datetime.timedelta(seconds=1),
        lambda: Fraction(1, 3),
        lambda: 1j,
        lambda: BOX,
        lambda: model(),
        lambda: HPolytope.empty(2),
        lambda: HPolytope.whole_space(2),
        lambda: range(3),
        lambda: (1.0, 2.0),
        lambda: np.eye(2),
        lambda: [np.nan, 0.0],
        lambda: [0.5, 0.5],
        lambda: [[1.0, 0.0], [0.0, 1.0]],
        lambda: np.random.default_rng(0),
        lambda: np.matrix(np.eye(2)),
        lambda: [1e308, 1e308],
        lambda: [[1e-320, 1.0], [0.0, 1e300]],
        lambda: lambda s: s,
    ]
    return choices[int(rng.integers(len(choices)))]()


def call(rng: np.random.Generator, folder: Path) -> None:
    """One function of the public face with one such thing."""
    ARRAYS[int(rng.integers(len(ARRAYS)))](nasty(rng))
