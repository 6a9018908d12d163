"""The smallest widening of a model's bounds that explains a healthy log which falsifies it.

Elastic linear programs: every chosen bound may give way, at the cost of the widening relative to the bound itself, and
the sum of these costs is least. The program holds a whole trajectory, so its answer is an explanation, not a promise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polytopes import HPolytope
from svo.analysis.elastic_program import Bound, ElasticProgram, bounds_of, widened
from svo.analysis.lifted_rows import bounding_box
from svo.checks import Array
from svo.logs.log import Log
from svo.models.model import UncertainModel
from svo.models.normal_form import NormalForm

NEGLIGIBLE = 1e-7  # relative widening that the solver's tolerance may cause
_ROUNDED_UP = 1e-6  # relative to the bound; room for the solver's tolerance


@dataclass(frozen=True)
class Widening:
    """One bound that is too narrow.

    Attributes
    ----------
    bound : str
        Such as "noise alpha", "disturbance gust u" or "Delta M_u".
    amount : float
        To be added at either end, in the unit of the bound (rounded up by a millionth of the bound).
    relative : float
        ``amount`` as a fraction of the half-width; of 1 where the half-width is zero.
    sample : int
        First sample at which it is needed: with the other bounds widened and this one as it was, the data up to here
        cannot be explained, the data before can.
    """

    bound: str
    amount: float
    relative: float
    sample: int


@dataclass(frozen=True)
class Calibration:
    """Answer of `calibrate`.

    Attributes
    ----------
    widenings : tuple of Widening
        The largest relative one first; empty if the model explains the log as it is.
    chosen : tuple of str
        Names of all bounds that could have been widened.
    model : UncertainModel
        The model with these bounds widened: a trajectory of it explains every sample of the log.
    smallest : bool
        Whether no cheaper widening explains the log. It is not claimed if the log was longer than one program, or if
        a Delta multiplies a state or a disturbance.
    """

    widenings: tuple[Widening, ...]
    chosen: tuple[str, ...]
    model: UncertainModel
    smallest: bool


def calibrate(
    model: UncertainModel,
    log: Log,
    initial: HPolytope,
    bounds: Sequence[str] = ("noise", "disturbances"),
    *,
    window: int = 1000,
) -> Calibration:
    """Find which bounds of a model are too narrow for a log without faults, by how much, and where.

    Parameters
    ----------
    model : UncertainModel
    log : Log
        Fault-free data, with the schedule of each sample if the model has one; NaN in y = missing.
    initial : HPolytope
        Bounded set of the states at the first sample.
    bounds : sequence of str
        What may be widened: "noise", "disturbances" and "deltas" for all of a kind, or the name of a single bound
        ("noise alpha"). Names come from ``model.names``, indices stand in for missing ones.
    window : int
        Samples >= 2 in one program. A longer log is explained piece by piece: every next program goes on from the
        middle of the trajectory that the last one found. The pieces make one trajectory, so what is found does
        explain the log, but a smaller widening may exist.

    Notes
    -----
    The cost of a widening is its size relative to the half-width of the bound (a bound of zero counts in its own unit);
    the sum is least, so few bounds are named. A Delta that multiplies states or disturbances takes the sign that its
    factor has along the best trajectory with every Delta at its centre; this can only make the widening larger.
    An uncertainty of higher rank than one enters as a sum of rank-one terms, each with a Delta of its own, as in
    `WindowObserver`.

    Raises
    ------
    ValueError, TypeError
        For a wrong argument; for a Delta that multiplies states or disturbances (its widening is not a linear program)
        and a disturbance polytope, if they were chosen; and if no widening of the chosen bounds explains the log.
    RuntimeError
        If the solver leaves a program undecided.
    """
    if not isinstance(window, int | np.integer) or window < 2:
        raise ValueError(f"window is {window!r}; expected a number of samples >= 2")
    _check_log(model, log)
    form = NormalForm.at(model, *bounding_box("initial", initial, model.n_states))
    chosen = bounds_of(model, bounds)
    amounts, samples = np.zeros(len(chosen)), dict[int, int]()
    first, start = 0, initial
    while True:
        count = min(int(window), len(log) - first)
        piece = ElasticProgram(form, log, chosen, first, count, start)
        found = piece.solve(amounts)
        if found is None:
            names = ", ".join(bound.name for bound in chosen) or "nothing"
            raise ValueError(
                f"no widening of {names} explains samples {first} to {first + count - 1}; let bounds contain 'noise'"
            )
        needed = np.flatnonzero(found.widenings > NEGLIGIBLE)
        before, amounts = amounts, amounts.copy()
        amounts[needed] += found.widenings[needed] + _ROUNDED_UP
        for i in needed:
            if i not in samples:
                samples[int(i)] = first + _first_needed(piece, int(i), before, amounts, found.signs, count)
        if first + count == len(log):
            break
        first, start = first + count // 2, HPolytope.box(found.x[count // 2], found.x[count // 2])
    widenings = [_widening(chosen[i], amounts[i], samples[i]) for i in samples]
    return Calibration(
        widenings=tuple(sorted(widenings, key=lambda w: -w.relative)),
        chosen=tuple(bound.name for bound in chosen),
        model=widened(model, chosen, amounts),
        smallest=len(log) <= window and piece.is_exact,
    )


def _widening(bound: Bound, amount: float, sample: int) -> Widening:
    return Widening(bound.name, float(amount * bound.scale), float(amount), sample)


def _first_needed(piece: ElasticProgram, bound: int, before: Array, after: Array, signs: Array, count: int) -> int:
    """Smallest sample of a piece that the data up to it need this bound to be widened for, the others being wide."""
    allowed = after.copy()
    allowed[bound] = before[bound]

    def is_explained(samples: int) -> bool:
        found = piece.solve(allowed, samples, only=bound, signs=signs)
        return found is not None and bool(found.widenings[bound] <= NEGLIGIBLE)

    low, high = 0, 1
    while high < count and is_explained(high):
        low, high = high, min(2 * high, count)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if is_explained(middle) else (low, middle)
    return high - 1


def _check_log(model: UncertainModel, log: Log) -> None:
    if not isinstance(log, Log):
        raise TypeError(f"log is {type(log).__name__}; expected an svo.Log")
    if len(log) == 0:
        raise ValueError("log has no samples; expected at least one")
    for name, count in (("u", model.n_inputs), ("y", model.n_outputs)):
        array = getattr(log, name)
        if array.shape[1] != count:
            raise ValueError(f"{name} of the log has shape {array.shape}; expected ({len(log)}, {count})")
        if np.isinf(array).any() or (name == "u" and np.isnan(array).any()):
            raise ValueError(f"{name} of the log contains Inf or NaN; expected finite numbers (NaN only in y)")
    if model.is_scheduled and log.schedule is None:
        raise ValueError("schedule of the log is missing: the model has arrays that are functions of it")
