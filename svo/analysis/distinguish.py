"""Whether a plant can hide behind another model: the smallest number of samples after which it cannot.

The question is directed: a plant, with a fault of a stated size, against the model of an observer. Both may use any
first state, disturbance, noise and Delta within their bounds. If no choice gives both the same outputs over N
samples, the observer is falsified within these N samples, whatever happens.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.analysis.model_pair import ModelPair, PairSolution, Witness, check_comparable
from svo.analysis.tube import Tube
from svo.checks import Array, expect, finite_array, is_count
from svo.models import UncertainModel, expect_model
from svo.models.nonlinear import NonlinearModel


@dataclass(frozen=True)
class Distinguishability(Shown):
    """Answer of `distinguishability`.

    Attributes
    ----------
    horizon : int or None
        Smallest number of samples N that no common output covers: the observer is falsified at the latest by the
        N-th sample. None if there is no such N up to ``searched``.
    searched : int
        Largest number of samples that was asked for.
    separation : float
        How much wider the noise of both would have to be, relative to the sum of their bounds, to give common outputs
        over ``horizon`` (or ``searched``) samples. Proven from below by weak duality.
    exact : bool
        Whether no product Delta s was relaxed. If one was, ``horizon`` is still valid but perhaps not the smallest, and
        None says only that none was found.
    witness : Witness or None
        The longest common output that was found: over horizon - 1, or ``searched`` samples. None if there is none (the
        first sample separates), or if it belongs to the relaxed program only.
    """

    horizon: int | None
    searched: int
    separation: float
    exact: bool
    witness: Witness | None


@options_by_name
def distinguishability(
    plant_model: UncertainModel | NonlinearModel,
    observer_model: UncertainModel | NonlinearModel,
    horizon: int,
    *,
    initial: HPolytope,
    observer_initial: HPolytope | None = None,
    u: ArrayLike | HPolytope | None = None,
    schedule: ArrayLike | None = None,
) -> Distinguishability:
    """The smallest number of samples within which an observer of one model is always falsified by another plant.

    Each number of samples is one sparse linear program: the least widening of both noises that gives a common output.
    It is exact without uncertainties, and where s of every product Delta s (s = f'(x, u, 1, w)) is known or keeps one
    sign over a reachable set that needs no measurements; elsewhere the product is relaxed to its convex hull, and so
    are uncertainties of higher rank than one. Then the answer is sufficient only, which `Distinguishability.exact`
    tells. The number found is valid for an observer that keeps all data since the first sample
    (``WindowObserver(..., horizon=None)``); one with a window keeps less.

    Parameters
    ----------
    plant_model : UncertainModel or NonlinearModel
        The plant, with its fault at a stated size; it should not contain the fault-free plant.
    observer_model : UncertainModel or NonlinearModel
        What the observer assumes; as many inputs and outputs as the plant.
    horizon : int
        Largest number of samples N >= 1 to search.
    initial : HPolytope
        Bounded set of the plant's states at the first sample.
    observer_initial : HPolytope, optional
        The same for the observer's model; ``initial`` by default.
    u : (K, nu) array or HPolytope
        The inputs of K >= horizon samples, or a bounded set that each input lies in; then the answer holds for every
        sequence out of it. May be left out for models without inputs.
    schedule : (K, ...) array, optional
        Scheduling value of each sample; needed if an array of a model is a function of it.

    Returns
    -------
    Distinguishability
        The number of samples, whether it is exact, and a common output of both models over one sample less.

    Raises
    ------
    ValueError, TypeError
        For models that do not belong together, and for a wrong or missing argument.
    RuntimeError
        If the solver leaves a program undecided.

    Notes
    -----
    A nonlinear model is linearised at each sample over the tube of all its states from the first set on under ``u``,
    remainders included, so that a number is proven of its own equations: no output is one of both models. The tube
    knows no measurement, and grows; None says that nothing was shown, and ``searched`` how far the tube was enclosed.
    """
    if isinstance(plant_model, NonlinearModel) or isinstance(observer_model, NonlinearModel):
        return _in_tubes(plant_model, observer_model, horizon, initial, observer_initial or initial, u, schedule)
    pair = ModelPair(plant_model, observer_model, horizon, initial, observer_initial or initial, u, schedule)
    below, above = 0, 1
    answers: dict[int, PairSolution] = {}
    while True:  # doubling, then bisection: feasibility can only be lost as samples are added
        answers[above] = pair.solve(above)
        if answers[above].separated or above == horizon:
            break
        below, above = above, min(2 * above, horizon)
    if not answers[above].separated:
        last = answers[above]
        return Distinguishability(None, horizon, last.separation, last.exact, last.witness())
    while above - below > 1:
        middle = (below + above) // 2
        answers[middle] = pair.solve(middle)
        below, above = (below, middle) if answers[middle].separated else (middle, above)
    exact = answers[above].exact and (below == 0 or answers[below].exact)
    witness = answers[below].witness() if below else None
    return Distinguishability(above, horizon, answers[above].separation, exact, witness)


def _in_tubes(
    plant: Any, observer: Any, horizon: int, initial: HPolytope, observer_initial: HPolytope, u: Any, schedule: Any
) -> Distinguishability:
    """Of the linear models that hold in the tubes of nonlinear ones."""
    expect(is_count(horizon, 1), "horizon", horizon, "a number of samples >= 1")
    for name, model in (("plant_model", plant), ("observer_model", observer)):
        if not isinstance(model, NonlinearModel):
            expect_model(name, model)
    check_comparable(plant, observer)
    inputs = inputs_along(plant, u, horizon)
    initial, observer_initial = (
        model.whole(start) if isinstance(model, NonlinearModel) else start
        for model, start in ((plant, initial), (observer, observer_initial))
    )
    linear, most = list[UncertainModel](), horizon
    for name, model, start in (("initial", plant, initial), ("observer_initial", observer, observer_initial)):
        if isinstance(model, NonlinearModel):
            tube = Tube.of(name, model, start, inputs)
            linear.append(tube.model)
            most = min(most, tube.samples)
        else:
            linear.append(model if schedule is None else model.along(np.asarray(schedule)[:horizon]))
    own, other = linear
    numbers = np.arange(float(horizon))
    found = distinguishability(
        own, other, most, initial=initial, observer_initial=observer_initial, u=inputs, schedule=numbers
    )
    return replace(found, exact=False, witness=None)


def inputs_along(model: UncertainModel | NonlinearModel, u: Any, horizon: int) -> Array:
    """The inputs (horizon, nu) of a tube."""
    if isinstance(u, HPolytope):
        raise TypeError("u is a set; expected inputs (K, nu), along which nonlinear models are enclosed")
    if u is None and model.n_inputs == 0:
        return np.zeros((horizon, 0))
    expect(u is not None, "u", u, f"inputs ({horizon}, {model.n_inputs}) of at least as many samples as horizon")
    given: Array = finite_array("u", u, ("samples", model.n_inputs))
    expect(len(given) >= horizon, "u", given.shape, f"at least {horizon} samples, as many as horizon")
    return given[:horizon]
