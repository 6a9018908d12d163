"""What a window observer takes of its model at each sample: matrices, bounds and data, in normal form.

A nonlinear model is linearised; of a linear one whose sensors have stamps that may be off, the rows are widened.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.logs.log import Log
from svo.models import UncertainModel
from svo.models.intervals import check_splits, transition_rows
from svo.models.nonlinear import NonlinearModel, Span
from svo.models.recent_inputs import RecentInputs
from svo.observers.relinearised_kernel import PlantSamples
from svo.observers.stamped import Stamped
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_samples import LogSamples, log_samples
from svo.observers.window.memory import WindowSettings
from svo.observers.window.relinearised import Relinearised
from svo.observers.window.sample import Sample
from svo.observers.window.setup import needs_next_input

_INJECTED = "and exact sensors read every disturbance"


class Instant(NamedTuple):
    """The inputs about a sample whose readings may have been taken at another time than their stamps say.

    Attributes
    ----------
    recent : RecentInputs
        Before the sample is read.
    around : tuple of (nu,), (nu,) arrays
        Bounds of the inputs about it.
    """

    recent: RecentInputs
    around: tuple[Array, Array]


class Sampler:
    """A model as a window asks for it, sample by sample.

    Parameters
    ----------
    model : UncertainModel or NonlinearModel

    Attributes
    ----------
    linear : UncertainModel
        What the window is laid out for.
    plant : Relinearised or None
        Of a nonlinear model.
    stamped : Stamped or None
        Of a linear one that has stamps that may be off.
    needs_next_input : bool
        Whether the input of a sample counts at the sample itself.
    """

    linear: UncertainModel

    def __init__(self, model: UncertainModel | NonlinearModel) -> None:
        self.model, self.plant, self.stamped, self._recent = model, None, None, None
        if model.jitter is not None:
            self._recent = RecentInputs.none(float(model.jitter.max()), model.n_inputs)
        if isinstance(model, NonlinearModel):
            self.plant, self.linear = Relinearised(model), model.carrier
            return
        self.linear = model
        if model.origin is not None and model.origin.stamps is not None:
            self.stamped = Stamped(model, model.origin.stamps)

    def connect(self, settings: WindowSettings) -> None:
        """Settings of the window that takes the samples; ValueError if they do not go with jitter."""
        self._form, self._injects = settings.form, settings.injection is not None
        self._normal = settings.form.model
        if self.plant is not None:
            self.plant.connect(settings.form)
        self.needs_next_input = (
            needs_next_input(self._normal) or self.model.uses_input_in_output or self._recent is not None
        )
        if self.stamped is not None and self._injects:
            raise ValueError(f"jitter is given, {_INJECTED}; state a noise n above zero")

    @property
    def has_jitter(self) -> bool:
        """Whether readings may be of other times than their stamps say."""
        return self._recent is not None

    def start_from(self, first: ArrivalSet | None) -> None:
        """A set of first states in normal form; None if nothing is known of them."""
        if first is None:
            if self.stamped is not None:
                self.stamped.box = None
            return
        box = Span(first.box_lower * self._form.x, first.box_upper * self._form.x)
        if self.plant is not None:
            self.plant.start_from(box)
        if self.stamped is not None:
            self.stamped.box = box

    # -- transitions -------------------------------------------------------------------------------

    def check_interval(self, dt: float) -> None:
        """Refuse seconds that a transition cannot take."""
        if self.plant is not None:
            return
        check_splits(self.linear)
        if self._injects:
            raise ValueError(
                f"dt is given, {_INJECTED}, which the observer takes out of its program (output injection) for "
                "transitions of Ts only; state a noise n above zero"
            )
        transition_rows(self.linear, dt)

    def rows_of(self, dt: float | None) -> Array:
        """Rows of the transition of a linear model in ``dt`` seconds; None = ``Ts``."""
        return self._form.state_rows(transition_rows(self.linear, dt))

    def move_stamped(self, bounds: tuple[Array, Array], u: Array, dt: float | None) -> None:
        """Carry on what is known of the state of a model with stamps that may be off."""
        assert self.stamped is not None
        self.stamped.moved(self._span(bounds), u, dt)

    def _span(self, bounds: tuple[Array, Array]) -> Span:
        n, (lower, upper) = self._normal.n_states, bounds
        return Span(lower[:n] * self._form.x, upper[:n] * self._form.x)

    # -- samples -----------------------------------------------------------------------------------

    def first_instant(self, u: Array, ahead: tuple[Array, Array] | None) -> Instant | None:
        """The inputs about the first sample, ``ahead`` being bounds of those that follow; None if stamps are exact."""
        if self._recent is None:
            return None
        recent = RecentInputs.none(self._recent.reach, u.size)
        return Instant(recent, recent.around(u, ahead))

    def next_instant(
        self, u: Array, u_next: Array, dt: float | None, ahead: tuple[Array, Array] | None
    ) -> Instant | None:
        """Those about a sample to which u drove the plant."""
        if self._recent is None:
            return None
        recent = self._recent.moved(u, dt or self.model.Ts)
        return Instant(recent, recent.around(u_next, ahead))

    def read(self, instant: Instant, y: Array) -> None:
        """The readings of a sample have been taken: their times may be yet to come."""
        assert self.model.jitter is not None
        self._recent = instant.recent.read(float(self.model.jitter[~np.isnan(y)].max(initial=0.0)), instant.around)

    def sample(
        self, u: Array, u_next: Array, y: Array, schedule: Any, number: int, instant: Instant | None = None
    ) -> Sample:
        """Model and data of the sample of this number, in normal form."""
        form, around = self._form, None if instant is None else instant.around
        if self.plant is not None:
            schedule, y = self.plant.measured(y, u_next, number, around)
        stack, (w_lower, w_upper, noise) = self._normal.stack(schedule), self._normal.bounds(schedule)
        if self.stamped is not None and around is not None:
            stack, noise, y = self.stamped.applied(form, stack, noise, y, around, u_next)
        u_next = form.inputs(u_next) if self.needs_next_input else u_next  # else zeros
        return Sample(form.inputs(u), u_next, form.outputs(y), stack, noise, w_lower, w_upper, y)

    def of_log(self, log: Log, first: int, last: int) -> LogSamples | PlantSamples | None:
        """Samples ``first`` to ``last`` - 1 for one call of the kernel; None where the first needs more than that."""
        if self._recent is not None:
            return None
        if self.plant is not None:
            return self.plant.samples(log, first, last, self.needs_next_input)
        if log.keeps_its_times or self._normal.physical_range is not None:
            return None
        return log_samples(self._form, log, first, last, self.needs_next_input)

    # -- saved states ------------------------------------------------------------------------------

    def state(self) -> dict[str, NDArray[Any]]:
        """What the next samples depend on, as named arrays."""
        plant = {} if self.plant is None else self.plant.state()
        return plant if self._recent is None else plant | self._recent.state()

    def resume(self, state: Mapping[str, NDArray[Any]], has_samples: bool) -> None:
        """Take back what `state` gave; KeyError or ValueError unless it is that of such a model."""
        if self.plant is not None:
            self.plant.resume(state, has_samples)
        if self._recent is not None:
            self._recent = RecentInputs.of_state(self._recent.reach, self.model.n_inputs, state)
