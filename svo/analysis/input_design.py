"""Inputs that force a plant with a fault to show: least energy for models that must differ within N samples.

With the inputs fixed, the separation of two models is a linear program (`svo.analysis.model_pair`): the least widening
of both noises that gives them a common output. That the separation be at least a margin is a bilevel constraint on the
inputs, and not convex; with its multipliers kept, the program's dual is affine in the inputs and, by weak duality,
never above the separation. So the least energy under these affine rows is a quadratic program whose solution separates
for certain and costs no more than the inputs that gave the multipliers. Repeated, this is the convex-concave procedure
on the bilevel program (which Scott et al., Automatica 50, 2014, solve by integer programming, for zonotopes): the
energy falls from step to step towards a local optimum.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import cvxpy as cp
import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes import HPolytope
from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.analysis.distinguish import Distinguishability, distinguishability
from svo.analysis.model_pair import LEAST_SEPARATION, ModelPair
from svo.analysis.nonlinear_design import Models, candidates, separating
from svo.checks import Array, expect, expect_kind, finite_array, is_count, is_finite_number, listed
from svo.models import UncertainModel
from svo.models.nonlinear import NonlinearModel

_ROUNDS = 60
_DECREASE = 1e-4  # of the energy, relative, below which the iteration stops
_TURNS = (0, 1, 2, 3)  # changes of sign of the inputs that the search starts from: constants, doublets, ...
_RANDOM = 40  # starts an input, besides
_CLIMBS = 8  # starts that are followed: of those that separate the cheapest, of the others the nearest to it
_PATIENCE = 3  # descents to nothing cheaper after which no more are made
_BACKTRACKS = 6


@dataclass(frozen=True)
class InputDesign(Shown):
    """Answer of `design_input`.

    Attributes
    ----------
    u : (N, nu) array or None
        The inputs, reference included; None if no start led to inputs that separate.
    reference : (N, nu) array
        What the energy counts from.
    energy : float or None
        Sum over samples and inputs of weight (u - reference)^2. No larger than that of any input that the search
        passed, but only locally the least: the problem is not convex.
    separation : float
        Of ``u``, the least over the observers, in noise widths as in `Distinguishability`; without ``u`` the largest
        that was found (negative: so much narrower would the noises have to be).
    checks : tuple of Distinguishability
        ``u`` against each observer's model, from `distinguishability`; empty without ``u``.
    """

    u: Array | None
    reference: Array
    energy: float | None
    separation: float
    checks: tuple[Distinguishability, ...]

    @property
    def horizon(self) -> int | None:
        """Samples within which every observer is falsified for certain; None without ``u``."""
        horizons = [check.horizon for check in self.checks if check.horizon is not None]
        return max(horizons) if self.checks and len(horizons) == len(self.checks) else None


@options_by_name
def design_input(
    plant_model: UncertainModel | NonlinearModel,
    observer_models: UncertainModel | NonlinearModel | Sequence[UncertainModel | NonlinearModel],
    horizon: int,
    *,
    initial: HPolytope,
    limits: tuple[ArrayLike, ArrayLike],
    observer_initial: HPolytope | Sequence[HPolytope] | None = None,
    reference: ArrayLike | None = None,
    schedule: ArrayLike | None = None,
    weight: ArrayLike | None = None,
    hold: int = 1,
    margin: float = 1e-2,
) -> InputDesign:
    """Inputs of little energy under which a plant falsifies observers within a number of samples, whatever happens.

    Parameters
    ----------
    plant_model : UncertainModel or NonlinearModel
        The plant, with its fault at a stated size; it should not contain the fault-free plant.
    observer_models : UncertainModel, NonlinearModel, or sequence of them
        Models that must be falsified: those of one observer, or of all that must fall to isolate the fault.
    horizon : int
        Samples N >= 1 within which each of them is falsified.
    initial : HPolytope
        Bounded set of the plant's states at the first sample.
    limits : (lower, upper)
        Bounds of the inputs, each (nu,) or (N, nu). Equal ones fix an input.
    observer_initial : HPolytope or sequence, optional
        Sets of the observers' states at the first sample; ``initial`` by default.
    reference : (K, nu) array, optional
        Inputs of K >= N samples that would be applied anyway; zero by default. The designed ones deviate from it.
    schedule : (K, ...) array, optional
        Scheduling value of each sample; needed if an array of a model is a function of it. It is taken as given,
        whatever the inputs do.
    weight : (nu,) array, optional
        Weights of the squared deviations; 1 by default. Give 1 / range^2 where inputs have different units.
    hold : int
        The deviation is constant over so many samples.
    margin : float
        Separation, in noise widths, that is asked for.

    Returns
    -------
    InputDesign
        With ``u`` None if none of the starts leads to separation: inputs at their limits, alone and in pairs, with up
        to three changes of sign, and random ones within the limits (always the same).

    Raises
    ------
    ValueError, TypeError
        For models that do not belong together, and for a wrong or missing argument.
    RuntimeError
        If a solver leaves a program undecided.

    Notes
    -----
    The answer holds for exactly these inputs, and for whatever first states, disturbances, noises and Deltas within
    their bounds. Where products with Delta are relaxed it is sufficient, as `distinguishability` tells.

    Of nonlinear models linear ones along the reference, then along the last design, give candidates, and inputs at
    their limits follow; the first of them that `distinguishability` proves in the tubes is taken. Its energy is not the
    least, and ``u`` None says that none of these was proven.
    """
    models = [observer_models] if isinstance(observer_models, UncertainModel | NonlinearModel) else observer_models
    expect_kind("plant_model", plant_model, (UncertainModel, NonlinearModel), "an UncertainModel or a NonlinearModel")
    observers: list[Any] = listed("observer_models", models, UncertainModel, NonlinearModel)
    sets = _sets(observer_initial, initial, len(observers))
    _check_numbers(horizon, hold, margin)
    given = _reference(reference, horizon, plant_model.n_inputs)
    plant: Any = plant_model
    every = Models(plant, observers, initial, sets, schedule)
    if not every.are_linear:
        bounds, weights = _limits(limits, given), _weight(weight, given.shape[1])
        again: dict[str, Any] = {"limits": limits, "reference": given, "weight": weight, "hold": hold}
        design = lambda near, asked: design_input(  # noqa: E731
            near.plant, near.observers, horizon, initial=initial, observer_initial=sets, schedule=near.schedule,
            margin=asked, **again,
        ).u  # fmt: skip
        tried = candidates(every, given, bounds, margin, design, _waves(horizon) if hold == 1 else ())
        u, separation, checks = separating(every, tried)
        energy = None if u is None else float(np.sum(weights * np.square(u - given)))
        return InputDesign(u, given, energy, separation, checks)
    pairs = [
        ModelPair(plant, model, horizon, initial, start, given, schedule)
        for model, start in zip(observers, sets, strict=True)
    ]
    search = _Search(pairs, given, _limits(limits, given), _weight(weight, given.shape[1]), hold, margin)
    u, separation = search.run()
    if u is None:
        return InputDesign(None, given, None, separation, ())
    checks = tuple(
        distinguishability(plant_model, model, horizon, initial=initial, observer_initial=start, u=u, schedule=schedule)
        for model, start in zip(observers, sets, strict=True)
    )
    return InputDesign(u, given, search.energy(u), separation, checks)


def _waves(samples: int) -> list[NDArray[np.bool_]]:
    """Where an input is up (N,), with few changes of sign, of either sign first."""
    up = [np.arange(samples) * (turns + 1) // samples % 2 == 0 for turns in _TURNS]
    return [side for wave in up for side in (wave, ~wave)]


@dataclass(frozen=True)
class _Support:
    """Affine lower bounds of the separations: value (pairs,) at u, and slopes (pairs, N, nu)."""

    u: Array
    values: Array
    slopes: Array

    @property
    def separation(self) -> float:
        return float(self.values.min())


class _Search:
    """Many starts, ascent to separation from the best, then descent in energy; each accepted step is solved anew."""

    def __init__(
        self, pairs: list[ModelPair], reference: Array, limits: tuple[Array, Array], weight: Array, hold: int,
        margin: float,
    ) -> None:  # fmt: skip
        self._pairs, self._reference, self._weight, self._margin = pairs, reference, weight, margin
        self._lower, self._upper = limits
        self._pieces = np.repeat(np.eye(-(-len(reference) // hold)), hold, axis=0)[: len(reference)]
        inside = self._pieces.T[:, :, None] > 0.0
        self._lower_piece = np.where(inside, self._lower - reference, -np.inf).max(axis=1)
        self._upper_piece = np.where(inside, self._upper - reference, np.inf).min(axis=1)
        if (self._lower_piece > self._upper_piece).any():
            raise ValueError("limits leave no deviation that is constant over hold samples; take a shorter hold")

    def energy(self, u: Array) -> float:
        """Weighted squares of the deviation from the reference."""
        return float(np.sum(self._weight * np.square(u - self._reference)))

    def run(self) -> tuple[Array | None, float]:
        """The cheapest inputs found and their separation; without any, the largest separation."""
        tried = [self._support(start) for start in self._starts()]
        tried.sort(key=lambda at: -at.separation)
        reached = [at for at in tried if at.separation >= self._margin]
        reached.sort(key=lambda at: self.energy(at.u))
        if not reached or self.energy(reached[0].u) > 0.0:
            reached = reached[:_CLIMBS] + [self._ascend(at) for at in tried[:_CLIMBS] if at.separation < self._margin]
        best = self._cheapest_of([at for at in reached if at.separation >= self._margin])
        if best is None:
            return None, max(at.separation for at in [*tried, *reached])
        return best.u, best.separation

    def _cheapest_of(self, starts: Sequence[_Support]) -> _Support | None:
        """The cheapest end of descents, which stop when some in a row have led to nothing cheaper."""
        best, idle = None, 0
        for start in starts:
            found = self._descend(start)
            if best is None or self.energy(found.u) < (1.0 - _DECREASE) * self.energy(best.u):
                best, idle = found, 0
            else:
                idle += 1
            if idle == _PATIENCE:
                break
        return best

    def _starts(self) -> Iterator[Array]:
        """The reference; inputs at their limits, alone and in pairs, with a few changes of sign; then random ones."""
        yield self._held(self._reference)
        free = np.flatnonzero((self._lower_piece < self._upper_piece).any(axis=0)).tolist()
        for i in free:
            for wave in _waves(len(self._reference)):
                yield self._at_limits({i: wave})
        for i, j in itertools.combinations(free, 2):
            for one, other in itertools.product(_waves(len(self._reference)), repeat=2):
                yield self._at_limits({i: one, j: other})
        rng = np.random.default_rng(0)
        for _ in range(_RANDOM * len(free)):
            inside = rng.uniform(size=self._lower_piece.shape)
            deviation = self._lower_piece + (self._upper_piece - self._lower_piece) * inside
            yield self._reference + self._pieces @ deviation

    def _at_limits(self, up: dict[int, NDArray[np.bool_]]) -> Array:
        """Some inputs at their upper limits where their wave (N,) is up, else at the lower ones; the others left."""
        u = self._reference.copy()
        for i, wave in up.items():
            u[:, i] = np.where(wave, self._upper[:, i], self._lower[:, i])
        return self._held(u)

    def _held(self, u: Array) -> Array:
        """Inputs near the given ones whose deviation is constant over each piece, within the limits."""
        deviation = (self._pieces.T @ (u - self._reference)) / self._pieces.sum(axis=0)[:, None]
        return self._reference + self._pieces @ np.clip(deviation, self._lower_piece, self._upper_piece)

    def _support(self, u: Array) -> _Support:
        solved = [pair.with_inputs(u).solve(len(u), least=-1.0) for pair in self._pairs]
        return _Support(u, np.array([s.separation for s in solved]), np.array([s.input_slope for s in solved]))

    def _ascend(self, at: _Support) -> _Support:
        """Towards the margin along the affine bounds; the separation grows from step to step."""
        for _ in range(_ROUNDS):
            if at.separation >= self._margin:
                break
            after = self._accept(at, self._steepest(at), at.separation + 1e-6)
            if after is None:
                break
            at = after
        return at

    def _descend(self, at: _Support) -> _Support:
        """Less energy under the affine bounds; the separation stays above the margin."""
        for _ in range(_ROUNDS):
            before = self.energy(at.u)
            after = self._accept(at, self._cheapest(at), self._margin * (1.0 - 1e-3))
            if after is None or self.energy(after.u) >= (1.0 - _DECREASE) * before:
                break
            at = after
        return at

    def _accept(self, at: _Support, target: Array, least: float) -> _Support | None:
        """The first point on the way back from a target that separates so far: rows change where an s changes sign."""
        for k in range(_BACKTRACKS):
            new = self._support(at.u + 0.5**k * (target - at.u))
            if new.separation >= least:
                return new
        return None

    def _steepest(self, at: _Support) -> Array:
        """Inputs with the largest of the least affine bound, as far as the margin needs it."""
        deviation = cp.Variable(self._lower_piece.shape)
        bound = cp.Variable()
        limit = self._margin + max(self._margin, 0.1 * (self._margin - at.separation))
        return self._optimum(cp.Maximize(bound), [self._bounds(at, deviation) >= bound, bound <= limit], deviation)

    def _cheapest(self, at: _Support) -> Array:
        """Inputs of least energy whose affine bounds reach the margin."""
        deviation = cp.Variable(self._lower_piece.shape)
        scale = np.sqrt(self._weight * self._pieces.sum(axis=0)[:, None])
        cost = cp.sum_squares(cp.multiply(scale, deviation))
        return self._optimum(cp.Minimize(cost), [self._bounds(at, deviation) >= self._margin], deviation)

    def _bounds(self, at: _Support, deviation: Any) -> Any:
        """The affine bounds (pairs,) as an expression of the pieces' deviations."""
        base = at.values + np.sum(at.slopes * (self._reference - at.u), axis=(1, 2))
        slopes = self._pieces.T @ at.slopes
        return cp.hstack([base[j] + cp.sum(cp.multiply(slopes[j], deviation)) for j in range(len(base))])

    def _optimum(self, objective: Any, rows: list[Any], deviation: Any) -> Array:
        problem = cp.Problem(objective, [*rows, deviation >= self._lower_piece, deviation <= self._upper_piece])
        problem.solve(solver=cp.CLARABEL)
        if deviation.value is None:
            raise RuntimeError(
                f"cvxpy left a program of the input design undecided ({problem.status}); scale the inputs"
            )
        inside = np.clip(deviation.value, self._lower_piece, self._upper_piece)
        return self._reference + self._pieces @ inside


