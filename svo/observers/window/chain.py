"""The whole proof of an observer's falsification: from its start to the alarm, in exact arithmetic.

What a window proves is conditional on its arrival set and on the bounds of its channels' s. The prover of the model
proves the alarm without the observer's own sets: from the readings alone, the physical range, the initial set, or where
the observer's set started again, the largest set there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from polytopes.shown import Shown
from svo.checks import Array, expect_kind
from svo.logs.drive import drive
from svo.logs.log import Log, expect_log
from svo.models.nonlinear import NonlinearModel
from svo.observers.base import Observer
from svo.observers.polytope.observer import PolytopeObserver
from svo.observers.polytope.prover import HullProver
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.chain_starts import Start, own_start
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.linearised_prover import LinearisedProver
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.observer import WindowObserver
from svo.observers.window.prover import ChainProver, ProvenChain
from svo.observers.window.sign_split import SplitCertificate

Prover = ChainProver | HullProver | LinearisedProver


@dataclass(frozen=True, eq=False)
class ChainCheck(Shown):
    """What `prove_chain` found.

    Attributes
    ----------
    proven : bool
        Whether the falsification was proven, with every bound that its proof rests on.
    falsified_at : int or None
        Sample of the falsification; None if the log ends without one.
    bounds : int
        Bounds of states and channels that the proof takes.
    unproven : tuple of str
        What was not proven: bounds and their samples, or the falsification itself.
    certificate : WindowCertificate, SplitCertificate or None
        Of the proof's last window; None without a proof.
    seconds : float
        Wall time that it took [s].
    given : tuple of str
        What the proof rests on besides the model, its bounds and the log: where it starts, and the physical range.
    """

    proven: bool
    falsified_at: int | None
    bounds: int
    unproven: tuple[str, ...]
    certificate: WindowCertificate | SplitCertificate | None
    seconds: float
    given: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class LateMeasurement(Shown):
    """A measurement that the observer got after its sample.

    Attributes
    ----------
    arrived : int
        Number of the sample right after which it came.
    taken : int
        Number of the sample that it is of, at most ``arrived``.
    y : (ny,) array
        In the outputs' own units; NaN = not these.
    """

    arrived: int
    taken: int
    y: Array


def prover_of(observer: Observer, first: ArrivalSet, log: Log, since: int, begun: Start | None) -> Prover:
    """What proves falsifications of an observer's model, by directions of its own if it has some.

    ``first`` was its set at its first sample, and it ran from ``begun`` on; ``since`` the model is claimed to hold.
    """
    if isinstance(observer.model, NonlinearModel):
        return LinearisedProver(observer.model, log, since, begun)
    template = observer.directions[observer.model.n_states :] if isinstance(observer, WindowObserver) else None
    of = ModelOnLog(observer.model, first, log)
    windows = ChainProver(of, since, begun, template)
    return HullProver(windows, of, observer.max_facets) if isinstance(observer, PolytopeObserver) else windows


def prove_chain(observer: WindowObserver, log: Log, late: Iterable[LateMeasurement] = ()) -> ChainCheck:
    """Run a log through an observer like the given one; prove its falsification from the model and the log alone.

    The proof is none of the observer's own: it begins where the readings nearest to the falsification bound the state,
    else with the physical range or the first set, and every bound that it takes is proven in rationals.

    Parameters
    ----------
    observer : WindowObserver
        Gives the model, the initial set and its options; it is left as it is. The proof keeps convex hulls where they
        do, and splits its last window by signs where they do not.
    log : Log
        With NaN where a measurement came late.
    late : iterable of LateMeasurement
        Those that did, in the order of their arrival.

    Returns
    -------
    ChainCheck

    Raises
    ------
    TypeError
        If the observer is no `WindowObserver`, or its model has jitter. If the log is no `svo.Log`.
    ValueError
        If a late measurement arrived after the log's end, or before it was taken; and as `WindowObserver.step` and
        `WindowObserver.late_update` do.
    """
    expect_kind("observer", observer, WindowObserver, "a WindowObserver, the only kind proven")
    expect_log(log)
    if observer.jitter is not None:
        raise TypeError("the observer has jitter; a proof of its whole chain takes a model with exact stamps")
    begun = perf_counter()
    waiting = list(late)
    for i, measurement in enumerate(waiting):
        if not 0 <= measurement.taken <= measurement.arrived < len(log):
            raise ValueError(
                f"late[{i}] was taken at sample {measurement.taken} and arrived after {measurement.arrived}; expected "
                f"0 <= taken <= arrived <= {len(log) - 1}, the last sample of the log"
            )
    again, at, y = observer.afresh(), None, log.y.copy()
    first = again.first_set
    assert first is not None  # it has not begun
    for k, step in enumerate(drive(again, log)):
        for measurement in waiting:
            if measurement.arrived == k and step.verdict != "falsified":
                step = again.late_update(measurement.y, measurement.taken)
                y[measurement.taken] = np.where(np.isnan(measurement.y), y[measurement.taken], measurement.y)
        if step.verdict == "falsified":
            at = k
            break
    found: ProvenChain | None = None
    prover: Prover | None = None
    if at is not None:
        own = own_start(again.model.start_range, first, again.largest_at)
        prover = prover_of(again, first, replace(log, y=y), 0, own)
        found = prover.prove(at)
    return ChainCheck(
        proven=found is not None,
        falsified_at=at,
        bounds=0 if found is None else found.bounds,
        unproven=() if prover is None or found is not None else prover.unproven,
        certificate=None if found is None else found.certificate,
        seconds=perf_counter() - begun,
        given=() if found is None else found.given,
    )
