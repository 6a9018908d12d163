"""Models and sets at the doors of the analysis, one or a sequence: anything else is one error that names it."""

from __future__ import annotations

from typing import Any

import pytest

from polytopes import HPolytope
from svo import UncertainModel, Uncertainty, WindowObserver, calibrate, design_input, distinguishability

BOX = HPolytope.box([-1.0], [1.0])
MODEL = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=[0.1])
DELTA = Uncertainty(A=[[0.1]])


@pytest.mark.parametrize("given", [3, None, [MODEL], "model", {"a": MODEL}])
def test_what_is_no_model_is_named(given: Any) -> None:
    kind = type(given).__name__
    for call, name in (
        (lambda: distinguishability(given, MODEL, 2, initial=BOX), "plant_model"),
        (lambda: distinguishability(MODEL, given, 2, initial=BOX), "observer_model"),
        (lambda: design_input(given, MODEL, 2, initial=BOX, limits=(-1.0, 1.0)), "plant_model"),
        (lambda: calibrate(given, None, BOX), "model"),  # type: ignore[arg-type]
        (lambda: WindowObserver(given, BOX), "model"),
    ):
        with pytest.raises(TypeError, match=f"^{name} is a {kind}; expected an UncertainModel"):
            call()


@pytest.mark.parametrize("wrap", [lambda v: {0: v}, lambda v: {"a": v}, lambda v: [v, 3], lambda v: [[v]], lambda v: 3])
def test_what_is_no_sequence_of_its_kind_is_named(wrap: Any) -> None:
    for call, name in (
        (lambda: MODEL.replace(uncertainties=wrap(DELTA)), "uncertainties"),
        (lambda: design_input(MODEL, wrap(MODEL), 2, initial=BOX, limits=(-1.0, 1.0)), "observer_models"),
        (
            lambda: design_input(MODEL, MODEL, 2, initial=BOX, limits=(-1.0, 1.0), observer_initial=wrap(BOX)),
            "observer_initial",
        ),
    ):
        with pytest.raises(TypeError, match=rf"^{name}(\[\d\])? is a .*; expected a sequence of "):
            call()
    assert MODEL.replace(uncertainties=iter([DELTA])).uncertainties == (DELTA,)
