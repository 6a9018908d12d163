"""Proofs of alarms from the models of their plant and the log alone (``svo verify --full``)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from time import perf_counter

import numpy as np

from svo.detection.bank_alarms import bank_of_source, digest_of_alarm, kind_of_model, promises_of
from svo.detection.proof_file import Chain
from svo.isolation import Alarm, AlarmCheck, ArchitectureII, Bank, read_alarms, verify_alarms
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models import ModelSample, UncertainModel
from svo.models.intervals import interval_of
from svo.models.nonlinear import NonlinearModel
from svo.observers.base import Observer
from svo.observers.certificate import Certificate
from svo.observers.window.certificate import OnWindow, WindowCertificate
from svo.observers.window.chain import prover_of
from svo.observers.window.chain_starts import Start, own_start
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.prover import ProvenChain
from svo.observers.window.setup import rows_on_w
from svo.plant import BankChoice, MonitoredPlant, with_bank
from svo.plant.dialects import on_log
from svo.plant.scheduling import scheduled


def _window_of(alarm: Alarm) -> WindowCertificate | None:
    """The proof on a window that an alarm's is, or is about; None where it is of another kind."""
    proof = alarm.certificate.about() if isinstance(alarm.certificate, OnWindow) else alarm.certificate
    return proof if isinstance(proof, WindowCertificate) else None


def _unknowns(alarm: Alarm, model: UncertainModel) -> str | None:
    """How the bounds of the unknowns in a window's proof are not those of a model: of Delta, and rows on w."""
    proof = _window_of(alarm)
    if proof is None:
        return None
    known = np.array([model.uncertainties[item - 1].bounds for item in proof.owner]).reshape(-1, 2)
    stated = (proof.w_rows, proof.w_rows_lower, proof.w_rows_upper)
    if not np.array_equal(proof.delta, known):
        what = "bounds of Delta are"
    elif not all(np.array_equal(mine, its) for mine, its in zip(stated, rows_on_w(model), strict=True)):
        what = "rows on w are"
    elif proof.sums is not None:
        what = "bounds of sums are"
    else:
        return None
    return f"the {what} not those of the plant's model {alarm.observer!r}"


def _kind(alarm: Alarm, observer: Observer) -> str | None:
    """How an alarm's source names another kind of model than the plant's, whose check leaves other things out."""
    kind, stated = kind_of_model(observer), alarm.source.get("model")
    if stated == kind:
        return None
    return f"source says 'model': {stated!r:.80}; expected {kind!r} of the plant's model {alarm.observer!r}"


def _around_linearisations(alarm: Alarm, model: NonlinearModel) -> str | None:
    """How what no linearisation chooses is not the model's: sizes, bounds of w, rows, and the least noise."""
    proof, carrier = _window_of(alarm), model.carrier
    if proof is None:
        return f"the proof is none of a nonlinear model, as {alarm.observer!r} of the plant is"
    (lower, upper, _), shape = carrier.bounds(carrier.schedule), carrier.stack(carrier.schedule).shape
    data = proof.model_data()
    for k, (mine, y) in enumerate(zip(data, (s.y for s in proof.samples), strict=True), alarm.sample + 1 - len(data)):
        what: str | None = "shape of the matrices"
        if mine.stack.shape == shape:
            noise = np.where(np.isnan(y), mine.noise, np.maximum(mine.noise, model.noise))
            what = mine.difference(ModelSample(mine.stack, noise, (lower, upper)))
        if what is not None:
            return f"the {what} of sample {k} differs from that of the plant's model {alarm.observer!r}"
    return _unknowns(alarm, carrier)


def _promises(alarm: Alarm, observer: Observer) -> str | None:
    """How the promises that an alarm rests on are not those of the plant's model; older records state none."""
    right = promises_of(observer)
    for name, stated in alarm.premises.items():
        if name not in right or not all(np.array_equal(a, b) for a, b in zip(stated, right[name], strict=True)):
            return f"the {name} range is not that of the plant's model {alarm.observer!r}"
    return None


