"""Where a chain may begin: sets that contain the state at a sample of a log, and what each of them rests on.

A model's claim is about all of its trajectories, so a proof may begin at any sample that the claim is about:

- "readings": nothing is known. With any left inverse L of the first samples' observability matrix,
  x_i = L_i (readings) + (what is left of x) + (noise, w, Delta), so that |x_i| <= c_i + G_i |x|; a box that this maps
  strictly into itself contains x, wherever it is. All of the uncertainties is left out of the rows here, bounded entry
  by entry, as the checker does.
- "physical": the range that the model promises at all times, where it is bounded.
- "first", "assumed", "largest": the set that an observer began with, at its own first sample, or began again with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from flint import arb, ctx

from svo.checks import Array
from svo.models.state_range import StateRange
from svo.observers.free_start import balls, balls_up, left_inverse
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.log_model import ModelOnLog
from svo.observers.window.sample import Sample

_ROOM = 9 / 8  # times the size of the box, within which it is looked for: as in the checker
_WIDER = _ROOM * (1 + 1e-6)
_EXTRA = 10  # samples more than states, of which the readings are tried
_BITS = 256
_ROUNDED_UP = 1e-9  # of the box: what the checker's sums in floats are larger by


@dataclass(frozen=True, eq=False)
class Start:
    """A set that contains the state at a sample.

    Attributes
    ----------
    kind : str
        As above.
    sample : int
        Of the log.
    set : ArrivalSet
        In the user's units.
    inverse : (n, samples, ny) array, or None
        Of "readings": multipliers of the outputs that bound each state from both sides.
    because : str
        Of "assumed": what the set is.
    """

    kind: str
    sample: int
    set: ArrivalSet
    inverse: Array | None = None
    because: str = "the set"

    @property
    def premise(self) -> str | None:
        """What of the set has to be taken as given; None where it follows from the model and the readings."""
        where = f"at sample {self.sample}"
        return {
            "first": "the first set",
            "largest": f"the largest set {where}, where the set started again",
            "assumed": f"{self.because} {where}",
        }.get(self.kind)

    @property
    def begins(self) -> str:
        """From where on the proof goes, in words."""
        if self.kind == "first":
            return "from the first sample"
        return f"from {'the readings since ' if self.kind == 'readings' else ''}sample {self.sample}"


def own_start(
    largest: StateRange | None, first: ArrivalSet, largest_at: int | None = None, since: int = 0
) -> Start | None:
    """Where an observer began; None if it was given another set than the first one, after the log's first sample.

    ``since`` is the sample of the log at which it was given a set, and ``largest_at`` that, counted from there, at
    which it began again from the model's ``largest`` one; one below zero is what the given set rests on.
    """
    if largest_at is not None and largest_at >= 0 and largest is not None:
        return Start("largest", since + largest_at, ArrivalSet.box(largest.lower, largest.upper))
    return None if since else Start("first", 0, first)


def from_readings(of: ModelOnLog, sample: int, last: int) -> Start | None:
    """The start that the readings from a sample on give, of as few as do, none of them after ``last``."""
    ends, form = np.abs(of.delta).max(axis=1, initial=0.0), of.form
    delta = np.column_stack([-ends, ends])  # about zero, from which the uncertainties are left out
    samples: list[Sample] = []
    for k in range(sample, min(last, sample + of.model.n_states + _EXTRA) + 1):
        samples.append(of.sample(k))
        if sum(int((~np.isnan(s.y)).sum()) for s in samples) < of.model.n_states:
            continue
        inverse = left_inverse([s.reading for s in samples], delta)
        if inverse is None:
            continue
        box = _box(samples, ends, np.swapaxes(inverse, 0, 1))
        if box is not None:
            lower, upper = (end * form.x for end in box)
            scaled = np.swapaxes(inverse, 0, 1) * form.x[:, None, None] / form.y
            return Start("readings", sample, ArrivalSet.box(lower, upper), scaled)
    return None


def _box(samples: Sequence[Sample], ends: Array, inverse: Array) -> tuple[Array, Array] | None:
    """The box that an inverse (n, samples, ny) proves, in normal form; None if the rows are no contraction."""
    bounds = _Bounds(samples, ends, inverse)
    with ctx.workprec(_BITS):
        n = len(inverse)
        known, growth = bounds.known(), balls_up(bounds.growth(np.eye(n)))
        middle, reach = known
        size = balls_up(abs(middle) + reach)
        if not (np.isfinite(size).all() and np.isfinite(growth).all()):
            return None
        with np.errstate(all="ignore"):
            try:
                box: Array = np.linalg.solve(np.eye(n) - _WIDER * growth, _WIDER * size).astype(np.float64)
            except np.linalg.LinAlgError:
                return None
        if not (np.isfinite(box).all() and (box >= 0.0).all()):
            return None
        reach = reach + bounds.growth(box[:, None])[:, 0]
        room = _ROUNDED_UP * balls_up(abs(middle) + reach)
        upper, lower = balls_up(middle + reach) + room, -balls_up(reach - middle) - room
    largest = _ROOM * np.maximum(np.abs(lower), np.abs(upper))
    return (lower, upper) if (largest <= box).all() else None


class _Bounds:
    """x_i <= middle_i + reach_i + growth_i |x|, and the same of -x_i with -middle_i: all in balls."""

    def __init__(self, samples: Sequence[Sample], ends: Array, inverse: Array) -> None:
        self._samples, self._n, self._ends = samples, len(inverse), balls(ends)
        self._weights, self._left = self._backward(balls(inverse))

    def _backward(self, inverse: Any) -> tuple[list[Any], Any]:
        """Weights (n, n + ny) of each sample's rows, and what the rows leave of each state (n, n)."""
        n, costate, found = self._n, balls(np.zeros((self._n, self._n))), []
        for j in range(len(self._samples) - 1, -1, -1):
            weight = np.hstack([costate, inverse[:, j]])
            found.append(weight)
            costate = weight @ balls(self._samples[j].stack[0])[:, :n]
        return found[::-1], abs(costate - balls(np.eye(n)))

    def known(self) -> tuple[Any, Any]:
        """Middle and reach (n,), of a state that is zero in what is left of it."""
        n, middle, reach = self._n, balls(np.zeros(self._n)), balls(np.zeros(self._n))
        for weight, s in zip(self._weights, self._samples, strict=True):
            used, lower, upper = ~np.isnan(s.y), balls(s.w_lower), balls(s.w_upper)
            on_y, half = weight[:, n:], (upper - lower) / 2
            g = weight @ balls(s.stack[0])[:, n:]
            given = np.concatenate([balls(s.u_next), [arb(1)], (lower + upper) / 2])
            middle = middle + on_y @ balls(np.where(used, s.y, 0.0)) - g @ given
            reach = reach + abs(on_y) @ balls(np.where(used, s.noise, 0.0)) + abs(g[:, g.shape[1] - half.size :]) @ half
        return middle, reach + self._uncertain(balls(np.zeros((n, 1))), 1)[:, 0]

    def growth(self, x: Array) -> Any:
        """Share (n, k) of each bound that columns x (n, k) >= 0 of |x| have."""
        return self._left @ balls(x) + self._uncertain(balls(x), 0)

    def _uncertain(self, x: Any, with_known: int) -> Any:
        """What |x| (n, k), and |u|, 1 and |w| if these are counted, contribute through what is left out."""
        n, total = self._n, balls(np.zeros((self._n, x.shape[1])))
        for weight, s in zip(self._weights, self._samples, strict=True):
            largest = np.maximum(np.abs(s.w_lower), np.abs(s.w_upper))
            rest = balls(with_known * np.concatenate([np.abs(s.u_next), [1.0], largest]))
            z = np.vstack([x, np.repeat(rest[:, None], x.shape[1], axis=1)])
            out = balls(np.zeros((weight.shape[1], z.shape[1])))
            for end, item in zip(self._ends, s.stack[1:], strict=True):
                out = out + end * (abs(balls(item)) @ z)
            total = total + abs(weight) @ out
            x = abs(balls(s.stack[0]))[:n] @ z + out[:n]
        return total
