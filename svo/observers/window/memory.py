"""A window in the kernel's memory, in normal form: its sizes, its arrays, what the certificate of its multipliers is
made of."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from svo.checks import Array
from svo.models.normal_form import ENORMOUS, NormalForm
from svo.observers import window_kernel as kernel
from svo.observers.given_units import window_out
from svo.observers.window.certificate import WindowCertificate, certificate_of
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.output_injection import OutputInjection, can_inject
from svo.observers.window.setup import (
    channel_owners,
    disturbance_rows,
    jitter,
    needs_next_input,
    output_is_disturbed,
)
from svo.observers.window.sign_split import SplitCertificate

_GROWING_START = 16
_LARGEST_BASIS = 128
_LARGEST_GROWING_BASIS = 256
_MOST_BYTES = 8 * 2**30


class WindowMemory:
    """Arrays of a window, anchored at a set of first states, and what is fixed of its model; all in normal form.

    Attributes
    ----------
    model : UncertainModel
    horizon : int or None
    eps : float
    sign_split : int
        As in `svo.WindowObserver`.
    largest_at : int or None
        Sample at which the set last started from the model's largest set, if what is known now rests on it.
    """

    largest_at: int | None

    def _configure(self, form: NormalForm, horizon: int | None, template: Array, eps: float, sign_split: int) -> None:
        self.model, self._form, self._normal, model = form.given, form, form.model, form.model
        self.sign_split = sign_split
        self.horizon = None if horizon is None else int(horizon)
        self.eps = float(eps)
        self._block = 1 if self.horizon is None else max(1, 2 * self.horizon // 5)
        self._template = template
        self._owner = channel_owners(model)
        self._late = output_is_disturbed(model)
        sizes = model.n_states, model.n_inputs, model.n_disturbances
        self._injection = OutputInjection(*sizes) if can_inject(model) else None
        self._wants_next_input = needs_next_input(model)

    @property
    def _first_steps(self) -> int:
        """Steps that an empty window has room for."""
        return _GROWING_START if self.horizon is None else self.horizon + self._block - 1

    def _begin(self, anchor: ArrivalSet, steps: int, origin: int = 0, free: bool = False) -> None:
        """An empty window of so many steps at most, anchored at a set of first states.

        Its first sample is the observer's ``origin``; ``free`` says that the set follows from the window's readings.
        """
        self._anchor, self._origin, self._free = anchor, origin, free
        self._allocate(steps)
        n, w = self._normal.n_states, self._arrays
        w["h_lower"][:n], w["h_upper"][:n] = anchor.box_lower, anchor.box_upper
        kernel.initialise(self._window, self._size, anchor.rows, anchor.lower, anchor.upper)
        self._falsified: WindowCertificate | SplitCertificate | None = None
        self._reading: Array | None = None  # the newest one, as it was given
        self._last_bounds: tuple[Array, Array] | None = None

    def _allocate(self, steps: int) -> None:
        model = self._form.model
        n = model.n_states
        nw = model.n_disturbances + (0 if self._injection is None else n)
        w_rows = disturbance_rows(self._form)
        nv, nr = nw + len(self._owner), model.n_outputs + len(w_rows[0]) + 2 * len(self._owner)
        na = max(len(self._template), len(self._anchor.rows))
        rows, columns = na + (steps + 1) * nr, n + (steps + 1) * nv
        largest = _LARGEST_BASIS if self.horizon is not None else _LARGEST_GROWING_BASIS
        size = kernel.Sizes(
            n=n, nu=model.n_inputs, nw=nw, ny=model.n_outputs, nq=len(self._owner), nh=len(w_rows[0]),
            nt=n + len(self._template), na=na, ni=1 + len(model.uncertainties), N=steps, block=self._block,
            K=min(rows, columns, largest) + 2, late=int(self._late),
        )  # fmt: skip
        w, self._size = _room_for(size), size
        self._arrays = w
        w["T"][:n] = np.eye(n)
        w["T"][n:] = self._template
        w["owner"][:] = self._owner
        w["delta"][:] = np.array([model.uncertainties[i - 1].bounds for i in self._owner]).reshape(-1, 2)
        w["w_rows"][:, : model.n_disturbances], w["w_rows_lower"][:], w["w_rows_upper"][:] = w_rows
        w["jitter"][:] = jitter(w["jitter"].size)
        self._window = kernel.new_window(dict(w))
        if self._injection is not None:
            w |= self._injection.allocate(self._size)

    def _grow(self) -> None:
        """Twice the room; nothing has wrapped around yet, so every array is a leading block of the larger one."""
        old = self._arrays
        self._allocate(2 * self._size.N)
        for name, small in old.items():
            self._arrays[name][tuple(slice(0, length) for length in small.shape)] = small

    @property
    def _time(self) -> int:
        """Newest sample, as the kernel counts from the start of its window."""
        return int(self._arrays["clock"][kernel.TIME])

    def _arrival(self) -> ArrivalSet:
        if self._arrays["clock"][kernel.BASE] == 0:
            return self._anchor
        n, lower, upper = self.model.n_states, self._arrays["h_lower"].copy(), self._arrays["h_upper"].copy()
        return ArrivalSet(lower[:n], upper[:n], self._template, lower[n:], upper[n:])

    def _certificate(self, objective: tuple[int, Array] | None = None) -> WindowCertificate:
        """Of the multipliers at hand, about the model and the data as given.

        ``objective`` is a sample of the window, as the kernel counts, and a direction, in normal form, whose bound is
        to be proven.
        """
        if self._injection is not None:
            found = self._injection.certificate(self._arrays, self._size, self._arrival(), objective)
        else:
            found = certificate_of(self._arrays, self._size, self._arrival())
        found = replace(found, first=found.first + self._origin, last=found.last + self._origin)
        given, beyond = window_out(found, self._form), np.abs(found.samples[-1].y) == ENORMOUS
        if self._reading is None or not beyond.any():
            return given
        newest = replace(given.samples[-1], y=np.where(beyond, self._reading, given.samples[-1].y))
        return replace(given, samples=(*given.samples[:-1], newest))


def _room_for(size: kernel.Sizes) -> dict[str, Any]:
    """The arrays of a window, or an error that names the horizon, also where the machine has no room for them."""
    _check_room(size)
    try:
        return kernel.allocate(size)
    except MemoryError as error:
        raise ValueError(f"horizon makes a window of {size.N} steps ({error}); expected a shorter one") from None


def _check_room(size: kernel.Sizes) -> None:
    """Refuse a window whose rows, which are kept twice, no machine could hold, before they are allocated."""
    nv, nr = size.nw + size.nq, size.ny + size.nh + 2 * size.nq
    needed = 16 * (size.N + 1) * nr * (size.n + (size.N + 1) * nv)
    if needed > _MOST_BYTES:
        raise ValueError(
            f"horizon makes a window of {size.N:.3g} steps, whose rows take {needed / 2**30:.3g} GB; expected at most "
            f"{_MOST_BYTES // 2**30} GB: take a shorter one"
            if size.N < 2**500
            else "horizon is beyond all memory; expected a number of steps"
        )