def _sets(given: HPolytope | Sequence[HPolytope] | None, initial: HPolytope, count: int) -> list[HPolytope]:
    """One set of first states an observer."""
    if given is None or isinstance(given, HPolytope):
        return [given or initial] * count
    sets = listed("observer_initial", given, HPolytope)
    if len(sets) != count:
        raise ValueError(f"observer_initial has {len(sets)} sets; expected {count}, one an observer's model")
    return sets


def _check_numbers(horizon: int, hold: int, margin: float) -> None:
    for name, value in (("horizon", horizon), ("hold", hold)):
        expect(is_count(value, 1), name, value, "a number of samples >= 1")
    enough = is_finite_number(margin) and margin > LEAST_SEPARATION
    expect(enough, "margin", margin, f"a separation above {LEAST_SEPARATION:g} noise widths")


def _reference(reference: ArrayLike | None, horizon: int, count: int) -> Array:
    if count == 0:
        raise ValueError("plant_model has no inputs; expected one with inputs to design")
    if reference is None:
        return np.zeros((horizon, count))
    values = finite_array("reference", reference)
    if values.ndim != 2 or values.shape[1] != count or len(values) < horizon:
        raise ValueError(
            f"reference has shape {values.shape}; expected finite numbers of shape (K, {count}) with K >= {horizon}"
        )
    return values[:horizon]


def _limits(limits: tuple[ArrayLike, ArrayLike], reference: Array) -> tuple[Array, Array]:
    """Bounds (N, nu) of the inputs."""
    try:
        lower, upper = limits
    except (TypeError, ValueError) as error:
        raise ValueError(f"limits is {limits!r}; expected (lower, upper)") from error
    ends = finite_array("lower limit", lower), finite_array("upper limit", upper)
    try:
        lower, upper = (np.broadcast_to(end, reference.shape) for end in ends)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"limits is {limits!r}; expected (lower, upper), each of shape ({reference.shape[1]},) or {reference.shape}"
        ) from error
    if not (lower <= upper).all():
        raise ValueError("limits: a lower one is above its upper one; expected lower <= upper")
    return lower, upper


def _weight(weight: ArrayLike | None, count: int) -> Array:
    values = np.ones(count) if weight is None else finite_array("weight", weight)
    fits = values.shape == (count,) and (values > 0).all()
    expect(fits, "weight", weight, f"{count} positive numbers, one an input")
    return values
