"""Linear programs over one set of rows: prepared once, solved by the kernel, by HiGHS, or in rationals.

`Program` holds ``{x : A x <= b, C x = d}`` ready for solving: equalities eliminated (exactly), constant rows set aside,
rows scaled by powers of two.  Small programs go to the compiled kernel, large ones to HiGHS.  Where the kernel gives no
clean answer (an iteration limit, a ray or a pivot near rounding), the rational simplex decides if the program is small
enough, else HiGHS, whose optimum must satisfy the optimality conditions.  What none of them settles is reported as
undecided, never guessed.
"""

import logging
import threading
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from polytopes import kernel
from polytopes.affine import AffineSet, affine_set
from polytopes.exact_simplex import affordable, exact_feasibility, exact_maximum, rounded
from polytopes.highs import HighsProgram

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_KERNEL_VARIABLES = 40
_KERNEL_ENTRIES = 200_000
_CLEAN = 1e-9  # relative violation of the optimality conditions that is still accepted from HiGHS
_THIN = 1e-9  # radius, relative to the size of b, below which floats do not vouch for a point
_SMALL_BALL = 1e-4  # radius, relative to the size of b, below which the widths of a set may differ much
_NOISE = 1e-15  # width, relative to the coordinates, that may be rounding
_SQUARABLE = 1e100  # norms of rows up to here, and down to its reciprocal, may be squared
_FARTHEST = 1e150  # distance of a hyperplane from the origin; the squares of coordinates beyond are no floats
_UNEVEN = 256.0  # ratio of the widths along two axes from which the axes are scaled

_ANNOUNCE_AFTER = 1.5  # seconds; loading the kernels from the cache takes less

OPTIMAL, UNBOUNDED, UNDECIDED = "optimal", "unbounded", "undecided"
_NAMES = {kernel.OPTIMAL: OPTIMAL, kernel.UNBOUNDED: UNBOUNDED}


@cache
def warm_up() -> None:
    """Compile the kernels, or load them from the cache, so that no later call has to.

    The first time on a machine takes some 30 s, and one line on the logger ``polytopes`` says so; afterwards it
    takes a fraction of a second.  Called on first use; call it yourself before a loop that must not be delayed.
    """
    line = "compiling the LP kernels: once on this machine, about 30 s"
    announce = threading.Timer(_ANNOUNCE_AFTER, logging.getLogger("polytopes").warning, [line])
    announce.daemon = True
    announce.start()
    try:
        AT, b, norms = np.array([[1.0, -1.0]]), np.ones(2), np.ones(2)
        kernel.interior(AT, b, norms, np.zeros(1), 1.0)
        kernel.supports(AT, b, np.zeros(1), np.ones((1, 1)))
        kernel.irredundant(AT, b, np.zeros(1))
        table, names = np.array([[1.0, 1.0, 1.0], [-1.0, 0.0, 1.0], [0.0, -1.0, 1.0]]), np.arange(2)
        kernel.eliminate(table, np.zeros(3, np.int64), names, names[:1], np.zeros(2), 10, False)
    finally:
        announce.cancel()


@dataclass(frozen=True, eq=False)
class Interior:
    """Centre of a largest ball (n,), its radius, and multipliers (m,) that prove the radius.

    `radius` is negative if the rows have no common point, and inf where the ball can grow without end.  `reliable` is
    False if no solver finished.
    """

    point: Floats
    radius: float
    multipliers: Floats
    reliable: bool


@dataclass(frozen=True, eq=False)
class Maxima:
    """Maxima of k linear forms: values (k,), points (k, n), multipliers of the rows (k, m), status (k,) of names."""

    values: Floats
    points: Floats
    multipliers: Floats
    status: list[str]


