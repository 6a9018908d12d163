"""Alarms of constrained-zonotope observers on disk: bit for bit, and nothing that was tampered with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import stored_alarms
from stored_alarms import CART, VARIANTS, X0, biased, same, stored, tampered

from svo import ArchitectureI, ConstrainedZonotopeObserver, UncertainModel, WindowObserver
from svo.detection.bank_alarms import alarms_of
from svo.isolation.alarms import Alarm, read_alarms, verify_alarms
from svo.logs.log import Log


def alarm_of(model: UncertainModel, biased_from: int = 12) -> tuple[Alarm, Log]:
    log = biased(model, biased_from)
    return stored_alarms.alarm_of(ConstrainedZonotopeObserver(model, X0), log), log


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("biased_from", [0, 12])
def test_an_alarm_comes_back_bit_for_bit_and_says_what_it_proves(name: str, biased_from: int, tmp_path: Path) -> None:
    alarm, log = alarm_of(VARIANTS[name], biased_from)
    path = stored(tmp_path, alarm)
    (again,) = read_alarms(path)
    assert same(again.certificate, alarm.certificate)
    (check,) = verify_alarms(path, log)
    assert check.ok
    takes_s = name == "uncertain C" or (name == "uncertain A" and biased_from > 0)
    bounds = " and the bounds of s of its channels" if takes_s else ""
    assert check.reason == f"proven given the arrival set{bounds}, data as in the log"


def test_data_that_differ_from_the_log_are_named(tmp_path: Path) -> None:
    alarm, log = alarm_of(VARIANTS["through"])
    path, k = stored(tmp_path, alarm), alarm.sample
    for sample in (k - 1, k):
        for name in ("y", "u"):
            changed = getattr(log, name).copy()
            changed[sample] += 1e-12
            (check,) = verify_alarms(path, replace(log, **{name: changed}))
            assert (check.ok, check.reason) == (False, f"{name} of sample {sample} differs from the log")


def test_a_broken_proof_proves_nothing(tmp_path: Path) -> None:
    alarm, _ = alarm_of(VARIANTS["uncertain A"])
    c, Z, window = alarm.certificate, alarm.certificate.arrival, alarm.certificate.window
    assert c.verify()
    narrow = replace(window.arrival, upper=window.arrival.upper - 1e-6)
    broken = [
        replace(c, arrival=replace(Z, room=Z.room + 1.0)),
        replace(c, arrival=replace(Z, generators=2.0 * Z.generators)),
        replace(c, arrival=replace(Z, slack=-Z.slack - 1.0)),
        replace(c, arrival=replace(Z, room=np.full(2, -10.0))),
        replace(c, arrival=replace(Z, center=np.full(2, np.nan))),
        replace(c, arrival=replace(Z, center=np.full(3, 0.0))),
        replace(c, arrival=replace(Z, constraints=Z.constraints[:, 1:])),
        replace(c, multipliers=np.append(c.multipliers, 1.0)),
        replace(c, window=replace(window, arrival=narrow)),
        replace(c, window=replace(window, arrival=replace(window.arrival, box_upper=window.arrival.box_lower))),
        replace(c, window=replace(window, samples=window.samples[1:])),
        replace(c, window=replace(window, samples=tuple(replace(s, noise=s.noise + 2.0) for s in window.samples))),
    ]
    checks = verify_alarms(stored(tmp_path, *(replace(alarm, certificate=b) for b in broken)))
    assert [(check.ok, check.reason) for check in checks] == [(False, "the proof does not hold")] * len(broken)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda r: r["certificate"].pop("window"), "incomplete alarm record"),
        (lambda r: r["certificate"]["arrival"].pop("room"), "incomplete alarm record"),
        (lambda r: r["certificate"]["arrival"].update(room={"shape": [2], "hex": "0"}), "incomplete alarm record"),
        (lambda r: r["certificate"]["arrival"].update(room={"shape": [1], "hex": "0"}), "the proof does not hold"),
        (lambda r: r["certificate"].update(multipliers={"shape": [1], "hex": "inf"}), "the proof does not hold"),
        (lambda r: r.update(kind="window"), "incomplete alarm record"),
        (lambda r: r.update(kind="polytope"), "incomplete alarm record"),
    ],
)
def test_a_changed_record_is_rejected_though_its_digest_is_new(
    change: Callable[[dict[str, Any]], None], reason: str, tmp_path: Path
) -> None:
    (check,) = verify_alarms(tampered(stored(tmp_path, alarm_of(CART)[0]), change))
    assert not check.ok
    assert check.reason.startswith(reason)


def test_a_bank_that_contains_it_stores_all_its_alarms(tmp_path: Path) -> None:
    bank = ArchitectureI(
        ConstrainedZonotopeObserver(CART, X0),
        {
            "bias": ConstrainedZonotopeObserver(CART.replace(n=[2.5]), X0),
            "drive": WindowObserver(CART.replace(w=[0.3]), X0),
        },
    )
    log = biased(CART)
    alarms = alarms_of(bank.run(log), log, {"plant": "cart"})
    assert {type(alarm.certificate).__name__ for alarm in alarms} == {"ZonotopeCertificate", "WindowCertificate"}
    assert all(check.ok for check in verify_alarms(stored(tmp_path, *alarms), log))
