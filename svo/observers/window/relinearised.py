"""A nonlinear model in a window: each sample is linearised over the set that is known there, with a proven remainder.

The set of a sample is the window's once it has read the sample, so the transition from it is known only then: it is
handed over afterwards, before the window takes the next sample. Everything here is in the user's units.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from svo.checks import Array
from svo.logs.log import Log
from svo.models import NormalForm
from svo.models.nonlinear import Linearisation, NonlinearModel, Span, Undecided
from svo.observers.relinearised_kernel import (
    NOT_MOVED,
    WITHOUT_ROOM,
    Carried,
    Followed,
    PlantSamples,
    follow,
    move,
    units_of,
)
from svo.observers.saved_state import numbers

_MEASURED = ("C", "c", "F", "n")  # what a sample has without a transition

OUTSIDE_MODEL = "outside"  # how a reason begins that a sample is not linearised


class Relinearised:
    """What a window observer asks of a nonlinear model at each sample.

    Parameters
    ----------
    model : NonlinearModel

    Attributes
    ----------
    reason : str or None
        Why the newest sample was not linearised.
    """

    reason: str | None = None

    def __init__(self, model: NonlinearModel) -> None:
        self.model = model
        self._carried = Carried(model)
        self._has_now = self._has_before = False
        self.start_from(Span(model.start_range.lower, model.start_range.upper))

    @property
    def box(self) -> Span:
        """Known of the newest state besides what the window knows."""
        return self._carried.box

    @property
    def now(self) -> Linearisation | None:
        """Of the newest sample, which has no transition yet; None before there is one."""
        return self._carried.now if self._has_now else None

    @property
    def before(self) -> Linearisation | None:
        """Of the one before it, with the transition from it."""
        return self._carried.before if self._has_before else None

    def connect(self, form: NormalForm) -> None:
        """That of the window that takes the samples."""
        self._units = units_of(form)

    def start_from(self, box: Span) -> None:
        """Nothing is known of the newest state but a box."""
        self._carried.box.lower[:], self._carried.box.upper[:] = box

    def _set_now(self, now: Linearisation) -> None:
        self._carried.now.rows[:], self._carried.now.n[:] = now.rows, now.n
        self._has_now = True

    def move(self, window: int, u: Array, dt: float | None) -> bool:
        """The transition from the newest sample, where a window reads it; whether its bases had room.

        It takes ``dt`` seconds; None = the model's ``Ts``.

        Raises
        ------
        Undecided
            As `NonlinearModel.transition`.
        """
        self.reason = None
        assert self.now is not None
        end, why = move(window, self.model.kernel, self._units, self._carried, u, dt or self.model.Ts)
        if why is not None:
            raise why
        if end == WITHOUT_ROOM:
            return False
        self._has_before = True
        return True

    def give_up(self, why: Undecided, sample: int) -> Span:
        """The box from which the set starts again where a transition to a sample is not enclosed."""
        self.reason = f"{OUTSIDE_MODEL}: at sample {sample}, {why}"
        largest = self.model.start_range
        self.start_from(Span(largest.lower, largest.upper))
        return self.box

    def measured(
        self, y: Array, u: Array, sample: int, around: tuple[Array, Array] | None = None
    ) -> tuple[Linearisation, Array]:
        """The newest sample without a transition, and its readings: none where the output is not enclosed."""
        model = self.model
        try:
            now, box = model.kernel.measured(self.box, y, u) if around is None else self._near(y, u, around)
            self.start_from(box)
        except Undecided as error:
            self.reason = self.reason or f"{OUTSIDE_MODEL}: at sample {sample}, {error}"
            nothing = Linearisation.empty(model.n_states, len(model.flow.varying), len(y), model.n_inputs)
            now, y = nothing._replace(n=model.noise), np.full(len(y), np.nan)
        self._set_now(now)
        return now, y

    def _near(self, y: Array, u: Array, around: tuple[Array, Array]) -> tuple[Linearisation, Span]:
        """The sample where readings may be of other instants, about which inputs are within ``around``, and its box.

        Once more over what the readings leave, which narrows what may happen meanwhile.
        """
        box, model = self.box, self.model
        for _ in range(2):
            box = model.seen_near(box, y, around)
            output = model.output_near(*box, u, around)
            box = model.kernel.cut(box, y, output) or box
        return Linearisation.before(output, model.noise, model.n_inputs), box

    # -- many samples at once --------------------------------------------------------------------------

    def sample(self, u: Array, u_next: Array, y: Array, dt: float | None) -> PlantSamples:
        """One, ``dt`` seconds after the newest; None = the model's ``Ts``."""
        return PlantSamples(u[None], u_next[None], y[None], np.array([dt or self.model.Ts]))

    def samples(self, log: Log, first: int, last: int, needs_next: bool) -> PlantSamples | None:
        """Samples ``first`` to ``last`` - 1 of a log; None where the first needs more than one call of the core.

        ``needs_next`` says whether the input of a sample itself counts.
        """
        model = self.model
        fits = (log.u.shape[1], log.y.shape[1]) == (model.n_inputs, model.n_outputs)
        if self.now is None or not 0 < first < last or log.schedule is not None or not fits:
            return None
        T = np.full(last - first, model.Ts)
        if log.keeps_its_times:
            if not model.continuous:
                return None
            T = np.diff(log.time[first - 1 : last])
        u, y = np.ascontiguousarray(log.u[first - 1 : last]), np.ascontiguousarray(log.y[first:last])
        if not np.isfinite(u).all() or np.isinf(y).any():
            return None
        return PlantSamples(u[:-1], u[1:] if needs_next else np.zeros((last - first, model.n_inputs)), y, T)

    def follow(self, window: int, samples: PlantSamples, eps: float, boxes: Array | None) -> Followed:
        """`relinearised_kernel.follow`, from what is known of the newest sample."""
        found = follow(window, self.model.kernel, self._units, self._carried, samples, eps, boxes)
        if found.done or found.end not in (WITHOUT_ROOM, NOT_MOVED):
            self._has_before, self.reason = True, None
        return found

    # -- saved states ------------------------------------------------------------------------------------

    def state(self) -> dict[str, NDArray[Any]]:
        """What the next samples depend on, as named arrays."""
        now = {} if self.now is None else {f"plant.{name}": getattr(self.now, name).copy() for name in _MEASURED}
        return {"plant.box": np.array(self.box), "plant.reason": np.array(self.reason or "")} | now

    def resume(self, state: Mapping[str, NDArray[Any]], has_samples: bool) -> None:
        """Take back what `state` gave; KeyError or ValueError unless it is that of such a model."""
        model = self.model
        n, ny, columns = model.n_states, model.n_outputs, model.carrier.n_disturbances
        box = Span(*numbers(state, "plant.box", 2, n))
        if not (box.lower <= box.upper).all():
            raise ValueError(f"plant.box is from {box.lower} to {box.upper}; expected a box")
        self.start_from(box)
        self._has_now, self.reason = False, str(state["plant.reason"]) or None
        if has_samples:
            shapes = zip(_MEASURED, ((ny, n), (ny,), (ny, columns), (ny,)), strict=True)
            parts = [numbers(state, f"plant.{name}", *shape) for name, shape in shapes]
            C, c, F, width = parts
            self._set_now(Linearisation.measured(C, c, F, width, model.n_inputs))
            if (width < model.noise).any():
                raise ValueError("plant.n is below the noise of the model")
