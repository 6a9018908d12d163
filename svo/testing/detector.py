"""The rules that a detector of a comparison keeps, and the check that asks them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from polytopes.signatures import options_by_name
from svo.detectors.detector import NOBODY, Detection, Detector, Setting
from svo.logs.log import Log
from svo.plant import HEALTHY, Plant
from svo.testing.plant_runs import SEED, cut
from svo.testing.rules import Conformance, NotApplicable, keep, rule, table

SEARCHED = 1.1  # a critical level may be too high by less than this factor, where it is searched for


@options_by_name
def check_detector(detector: Detector, plant: Plant, *, noise: str | None = None) -> Conformance:
    """Ask every rule of `DETECTOR_RULES` of a detector.

    Parameters
    ----------
    detector : Detector
    plant : Plant
        The detector's; it is simulated with fixed seeds, without a fault and with each fault's first profile.
    noise : str, optional
        Noise set; by default the plant's first.

    Returns
    -------
    Conformance
        The rules that hold, and those that could not be asked, with the reason.

    Raises
    ------
    ConformanceError
        (an AssertionError) at the first broken rule; it names the rule, what was seen and what to do.
    """
    return keep(DETECTOR_RULES.values(), Runs(detector, plant, plant.noise_sets[0] if noise is None else noise))


class Runs:
    """A detector, and runs of its plant: three without a fault, one with each."""

    def __init__(self, detector: Detector, plant: Plant, noise: str) -> None:
        self.detector, self._plant, self._noise = detector, plant, noise

    @cached_property
    def healthy(self) -> list[Log]:
        return [self._plant.simulate(HEALTHY, HEALTHY, self._noise, SEED + i) for i in range(3)]

    @cached_property
    def faulty(self) -> list[Log]:
        faults = self._plant.faults.items()
        return [self._plant.simulate(fault, profiles[0], self._noise, SEED) for fault, profiles in faults]

    @cached_property
    def setting(self) -> Setting:
        """The fixed one; or with inner parameters in the middle, at the least level without a false alarm."""
        detector = self.detector
        if detector.fixed is not None:
            return detector.fixed
        parameters = {name: parameter.at(0.5) for name, parameter in detector.parameters.items()}
        prepared = [detector.prepare(log) for log in self.healthy]
        setting = Setting(np.inf, parameters, detector.learn(parameters, prepared))
        return replace(setting, level=max(detector.critical_level(setting, log, 0.0) for log in prepared))

    @property
    def tuned(self) -> Setting:
        """That setting, if the level is to be tuned."""
        if self.detector.fixed is not None:
            raise NotApplicable("the detector's setting is fixed")
        return self.setting

    def detect(self, log: Log, setting: Setting | None = None, isolate: bool = True) -> Detection:
        return self.detector.run(setting or self.setting, self.detector.prepare(log), isolate)


@rule(
    "run says one thing a sample: an alarm, and where it isolates the number of a fault",
    advice="return Detection with alarm (K,) of bool and isolated (K,) of indices into `faults`, -1 for none",
)
def answers(runs: Runs) -> Iterator[str]:
    for log in (*runs.healthy, *runs.faulty):
        found, faults = runs.detect(log), runs.detector.faults
        if found.alarm.shape != (len(log),):
            yield f"alarm has shape {found.alarm.shape} for a log of {len(log)} samples"
        if found.isolated is not None and not np.isin(found.isolated, range(NOBODY, len(faults))).all():
            yield f"isolated has {sorted(set(found.isolated.tolist()))}; `faults` has {len(faults)} names"
        if found.isolated is not None and (found.isolated[~found.alarm] != NOBODY).any():
            yield "a fault is isolated at a sample without an alarm"


@rule("a run leaves nothing behind", advice="keep what a run needs in local variables, made anew in run and prepare")
def runs_apart(runs: Runs) -> Iterator[str]:
    for log in (runs.healthy[0], *runs.faulty[:1]):
        first = runs.detect(log)
        runs.detect(runs.healthy[-1])
        if not _same(first, runs.detect(log), len(log)):
            yield "the same log is judged otherwise after another one"


@rule(
    "an alarm knows nothing of later samples",
    advice="let the score of a sample depend on the samples up to it; no mean, scaling or smoothing over the whole log",
)
def no_look_ahead(runs: Runs) -> Iterator[str]:
    for log in (runs.healthy[0], *runs.faulty):
        whole = runs.detect(log)
        for samples in (len(log) // 3, 2 * len(log) // 3):
            if not _same(whole, runs.detect(cut(log, 0, samples)), samples):
                yield f"the first {samples} samples are judged otherwise when the rest is not there yet"


@rule(
    "a higher level never adds an alarm",
    advice="compare a score that does not depend on the level with the level",
)
def higher_level(runs: Runs) -> Iterator[str]:
    setting = runs.tuned
    for log in (*runs.healthy[:1], *runs.faulty):
        before = np.ones(len(log), dtype=bool)
        for level in setting.level * 2.0 ** np.arange(-2.0, 5.0):
            alarm = runs.detect(log, replace(setting, level=float(level)), isolate=False).alarm
            if (alarm & ~before).any():
                yield f"level {level:g} adds an alarm at sample {int(np.argmax(alarm & ~before))}"
            before = alarm


@rule(
    "critical_level is the least level without an alarm on a log, and no less than the floor",
    advice="return the largest score, or the floor if that is higher; round up what is searched for",
)
def critical_level(runs: Runs) -> Iterator[str]:
    detector, setting = runs.detector, runs.tuned
    for log in runs.healthy:
        prepared = detector.prepare(log)
        level = detector.critical_level(setting, prepared, 0.0)

        def alarms(at: float, prepared: Any = prepared) -> bool:
            return bool(detector.run(replace(setting, level=at), prepared, False).alarm.any())

        if alarms(level):
            yield f"there is an alarm at the critical level {level:g}"
        if level > 0 and not alarms(level / SEARCHED):
            yield f"the critical level is {level:g}, and {level / SEARCHED:g} gives no alarm either"
        if detector.critical_level(setting, prepared, 2.0 * level) != 2.0 * level:
            yield f"the critical level is {level:g}, and with the floor {2.0 * level:g} it is not the floor"


@rule(
    "a falsification with the bounds as stated is no false alarm",
    advice="state bounds that hold for the plant's noise set, or let the level be tuned (`fixed` None)",
)
def stated_bounds(runs: Runs) -> Iterator[str]:
    if runs.detector.kind != "falsification" or runs.detector.fixed is None:
        raise NotApplicable("the detector's bounds are not as stated")
    for log in runs.healthy:
        if runs.detect(log, isolate=False).alarm.any():
            yield "an alarm without a fault"


def _same(one: Detection, other: Detection, samples: int) -> bool:
    """Whether two detections agree over the first samples."""
    alike = np.array_equal(one.alarm[:samples], other.alarm[:samples])
    if one.isolated is None or other.isolated is None:
        return alike and one.isolated is other.isolated
    return alike and np.array_equal(one.isolated[:samples], other.isolated[:samples])


DETECTOR_RULES = table(answers, runs_apart, no_look_ahead, higher_level, critical_level, stated_bounds)
