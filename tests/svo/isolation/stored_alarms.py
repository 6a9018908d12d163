"""Alarms of a cart with a biased sensor, as the three kinds of observers store them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from polytopes import HPolytope
from svo.isolation.alarms import Alarm, write_alarms
from svo.logs.log import Log
from svo.models.model import UncertainModel, Uncertainty

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


def biased(model: UncertainModel, biased_from: int = 12) -> Log:
    """A run whose position sensor is wrong by 2 from a sample on."""
    log = model.simulate([0.0, 0.0], np.ones((20, 1)), np.random.default_rng(0))
    log.y[biased_from:] += 2.0
    return log


def alarm_of(observer: Any, log: Log) -> Alarm:
    """That of a fresh observer over a log."""
    record = observer.run(log)
    k = record.verdicts.index("falsified")
    return Alarm("cart", k, float(log.time[k]), record.certificate, {"plant": "cart"})


def stored(folder: Path, *alarms: Alarm) -> Path:
    path = folder / "alarms.jsonl"
    write_alarms(path, alarms)
    return path


def with_digest(record: dict[str, Any]) -> str:
    """A line of a record that may have been changed, with a digest that fits."""
    content = {key: value for key, value in record.items() if key != "sha256"}
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    return json.dumps(content | {"sha256": digest}) + "\n"


def tampered(path: Path, change: Callable[[dict[str, Any]], Any]) -> Path:
    """Change the only record of a file and give it a new digest."""
    record = json.loads(path.read_text())
    change(record)
    path.write_text(with_digest(record))
    return path


def same(a: Any, b: Any) -> bool:
    """Equal in type and in every bit."""
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    return type(a) is type(b) and a == b
