"""Sets that a disturbed linear system does not leave: the largest one in a constraint, and a smallest one from outside.

The largest: ``O_0 = X``, ``O_k+1 = O_k`` and the predecessor of O_k, until nothing changes (Gilbert and Tan 1991,
Kolmanovsky and Gilbert 1998).  The smallest: with ``A^s W`` in ``factor W``, the sum of ``A^i W`` for i < s over
``1 - factor`` holds it (Rakovic, Kerrigan, Kouramas and Mayne 2005).  What is called invariant is proved: no transition
from the set leaves it, decided in rationals about the rows and matrices as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from polytopes import Certificate, HPolytope, UndecidedError
from polytopes.inclusion import half_spaces
from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.analysis.kept_vertices import can_be_kept
from svo.analysis.one_step_sets import LinearSystem, predecessor, system_of
from svo.checks import Array, expect, expect_kind, real_array, real_number, whole_number
from svo.models.model import UncertainModel

_SLACK = 1e-6  # of the factor: room for rounding in the proof
_ENDED = 1e-9  # of the width of a set along a row: by so much it may break it where a search ends
_INWARD = 1e-11  # of its terms: how far a row moves inward where rounding left no proof; then 1e2 and 1e4 times


@dataclass(frozen=True, eq=False)
class InvariantSet(Shown):
    """The answer to a search for an invariant set.

    Attributes
    ----------
    status : {"invariant", "empty", "undecided"}
        "invariant": proved.  "empty": there is none.  "undecided": the search did not end, or left no proof.
    set : HPolytope
        The invariant set; where undecided the last iterate, which is not invariant, and where empty the one that is.
    steps : int
        Steps of the search; of the smallest set the number of terms of its sum.
    reason : str
    system : LinearSystem
    certificate : Certificate or None
        With "empty": exact multipliers that prove it of the rows of `set`.
    factor : float or None
        Of the smallest set: it is at most so many times as large as the exact one (of the widened system).
    widened_by : array (n,) or None
        Half-widths of the box that was added to ``E w``.
    """

    status: Literal["invariant", "empty", "undecided"]
    set: HPolytope
    steps: int
    reason: str
    system: LinearSystem
    certificate: Certificate | None = None
    factor: float | None = None
    widened_by: Array | None = None

    def verify(self) -> bool:
        """Whether the status is proved, once again, in rationals."""
        if self.status == "empty":
            return self.certificate is not None and self.certificate.verify(self.set)
        return self.status == "invariant" and is_invariant(self.set, self.system, self.widened_by)


def is_invariant(P: HPolytope, system: LinearSystem, room: Array | None = None) -> bool:
    """Whether no transition from P leaves it, decided exactly; with inputs, whether some input keeps every state in.

    With inputs every vertex is asked for one (Gutman and Cwikel 1986); where rounding of a side leaves that open, the
    answer is False.

    Parameters
    ----------
    P : HPolytope
    system : LinearSystem
    room : array (n,), optional
        Half-widths of a box that is added to the next state.

    Raises
    ------
    UndecidedError
        If the program is too large for rationals where floats cannot decide.
    """
    if system.inputs is None:
        n, steps = system.n_states, system.transitions(P, room)
        return steps <= P.lift(steps.dim, range(steps.dim - n, steps.dim))
    return can_be_kept(P, system)


@options_by_name
def largest_invariant_set(
    constraint: HPolytope,
    system: LinearSystem | UncertainModel,
    *,
    inputs: HPolytope | None = None,
    max_steps: int = 100,
) -> InvariantSet:
    """The largest set in a constraint that the system does not leave, for all w (and for some u, where it has inputs).

    ``O_0`` is the constraint, ``O_k+1`` is what `predecessor` leaves of ``O_k`` (Gilbert and Tan 1991, Kolmanovsky and
    Gilbert 1998). Every iterate contains the set; the last one is proved invariant where the search ends.  Where that
    leaves no proof, the search goes on from there with new rows moved inward by 1e-11 of their terms, then 1e-9 and
    1e-7: the set is then invariant, smaller than the largest by some such parts, and the reason names them.

    Parameters
    ----------
    constraint : HPolytope
        In R^n.
    system : LinearSystem or UncertainModel
    inputs : HPolytope, optional
        As of `predecessor`.
    max_steps : int
        Most iterates, at least 1.

    Returns
    -------
    InvariantSet
        "undecided" where the search has not ended by then.

    Raises
    ------
    TypeError, ValueError, UndecidedError
        As `predecessor`, and for a limit below 1.
    """
    expect_kind("constraint", constraint, HPolytope, "an HPolytope")
    known, most = system_of(system, inputs), whole_number("max_steps", max_steps, least=1)
    expect(constraint.dim == known.n_states, "constraint", constraint, f"a set in R^{known.n_states}")
    found = _iterated(constraint, known, most, 0.0)
    if found.status != "undecided" or found.steps == most:
        return found
    for part in (_INWARD, 1e2 * _INWARD, 1e4 * _INWARD):
        again = _iterated(found.set, known, most - found.steps, part)
        if again.status == "invariant":
            reason = f"proved in rationals; rows were moved inward by {part:g} of their terms"
            return replace(again, steps=found.steps + again.steps, reason=reason)
    return found


def _iterated(constraint: HPolytope, system: LinearSystem, most: int, inward: float) -> InvariantSet:
    """The search, with new rows moved inward by a part of their terms."""
    current = constraint
    for step in range(most + 1):
        answer = current.emptiness()
        if answer.status == "empty":
            return InvariantSet("empty", current, step, "an iterate is empty", system, answer.certificate)
        if answer.status == "undecided" or step == most:
            break
        before = _moved_inward(predecessor(current, system), current, inward)
        if _holds(before, current, 0.25 * inward or _ENDED):
            return _ended(current, constraint, step, system)
        current = _reduced(current & before)
    reason = f"it did not end in {step} steps: the set is the last outer iterate, and not invariant"
    return InvariantSet("undecided", current, step, reason, system)


def _holds(before: HPolytope, current: HPolytope, part: float) -> bool:
    """Whether the current set reaches beyond no row of another by more than a part of its width along it."""
    normals, sides = half_spaces(before)
    values, opposite = current.support(normals), current.support(-normals)
    widths = np.where(np.isfinite(values + opposite), values + opposite, np.abs(sides))
    return bool((values <= sides + part * np.maximum(widths, 0.0)).all())


def _moved_inward(before: HPolytope, current: HPolytope, part: float) -> HPolytope:
    """Rows moved inward by a part of their terms over the bounded current set."""
    ends = np.abs(current.bounding_box()).max(axis=0)
    if not part or not np.isfinite(ends).all():
        return before
    return before.with_rows(before.A, before.b - part * (np.abs(before.A) @ ends + np.abs(before.b)))


def _reduced(P: HPolytope) -> HPolytope:
    """Without redundant rows; as it is where it is empty, so that the proof is about its rows."""
    return P if P.emptiness().status == "empty" else P.remove_redundancy()


def _ended(found: HPolytope, constraint: HPolytope, step: int, system: LinearSystem) -> InvariantSet:
    within = found if found <= constraint else found & constraint
    try:
        if is_invariant(within, system):
            return InvariantSet("invariant", within, step, "proved in rationals", system)
        reason = "its predecessor holds it to within 1e-9, and there is no proof: the set is not known to be invariant"
    except UndecidedError as error:
        reason = f"the proof is open: {error}"
    return InvariantSet("undecided", within, step, reason, system)


@options_by_name
def smallest_invariant_set(
    system: LinearSystem | UncertainModel, *, factor: float = 0.05, box: ArrayLike | None = None, max_steps: int = 200
) -> InvariantSet:
    """A set that a stable system does not leave, little larger than the smallest one (where all trajectories end).

    The sum of ``A^i W`` for i < s over ``1 - alpha``, where ``A^s W`` is in ``alpha W`` (Rakovic, Kerrigan, Kouramas
    and Mayne 2005, theorem 1).

    Parameters
    ----------
    system : LinearSystem or UncertainModel
        Without inputs.
    factor : float
        Between 0 and 1: ``A^s W`` is to lie in that part of W; the set is at most ``1 / (1 - factor)`` as large as the
        smallest one.
    box : array_like (n,), optional
        Half-widths of a box that is added to ``E w``: needed if ``E W`` has no interior.  The result is for the system
        with it, and names it.
    max_steps : int
        Limit on the number of terms s.

    Returns
    -------
    InvariantSet
        "undecided" where the limit is too low, as it is for every system that is not stable.

    Raises
    ------
    ValueError
        If the system has inputs or no disturbances, or ``E W`` (and the box) is unbounded or has no interior.
    """
    known = system_of(system)
    expect(known.inputs is None, "system", "one with inputs", "one without: put a feedback into A")
    expect(known.disturbances is not None, "system", "one without disturbances", "one with: it ends in a point")
    wanted, most = real_number("factor", factor, least=0.0), whole_number("max_steps", max_steps, least=1)
    expect(0.0 < wanted < 1.0, "factor", wanted, "a number between 0 and 1")
    n = known.n_states
    room = None if box is None else real_array("box", box, (n,))
    assert known.disturbances is not None
    W = known.E @ known.disturbances
    W = W if room is None else W + HPolytope.box(-room, room)
    expect(W.is_bounded(), "disturbances", "unbounded", "a bounded set")
    if W.affine_dim() < n:
        raise ValueError("E w has no interior; state box=..., half-widths (n,) that are added to it.")
    middle = W.chebyshev().centre
    centred = (W - middle).remove_redundancy()
    limits = centred.support(centred.A)
    terms, power = [centred], known.A
    for _ in range(most):
        reached = float(np.max(centred.support(centred.A @ power) / limits))
        if reached <= wanted:
            return _sum(known, terms, reached, middle, room)
        terms.append(power @ centred)
        power = power @ known.A
    reason = f"A^s W is not in {wanted:g} W for s up to {most}: the set is W, and not invariant"
    return InvariantSet("undecided", W, most, reason, known, widened_by=room)


def _sum(
    system: LinearSystem, terms: list[HPolytope], reached: float, middle: Array, room: Array | None
) -> InvariantSet:
    part = reached + _SLACK * (1.0 - reached)
    total = terms[0]
    for term in terms[1:]:
        total = (total + term).remove_redundancy()
    fixed = np.linalg.solve(np.eye(system.n_states) - system.A, system.a + middle)
    found = total.scale(1.0 / (1.0 - part)) + fixed
    proved = is_invariant(found, system, room)
    reason = "proved in rationals" if proved else "rounding left no proof: the set is not known to be invariant"
    status: Literal["invariant", "undecided"] = "invariant" if proved else "undecided"
    return InvariantSet(status, found, len(terms), reason, system, None, 1.0 / (1.0 - part), room)