@dataclass(frozen=True, eq=False)
class Program:
    """Rows ``A x <= b``, ``C x = d`` prepared for linear programs; build it with `prepare`.

    Attributes
    ----------
    AT, rhs : arrays (free, kept) and (kept,)
        Rows in the free coordinates z, scaled and transposed.
    norms : array (kept,)
        Norms of the scaled rows in the metric of x, within the affine set.
    scale : array (kept,)
        The powers of two.
    columns : array (free,)
        Powers of two: the coordinates of AT are the free coordinates divided by them.
    kept : array of int
        The rows that are not constant on the affine set.
    violated : int or None
        A constant row that fails, if there is one.
    """

    A: Floats
    b: Floats
    flat: AffineSet
    AT: Floats
    rhs: Floats
    norms: Floats
    scale: Floats
    columns: Floats
    kept: Indices
    violated: int | None

    @property
    def consistent(self) -> bool:
        """Whether neither the equalities nor a constant row are contradictory by themselves."""
        return self.flat.contradiction is None and self.violated is None

    @cached_property
    def size(self) -> float:
        """The size that tolerances refer to: the largest entry of the scaled b, or 1; ValueError beyond 1e150."""
        size = float(np.abs(self.rhs).max(initial=0.0)) or 1.0
        if size > _FARTHEST:
            far = int(self.kept[np.abs(self.rhs).argmax()])
            raise ValueError(
                f"row {far} of A bounds {self.A[far].tolist()} x by {self.b[far]:.3g}, some {size:.1g} from the "
                f"origin; expected at most {_FARTHEST:g}. Use other units, or leave out a row that is not to bound."
            )
        return size

    @cached_property
    def _small(self) -> bool:
        return self.AT.shape[0] <= _KERNEL_VARIABLES and self.AT.size <= _KERNEL_ENTRIES

    @cached_property
    def _highs(self) -> HighsProgram:
        return HighsProgram(np.ascontiguousarray(self.AT.T), self.rhs)

    @cached_property
    def interior(self) -> Interior:
        """Centre and radius of a largest ball within the affine set; the program must be consistent."""
        free, kept = self.AT.shape
        if kept == 0:
            return Interior(self.flat.lift(np.zeros(free)), np.inf, np.zeros(self.b.size), True)
        # By duality a largest ball has a radius of at most max |b_i| / |a_i|, or none at all.
        cap = 2.0 * self.size / float(self.norms.min())
        if self._small:
            warm_up()
            z, radius, status, weights = kernel.interior(self.AT, self.rhs, self.norms, np.zeros(free), cap)
            if status == kernel.OPTIMAL:
                proof = self._unscaled(weights)
                return Interior(self.flat.lift(z * self.columns), _uncapped(radius, cap), proof, True)
        return self._interior_by_highs(cap)

    def _interior_by_highs(self, cap: float) -> Interior:
        free, kept = self.AT.shape
        rows = np.vstack([np.hstack([self.AT.T, self.norms[:, None]]), np.append(np.zeros(free), 1.0)])
        answer = HighsProgram(rows, np.append(self.rhs, cap)).maximise(np.append(np.zeros(free), 1.0))
        point = answer.point if answer.point.size == free + 1 else np.zeros(free + 1)
        weights = answer.multipliers[:kept] if answer.multipliers.size == kept + 1 else np.zeros(kept)
        proof, centre = self._unscaled(np.maximum(weights, 0.0)), self.flat.lift(point[:-1] * self.columns)
        return Interior(centre, _uncapped(point[-1], cap), proof, answer.status == "optimal")

    @cached_property
    def thin(self) -> bool:
        """Whether the set is so thin (or so nearly empty) that only exact arithmetic can say that it has a point."""
        interior = self.interior
        return self.AT.shape[0] == 0 or not interior.reliable or interior.radius <= _THIN * self.size

    @cached_property
    def fat(self) -> bool:
        """Whether a ball fits in, within the affine set, that floats vouch for."""
        return self.consistent and not self.thin and self.interior.radius > 0.0

    @cached_property
    def centre(self) -> Floats:
        """The centre of a largest ball in the coordinates of AT."""
        point: Floats = self.interior.point[self.flat.free] / self.columns
        return point

    @cached_property
    def balanced(self) -> "Program":
        """The same program in coordinates in which the set is about as wide along each axis, by powers of two.

        The program itself if it may be as it is.  Its largest ball, if it has been scaled, is one of the scaled set.
        """
        free = self.AT.shape[0]
        if free < 2 or not self.consistent or not self._small or self.interior.radius > _SMALL_BALL * self.size:
            return self
        program = self
        for _ in range(3):
            widths = program._widths()
            if widths.max() <= _UNEVEN * widths.min():
                break
            program = program._scaled(np.ldexp(1.0, np.frexp(widths)[1]))
        return program

    def _widths(self) -> Floats:
        """Widths (free,) along the axes of AT: an infinite one by the steepest entry, a hidden one the largest."""
        axes = np.eye(len(self.columns))
        points, _, status = self._solve(np.vstack([axes, -axes]))
        solved = np.array([name == OPTIMAL for name in status])
        upper, lower = np.split(np.where(solved[:, None], points, np.nan), 2)
        widths = np.diag(upper) - np.diag(lower)
        rest = self.rhs - self.centre @ self.AT
        open_ = rest > _NOISE * self.size  # a row that holds with equality says nothing about a width
        steepest = (np.abs(self.AT[:, open_]) / rest[open_]).max(axis=1, initial=0.0)
        widths = np.where(np.isnan(widths) & (steepest > 0.0), 1.0 / np.maximum(steepest, 1e-30), widths)
        size = np.abs(np.where(solved[:, None], points, 0.0)).max(axis=0, initial=float(np.abs(self.centre).max()))
        known = widths > _NOISE * size
        return np.where(known, widths, widths[known].max() if known.any() else 1.0)

    def _scaled(self, factors: Floats) -> "Program":
        AT = self.AT * factors[:, None]
        change = np.ldexp(1.0, -np.frexp(np.linalg.norm(AT, axis=0))[1])
        AT = AT * change
        return replace(
            self, AT=AT, rhs=self.rhs * change, norms=np.linalg.norm(AT, axis=0), scale=self.scale * change,
            columns=self.columns * factors,
        )  # fmt: skip

    def maximise(self, directions: Floats) -> Maxima:
        """Maxima of ``directions x`` over the set, which must not be empty.

        Parameters
        ----------
        directions : array (k, n)
        """
        program = self.balanced
        k = directions.shape[0]
        reduced = np.ascontiguousarray(self.flat.restrict(directions, np.zeros(k))[0] * program.columns)
        points, weights, status = program._solve(reduced)
        lifted, multipliers = self.flat.lift(points * program.columns), np.zeros((k, self.b.size))
        multipliers[:, self.kept] = weights * program.scale
        solved = np.array([name == OPTIMAL for name in status], dtype=bool)
        values = np.where(solved, (directions * lifted).sum(axis=1), np.inf)
        for q in np.flatnonzero(~solved).tolist():
            if status[q] == UNDECIDED or self.thin:  # of a thin set, floats take an edge for a ray
                status[q], values[q], lifted[q], multipliers[q] = program._maximise_carefully(directions[q], reduced[q])
        return Maxima(values, lifted, multipliers, status)

    def _solve(self, reduced: Floats) -> tuple[Floats, Floats, list[str]]:
        """Points (k, free) and multipliers (k, kept) in the coordinates of AT by the kernel, and the status of each."""
        k, free = reduced.shape
        points, weights = np.zeros((k, free)), np.zeros((k, self.kept.size))
        if free and self._small:
            return points, weights, self._maximise_by_kernel(reduced, points, weights)
        return points, weights, [OPTIMAL if free == 0 else UNDECIDED] * k

    def _maximise_by_kernel(self, reduced: Floats, points: Floats, weights: Floats) -> list[str]:
        warm_up()
        points[:], active, y, status = kernel.supports(self.AT, self.rhs, self.centre, reduced)
        row, slot = np.nonzero(active >= 0)
        weights[row, active[row, slot]] = y[row, slot]
        return [_NAMES.get(code, UNDECIDED) for code in status.tolist()]

    def _maximise_carefully(self, direction: Floats, reduced: Floats) -> tuple[str, float, Floats, Floats]:
        """The rational simplex if it is affordable, else HiGHS, accepted if the optimality conditions hold."""
        nowhere, nothing = np.full(self.flat.dim, np.nan), np.zeros(self.b.size)
        if affordable(*self.A.shape):
            start = exact_feasibility(self.A, self.b, self.flat, self.interior.point)
            if start.status == "reached":
                outcome = exact_maximum(self.A, self.b, self.flat, direction, start.point)
                if outcome.status == "optimal":
                    return OPTIMAL, *rounded(outcome, self.b.size)
                if outcome.status == "unbounded":
                    return UNBOUNDED, np.inf, nowhere, nothing
        answer = self._highs.maximise(reduced)
        if answer.status == "optimal" and self._optimal(reduced, answer.point, answer.multipliers):
            point = self.flat.lift(answer.point * self.columns)
            return OPTIMAL, float(direction @ point), point, self._unscaled(answer.multipliers)
        if answer.status == "unbounded":
            return UNBOUNDED, np.inf, nowhere, nothing
        return UNDECIDED, np.nan, nowhere, nothing

    def _optimal(self, c: Floats, z: Floats, y: Floats) -> bool:
        """Primal and dual feasibility and equal objectives, to a relative 1e-9."""
        reach = max(self.size, float(np.abs(z).max(initial=0.0)))
        size = float(np.abs(c).max(initial=0.0)) or 1.0
        return bool(
            (self.AT.T @ z - self.rhs).max(initial=0.0) <= _CLEAN * reach
            and y.min(initial=0.0) >= -_CLEAN * size
            and np.abs(self.AT @ y - c).max(initial=0.0) <= _CLEAN * size
            and abs(c @ z - y @ self.rhs) <= _CLEAN * size * reach
        )

    def _unscaled(self, weights: Floats) -> Floats:
        """Multipliers of the scaled, kept rows as multipliers of the rows of A."""
        multipliers = np.zeros(self.b.size)
        multipliers[self.kept] = weights * self.scale
        return multipliers