class PlantModels:
    """Compares the models of alarms with those of the plant's banks, at the scheduling values of a log.

    Parameters
    ----------
    plant : MonitoredPlant
    log : Log
        Only time, u and y are used; the plant's own scheduler makes the schedule of them.
    """

    def __init__(self, plant: MonitoredPlant, log: Log) -> None:
        self._plant, self._log = plant, log
        self._chosen: dict[BankChoice, tuple[MonitoredPlant, Log]] = {}

    def bank(self, alarm: Alarm) -> Bank:
        """A fresh bank of the choice and noise set that an alarm names."""
        plant, log = self._of(alarm)
        return on_log(plant, log).bank(str(alarm.source.get("noise")))

    def log(self, alarm: Alarm) -> Log:
        """The log with the schedule of the bank that an alarm names."""
        return self._of(alarm)[1]

    def _of(self, alarm: Alarm) -> tuple[MonitoredPlant, Log]:
        choice = bank_of_source(alarm.source)
        if choice not in self._chosen:
            plant = with_bank(self._plant, choice)
            self._chosen[choice] = plant, scheduled(plant.scheduler(), self._log)
        return self._chosen[choice]

    def difference(self, alarm: Alarm) -> str | None:
        """How an alarm's matrices, bounds and digest are not those of the plant's observer that it names, or None."""
        observer = self.bank(alarm).observers.get(alarm.observer)
        if observer is None:
            return f"the plant's bank has no model {alarm.observer!r:.80}"
        different = _kind(alarm, observer)
        if different is None and isinstance(observer.model, NonlinearModel):
            different = _around_linearisations(alarm, observer.model)
        elif different is None:
            different = self._matrices(alarm, observer) or _unknowns(alarm, observer.model)
        different = different or _promises(alarm, observer)
        if different is not None:
            return different
        if alarm.model is not None and alarm.model != digest_of_alarm(observer, alarm.certificate):
            return f"the digest is not that of the plant's observer {alarm.observer!r}: it has other options or bounds"
        return None

    def _matrices(self, alarm: Alarm, observer: Observer) -> str | None:
        """How an alarm's matrices differ; where they do not, only sizes, sampling time and options can."""
        claimed = alarm.certificate.model_data()
        first = alarm.sample + 1 - len(claimed)
        log = self.log(alarm)
        right = [_sample(observer, log, k, alarm.sample) for k in range(first, first + len(claimed))]
        for k, (mine, its) in enumerate(zip(claimed, right, strict=True), start=first):
            what = mine.difference(_widened(its, mine, observer))
            if what is not None:
                return f"the {what} of sample {k} differs from that of the plant's model {alarm.observer!r}"
        return None


def _widened(its: ModelSample, mine: ModelSample, observer: Observer) -> ModelSample:
    """Numbers of the plant's model as they are where stamps may be off: by how much is not made again."""
    stamps = None if observer.model.origin is None else observer.model.origin.stamps
    if stamps is None:
        return its
    noise = np.where(stamps.is_off, np.maximum(its.noise, mine.noise), its.noise)
    return replace(its, stack=stamps.applied(its.stack, stamps.shift), noise=noise)


def _sample(observer: Observer, log: Log, k: int, last: int) -> ModelSample:
    """Matrices and bounds at sample k, with the transition to the next one, where a proof goes on to it."""
    dt = log.interval_at(k + 1) if k < last else None
    return ModelSample.of(observer.model, log.schedule_at(k), interval_of(observer.model, dt))


def verify_chains(path: str | Path, log: Log, plant: MonitoredPlant) -> list[AlarmCheck]:
    """Check every stored alarm and, if it holds, prove it from the plant's model and the log alone.

    The model is that of the plant's bank for the noise set and architecture that the alarm names, and must be the
    alarm's. Of an observer that starts during the run, as those of class II do, the model is claimed to hold from
    there on, and the set that it starts from is used where the readings do not do: as given.
    Bounds are proven over convex hulls, and of polytope observers at the vertices of Delta; an alarm may be split by
    the signs of s.

    Parameters
    ----------
    path : path
        JSON Lines, as `svo.isolation.alarms.write_alarms` writes them; all alarms of one run.
    log : Log
        Only time, u and y are used; the plant's own scheduler makes the schedule from y.
    plant : MonitoredPlant
    """
    models = PlantModels(plant, log)
    checks = verify_alarms(path, log, models.difference)
    return with_chains(checks, read_alarms(path), models) if all(check.ok for check in checks) else checks


