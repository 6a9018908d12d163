"""Every observer says why an answer is undecided, and a run says of the first one where it was."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import ArchitectureI, ConstrainedZonotopeObserver, Log, PolytopeObserver, UncertainModel, WindowObserver
from svo.observers.polytope.certificate import PolytopeCertificate
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.zonotope.certificate import ZonotopeCertificate

FIRST = HPolytope.box([-1.0, -1.0], [1.0, 1.0])
PROOFS = (PolytopeCertificate, WindowCertificate, SplitCertificate, ZonotopeCertificate)


def cart() -> UncertainModel:
    return UncertainModel([[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]], w=[0.1], E=[[0.0], [0.1]], n=[0.05])


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (WindowObserver, {}),
        (WindowObserver, {"sign_split": 4}),
        (ConstrainedZonotopeObserver, {}),
        (PolytopeObserver, {}),
    ],
)
def test_data_that_nothing_explains_without_a_proof(
    kind: Any, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    for proof in PROOFS:
        monkeypatch.setattr(proof, "verify", lambda self: False)
    observer = kind(cart(), FIRST, **options)
    observer.update([0.0])
    step = observer.step([0.0], [50.0])
    assert (step.verdict, step.reason) == ("undecided", "no proof")
    assert not np.isnan(step.box).any()
    log = Log(0.1 * np.arange(4), np.zeros((4, 1)), np.array([[0.0], [0.0], [50.0], [50.0]]))
    record = ArchitectureI(kind(cart(), FIRST, **options), {"free": kind(cart(), FIRST, **options)}).run(log)
    assert record.reason == "nominal at sample 2, no proof"


def test_a_deadline_that_is_over_is_the_reason() -> None:
    observer = WindowObserver(cart(), FIRST)
    observer.update([0.0])
    reasons = {(s.verdict, s.reason) for s in (observer.step([0.0], [0.0], deadline=0.0) for _ in range(20))}
    assert ("undecided", "out of time") in reasons
    assert reasons <= {("undecided", "out of time"), ("consistent", None)}
    assert observer.step([0.0], [0.0]).verdict == "consistent"
