"""The polytope observer: explicit H-polytopes from sample to sample, the paper's method in its sound form."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope, warm_up
from svo.checks import Array, is_count, is_finite_number
from svo.logs.drive import drive
from svo.logs.log import Log
from svo.models.model import UncertainModel, expect_model
from svo.models.normal_form import NormalForm, set_in
from svo.models.stack import may_be_nonzero
from svo.observers.data import check_may_start_by_step, inputs_of, outputs_of, stack_at
from svo.observers.polytope.limits import readable, within_physical
from svo.observers.polytope.restart import RestartingPolytope
from svo.observers.polytope.sets import PublishedRecursion, Sample, SoundRecursion
from svo.observers.polytope.state import (
    read_outcome,
    read_sample,
    read_set,
    write_outcome,
    write_sample,
    write_set,
)
from svo.observers.polytope.step import PolytopeRecord, PolytopeStep
from svo.observers.readings import NO_SAMPLE
from svo.observers.saved_state import check_model, check_unchanged, last_schedule, sealed
from svo.observers.window.setup import finite_box

_PUBLISHED_STACKS = 4096

UNSOUND = (
    "as_published=True reproduces equation (3) of the paper, which keeps the measurements inside the stack of every "
    "vertex of Delta. With uncertain A a state at an interior Delta is a mix of vertex trajectories that need not "
    "satisfy them, so the set can exclude the true state and a healthy plant can be falsified. Leave it out for the "
    "sound form."
)


class PolytopeObserver(RestartingPolytope):
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
        of the data.
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

    def __init__(
        self,
        model: UncertainModel,
        initial: HPolytope,
        horizon: int = 1,
        max_facets: int | None = 60,
        eps: float = 1e-9,
        as_published: bool = False,
    ) -> None:
        expect_model("model", model)
        if not is_count(horizon, 1):
            raise ValueError(f"horizon is {horizon!r}; expected an integer number of steps >= 1")
        if not (is_finite_number(eps) and eps >= 0):
            raise ValueError(f"eps is {eps}; expected a relative slack >= 0, such as 1e-9")
        coupled = _is_coupled(model)
        smallest = 2 * (model.n_states + (model.n_disturbances if coupled else 0))
        if max_facets is not None and not is_count(max_facets, smallest):
            raise ValueError(
                f"max_facets is {max_facets!r}; expected an integer of at least {smallest}, or None for exact"
            )
        if as_published:
            _check_published(model, coupled, int(horizon))
            warnings.warn(UNSOUND, UserWarning, stacklevel=2)
        form = NormalForm.at(model, *finite_box(initial, model.n_states))
        self._configure(form, int(horizon), max_facets, float(eps), as_published)
        self.reset(initial)

    def _configure(
        self, form: NormalForm, horizon: int, max_facets: int | None, eps: float, as_published: bool
    ) -> None:
        self.model, self._form, self._normal = form.given, form, form.model
        self.horizon, self.max_facets, self.eps = horizon, max_facets, eps
        if as_published:
            self._recursion = PublishedRecursion(form.model, horizon, max_facets, eps)
        else:
            self._recursion = SoundRecursion(form.model, horizon, max_facets, eps, _is_coupled(form.given))

    def reset(self, set: HPolytope) -> None:
        """Forget all data; the state at the next measurement lies in ``set``.

        Raises
        ------
        ValueError
            If the set is empty, unbounded or of the wrong dimension, or outside the model's physical range.
        """
        finite_box(set, self.model.n_states)
        self._forget(within_physical(self._normal.physical_range, set_in(set, self._form.x)))

    def update(self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None) -> PolytopeStep:
        """The first measurement, without a transition.

        Parameters
        ----------
        y0 : (ny,) array
            NaN = that sensor is missing.
        u : (nu,) array, optional
            Needed only if D or a D_i is not zero.
        schedule : optional
            Scheduling value at this sample.
        """
        begun = perf_counter()
        if self._number >= 0:
            raise ValueError("update was called after the first sample; use step(u, y), or reset(set) to start again")
        sample = self._sample(0, y0, inputs_of(self.model, "u", u, self.model.uses_input_in_output), schedule)
        return self._answer(sample.u, sample, y0, begun)

    def step(
        self, u: ArrayLike | None, y: ArrayLike, u_next: ArrayLike | None = None, schedule: Any = None
    ) -> PolytopeStep:
        """One transition x(k) -> x(k+1) driven by u, then the measurement y at k + 1.

        Parameters
        ----------
        u : (nu,) array
        y : (ny,) array
            NaN = that sensor is missing; all NaN = prediction only.
        u_next : (nu,) array, optional
            u(k+1); needed only if D or a D_i is not zero.
        schedule : optional
            Scheduling value at the sample of y; it also gives the matrices of the next transition.

        Raises
        ------
        ValueError
            For a wrong shape, an infinite or missing value, or a scheduled model whose first call is not `update`. The
            observer is unchanged.
        FacetLimitError
            In exact mode, when a set has too many facets, or Qhull fails on it. The observer is unchanged.
        UndecidedError
            If a set is too thin for any linear program to settle. The observer is unchanged.
        """
        begun = perf_counter()
        inputs = inputs_of(self.model, "u", u, True)
        following = inputs_of(self.model, "u_next", u_next, self.model.uses_input_in_output)
        if self._number < 0:
            check_may_start_by_step(self.model)
            self.update(np.full(self.model.n_outputs, np.nan), inputs, schedule)
        sample = self._sample(self._number + 1, y, following, schedule)
        return self._answer(self._form.inputs(inputs), sample, y, begun)

    @property
    def options(self) -> dict[str, Any]:
        """What besides model and sets decides what the observer answers: it is part of what names a saved state."""
        published = isinstance(self._recursion, PublishedRecursion)
        limits = {"horizon": self.horizon, "max_facets": self.max_facets}
        return {"kind": "polytope", **limits, "eps": self.eps, "as_published": published}

    def state_dict(self) -> dict[str, NDArray]:
        """Everything that the next steps depend on, as named arrays (for ``numpy.savez``)."""
        facets = -1 if self.max_facets is None else self.max_facets
        published = isinstance(self._recursion, PublishedRecursion)
        state: dict[str, NDArray] = {"settings": np.array([self.horizon, facets, self.eps, published])}
        largest = NO_SAMPLE if self.largest_at is None else self.largest_at
        state["restart"] = np.array([self._number, largest, self._readings is not None])
        state |= self._form.state_dict() | write_set("initial", self._initial)
        if self._readings is not None:
            state |= {f"readings.{name}": value for name, value in self._readings.state().items()}
        if self._last is not None:
            sample, outcome = self._last
            state |= write_sample("sample", sample) | write_outcome("outcome", outcome)
        return sealed(state, self.model, self.options, self._schedule)

    @classmethod
    def from_state_dict(cls, model: UncertainModel, state: Mapping[str, NDArray]) -> PolytopeObserver:
        """The observer that `state_dict` described, to continue bit for bit with the same model.

        Raises
        ------
        ValueError
            If the state is not that of a polytope observer of this very model, or was changed since.
        """
        try:
            check_unchanged(state)
            horizon, facets, eps, published = (float(v) for v in state["settings"])
            limit = None if facets < 0 else int(facets)
            observer = cls.__new__(cls)
            observer._configure(NormalForm.from_state_dict(model, state), int(horizon), limit, eps, bool(published))
            observer._forget(read_set(state, "initial"))
            if "sample.stack" in state:
                sample = read_sample(state, "sample")
                if sample.stack.shape != model.stack(model.schedule).shape:
                    raise ValueError(f"its stack has shape {sample.stack.shape}")
                observer._last = sample, read_outcome(state, "outcome")
            check_model(state, model, observer.options)
            observer._schedule = last_schedule(state)
            observer._restore(state)
        except (KeyError, IndexError, TypeError, ValueError) as error:
            raise ValueError(f"state does not belong to a polytope observer of this model: {error}") from error
        return observer

    def run(self, log: Log) -> PolytopeRecord:
        """All samples of a log, with the box of the state at each."""
        steps = list(drive(self, log))
        boxes = np.array([step.box for step in steps])
        return PolytopeRecord(
            verdicts=tuple(step.verdict for step in steps),
            lower=boxes[:, 0],
            upper=boxes[:, 1],
            facets=np.array([len(step.joint.b) for step in steps]),
            seconds=np.array([step.seconds for step in steps]),
            certificate=steps[-1].certificate,
        )

    def warm_up(self) -> float:
        """Compile the linear programs, without touching this observer; returns the seconds it took."""
        begun = perf_counter()
        warm_up()
        return perf_counter() - begun

    def _sample(self, number: int, y: ArrayLike, u: Array, schedule: Any) -> Sample:
        """Model and data of a sample, in normal form."""
        outputs, form = outputs_of(self.model, y), self._form
        stack, self._schedule = stack_at(form.model, schedule), schedule
        lower, upper, noise = form.model.bounds(schedule)
        disturbances, read = self._disturbances(lower, upper), readable(form.outputs(outputs))
        return Sample(number, stack, disturbances, noise, form.inputs(u), read, (lower, upper))


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
