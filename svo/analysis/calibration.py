"""The smallest widening of a model's bounds that explains a healthy log which falsifies it.

Elastic linear programs: every chosen bound may give way, at the cost of the widening relative to the bound itself, and
the sum of these costs is least. The program holds a whole trajectory, and what that needs is proven.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from polytopes import HPolytope
from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.analysis.elastic_bounds import Bound, bounds_of
from svo.analysis.elastic_program import ElasticProgram, Explained
from svo.analysis.event_calibration import ContinuousPlant
from svo.analysis.explanation import NEGLIGIBLE, explain
from svo.analysis.nonlinear_calibration import WidenedPlant, half_widths
from svo.analysis.trajectory import Trajectory
from svo.checks import Array, bounded_box, expect, expect_shape, is_count
from svo.logs.log import Log, expect_log
from svo.models import NormalForm, UncertainModel, expect_model
from svo.models.intervals import has_own_intervals
from svo.models.nonlinear import NonlinearModel

_MOST_RUNS = 50
_ROOM = 1e-6  # relative: of bounds that are wide enough while the first sample of another is looked for


@dataclass(frozen=True)
class Widening(Shown):
    """One bound that is too narrow.

    Attributes
    ----------
    bound : str
        Such as "noise alpha", "disturbance gust u" or "Delta M_u".
    amount : float
        To be added at either end, in the unit of the bound, rounded up.
    relative : float
        ``amount`` as a fraction of the half-width; inf where the half-width is zero.
    sample : int
        First sample at which it is needed: with the other bounds widened and this one as it was, the data up to here
        cannot be explained, the data before can.
    """

    bound: str
    amount: float
    relative: float
    sample: int


@dataclass(frozen=True)
class Calibration(Shown):
    """Answer of `calibrate`.

    Attributes
    ----------
    widenings : tuple of Widening
        The largest relative one first; empty if the model explains the log as it is.
    chosen : tuple of str
        Names of all bounds that could have been widened.
    model : UncertainModel or NonlinearModel
        The model with these bounds widened. A linear one has a trajectory through every sample of the log: no observer
        of it falsifies the log. Of a nonlinear one a `WindowObserver` with the default options does not, which was run.
    smallest : bool
        Whether no widening that is cheaper, by more than the solver's tolerance, explains the log. It is not claimed
        if the log was longer than one program, if a Delta multiplies a state or a disturbance, or of a nonlinear model.
    """

    widenings: tuple[Widening, ...]
    chosen: tuple[str, ...]
    model: UncertainModel | NonlinearModel
    smallest: bool


@options_by_name
def calibrate(
    model: UncertainModel | NonlinearModel,
    log: Log,
    initial: HPolytope,
    *,
    bounds: Sequence[str] = ("noise", "disturbances"),
    window: int = 1000,
) -> Calibration:
    """Find which bounds of a model are too narrow for a log without faults, by how much, and where.

    Parameters
    ----------
    model : UncertainModel or NonlinearModel
    log : Log
        Fault-free data, with the schedule of each sample if the model has one; NaN in y = missing.
    initial : HPolytope
        Bounded set of the states at the first sample.
    bounds : sequence of str
        What may be widened: "noise", "disturbances" and "deltas", or of a nonlinear model "parameters", for all of a
        kind, or the name of a single bound ("noise alpha"). Names come from ``model.names``, indices stand in for
        missing ones.
    window : int
        Samples >= 2 in one program. A longer log is explained piece by piece: every next program goes on from the
        middle of the trajectory that the last one found. The pieces make one trajectory, so what is found does
        explain the log, but a smaller widening may exist.

    Returns
    -------
    Calibration
        The widenings, and the model with them.

    Notes
    -----
    The cost of a widening is its size relative to the half-width of the bound, or where that is zero to the unit of the
    normal form, which comes from the sizes of the states, so that units of the user change nothing; the sum is least,
    so few bounds are named. Where a Delta multiplies states or disturbances the least sum is a local one. Each
    uncertainty has one Delta a sample, whatever its rank: a trajectory of the model itself. Observers take an
    uncertainty of higher rank apart into terms with Deltas of their own, and how depends on units, bounds and first
    set; so each may explain a log that asks for a widening here, but none falsifies what is explained here.

    The amounts are those that the trajectory needs, followed from its first state in balls: nothing in them rests on a
    solver. Readings are allowed 1e-9 (|y| + n) of rounding, as observers allow. Where floats cannot
    hold a trajectory in sets without an interior, the window observer of full information is run on the log instead.

    A nonlinear model is calibrated on the linear models that a `WindowObserver` makes of it, remainders included, up to
    the sample that falsifies it; with the bounds that these need it is run again, until nothing is falsified. That is
    sufficient: other bounds linearise the plant elsewhere, so no smallest widening is claimed. A linear model by
    `UncertainModel.from_continuous` is calibrated in the same way on a log that keeps its own times.

    Raises
    ------
    ValueError, TypeError
        For a wrong argument; for a Delta that multiplies states or disturbances (its widening is not a linear program)
        and a disturbance polytope, if they were chosen; and if no widening of the chosen bounds explains the log.
    RuntimeError
        If the solver leaves a program undecided, or the trajectory found cannot be proven one.
    """
    expect(is_count(window, 2), "window", window, "a number of samples >= 2")
    _check_log(model, log)
    if isinstance(model, NonlinearModel):
        return _until_consistent(model, log, initial, bounds, window)
    if log.events or (log.keeps_its_times and has_own_intervals(model)):
        return _at_own_times(ContinuousPlant.of(model), log, initial, bounds, window)
    form = NormalForm.at(model, *bounded_box("initial", initial, model.n_states))
    chosen = bounds_of(form, bounds)
    amounts = np.zeros(len(chosen))
    pieces, first, start = list[_Piece](), 0, initial
    while True:
        count = min(int(window), len(log) - first)
        program = ElasticProgram(form, log, chosen, first, count, start)
        found = program.solve(amounts)
        if found is None:
            raise ValueError(_no_explanation(chosen, first, count, program.is_exact))
        before, amounts = amounts, amounts + found.widenings
        pieces.append(_Piece(program, found, first, count, before))
        if first + count == len(log):
            break
        middle = found.x[count // 2] * form.x
        first, start = first + count // 2, HPolytope.box(middle, middle)
    explanation = explain(form, log, initial, chosen, _joined(pieces))
    relative = explanation.amounts / np.array([bound.scale for bound in chosen])
    widenings = [
        Widening(bound.name, float(amount), _relative(bound, amount), _first_needed(i, relative, pieces))
        for i, (bound, amount) in enumerate(zip(chosen, explanation.amounts, strict=True))
        if amount > 0.0
    ]
    return Calibration(
        widenings=tuple(sorted(widenings, key=lambda w: -w.relative)),
        chosen=tuple(bound.name for bound in chosen),
        model=explanation.model,
        smallest=len(pieces) == 1 and program.is_exact,
    )


def _until_consistent(
    model: NonlinearModel, log: Log, initial: HPolytope, bounds: Sequence[str], window: int
) -> Calibration:
    """The linear models of each run give the bounds of the next one, until nothing is falsified."""
    initial = model.whole(initial)
    plant, first, half = WidenedPlant.of(model, bounds), dict[str, int](), half_widths(model)
    for _ in range(_MOST_RUNS):
        part = plant.falsified_part(log, initial)
        if part is None:
            break
        try:
            found = calibrate(*part, initial, bounds=plant.linear_names, window=window)
        except ValueError as error:
            raise ValueError(plant.told(str(error))) from None
        plant = plant.wider({w.bound: w.amount for w in found.widenings})
        samples = {w.bound: w.sample for w in found.widenings}
        names = zip(plant.chosen, plant.linear_names, strict=True)
        first = {name: samples[own] for name, own in names if own in samples} | first
    else:
        raise RuntimeError(f"after {_MOST_RUNS} widenings the log is still falsified; let bounds contain more")
    widenings = [
        Widening(name, amount, amount / half[name] if half[name] else np.inf, first[name])
        for name, amount in plant.amounts.items()
    ]
    widest = tuple(sorted(widenings, key=lambda w: -w.relative))
    return Calibration(widest, plant.chosen, plant.model, smallest=not widest)


def _at_own_times(
    plant: ContinuousPlant, log: Log, initial: HPolytope, bounds: Sequence[str], window: int
) -> Calibration:
    """By the equations of a linear plant, whose transitions take any time."""
    found = _until_consistent(plant.equations(log), log, initial, bounds, window)
    model = plant.widened({widening.bound: widening.amount for widening in found.widenings}, log, initial)
    return replace(found, model=model)


@dataclass(frozen=True)
class _Piece:
    """A part of the log and its trajectory; ``before`` are the relative widenings that earlier parts need."""

    program: ElasticProgram
    found: Explained
    first: int
    count: int
    before: Array


def _joined(pieces: list[_Piece]) -> Trajectory:
    """One trajectory: each piece up to the middle from which the next one goes on."""
    ends = [following.first - piece.first for piece, following in pairwise(pieces)] + [pieces[-1].count]
    parts = [
        (piece.found.x[:end], piece.found.w[:end], piece.found.deltas[:end])
        for piece, end in zip(pieces, ends, strict=True)
    ]
    return Trajectory(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _relative(bound: Bound, amount: float) -> float:
    return float(amount / bound.half) if bound.half > 0.0 else np.inf


def _first_needed(bound: int, widened: Array, pieces: list[_Piece]) -> int:
    """First sample that this bound must be widened for, the others being as wide as they became."""
    piece = next((p for p in pieces if p.found.widenings[bound] > NEGLIGIBLE), pieces[-1])
    allowed = widened + _ROOM
    allowed[bound] = piece.before[bound]

    def is_explained(samples: int) -> bool:
        return piece.program.alone(allowed, bound, samples, piece.found.signs) <= NEGLIGIBLE

    low, high = 0, 1
    while high < piece.count and is_explained(high):
        low, high = high, min(2 * high, piece.count)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if is_explained(middle) else (low, middle)
    return piece.first + high - 1


def _no_explanation(chosen: Sequence[Bound], first: int, count: int, is_exact: bool) -> str:
    names, which = ", ".join(bound.name for bound in chosen) or "nothing", f"samples {first} to {first + count - 1}"
    if is_exact:
        return f"no widening of {names} explains {which}; let bounds contain 'noise'"
    return f"no widening of {names} that explains {which} was found; let bounds contain 'noise'"


def _check_log(model: UncertainModel | NonlinearModel, log: Log) -> None:
    if not isinstance(model, NonlinearModel):
        expect_model("model", model)
    expect_log(log)
    for name, count in (("u", model.n_inputs), ("y", model.n_outputs)):
        array = getattr(log, name)
        expect_shape(array.shape[1] == count, f"{name} of the log", array, f"({len(log)}, {count})")
        if np.isinf(array).any() or (name == "u" and np.isnan(array).any()):
            raise ValueError(f"{name} of the log contains Inf or NaN; expected finite numbers (NaN only in y)")
    if model.is_scheduled and log.schedule is None:
        raise ValueError("schedule of the log is missing: the model has arrays that are functions of it")
