"""The polytope observer: explicit H-polytopes from sample to sample, the paper's method in its sound form."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polytopes import HPolytope, UndecidedError
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, is_count
from svo.models import NormalForm, UncertainModel, may_be_nonzero, set_in
from svo.observers.answers import NO_PROOF, Step
from svo.observers.data import relative_slack
from svo.observers.first_states import finite_box
from svo.observers.free_start import Reading
from svo.observers.given_units import polytope_proof_out
from svo.observers.polytope.certificate import PolytopeCertificate
from svo.observers.polytope.limits import (
    FLOATS_TELL_APART,
    anywhere,
    cut_to,
    is_of_use,
    reach_ahead,
    readable,
    within_physical,
)
from svo.observers.polytope.sets import Outcome, PublishedRecursion, Recursion, Sample, SoundRecursion
from svo.observers.polytope.state import (
    read_outcome,
    read_sample,
    write_outcome,
    write_sample,
)
from svo.observers.polytope.step import PolytopeStep
from svo.observers.polytope.vertex_images import transitions
from svo.observers.readings import NO_SAMPLE, OUTGROWN, OUTSIDE, TOO_LARGE
from svo.observers.recursion import RecursiveObserver
from svo.observers.saved_state import arrays_of, read_arrays
from svo.observers.window.setup import arrival_of
from svo.observers.window_kernel import LARGEST

_PUBLISHED_STACKS = 4096

UNSOUND = (
    "as_published=True reproduces equation (3) of the paper, which keeps the measurements inside the stack of every "
    "vertex of Delta. With uncertain A a state at an interior Delta is a mix of vertex trajectories that need not "
    "satisfy them, so the set can exclude the true state and a healthy plant can be falsified. Leave it out for the "
    "sound form."
)


class PolytopeObserver(RecursiveObserver[Sample]):
    """Set-valued observer on explicit polytopes (Rosa and Silvestre 2013, section 2), in a form that is sound.

    The set of the next state is the intersection over m = 1..N of the hulls, over the vertices of Delta, of the
    m-step images of X(k+1-m) without any later measurement, and then the measurement. Where w enters the output as
    well, (x, w) is kept as one set, so that the measurement also says what w drives the next state.

    Parameters
    ----------
    model : UncertainModel
    initial : HPolytope
        Bounded set that contains the state at the first sample.
    horizon : int
        N >= 1. With exact sets N > 1 changes nothing, since the one-step image lies in all the others; under a
        facet budget longer images recover part of what the reduction gave away.
    max_facets : int or None
        Sets are reduced outward to so many facets, at least twice their dimension (n, or n + nw where w enters the
        output). None = exact, until a set has more than 500 facets or its elimination forms more than 5000 rows.
    eps : float
        Every measurement row is widened by eps (|y| + |C||x|max + |D u| + |c| + |F| wmax + n), for the rounding
        of the data, and by its own rounding.
    as_published : bool
        Equation (3) as printed, for reproduction only: unsound with uncertain A, and it warns. No F and no
        uncertain output.

    Raises
    ------
    TypeError, ValueError
        For arguments that do not fit, and for an initial set that is empty or unbounded.

    Notes
    -----
    "falsified" comes with a `PolytopeCertificate` that was checked in exact arithmetic; it is conditional on the set
    before the measurement, which is computed in floats and rounded outward. After it the observer stays falsified
    until `reset`. A Delta in the output costs two rows a sensor (chords), each Delta taken as free there: wider than
    the channels of `WindowObserver`, which keep one Delta in state and output. Facets grow quickly with disturbances
    and uncertainties: meant for small models and as a reference; `WindowObserver` is the fast one.
    """

    kind = "polytope"
    saves_state = True

    @options_by_name
    def __init__(
        self,
        model: UncertainModel,
        initial: HPolytope,
        horizon: int = 1,
        *,
        max_facets: int | None = 60,
        eps: float = 1e-9,
        as_published: bool = False,
    ) -> None:
        super().__init__(model)
        expect(is_count(horizon, 1), "horizon", horizon, "an integer number of steps >= 1")
        slack = relative_slack(eps)
        coupled = _is_coupled(model)
        smallest = 2 * (model.n_states + (model.n_disturbances if coupled else 0))
        wanted = f"an integer of at least {smallest}, or None for exact"
        expect(max_facets is None or is_count(max_facets, smallest), "max_facets", max_facets, wanted)
        if as_published:
            _check_published(model, coupled, int(horizon))
            warnings.warn(UNSOUND, UserWarning, stacklevel=2)
        form = NormalForm.at(model, *finite_box(initial, model.n_states))
        self._configure(form, int(horizon), max_facets, slack, as_published)
        self.reset(initial)

    def _configure(
        self, form: NormalForm, horizon: int, max_facets: int | None, eps: float, as_published: bool
    ) -> None:
        self.model, self._form, self._normal = form.given, form, form.model
        self.horizon, self.max_facets, self.eps = horizon, max_facets, eps
        self._steps_kept, self._wants_next_input = horizon, self.model.uses_input_in_output
        self._plan_stamps()
        self._recursion: Recursion
        if as_published:
            self._recursion = PublishedRecursion(form.model, horizon, max_facets, eps)
        else:
            self._recursion = SoundRecursion(form.model, horizon, max_facets, eps, _is_coupled(form.given))

    # -- the hooks -------------------------------------------------------------------------------

    def _reset(self, set: HPolytope, lower: Array, upper: Array) -> None:
        self.first_set = arrival_of(set, lower, upper)
        self._begin_from(within_physical(self._normal.physical_range, set_in(set, self._form.x)))

    def _begin_from(self, initial: HPolytope) -> None:
        """Nothing is known but a set of first states."""
        self._initial, self._readings = initial, None
        self._drop()

    def _start_from(self, lower: Array, upper: Array) -> None:
        self._initial = HPolytope.box(lower, upper)

    def _drop(self) -> None:
        self._last: tuple[Sample, Outcome] | None = None

    def _update(self, y: Array, u: Array, schedule: Any) -> Step:
        return self._checked(super()._update(y, u, schedule), y)

    def _step(self, u: Array, y: Array, u_next: Array, schedule: Any, end: float | None) -> Step:
        return self._checked(super()._step(u, y, u_next, schedule, end), y)

    def _options(self) -> dict[str, Any]:
        published = isinstance(self._recursion, PublishedRecursion)
        limits = {"horizon": self.horizon, "max_facets": self.max_facets}
        return {**limits, "eps": self.eps, "as_published": published}

    def _state(self) -> dict[str, NDArray[Any]]:
        facets = -1 if self.max_facets is None else self.max_facets
        published = isinstance(self._recursion, PublishedRecursion)
        state: dict[str, NDArray[Any]] = {"settings": np.array([self.horizon, facets, self.eps, published])}
        largest = NO_SAMPLE if self.largest_at is None else self.largest_at
        state["restart"] = np.array([self._number, largest, self._readings is not None])
        state |= self._form.state_dict() | arrays_of("initial", self._initial)
        state |= self._saved_readings()
        if self._last is not None:
            sample, outcome = self._last
            state |= write_sample("sample", sample) | write_outcome("outcome", outcome)
        return state

    def _set_up(self, model: UncertainModel, state: Mapping[str, NDArray[Any]]) -> None:
        horizon, facets, eps, published = (float(v) for v in state["settings"])
        limit = None if facets < 0 else int(facets)
        self._configure(NormalForm.from_state_dict(model, state), int(horizon), limit, eps, bool(published))

    def _resume(self, state: Mapping[str, NDArray[Any]]) -> PolytopeStep | None:
        self._begin_from(read_arrays(HPolytope, "initial", state))
        number, largest, lost = (int(v) for v in state["restart"])
        self._number, self.largest_at = number, None if largest == NO_SAMPLE else largest
        self._restore_readings(lost, state)
        self._check_started("sample.stack" in state)
        if "sample.stack" not in state:
            return None
        sample, outcome = read_sample(state, "sample", self.model), read_outcome(state, "outcome", self.model)
        self._last = sample, outcome
        return self._answer(outcome) if outcome.verdict == "falsified" else None

    # -- inside ------------------------------------------------------------------------------------

    def _checked(self, step: Step, y: Array) -> Step:
        """An answer that says so where a reading was too large to count."""
        if step.verdict == "consistent" and (np.isnan(readable(self._form.outputs(y))) & ~np.isnan(y)).any():
            return replace(step, verdict="undecided", reason=TOO_LARGE)
        return step

    def _keep(self, sample: Sample, outcome: Outcome) -> PolytopeStep:
        reason = NO_PROOF if outcome.verdict == "undecided" else None
        if isinstance(outcome.certificate, PolytopeCertificate):
            outcome = outcome._replace(certificate=replace(outcome.certificate, largest_at=self.largest_at))
        if outcome.verdict != "falsified" and self._normal.physical_range is not None:
            joint, meets = cut_to(outcome.joint, self._normal.physical_range, self.max_facets)
            if not meets:  # not proven, so no alarm
                outcome, reason = outcome._replace(verdict="undecided"), OUTSIDE
            outcome = outcome._replace(joint=joint)
        self._last = sample, outcome
        return self._answer(outcome, reason)

    def _answer(self, outcome: Outcome, reason: str | None = None) -> PolytopeStep:
        certificate = None if outcome.certificate is None else polytope_proof_out(outcome.certificate, self._form)
        return PolytopeStep(outcome.joint, self._form, verdict=outcome.verdict, certificate=certificate, reason=reason)

    def _disturbances(self, lower: Array, upper: Array) -> HPolytope | None:
        polytope = self._normal.disturbance_polytope
        return HPolytope.box(lower, upper) if polytope is None and lower.size else polytope

    # -- the recursion -----------------------------------------------------------------------------

    def _data(self, stack: Array, bounds: tuple[Array, Array, Array], u: Array, y: Array) -> Sample:
        lower, upper, noise = bounds
        return Sample(self._number, stack, self._disturbances(lower, upper), noise, u, readable(y), (lower, upper))

    def _again(self, reading: Reading, number: int) -> Sample:
        box = reading.w_lower, reading.w_upper
        return Sample(number, reading.stack, self._disturbances(*box), reading.noise, reading.u, reading.y, box)

    def _reading(self, data: Sample) -> Reading:
        slack = np.zeros(self._normal.n_outputs)
        return Reading(data.stack, data.u, data.y, data.noise, slack, *data.w_box)

    def _begin(self, data: Sample) -> PolytopeStep | None:
        if not is_of_use(data, data.u):
            return None
        return self._keep(data, self._recursion.first(self._initial, data))

    def _go_on(self, u: Array, data: Sample) -> PolytopeStep | None:
        assert self._last is not None
        before, last = self._last
        if not (is_of_use(before, u) and is_of_use(data, data.u)):
            return None
        size = reach_ahead(self._normal, before, last.joint, u)
        if not size < LARGEST:
            return None
        try:
            maps = transitions(before.stack, self._normal, u)
            return self._keep(data, self._recursion.next(last, before, maps, data))
        except (UndecidedError, np.linalg.LinAlgError):
            if size < FLOATS_TELL_APART:
                raise
            return None

    def _move_by(self, rows: Array) -> None:
        assert self._last is not None
        sample, outcome = self._last
        stack = sample.stack.copy()
        stack[:, : self._normal.n_states] = rows
        self._last = sample._replace(stack=stack), outcome

    def _known(self) -> tuple[Array, Array]:
        joint = self._initial if self._last is None else self._last[1].joint
        return PolytopeStep(joint, self._form, verdict="consistent").box

    def _unknown(self) -> PolytopeStep:
        joint = anywhere(self._normal.n_states, self._normal.physical_range)
        return PolytopeStep(joint, self._form, verdict="undecided", reason=OUTGROWN)


def _check_published(model: UncertainModel, coupled: bool, horizon: int) -> None:
    if coupled or may_be_nonzero(*(array for item in model.uncertainties for array in (item.C, item.D, item.c))):
        raise ValueError("as_published is True, but equation (3) has neither F nor an uncertain output: leave it out")
    stacks = 2 ** (horizon * len(model.uncertainties))
    if stacks > _PUBLISHED_STACKS:
        raise ValueError(
            f"horizon is {horizon}: equation (3) has {stacks} vertex stacks; expected at most {_PUBLISHED_STACKS}"
        )


def _is_coupled(model: UncertainModel) -> bool:
    """Whether w may enter the output."""
    return may_be_nonzero(model.F, *(item.F for item in model.uncertainties))
