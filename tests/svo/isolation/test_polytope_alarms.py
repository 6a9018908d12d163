"""Alarms of polytope observers on disk: rows that follow from model and data, and nothing that was tampered with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stored_alarms
from stored_alarms import CART, VARIANTS, X0, biased, stored, tampered

from polytopes import HPolytope
from svo import ArchitectureI, PolytopeObserver, UncertainModel, WindowObserver
from svo.detection.bank_alarms import alarms_of
from svo.isolation.alarms import Alarm, alarm_line, read_alarms, verify_alarms
from svo.logs.log import Log


def alarm_of(model: UncertainModel) -> tuple[Alarm, Log]:
    log = biased(model)
    return stored_alarms.alarm_of(PolytopeObserver(model, X0, max_facets=24), log), log


@pytest.mark.parametrize("name", VARIANTS)
def test_an_alarm_comes_back_and_says_what_it_proves(name: str, tmp_path: Path) -> None:
    alarm, log = alarm_of(VARIANTS[name])
    path = stored(tmp_path, alarm)
    (again,) = read_alarms(path)
    for P, Q in zip((*alarm.certificate.before, alarm.certificate.measurement),
                    (*again.certificate.before, again.certificate.measurement), strict=True):  # fmt: skip
        assert all(np.array_equal(getattr(P, part), getattr(Q, part)) for part in "AbCd")
    assert again.certificate.multipliers == alarm.certificate.multipliers
    (check,) = verify_alarms(path, log)
    assert check.ok
    extra = ", and the bounds of the uncertain output" if name == "uncertain C" else ""
    assert check.reason == f"proven given the set before the measurement{extra}, data as in the log"
    assert check.seconds < 1.0


def test_data_that_differ_from_the_log_are_named(tmp_path: Path) -> None:
    alarm, log = alarm_of(VARIANTS["through"])
    path, k = stored(tmp_path, alarm), alarm.sample
    moved = log.y.copy()
    moved[k] += 1e-12
    (check,) = verify_alarms(path, replace(log, y=moved))
    assert (check.ok, check.reason) == (False, f"y of sample {k} differs from the log")
    driven = log.u.copy()
    driven[k] += 1e-12
    (check,) = verify_alarms(path, replace(log, u=driven))
    assert check.reason == f"u of sample {k} differs from the log"


@pytest.mark.parametrize(
    ("name", "what"),
    [*((name, what) for name in ("plain", "shared w", "uncertain A") for what in ("y", "noise", "stack")),
     *(("through", what) for what in ("y", "u", "noise", "stack"))],
)  # fmt: skip
def test_rows_that_do_not_follow_from_model_and_data_prove_nothing(name: str, what: str) -> None:
    # Data that would make the measurement's rows weaker than those stored: a higher reading, more noise, other C or D.
    alarm, _ = alarm_of(VARIANTS[name])
    array = getattr(alarm.certificate.data, what).copy()
    array[(0, 2, 0) if what == "stack" else 0] += 0.01
    data = replace(alarm.certificate.data, **{what: array})
    assert not replace(alarm.certificate, data=data).verify()


def test_rows_tighter_than_the_measurement_prove_nothing() -> None:
    alarm, _ = alarm_of(CART)
    rows = alarm.certificate.measurement
    wider = replace(alarm.certificate, measurement=HPolytope(rows.A, rows.b + 1e-9))
    assert wider.verify()
    assert not replace(alarm.certificate, measurement=HPolytope(rows.A, rows.b - 1e-6)).verify()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda r: r["certificate"]["multipliers"]["inequality"].clear(), "the proof does not hold"),
        (lambda r: r["certificate"].pop("data"), "incomplete alarm record"),
        (lambda r: r["certificate"].update(before=[]), ""),
        (lambda r: r["certificate"]["data"].update(y={"shape": [0], "hex": ""}), "the proof does not hold"),
        (lambda r: r["certificate"]["data"].update(y={"shape": [1], "hex": "inf"}), "the proof does not hold"),
        (lambda r: r["certificate"]["data"]["y"].update(shape=[1, 1]), "the proof does not hold"),
        (lambda r: r["certificate"]["data"]["y"].update(shape=[]), "the proof does not hold"),
        (lambda r: r["certificate"]["measurement"]["b"].update(hex="nan nan"), "incomplete alarm record"),
        (lambda r: r.update(kind="rumour"), "no certificate of a known kind; known are window, "),
        (lambda r: r.update(kind="window"), "incomplete alarm record"),
    ],
)
def test_a_changed_record_is_rejected_though_its_digest_is_new(change: Any, reason: str, tmp_path: Path) -> None:
    alarm, _ = alarm_of(CART)
    (check,) = verify_alarms(tampered(stored(tmp_path, alarm), change))
    assert not check.ok
    assert reason in check.reason


def test_a_bank_with_both_kinds_of_observers_stores_all_its_alarms(tmp_path: Path) -> None:
    noisy = CART.replace(n=[2.5])
    bank = ArchitectureI(
        PolytopeObserver(CART, X0, max_facets=24),
        {"bias": PolytopeObserver(noisy, X0, max_facets=24), "drive": WindowObserver(CART.replace(w=[0.3]), X0)},
    )
    log = biased(CART)
    alarms = alarms_of(bank.run(log), log, {"plant": "cart"})
    assert {type(alarm.certificate).__name__ for alarm in alarms} == {"PolytopeCertificate", "WindowCertificate"}
    assert all(check.ok for check in verify_alarms(stored(tmp_path, *alarms), log))


def test_what_proves_nothing_of_the_model_is_not_stored() -> None:
    log = biased(CART)
    with pytest.warns(UserWarning, match="can exclude the true state"):
        observer = PolytopeObserver(CART, X0, max_facets=24, as_published=True)
    record = observer.run(log)
    with pytest.raises(TypeError, match="PublishedCertificate, which no alarm can store"):
        alarm_line(Alarm("cart", 12, 1.2, record.certificate, {}))
