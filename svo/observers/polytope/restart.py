"""A polytope observer that loses its set, and finds one again: from the largest set, or from the readings alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope, UndecidedError
from svo.checks import Array
from svo.models.model import UncertainModel
from svo.models.normal_form import NormalForm
from svo.observers.free_start import Reading
from svo.observers.given_units import polytope_proof_out
from svo.observers.polytope.limits import FLOATS_TELL_APART, anywhere, cut_to, is_of_use, reach_ahead
from svo.observers.polytope.sets import Outcome, Recursion, Sample
from svo.observers.polytope.step import PolytopeCertificate, PolytopeStep
from svo.observers.polytope.vertex_images import transitions
from svo.observers.readings import NO_SAMPLE, OUTGROWN, OUTSIDE, TOO_LARGE, Readings
from svo.observers.window_kernel import LARGEST


class RestartingPolytope:
    """Samples through a recursion of sets, in normal form, however long the gaps between their measurements.

    Attributes
    ----------
    largest_at : int or None
        Sample at which the set last started from the model's largest set, if what is known now rests on it.
    """

    _form: NormalForm
    _normal: UncertainModel
    horizon: int
    max_facets: int | None
    eps: float
    largest_at: int | None
    _recursion: Recursion

    def _forget(self, initial: HPolytope) -> None:
        self._initial = initial
        self._last: tuple[Sample, Outcome] | None = None
        self._number = -1
        self._readings: Readings | None = None  # of an observer that has lost its set
        self.largest_at: int | None = None
        self._schedule: Any = None  # of the newest sample

    def lose_set(self) -> None:
        """Forget all data; nothing is known of the state at the next measurement.

        The observer starts from the model's largest set, or is undecided until the readings alone bound the state.
        """
        largest = self._normal.start_range
        if largest is None:
            self._forget(self._initial)
            self._readings = Readings(self._normal, self.eps, self.horizon)
        else:
            self._forget(HPolytope.box(largest.lower, largest.upper))
            self.largest_at = 0

    def _keep(self, sample: Sample, outcome: Outcome, begun: float) -> PolytopeStep:
        reason = None
        if isinstance(outcome.certificate, PolytopeCertificate):
            outcome = outcome._replace(certificate=replace(outcome.certificate, largest_at=self.largest_at))
        if outcome.verdict != "falsified" and self._normal.physical_range is not None:
            joint, meets = cut_to(outcome.joint, self._normal.physical_range, self.max_facets)
            if not meets:  # not proven, so no alarm
                outcome, reason = outcome._replace(verdict="undecided"), OUTSIDE
            outcome = outcome._replace(joint=joint)
        self._last, self._number = (sample, outcome), sample.number
        certificate = None if outcome.certificate is None else polytope_proof_out(outcome.certificate, self._form)
        seconds = perf_counter() - begun
        return PolytopeStep(sample.number, outcome.verdict, certificate, seconds, outcome.joint, self._form, reason)

    def _answer(self, u: Array, sample: Sample, y: ArrayLike, begun: float) -> PolytopeStep:
        """One sample, driven to by u, whose measurement as it was given is y."""
        if self._readings is not None:
            step = self._without_set(u, sample, begun)
        elif self._number < 0:
            step = self._begin(sample, begun)
        else:
            step = self._go_on(u, sample, begun) or self._give_up(u, sample, begun)
        if step.verdict == "consistent" and (np.isnan(sample.y) & ~np.isnan(np.asarray(y, dtype=float))).any():
            return replace(step, verdict="undecided", reason=TOO_LARGE)
        return step

    # -- a set that is lost ------------------------------------------------------------------------

    def _begin(self, sample: Sample, begun: float) -> PolytopeStep:
        """The first sample of a set."""
        if not is_of_use(sample, sample.u):
            return self._lost(sample.u, sample, begun)
        return self._keep(sample, self._recursion.first(self._initial, sample), begun)

    def _go_on(self, u: Array, sample: Sample, begun: float) -> PolytopeStep | None:
        """The next sample, or None if the set has outgrown all bounds."""
        assert self._last is not None
        before, last = self._last
        if last.verdict == "falsified":
            return self._keep(sample, last, begun)
        if not (is_of_use(before, u) and is_of_use(sample, sample.u)):
            return None
        size = reach_ahead(self._normal, before, last.joint, u)
        if not size < LARGEST:
            return None
        try:
            maps = transitions(before.stack, self._normal, u)
            return self._keep(sample, self._recursion.next(last, before, maps, sample), begun)
        except (UndecidedError, np.linalg.LinAlgError):
            if size < FLOATS_TELL_APART:
                raise
            return None

    def _give_up(self, u: Array, sample: Sample, begun: float) -> PolytopeStep:
        """The set has outgrown all bounds at this sample: it starts again from the largest set, if there is one."""
        largest = self._normal.start_range
        if largest is None:
            return self._lost(u, sample, begun)
        self._initial, self.largest_at = HPolytope.box(largest.lower, largest.upper), sample.number
        return self._begin(sample, begun)

    def _lost(self, u: Array, sample: Sample, begun: float) -> PolytopeStep:
        self._last, self.largest_at = None, None
        self._readings = Readings(self._normal, self.eps, self.horizon)
        return self._without_set(u, sample, begun)

    def _without_set(self, u: Array, sample: Sample, begun: float) -> PolytopeStep:
        """A sample of an observer that has no set: it starts again once the readings alone bound the state."""
        assert self._readings is not None
        self._number = sample.number
        slack = np.zeros(self._normal.n_outputs)
        self._readings.add(u, Reading(sample.stack, sample.u, sample.y, sample.noise, slack, *sample.w_box))
        found = self._readings.start()
        if found is not None:
            step = self._start_again(*found, begun)
            if step is not None:
                return step
        joint = anywhere(self._normal.n_states, self._normal.physical_range)
        return PolytopeStep(sample.number, "undecided", None, perf_counter() - begun, joint, self._form, OUTGROWN)

    def _start_again(self, samples: list[Reading], lower: Array, upper: Array, begun: float) -> PolytopeStep | None:
        """From bounds of the state at the first of some samples; None if a set does not come out of it."""
        number, readings = self._number, self._readings
        physical = self._normal.physical_range
        if physical is not None:
            lower, upper, _ = physical.cut(lower, upper)
        self._readings, self._initial = None, HPolytope.box(lower, upper)
        step = None
        for j, s in enumerate(samples):
            disturbances = self._disturbances(s.w_lower, s.w_upper)
            at, box = number - len(samples) + 1 + j, (s.w_lower, s.w_upper)
            sample = Sample(at, s.stack, disturbances, s.noise, s.u, s.y, box)
            step = self._begin(sample, begun) if j == 0 else self._go_on(samples[j - 1].u, sample, begun)
            if step is None or step.reason == OUTGROWN or (step.verdict == "falsified" and j + 1 < len(samples)):
                # a proof before the last sample would rest on readings that come after it
                self._number, self._readings, self._last = number, readings, None
                return None
        return step

    def _restore(self, state: Mapping[str, NDArray]) -> None:
        """What a saved state says of the set's start."""
        number, largest, lost = (int(v) for v in state["restart"])
        self._number, self.largest_at = number, None if largest == NO_SAMPLE else largest
        if lost:
            self._readings = Readings(self._normal, self.eps, self.horizon)
            prefix = "readings."
            self._readings.restore({k.removeprefix(prefix): state[k] for k in state if k.startswith(prefix)})

    def _disturbances(self, lower: Array, upper: Array) -> HPolytope | None:
        polytope = self._normal.disturbance_polytope
        return HPolytope.box(lower, upper) if polytope is None and lower.size else polytope
