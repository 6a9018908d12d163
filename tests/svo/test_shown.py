"""Objects of the public face show themselves: in a line that is never long, and in a notebook with a picture."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from base64 import b64decode
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import cache
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from polytopes import HPolytope
from polytopes.shown import LIMIT, Shown
from svo import (
    ArchitectureI,
    ConstrainedZonotopeObserver,
    Log,
    PolytopeObserver,
    ScheduleTable,
    UncertainModel,
    Uncertainty,
    WindowObserver,
    calibrate,
    detect,
    find_plant,
    prove_chain,
    read_log,
    verify,
)
from svo.interval import GainBounds, IntervalDetector, IntervalPredictor, NoiseCharacterization
from svo.residual_tests import CUSUM, OnlineTest

FACES = (
    "polytopes", "svo", "svo.plant", "svo.faults", "svo.interval", "svo.indices", "svo.residual_tests", "svo.baselines",
    "svo.testing", "svo.models", "svo.isolation", "svo.plant.description", "svo.observers.base",
    "svo.detectors.standard", "svo.detectors.residuals", "svo.detectors.window_bank", "svo.detectors.interval",
    "svo.logs.names",
)  # fmt: skip
CART = UncertainModel(
    [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1,
    uncertainties=[Uncertainty(B=[[0.0], [0.01]])],
)  # fmt: skip
START = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "cart.toml"
KINDS: dict[str, Callable[..., Any]] = {
    "window": WindowObserver,
    "zonotope": ConstrainedZonotopeObserver,
    "polytope": lambda *a: PolytopeObserver(*a, max_facets=16),
}


def classes() -> dict[str, type]:
    """Every class that a face offers, but for errors, protocols and named tuples of numbers."""
    found = {}
    for face in FACES:
        module = import_module(face)
        for name in getattr(module, "__all__", None) or [n for n in vars(module) if not n.startswith("_")]:
            kind = getattr(module, name)
            ours = inspect.isclass(kind) and kind.__module__.split(".")[0] in ("polytopes", "svo")
            if ours and not issubclass(kind, BaseException | tuple) and not getattr(kind, "_is_protocol", False):
                found[f"{kind.__module__}.{kind.__name__}"] = kind
    return found


CLASSES = classes()
FLAT = sorted(
    name
    for name, kind in CLASSES.items()
    if is_dataclass(kind) and not inspect.isabstract(kind) and kind.__repr__ is Shown.__repr__
)
MACHINERY = {
    "polytopes.distance.Distance",  # a float
    "svo.isolation.recorder.Outcome",
    "svo.isolation.recorder.Recorder",
    "svo.testing.plant_runs.PlantRuns",
    "svo.testing.observer_kind.Kind",
}


def faulty(samples: int = 30) -> Log:
    log = CART.simulate([0.0, 0.0], np.ones((samples, 1)), np.random.default_rng(0))
    log.y[samples // 2 :] += 0.8
    return log


def large() -> UncertainModel:
    n = 60
    return UncertainModel(np.eye(n), np.ones((n, 3)), np.eye(n), n=np.ones(n), names={"states": ["x" * 90] * n})


def many() -> ArchitectureI:
    names = [f"a fault with a long name, \x1b[31m number {i}" for i in range(12)]
    return ArchitectureI(WindowObserver(CART, START), {name: WindowObserver(CART, START) for name in names})


def stepped(observer: Any, samples: int) -> list[Any]:
    log = faulty()
    return [observer.update(log.y[0]) if k == 0 else observer.step(u=log.u[k - 1], y=log.y[k]) for k in range(samples)]


LARGE = large()


@cache
def shown() -> dict[str, Any]:
    """Objects that a user sees, small and large, and for those with a picture a mark."""
    plant = find_plant(EXAMPLE)
    found = detect(plant, read_log(EXAMPLE.with_suffix(".csv"), plant))
    bank, walked = many(), many()
    items: dict[str, Any] = {
        "set": START, "interval": HPolytope.box([0.0], [1.0]), "empty set": HPolytope.empty(2),
        "set of many rows": HPolytope.box(np.zeros(50), np.ones(50)), "whole space": HPolytope.whole_space(2),
        "emptiness": HPolytope.empty(3).emptiness(), "nonempty": HPolytope.box([0.0] * 99, [9.0] * 99).emptiness(),
        "support": START.support_points(np.ones((500, 2))), "ball": HPolytope.box([0.0] * 99, [1.0] * 99).chebyshev(),
        "generators": START.generators(), "proof of emptiness": HPolytope.empty(3).emptiness().certificate,
        "model": CART, "large model": LARGE, "model without inputs": CART.replace(B=None, uncertainties=[]),
        "uncertainty": CART.uncertainties, "table": ScheduleTable(np.arange(900.0), np.ones((900, 9, 9))),
        "log": faulty(), "long log": faulty(5000), "empty log": Log(np.zeros(0), np.zeros((0, 1)), np.zeros((0, 1))),
        "bank": many(), "bank record": bank.run(faulty()), "verdict": stepped(walked, 4)[-1], "stepped bank": walked,
        "detection": found, "last verdict": found.verdict, "alarm": found.alarms[0], "verification": verify(found),
        "plant": plant, "columns": plant.columns, "eclipse": find_plant("eclipse"), "elevator": find_plant("elevator"),
        "missile": find_plant("missile"),
        "calibration": calibrate(CART, faulty(12), START),
        "chain": prove_chain(WindowObserver(CART, START), faulty(6)),
        "detector": IntervalDetector(
            IntervalPredictor(GainBounds(0.9, 0.01), (0.0, 0.1)), NoiseCharacterization(np.ones(500)), 0.5
        ),
        "online test": OnlineTest(CUSUM()),
    }  # fmt: skip
    for kind, make in KINDS.items():
        fallen = make(CART, START)
        items |= {
            f"{kind} observer": make(CART, START), f"{kind} observer, stepped": (walk := make(CART, START)),
            f"{kind} step": stepped(walk, 5)[-1], f"{kind} record": make(CART, START).run(faulty()),
            f"{kind} alarm": (alarm := stepped(fallen, 20)[-1]), f"{kind} certificate": alarm.certificate,
            f"{kind} observer, fallen": fallen,
        }  # fmt: skip
    return items


PICTURED = (
    "set", "interval", "proof of emptiness", "model", "log", "verdict", "stepped bank", "detection", "window record",
    "window observer, stepped", *(f"{kind} certificate" for kind in KINDS),
)  # fmt: skip
PICTURED_TOO = (
    "whole space", "set of many rows", "large model", "model without inputs", "long log", "bank record",
    "window observer, fallen", *(f"{kind} {what}" for kind in KINDS for what in ("step", "alarm", "record")),
)  # fmt: skip
LINES_ONLY = ("alarm", "empty log", "empty set", "window observer", "bank")


def test_whatever_a_face_offers_shows_itself() -> None:
    plain = {name for name, kind in CLASSES.items() if not issubclass(kind, Shown)}
    assert plain <= MACHINERY, plain - MACHINERY
    assert len(CLASSES) > 60
    assert set(FLAT) > {"svo.models.uncertainty.Uncertainty", "polytopes.support.Ball", "svo.faults.sensor.SensorFault"}


@pytest.mark.parametrize("name", FLAT)
def test_a_line_is_short_whatever_stands_in_the_fields(name: str) -> None:
    values: list[Any] = [
        np.ones((300, 70)), "long \n" * 900, {f"a name {i}": 1.0 for i in range(500)}, tuple(range(10_000)),
        [[1.0] * 99] * 99, LARGE, np.arange(6.0), lambda schedule: schedule,
    ]  # fmt: skip
    for value in values:
        item = object.__new__(CLASSES[name])
        for field in fields(CLASSES[name]):
            object.__setattr__(item, field.name, value)
        assert len(repr(item)) <= LIMIT < 400
        assert repr(item).startswith(CLASSES[name].__name__)
        assert "\n" not in repr(item)


def test_what_a_user_sees_is_short_and_one_line() -> None:
    for name, item in shown().items():
        assert len(repr(item)) <= LIMIT, name
        assert "\n" not in repr(item), name
        assert "\x1b" not in repr(item), name


@pytest.mark.parametrize(
    "name", [*PICTURED, *LINES_ONLY, *(pytest.param(name, marks=pytest.mark.slow) for name in PICTURED_TOO)]
)
def test_a_notebook_shows_the_line_and_the_picture(name: str) -> None:
    open_before = plt.get_fignums()
    page = shown()[name]._repr_html_()
    assert page.startswith("<pre>")
    assert "<script" not in page
    images = re.findall(r'<img alt="[^"<>]*" width="\d+" src="data:image/png;base64,([^"]*)">', page)
    assert len(images) == (name not in LINES_ONLY)
    for image in images:
        content = b64decode(image)
        assert content.startswith(b"\x89PNG")
        assert len(content) < 400_000
        assert len(np.unique(plt.imread(BytesIO(content)).reshape(-1, 4), axis=0)) > 10  # not blank
    assert plt.get_fignums() == open_before


def test_a_step_that_is_past_has_a_line_and_no_picture() -> None:
    observer = WindowObserver(CART, START)
    first, *_ = stepped(observer, 3)
    assert "<img" not in first._repr_html_()
    assert repr(first) == "<WindowStep at sample 0: consistent>"


def test_names_cannot_leave_the_page() -> None:
    bad = "<script>alert(1)</script>\x1b[2J"
    page = Log(np.arange(3.0), np.zeros((3, 1)), np.zeros((3, 1)), source=bad)._repr_html_()
    assert "<script" not in page
    assert "\x1b" not in page


def test_lines_say_what_there_is() -> None:
    assert repr(CART) == "<UncertainModel of 2 states, 1 input, 1 output, 1 disturbance, 1 uncertainty; Ts = 0.1 s>"
    log = read_log(EXAMPLE.with_suffix(".csv"), find_plant(EXAMPLE))
    assert repr(log) == "<Log of 80 samples, 0 to 7.9 s: 1 input, 1 output, x; from 'cart.csv'>"
    observer = WindowObserver(CART, START)
    assert repr(observer).startswith("<WindowObserver before its first sample: horizon 10, ")
    stepped(observer, 3)
    assert repr(observer).startswith("<WindowObserver at sample 2: horizon 10, ")
    assert repr(Uncertainty(A=np.eye(9), name="mass")) == "Uncertainty(A=array (9, 9), name='mass')"
    assert repr(find_plant(EXAMPLE)).startswith("<DescribedPlant 'cart.toml'")


def test_showing_oneself_loads_no_pyplot() -> None:
    """Only `plot()` without axes makes a figure of pyplot, and importing loads no matplotlib at all."""
    code = (
        "import sys; from svo import *; from polytopes import HPolytope; P = HPolytope.box([0, 0], [1, 1]); repr(P); "
        "assert 'matplotlib' not in sys.modules; P._repr_html_(); print('matplotlib.pyplot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
