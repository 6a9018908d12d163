"""Alarms of constrained-zonotope observers on disk: bit for bit, and nothing that was tampered with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, UncertainModel, Uncertainty, WindowObserver
from svo.detection.detect import alarms_of
from svo.isolation.alarms import Alarm, read_alarms, verify_alarms, write_alarms
from svo.logs.log import Log

CART = UncertainModel(
    [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], E=[[0.0], [0.1]], w=[0.2], n=[0.05], Ts=0.1
)
VARIANTS = {
    "plain": CART,
    "shared w": CART.replace(F=[[0.1]]),
    "through": CART.replace(D=[[0.3]], c=[0.2]),
    "uncertain A": CART.replace(uncertainties=[Uncertainty(A=[[0.0, 0.0], [0.05, 0.0]])]),
    "uncertain C": CART.replace(uncertainties=[Uncertainty(C=[[0.1, 0.0]])]),
}
X0 = HPolytope.box([-0.1, -0.1], [0.1, 0.1])


def alarm_of(model: UncertainModel, biased_from: int = 12) -> tuple[Alarm, Log]:
    log = model.simulate([0.0, 0.0], np.ones((20, 1)), np.random.default_rng(0))
    log.y[biased_from:] += 2.0
    record = ConstrainedZonotopeObserver(model, X0).run(log)
    k = record.verdicts.index("falsified")
    return Alarm("cart", k, float(log.time[k]), record.certificate, {"plant": "cart"}), log


def stored(path: Path, *alarms: Alarm) -> Path:
    write_alarms(path, alarms)
    return path


def same(a: Any, b: Any) -> bool:
    """Equal in every bit."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return bool(a == b)


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("biased_from", [0, 12])
def test_an_alarm_comes_back_bit_for_bit_and_says_what_it_proves(name: str, biased_from: int, tmp_path: Path) -> None:
    alarm, log = alarm_of(VARIANTS[name], biased_from)
    path = stored(tmp_path / "alarms.jsonl", alarm)
    (again,) = read_alarms(path)
    assert same(again.certificate, alarm.certificate)
    (check,) = verify_alarms(path, log)
    assert check.ok
    assert check.reason == "proven given the arrival set, data as in the log"


def test_data_that_differ_from_the_log_are_named(tmp_path: Path) -> None:
    alarm, log = alarm_of(VARIANTS["through"])
    path, k = stored(tmp_path / "alarms.jsonl", alarm), alarm.sample
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
    checks = verify_alarms(stored(tmp_path / "alarms.jsonl", *(replace(alarm, certificate=b) for b in broken)))
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
    path = stored(tmp_path / "alarms.jsonl", alarm_of(CART)[0])
    record = json.loads(path.read_text())
    del record["sha256"]
    change(record)
    digest = hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
    path.write_text(json.dumps(record | {"sha256": digest}) + "\n")
    (check,) = verify_alarms(path)
    assert not check.ok
    assert check.reason.startswith(reason)


def test_any_changed_number_fails_the_digest(tmp_path: Path) -> None:
    path = stored(tmp_path / "alarms.jsonl", alarm_of(CART)[0])
    text = path.read_text()
    place = text.index("0x1.") + 5
    path.write_text(text[:place] + ("7" if text[place] != "7" else "8") + text[place + 1 :])
    (check,) = verify_alarms(path)
    assert "SHA-256 does not match" in check.reason


def test_a_bank_that_contains_it_stores_all_its_alarms(tmp_path: Path) -> None:
    bank = ArchitectureI(
        ConstrainedZonotopeObserver(CART, X0),
        {
            "bias": ConstrainedZonotopeObserver(CART.replace(n=[2.5]), X0),
            "drive": WindowObserver(CART.replace(w=[0.3]), X0),
        },
    )
    log = CART.simulate([0.0, 0.0], np.ones((20, 1)), np.random.default_rng(0))
    log.y[12:] += 2.0
    alarms = alarms_of(bank.run(log), log, {"plant": "cart"})
    assert {type(alarm.certificate).__name__ for alarm in alarms} == {"ZonotopeCertificate", "WindowCertificate"}
    assert all(check.ok for check in verify_alarms(stored(tmp_path / "alarms.jsonl", *alarms), log))