def with_chains(
    checks: Sequence[AlarmCheck],
    alarms: Sequence[Alarm],
    models: PlantModels,
    keep: Callable[[Chain], object] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[AlarmCheck]:
    """Checks of alarms that hold, each with what its proof from the model and the log is.

    What holds is given to ``keep``, step by step; ``progress`` is told how many alarms of how many are done.
    """
    found = []
    for done, (check, alarm) in enumerate(zip(checks, alarms, strict=True), start=1):
        found.append(_with_chain(check, alarm, models, keep))
        if progress is not None:
            progress(done, len(checks))
    return found


def _with_chain(
    check: AlarmCheck, alarm: Alarm, models: PlantModels, keep: Callable[[Chain], object] | None
) -> AlarmCheck:
    begun = perf_counter()
    found, reason = _prove(models, alarm)
    if found is not None and keep is not None:
        keep(Chain(alarm, found.steps))
    return replace(check, ok=found is not None, reason=reason, seconds=check.seconds + perf_counter() - begun)


def _prove(models: PlantModels, alarm: Alarm) -> tuple[ProvenChain | None, str]:
    """The proof of an alarm, and in words what it is or why there is none."""
    bank, log = models.bank(alarm), models.log(alarm)
    observer = bank.observers[alarm.observer]
    first = observer.first_set
    if first is None:
        return None, f"the observer {alarm.observer!r} ({type(observer).__name__}) does not say its first_set"
    if observer.jitter is not None:
        return None, "bounds of a model with jitter are not proven; verify without --full"
    begun = _beginning(bank, alarm, log, first)
    if begun is None:
        where = f"at sample {alarm.sample}"
        return None, f"run again over the log, the plant's bank does not ask its observer {alarm.observer!r} {where}"
    prover = prover_of(observer, first, log, *begun)
    found = prover.prove(alarm.sample)
    if found is None:
        return None, prover.reason
    over = f", over {found.bounds} bounds" if found.bounds else ""
    given = f", given {' and '.join(found.given)}" if found.given else ""
    return found, f"proven {found.start.begins}{over}{given}"


def _beginning(bank: Bank, alarm: Alarm, log: Log, first: ArrivalSet) -> tuple[int, Start | None] | None:
    """The sample from which on the alarm's model is claimed to hold, and what set its observer had; None = never.

    Only where the observer may have begun later than at the first sample, the bank is run over the log again.
    """
    observer, proof = bank.observers[alarm.observer], _window_of(alarm)
    rests_on_first = observer.model.start_range is None or (proof is not None and proof.largest_at is None)
    if not bank.may_start_again and rests_on_first:
        return 0, Start("first", 0, first)
    answers = drive(bank, log)
    deque(islice(answers, alarm.sample), maxlen=0)
    given = observer.first_set  # before the bank starts it again on account of the alarm
    step = next(answers).steps.get(alarm.observer)
    if step is None:
        return None
    since = alarm.sample - step.sample
    begun = own_start(observer.model.start_range, first, _largest_at(step.certificate), since)
    given = given if step.sample else observer.first_set
    if begun is not None or given is None:
        return since, begun
    left_by = "the global set" if isinstance(bank, ArchitectureII) else "the set that the survivors left"
    return since, Start("assumed", since, given, because=left_by)


def _largest_at(proof: Certificate | None) -> int | None:
    """Sample, as its observer counts, at which the set that a proof rests on started again from the largest one."""
    found = getattr(proof.about() if isinstance(proof, OnWindow) else proof, "largest_at", None)
    return None if found is None else int(found)