def prepare(A: Floats, b: Floats, C: Floats, d: Floats) -> Program:
    """Eliminate the equalities, set constant rows aside and scale the others.

    Parameters
    ----------
    A, b, C, d : arrays (m, n), (m,), (q, n), (q,)
    """
    flat = affine_set(C, d)
    rows, rhs = flat.restrict(A, b)
    norms, kept, violated, factors = _norms(rows), np.arange(b.size), None, None
    if np.count_nonzero((norms > 1.0 / _SQUARABLE) & (norms < _SQUARABLE)) < b.size:
        rows, rhs, factors = _squarable(rows, rhs)
        norms = _norms(rows)
        failing = np.flatnonzero((norms == 0.0) & (rhs < 0.0))
        violated = int(failing[0]) if failing.size else None
        kept = np.flatnonzero(norms)
        rows, rhs, norms, factors = rows[kept], rhs[kept], norms[kept], factors[kept]
    scale = np.ldexp(1.0, -np.frexp(norms)[1])
    AT = np.ascontiguousarray(rows.T) * scale
    lengths = norms * scale if not flat.pivots else _metric_norms(AT.T, flat)
    total = scale if factors is None else scale * factors
    return Program(A, b, flat, AT, rhs * scale, lengths, total, np.ones(len(flat.free)), kept, violated)


def _norms(rows: Floats) -> Floats:
    norms: Floats = np.sqrt(np.einsum("ij,ij->i", rows, rows))
    return norms


def _squarable(rows: Floats, rhs: Floats) -> tuple[Floats, Floats, Floats]:
    """Rows whose largest entry is about one, but rows of zeros as they are, and the powers of two that made them so."""
    largest = np.abs(rows).max(axis=1, initial=0.0)
    factors = np.ldexp(1.0, np.minimum(-np.frexp(np.where(largest > 0.0, largest, 0.5))[1], 1000))
    with np.errstate(over="ignore"):  # a bound of infinity is refused later, where its row is known
        return rows * factors[:, None], rhs * factors, factors


def _uncapped(radius: float, cap: float) -> float:
    return float(radius) if radius < 0.99 * cap else np.inf


def _metric_norms(rows: Floats, flat: AffineSet) -> Floats:
    """Norms of the rows (in free coordinates) measured in x, along the affine set."""
    if not flat.free:
        return np.ones(len(rows))
    gram = np.linalg.cholesky(flat.basis.T @ flat.basis)
    return np.linalg.norm(np.linalg.solve(gram, rows.T), axis=0)
