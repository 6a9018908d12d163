"""An alarm belongs to the model of its plant: forged records are found once the plant is at hand."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, PolytopeObserver, WindowObserver
from svo.cli import app
from svo.detection.bank_alarms import alarms_of
from svo.detection.chains import PlantModels, verify_chains
from svo.detection.detect import detect
from svo.isolation.alarms import Alarm, AlarmCheck, read_alarms, verify_alarms, write_alarms
from svo.logs.file import read_log
from svo.logs.log import Log
from svo.plant.description import read_description
from tests.svo.studies.isolation.registered.tank_plant import Tank

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
LOG = CART.with_suffix(".csv")


@pytest.fixture(scope="module")
def cart() -> tuple[Any, Log, tuple[Alarm, ...]]:
    plant = read_description(CART)
    log = read_log(LOG, plant.columns, plant.Ts)
    return plant, log, detect(plant, log, "stated").alarms


def checked(tmp_path: Path, plant: Any, log: Log, *alarms: Alarm) -> list[AlarmCheck]:
    path = tmp_path / "alarms.jsonl"
    write_alarms(path, alarms)
    return verify_alarms(path, log, PlantModels(plant, log).difference)


def test_alarms_are_of_the_plants_models(tmp_path: Path, cart: tuple[Any, Log, tuple[Alarm, ...]]) -> None:
    plant, log, alarms = cart
    checks = checked(tmp_path, plant, log, *alarms)
    assert checks
    assert all(c.ok and c.reason.endswith("data as in the log, model as the plant's") for c in checks)
    (first, *_) = verify_alarms(tmp_path / "alarms.jsonl")
    assert first.reason == "proven given the arrival set and that its model is the plant's"


def in_samples(**changes: Callable[[np.ndarray], np.ndarray]) -> Callable[[Alarm], Alarm]:
    def forge(alarm: Alarm) -> Alarm:
        samples = tuple(
            replace(s, **{name: change(getattr(s, name)) for name, change in changes.items()})
            for s in alarm.certificate.samples
        )
        return replace(alarm, certificate=replace(alarm.certificate, samples=samples))

    return forge


def without_outputs(stack: np.ndarray) -> np.ndarray:
    """C = 0: no state explains a reading that is not zero."""
    changed = stack.copy()
    changed[:, 2:] = 0.0
    return changed


FORGED = {
    "noise bound": in_samples(noise=lambda n: 0.0 * n),
    "matrices": in_samples(stack=without_outputs),
    "disturbance bound": in_samples(w_lower=lambda w: 0.5 * w, w_upper=lambda w: 0.5 * w),
    "digest": lambda alarm: replace(alarm, model="0" * 64),
}


@pytest.mark.parametrize("what", FORGED)
def test_a_forged_model_is_found(tmp_path: Path, cart: tuple[Any, Log, tuple[Alarm, ...]], what: str) -> None:
    plant, log, alarms = cart
    forged = FORGED[what](alarms[0])
    for alarm in (forged, replace(forged, model=None)):
        check, *_ = checked(tmp_path, plant, log, alarm)
        if what == "digest" and alarm.model is None:
            assert check.ok
            assert check.reason.endswith("model not compared beyond matrices and bounds")
        else:
            assert not check.ok
            assert what in check.reason or check.reason == "the proof does not hold"
        full, *_ = verify_chains(tmp_path / "alarms.jsonl", log, plant)
        assert full.ok is check.ok


def test_an_alarm_of_another_observer_is_found(tmp_path: Path, cart: tuple[Any, Log, tuple[Alarm, ...]]) -> None:
    plant, log, alarms = cart
    renamed = [replace(alarms[0], observer=name) for name in ("sensor", "no such model")]
    checks = checked(tmp_path, plant, log, *renamed)
    assert not any(c.ok for c in checks)
    assert checks[1].reason == "the plant's bank has no model 'no such model'"


@pytest.mark.parametrize("kind", [WindowObserver, ConstrainedZonotopeObserver, PolytopeObserver])
def test_every_kind_of_observer_is_compared(tmp_path: Path, kind: Any) -> None:
    class Watched(Tank):
        def bank(self, noise: str) -> Any:
            made = super().bank(noise)
            start = HPolytope.box([0.0], [3.0])
            observers = {name: kind(observer.model, start) for name, observer in made.observers.items()}
            return ArchitectureI(observers.pop("nominal"), observers)

    plant = Watched()
    log = plant.simulate("gauge", "step", "calm", 1)
    bank = plant.bank("calm")
    alarms = alarms_of(bank.run(log), log, {"noise": "calm"}, bank.observers)
    assert alarms
    assert all(check.ok for check in checked(tmp_path, plant, log, *alarms))
    # the same records said to be of the other noise set, whose bounds are wider
    wrong = checked(tmp_path, plant, log, *(replace(a, source={"noise": "rough"}) for a in alarms))
    assert not any(check.ok for check in wrong)


def test_the_digest_tells_options_and_sampling_time_apart(cart: tuple[Any, Log, tuple[Alarm, ...]]) -> None:
    from svo.detection.bank_alarms import digest_of_alarm

    plant, _, alarms = cart
    model = plant.bank("stated").observers["nominal"].model
    start = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
    certificate = alarms[0].certificate
    observers = [
        WindowObserver(model, start),
        WindowObserver(model, start, horizon=9),
        WindowObserver(model, start, eps=1e-8),
        WindowObserver(model, start, template=[[1.0, 1.0]]),
        WindowObserver(model, start, sign_split=2),
        WindowObserver(model.replace(Ts=0.2), start),
        ConstrainedZonotopeObserver(model, start),
    ]
    digests = {digest_of_alarm(observer, certificate) for observer in observers}
    assert len(digests) == len(observers)
    again = WindowObserver(read_description(CART).bank("stated").observers["nominal"].model, start)
    assert digest_of_alarm(again, certificate) in digests


def with_digest(record: dict[str, Any]) -> str:
    content = {key: value for key, value in record.items() if key != "sha256"}
    return json.dumps(content | {"sha256": hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sample", 50.7), ("sample", "50"), ("sample", True), ("sample", -1), ("sample", 10**4000), ("sample", None),
        ("time", ""), ("time", "50"), ("time", 5.0), ("observer", 5), ("source", {"a": []}), ("model", 7),
        ("extra", 1), ("certificate.owner", [1.5]), ("certificate.owner", ["1"]), ("certificate.late", 0),
        ("certificate.first", 2.0), ("certificate.samples.0.y", {"shape": [1], "hex": ""}),
        ("certificate.samples.0.y", {"shape": [1.0], "hex": "0"}),
        ("certificate.samples.0.y", {"shape": [1], "hex": "7"}),
        ("certificate.samples.0.y", {"shape": [1], "hex": "0", "more": 1}),
        ("certificate.samples.0.y", {"shape": [2**50], "hex": "0"}),
    ],
)  # fmt: skip
def test_records_are_read_strictly(
    tmp_path: Path, cart: tuple[Any, Log, tuple[Alarm, ...]], name: str, value: Any
) -> None:
    path = tmp_path / "alarms.jsonl"
    write_alarms(path, cart[2][:1])
    record = json.loads(path.read_text())
    parent: Any = record
    *way, last = name.split(".")
    for key in way:
        parent = parent[int(key) if isinstance(parent, list) else key]
    parent[last] = value
    path.write_text(with_digest(record))
    (check,) = verify_alarms(path)
    assert not check.ok
    assert len(check.reason) < 200
    with pytest.raises(ValueError, match="line 1: incomplete alarm record"):
        read_alarms(path)


def test_the_command_compares_the_model(tmp_path: Path) -> None:
    run = CliRunner()
    assert run.invoke(app, ["detect", str(CART), str(LOG), "--out", str(tmp_path / "out")]).exit_code == 0
    path = tmp_path / "out" / "alarms.jsonl"
    assert run.invoke(app, ["verify", str(path), "--log", str(LOG)]).exit_code == 0
    alarms = read_alarms(path)
    write_alarms(path, [FORGED["noise bound"](alarm) for alarm in alarms])
    assert run.invoke(app, ["verify", str(path)]).exit_code == 0  # it stands on its own record, and says so
    for option in ("--log", "--full"):
        found = run.invoke(app, ["verify", str(path), option, str(LOG)])
        assert found.exit_code == 1
        assert "noise bound" in found.output
