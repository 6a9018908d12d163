"""What one step of a linear system makes of a set: where it comes from and where it goes.

The system is ``x+ = A x + B u + a + E w`` with the input u in a set U, chosen, and the disturbance w in a set W, not
chosen.  Everything is an operation of `polytopes` (Blanchini and Miani 2015, chapters 4 and 5).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from polytopes import HPolytope
from polytopes.integers import up
from polytopes.outer_supports import exact_support
from polytopes.signatures import options_by_name
from svo.checks import Array, expect, expect_kind, real_array
from svo.models.model import UncertainModel

_FEW_ROWS = 12  # up to which supports are taken exactly: about a millisecond each


@options_by_name
@dataclass(frozen=True, eq=False)
class LinearSystem:
    """``x+ = A x + B u + a + E w``, u in `inputs` and w in `disturbances`.

    Parameters
    ----------
    A, B : array_like (n, n) and (n, nu)
        ``B=None``: no input.
    a : array_like (n,), optional
        Zero if absent.
    E : array_like (n, nw), optional
        The identity if there are disturbances and it is absent.
    inputs, disturbances : HPolytope, optional
        Sets of u and w, not empty; needed if the system has such.

    Raises
    ------
    TypeError, ValueError
        If a set is missing or empty, or a shape does not fit.
    """

    A: Array
    B: Array
    a: Array
    E: Array
    inputs: HPolytope | None
    disturbances: HPolytope | None

    def __init__(
        self,
        A: ArrayLike,
        B: ArrayLike | None = None,
        *,
        a: ArrayLike | None = None,
        E: ArrayLike | None = None,
        inputs: HPolytope | None = None,
        disturbances: HPolytope | None = None,
    ) -> None:
        matrix = real_array("A", A, ("n", "n"))
        n = len(matrix)
        expect(matrix.shape == (n, n), "A", matrix.shape, "a square matrix")
        moved = np.zeros(n) if a is None else real_array("a", a, (n,))
        given = {"inputs": (B, inputs), "disturbances": (E, disturbances)}
        blocks = {}
        for (name, (block, set_of)), column in zip(given.items(), ("B", "E"), strict=True):
            if set_of is not None:
                expect_kind(name, set_of, HPolytope, "an HPolytope")
                expect(not set_of.is_empty(), name, "empty", "a set with a point")
            matrix_of = np.eye(n) if block is None and column == "E" and set_of is not None else block
            blocks[column] = np.zeros((n, 0)) if matrix_of is None else real_array(column, matrix_of, (n, "k"))
            wide = blocks[column].shape[1]
            expect((set_of.dim if set_of else 0) == wide, name, set_of, f"a set in R^{wide}, the columns of {column}")
        parts = (matrix, blocks["B"], moved, blocks["E"], inputs, disturbances)
        for name, value in zip(("A", "B", "a", "E", "inputs", "disturbances"), parts, strict=True):
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, model: UncertainModel, inputs: HPolytope | None = None) -> LinearSystem:
        """The transition of a model without parametric uncertainties and schedule.

        Parameters
        ----------
        model : UncertainModel
        inputs : HPolytope, optional
            The set of u; needed if the model has inputs.

        Raises
        ------
        TypeError, ValueError
            If it is no such model, or the set of inputs is missing or does not fit.
        """
        expect_kind("model", model, UncertainModel, "an UncertainModel")
        fixed = not (model.is_scheduled or model.uncertainties)
        expect(fixed, "model", "scheduled or has uncertainties", "one of fixed matrices: bound the rest as w")
        lower, upper, _ = model.bounds()
        W = model.disturbance_polytope or (HPolytope.box(lower, upper) if model.n_disturbances else None)
        blocks = {name: model.block(name) for name in "ABEa"}
        B = blocks["B"] if model.n_inputs else None
        E = blocks["E"] if model.n_disturbances else None
        return cls(blocks["A"], B, a=blocks["a"].ravel(), E=E, inputs=inputs, disturbances=W)

    @property
    def n_states(self) -> int:
        """How many states there are."""
        return len(self.A)

    @cached_property
    def disturbed(self) -> HPolytope | None:
        """All ``(w, E w)``; exact, where ``E w`` alone is rounded."""
        if self.disturbances is None:
            return None
        nw = self.disturbances.dim
        step = np.hstack([self.E, -np.eye(self.n_states)])
        space = self.disturbances.lift(nw + self.n_states)
        return space & HPolytope(np.empty((0, step.shape[1])), [], step, np.zeros(self.n_states))

    def kept_inputs(self, start: HPolytope, sure: HPolytope) -> HPolytope:
        """All ``(x, u, A x + B u + a)`` with x in `start`, u in its set and the third in `sure`; exact."""
        n, nu = self.n_states, self.B.shape[1]
        step = np.hstack([self.A, self.B, -np.eye(n)])
        joint = start if self.inputs is None else start.product(self.inputs)
        space = joint.lift(2 * n + nu) & sure.lift(2 * n + nu, range(n + nu, 2 * n + nu))
        return space & HPolytope(np.empty((0, step.shape[1])), [], step, -self.a)

    def is_short(self, *sets: HPolytope) -> bool:
        """Whether all numbers of the system and of some sets are multiples of 2^-16 below 2^16: sets are exact then."""
        every = [*sets, *(P for P in (self.inputs, self.disturbances) if P is not None)]
        parts = [part.ravel() for P in every for part in P.table]
        numbers = np.concatenate([*parts, *(block.ravel() for block in (self.A, self.B, self.E, self.a))]) * 2.0**16
        return bool((numbers == np.round(numbers)).all() and (np.abs(numbers) < 2.0**32).all())

    def transitions(self, start: HPolytope, room: Array | None = None) -> HPolytope:
        """All ``(x, u, w, x+)`` with x in `start` and x+ the next state, within `room` (n,) if given; exact."""
        n, sets = self.n_states, [start, *(P for P in (self.inputs, self.disturbances) if P is not None)]
        joint = sets[0]
        for P in sets[1:]:
            joint = joint.product(P)
        step = np.hstack([self.A, self.B, self.E, -np.eye(n)])
        space = joint.lift(step.shape[1])
        if room is None:
            return space & HPolytope(np.empty((0, step.shape[1])), [], step, -self.a)
        return space & HPolytope(np.vstack([step, -step]), np.concatenate([room - self.a, room + self.a]))


def system_of(system: LinearSystem | UncertainModel, inputs: HPolytope | None = None) -> LinearSystem:
    """A system, or that of a model with a set of inputs; ValueError if a system is given another one."""
    if isinstance(system, UncertainModel):
        return LinearSystem.of(system, inputs)
    expect_kind("system", system, LinearSystem, "a LinearSystem or an UncertainModel")
    expect(inputs is None, "inputs", inputs, "None: a LinearSystem has the set of its inputs already")
    return system


@options_by_name
def predecessor(
    target: HPolytope, system: LinearSystem | UncertainModel, *, inputs: HPolytope | None = None
) -> HPolytope:
    """The states from which some input leads into a target whatever the disturbance is.

    ``{x : there is u in U with A x + B u + a + E w in the target for all w in W}``: the Pontryagin difference of the
    target and ``E W``, pulled back, and projected on x where there are inputs (Blanchini and Miani 2015, chapter 5).

    Parameters
    ----------
    target : HPolytope
        In R^n.
    system : LinearSystem or UncertainModel
    inputs : HPolytope, optional
        The set U of u in R^nu, where a model is given that has inputs; a `LinearSystem` has its own.

    Returns
    -------
    HPolytope
        In R^n; exact where all numbers are short (`LinearSystem.is_short`), else it contains the exact set: floats tell
        the normals, and the sides are rounded up.

    Raises
    ------
    TypeError, ValueError
        If the target is of another dimension than the states, or a model has uncertainties or a schedule, or inputs
        and no set of them.
    UndecidedError
        If a linear program cannot be decided.
    """
    known = system_of(system, inputs)
    expect(target.dim == known.n_states, "target", target, f"a set in R^{known.n_states}")
    sure = whatever_comes(target, known)
    if known.inputs is None:
        return sure.preimage(known.A, known.a)
    n, moves = known.n_states, np.hstack([known.A, known.B])
    U = known.inputs.lift(n + known.inputs.dim, range(n, n + known.inputs.dim))
    if known.is_short(sure):
        return (sure.preimage(moves, known.a) & U).project(range(n))
    joint = known.kept_inputs(HPolytope.whole_space(n), sure)
    if joint.is_empty():
        return HPolytope.empty(n)
    near = U & HPolytope(sure.A @ moves, sure.b - sure.A @ known.a, sure.C @ moves, sure.d - sure.C @ known.a)
    shadow = (joint if near.is_empty() else near).project(range(n))
    normals = np.vstack([shadow.A, shadow.C, -shadow.C])
    directions = np.pad(normals, ((0, 0), (0, joint.dim - n)))
    if joint.b.size > _FEW_ROWS:
        return HPolytope(normals, joint.support(directions))
    return HPolytope(normals, [up(exact_support(joint, row)) for row in directions])


def whatever_comes(target: HPolytope, system: LinearSystem) -> HPolytope:
    """``{z : z + E w in the target for all w in W}``: the rows of the target moved inward, exact or outward."""
    W, both = system.disturbances, system.disturbed
    if W is None or both is None:
        return target
    if np.array_equal(system.E, np.eye(system.n_states)):
        return target - W
    n, nw = system.n_states, W.dim
    return (target.lift(nw + n, range(nw, nw + n)) - both).slice(dict.fromkeys(range(nw), 0.0))


@options_by_name
def successor(start: HPolytope, system: LinearSystem | UncertainModel, *, inputs: HPolytope | None = None) -> HPolytope:
    """The states that some input and some disturbance reach from a set: ``{A x + B u + a + E w : x in start}``.

    Images and Minkowski sums.

    Parameters
    ----------
    start : HPolytope
        In R^n.
    system : LinearSystem or UncertainModel
    inputs : HPolytope, optional
        The set U of u in R^nu, where a model is given that has inputs; a `LinearSystem` has its own.

    Returns
    -------
    HPolytope
        In R^n; exact where all numbers are short (`LinearSystem.is_short`), else it contains the exact set.

    Raises
    ------
    TypeError, ValueError
        If the set is of another dimension than the states, or a model has uncertainties or a schedule, or inputs
        and no set of them.
    UndecidedError
        If a linear program cannot be decided.
    """
    known = system_of(system, inputs)
    expect(start.dim == known.n_states, "start", start, f"a set in R^{known.n_states}")
    reached = start.affine_map(known.A, known.a)
    for block, values in ((known.B, known.inputs), (known.E, known.disturbances)):
        if values is not None:
            reached = reached + block @ values
    return reached
