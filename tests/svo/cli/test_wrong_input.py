"""What users hand to the Python face by mistake: one error each, and never a result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import Log, UncertainModel, WindowObserver, calibrate, prove_chain
from svo.detection.detect import detect
from svo.detection.log_calibration import calibrate_log
from svo.faults import ActuatorFault, PlantFault, SensorFault, Step
from svo.logs.file import read_log
from svo.models.uncertainty import Uncertainty
from svo.plant.description import DescribedPlant, read_description

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples"
CART = read_description(EXAMPLES / "cart.toml")
LOG = read_log(EXAMPLES / "cart.csv", CART.columns, CART.Ts)


@pytest.mark.parametrize("run", [detect, lambda plant, log, noise: calibrate_log(plant, log, noise)])
@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (lambda: replace(LOG, time=LOG.time * 1000.0), "log, sample 1: time goes .*seems to be in milliseconds"),
        (lambda: replace(LOG, time=LOG.time * 2.0), "log, sample 1: .*expected the model's sampling time 0.1 s"),
        (lambda: replace(LOG, y=np.hstack([LOG.y, LOG.y])), "y of the log has 2 channels; expected 1"),
        (lambda: replace(LOG, u=LOG.u[:, :0]), "u of the log has 0 channels; expected 1"),
        (lambda: Log(LOG.time[:0], LOG.u[:0], LOG.y[:0]), "log has no samples"),
        (lambda: LOG.to_dataframe(CART.columns), "log is a DataFrame; expected an svo.Log"),
        (lambda: "cart.csv", "log is a str; expected an svo.Log, such as svo.read_log gives"),
    ],
)
def test_a_log_that_is_none_of_the_plant_is_refused(
    run: Callable[[DescribedPlant, Any, str], Any], wrong: Callable[[], Any], expected: str
) -> None:
    with pytest.raises((ValueError, TypeError), match=expected):
        run(CART, wrong(), "stated")


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"y": LOG.y + 1j}, "y has dtype complex128; expected real numbers"),
        ({"y": LOG.y.astype(str)}, "y has dtype <U.*; expected real numbers"),
        ({"u": None}, "u is a NoneType; expected real numbers"),
        ({"y": LOG.y[:, 0]}, r"y has shape \(80,\); expected \(80, channels\)"),
    ],
)
def test_what_are_no_measurements_make_no_log(change: dict[str, Any], expected: str) -> None:
    with pytest.raises((ValueError, TypeError), match=expected):
        replace(LOG, **change)


@pytest.mark.parametrize(
    ("make", "expected"),
    [
        (lambda: SensorFault(0, "bias", "big", Step(1.0)), "magnitude of the bias is big; expected a finite number"),  # type: ignore[arg-type]
        (lambda: SensorFault(0, "bias", 0.1, 1.0), r"profile is a float; expected a Profile, such as Step\(1.0\)"),  # type: ignore[arg-type]
        (lambda: ActuatorFault(0, "loss", "half", Step(1.0)), "magnitude is half; loss needs a finite number"),  # type: ignore[arg-type]
        (lambda: ActuatorFault(0, "loss", 0.5, None), "profile is a NoneType"),  # type: ignore[arg-type]
        (lambda: PlantFault(Uncertainty(A=[[1.0]]), 1j, Step(1.0)), "magnitude is 1j; expected a finite number"),  # type: ignore[arg-type]
        (lambda: PlantFault(Uncertainty(A=[[1.0]]), 1.0, "step"), "profile is a str"),  # type: ignore[arg-type]
    ],
)
def test_a_fault_of_wrong_types_is_named(make: Callable[[], Any], expected: str) -> None:
    with pytest.raises((ValueError, TypeError), match=expected):
        make()


def test_readings_and_commands_have_a_row_a_time() -> None:
    bias, loss = SensorFault(0, "bias", 0.1, Step(1.0)), ActuatorFault(0, "loss", 0.5, Step(1.0))
    with pytest.raises(ValueError, match=r"y has shape \(80,\); expected \(80, channels\) for t of shape \(80,\)"):
        bias.corrupt(LOG.time, LOG.y[:, 0])
    with pytest.raises(ValueError, match=r"u has shape \(80, 1\); expected \(5, channels\)"):
        loss.corrupt(LOG.time[:5], LOG.u)
    with pytest.raises(ValueError, match=r"y has shape \(80, 1\); expected \(channels,\)"):
        bias.corrupt(2.0, LOG.y)


def test_a_simulation_needs_numbers() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="u contains NaN at"):
        CART.model.simulate([0.0, 0.0], np.full((3, 1), np.nan), rng)
    with pytest.raises(ValueError, match="x0 contains an infinity at"):
        CART.model.simulate([np.inf, 0.0], np.ones((3, 1)), rng)


def test_an_input_that_is_not_finite_is_said_to_be_so() -> None:
    from svo import ConstrainedZonotopeObserver, PolytopeObserver

    model, start = UncertainModel([[0.9]], [[1.0]], [[1.0]], n=0.1), HPolytope.box([-1.0], [1.0])
    for kind in (WindowObserver, PolytopeObserver, ConstrainedZonotopeObserver):
        with pytest.raises(ValueError, match=r"u is \[ *nan\]; expected finite numbers"):
            kind(model, start).step([np.nan], [0.0])


def test_a_frame_is_no_log() -> None:
    start = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
    frame: Any = LOG.to_dataframe(CART.columns)
    for run in (
        lambda: calibrate(CART.model, frame, start),
        lambda: prove_chain(WindowObserver(CART.model, start), frame),
    ):
        with pytest.raises(TypeError, match=r"log is a DataFrame; expected an svo\.Log"):
            run()


def test_a_name_is_no_plant_and_a_text_no_sampling_time() -> None:
    with pytest.raises(TypeError, match=r"plant is 'cart.toml'; .* svo.find_plant\('cart.toml'\)"):
        detect("cart.toml", LOG, "stated")  # type: ignore[arg-type]
    for wrong in ("10 ms", 0.0, float("nan")):
        with pytest.raises(ValueError, match=r"Ts is .*; expected a positive sampling time in seconds"):
            read_log(EXAMPLES / "cart.csv", CART.columns, wrong)  # type: ignore[arg-type]


def test_findings_go_to_a_folder_named_by_text(tmp_path: Path) -> None:
    detect(CART, LOG).save(str(tmp_path / "found"))
    assert (tmp_path / "found" / "alarms.jsonl").exists()
