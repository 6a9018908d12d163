"""Linear programs over one set of rows: prepared once, solved by the kernel, by HiGHS, or in rationals.

`Program` holds ``{x : A x <= b, C x = d}`` ready for solving: equalities eliminated (exactly), constant rows set aside,
rows and coordinates in even units, which are powers of two.  Solvers see only numbers in these units, so that no unit
of the user changes an answer.  Small programs go to the compiled core, large ones to HiGHS.  Where floats give no
clean answer (an iteration limit, a ray or a pivot near rounding), the rational simplex decides if the program is small
enough, else HiGHS.  Every maximum comes as an upper bound of the exact one, by weak duality with a bound of what was
rounded; what none of them settles is reported as undecided, never guessed.
"""

from dataclasses import dataclass, replace

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from polytopes import kernel, large_program
from polytopes.affine import AffineSet
from polytopes.checks import Floats
from polytopes.derived import derived
from polytopes.duality import Bounds, proved_reach
from polytopes.exact import rounded_up, to_floats
from polytopes.exact_units import EvenRows, weights_of
from polytopes.highs import HighsProgram
from polytopes.rounding import check_rounding

Indices = NDArray[np.int64]

_KERNEL_VARIABLES = 200
_KERNEL_ENTRIES = 200_000
_EPS = float(np.finfo(np.float64).eps)
WIDEST = 4.0  # of the size of b: by duality no radius is beyond max |b_i| / |a_i|, and no norm is below 1/2
CLEAN = 1e-9  # relative gap between a maximum and its bound that is still accepted from floats
SHARP = 1e-6  # the same gap, of the radius of a largest ball
_LOST = 1e-6  # of the largest entry of balanced rows: floats do not vouch for a ray beside smaller ones
_THIN = 1e-9  # radius, relative to the size of b, below which floats do not vouch for a point
SMALL_BALL = 1e-4  # radius, relative to the size of b, below which the widths of a set may differ much
_NOTHING = -(2**20)  # exponent of zero
_NOISE = 1e-15  # width, relative to the coordinates, that may be rounding
_EVEN_POWERS = 2  # exponents of two by which the units of the axes may differ from even ones
_UNEVEN = 256.0  # ratio of the widths along two axes from which the axes are scaled

OPTIMAL, UNBOUNDED, UNDECIDED = "optimal", "unbounded", "undecided"
_NAMES = {kernel.OPTIMAL: OPTIMAL, kernel.UNBOUNDED: UNBOUNDED}


def small(variables: int, rows: int) -> bool:
    """Whether programs of that size go to the core."""
    return variables <= _KERNEL_VARIABLES and variables * rows <= _KERNEL_ENTRIES


def warm_up() -> None:
    """Nothing: the compiled core is loaded with the package.  Programs that call it before a loop go on working."""


@dataclass(frozen=True, eq=False)
class Interior:
    """A largest ball in the even units of a program.

    Attributes
    ----------
    point, centre : arrays (n,) and (free,)
        The centre, in the coordinates of the user and in those of the program.
    radius : float
        In the units of the program, among its free coordinates: negative if the rows have no common point, and inf
        where the ball can grow without end.
    multipliers : array (kept,)
        Of the scaled rows; they prove the radius.
    reliable : bool
        False if no solver finished.
    """

    point: Floats
    centre: Floats
    radius: float
    multipliers: Floats
    reliable: bool


@dataclass(frozen=True, eq=False)
class Maxima:
    """Maxima of k linear forms: values (k,), points (k, n), multipliers of the rows (k, m), status (k,) of names.

    The values are upper bounds of the exact maxima, and about as near as floats are.
    """

    values: Floats
    points: Floats
    multipliers: Floats
    status: list[str]


@dataclass(frozen=True, eq=False)
class _Solved:
    """What a solver says of k forms, in the units of a program."""

    points: Floats
    weights: Floats
    bounds: Bounds
    status: list[str]


@dataclass(frozen=True, eq=False)
class Program:
    """Rows ``A x <= b``, ``C x = d`` prepared for linear programs; built by `polytopes.preparation`.

    Attributes
    ----------
    exact : EvenRows
        All rows, for the rational simplex.
    AT, rhs, norms : arrays (free, kept), (kept,) and (kept,)
        Rows in the free coordinates, in even units, transposed, and their norms, in [1/2, 1).
    row_powers, powers : arrays (kept,) and (free,) of int
        Exponents of two: of row i of the user ``2^row_powers[i]`` times as much, in coordinates ``x_j / 2^powers[j]``.
    kept : array of int
        The rows that are not constant on the affine set.
    violated : int or None
        A constant row that fails, if there is one.
    """

    A: Floats
    b: Floats
    flat: AffineSet
    exact: EvenRows
    AT: Floats
    rhs: Floats
    norms: Floats
    row_powers: Indices
    powers: Indices
    kept: Indices
    violated: int | None

    @property
    def scale(self) -> Floats:
        """The powers of two of the kept rows (kept,)."""
        return np.ldexp(1.0, self.row_powers)

    @property
    def columns(self) -> Floats:
        """The powers of two of the free coordinates (free,): ``x_j = columns[j] z_j``."""
        return np.ldexp(1.0, self.powers)

    @property
    def consistent(self) -> bool:
        """Whether neither the equalities nor a constant row are contradictory by themselves."""
        return self.flat.contradiction is None and self.violated is None

    @derived
    def size(self) -> float:
        """The size that tolerances refer to: the largest entry of the scaled b, or 1."""
        return float(np.abs(self.rhs).max(initial=0.0)) or 1.0

    @derived
    def _small(self) -> bool:
        return small(*self.AT.shape)

    @derived
    def _highs(self) -> HighsProgram:
        return HighsProgram(np.ascontiguousarray(self.AT.T), self.rhs)

    def lift(self, z: Floats) -> Floats:
        """Points (..., free) in the units of the program as points (..., n) of the user."""
        return self.flat.lift(np.ldexp(z, self.powers))

    @derived
    def interior(self) -> Interior:
        """Centre and radius of a largest ball within the affine set; the program must be consistent."""
        free, kept = self.AT.shape
        if kept == 0:
            origin = np.zeros(free)
            return Interior(self.lift(origin), origin, np.inf, np.zeros(0), True)
        if self._small:
            z, radius, status, weights = kernel.interior(self.AT, self.rhs, self.norms, np.zeros(free), WIDEST)
            if status == kernel.OPTIMAL:
                return Interior(self.lift(z), z, radius, weights, True)
        z, radius, weights, reliable = large_program.largest_ball(self.AT, self.rhs, self.norms, WIDEST * self.size)
        return Interior(self.lift(z), z, radius, weights, reliable)

    @derived
    def thin(self) -> bool:
        """Whether the set is so thin (or so nearly empty) that only exact arithmetic can say that it has a point."""
        interior = self.interior
        return self.AT.shape[0] == 0 or not interior.reliable or interior.radius <= _THIN * self.size

    @derived
    def tells_rays(self) -> bool:
        """Whether floats tell a ray from a long edge: not of a thin set, nor where entries are lost beside others."""
        sizes = np.abs(self.balanced.AT[self.balanced.AT != 0.0])
        return not self.thin and sizes.min(initial=1.0) >= _LOST * sizes.max(initial=1.0)

    @derived
    def fat(self) -> bool:
        """Whether a ball fits in, within the affine set, that floats vouch for."""
        return self.consistent and not self.thin and self.interior.radius > 0.0

    @property
    def centre(self) -> Floats:
        """The centre of a largest ball in the coordinates of AT."""
        return self.interior.centre

    @derived
    def balanced(self) -> "Program":
        """The same program in coordinates in which the set is about as wide along each axis, by powers of two.

        The program itself if it may be as it is.  Its largest ball, if it has been scaled, is one of the scaled set.
        """
        if self.AT.shape[0] < 2 or not self.consistent or not self._small:
            return self
        if self.interior.radius > SMALL_BALL * self.size:
            return self
        program = self._evened()
        for _ in range(3):
            widths = program._widths()
            if widths.max() <= _UNEVEN * widths.min():
                break
            program = program._scaled(np.frexp(widths)[1])
        return program

    def _evened(self) -> "Program":
        """The program in units in which the nearest rows along the axes, seen from the centre, are about as far.

        Exponents of entries alone do not tell small coefficients that matter from those that do not; the slacks do.
        """
        program = self
        for _ in range(3):
            radius = program.interior.radius
            if not program.interior.reliable or not _THIN * program.size < radius < np.inf:
                break
            slack = program.rhs - program.centre @ program.AT
            steepest = (np.abs(program.AT) / np.maximum(slack, radius / 2.0)).max(axis=1)
            powers = -np.frexp(steepest)[1]
            if np.ptp(powers) <= _EVEN_POWERS or not steepest.all():
                break
            program = program._scaled(powers)
        return program

    def _widths(self) -> Floats:
        """Widths (free,) along the axes of AT: an infinite one by the steepest entry, a hidden one the largest."""
        axes = np.eye(self.powers.size)
        found = self._solve(np.vstack([axes, -axes]))
        solved = np.array([name == OPTIMAL for name in found.status])
        upper, lower = np.split(np.where(solved[:, None], found.points, np.nan), 2)
        widths = np.diag(upper) - np.diag(lower)
        rest = self.rhs - self.centre @ self.AT
        open_ = rest > _NOISE * self.size  # a row that holds with equality says nothing about a width
        steepest = (np.abs(self.AT[:, open_]) / rest[open_]).max(axis=1, initial=0.0)
        widths = np.where(np.isnan(widths) & (steepest > 0.0), 1.0 / np.maximum(steepest, 1e-30), widths)
        reach = np.abs(np.where(solved[:, None], found.points, 0.0)).max(
            axis=0, initial=float(np.abs(self.centre).max())
        )
        known = widths > _NOISE * reach
        return np.where(known, widths, widths[known].max() if known.any() else 1.0)

    def _scaled(self, factors: Indices) -> "Program":
        AT = np.ldexp(self.AT, factors[:, None])
        change = -np.frexp(np.linalg.norm(AT, axis=0))[1]
        AT = np.ascontiguousarray(np.ldexp(AT, change))
        return replace(
            self, AT=AT, rhs=np.ldexp(self.rhs, change), norms=np.linalg.norm(AT, axis=0),
            row_powers=self.row_powers + change, powers=self.powers + factors,
        )  # fmt: skip

    def maximise(self, directions: Floats) -> Maxima:
        """Maxima of ``directions x`` over the set, which must not be empty.

        Parameters
        ----------
        directions : array (k, n)
        """
        check_rounding()
        program = self.balanced
        k = directions.shape[0]
        reduced, tops, constants, whole = program._scaled_forms(directions)
        found = program._solve(reduced)
        with np.errstate(over="ignore", invalid="ignore"):  # a bound beyond floats: none above, the least float below
            values = np.ldexp(program._proved(directions, reduced, tops, found), tops)
        values = np.maximum(values, -np.finfo(np.float64).max)
        values = program._with_constants(directions, values, constants)
        lifted, multipliers = program.lift(found.points), np.zeros((k, self.b.size))
        with np.errstate(over="ignore"):  # rows far below one: those used are right, whatever their multipliers
            weights = np.ldexp(found.weights, program.row_powers + tops[:, None])
        multipliers[:, self.kept] = np.minimum(weights, np.finfo(np.float64).max)
        inside = program._keeps(found.points)
        for q, name in enumerate(found.status):
            if name == UNBOUNDED and whole[q] and self.tells_rays:
                values[q] = np.inf
            elif name != OPTIMAL or not inside[q] or not whole[q]:
                guess = lifted[q], multipliers[q]
                answer = program._by_exact_multipliers(directions[q], *guess) if inside[q] else None
                answer = answer or program._maximise_carefully(directions[q], reduced[q], tops[q])
                found.status[q], values[q], lifted[q], multipliers[q] = answer
        return Maxima(values, lifted, multipliers, found.status)

    def estimate(self, directions: Floats) -> Floats:
        """The maxima as floats see them (k,): forms that rounding may have turned a little are not unbounded for it.

        For questions with a tolerance; nothing is proved.
        """
        program = self.balanced
        reduced, tops, constants, _ = program._scaled_forms(directions)
        found = program._solve(reduced)
        values = np.ldexp((reduced * found.points).sum(axis=1), tops) - constants
        solved = np.array([name == OPTIMAL for name in found.status], dtype=bool)
        values[~solved] = self.maximise(directions[~solved]).values
        return values

    def _scaled_forms(self, directions: Floats) -> tuple[Floats, Indices, Floats, NDArray[np.bool_]]:
        """Forms (k, free) in the coordinates of the program, their largest entries about one, what they were divided by
        (exponents of two), their values on the affine set at the origin of its coordinates, negative, and whether no
        bit of an entry was lost beside the largest."""
        rows, constants = self.flat.restrict(directions, np.zeros(len(directions)))
        sizes = np.where(rows != 0.0, np.frexp(rows)[1] + self.powers, _NOTHING)
        tops = sizes.max(axis=1, initial=_NOTHING)
        tops[tops == _NOTHING] = 0
        reduced = np.ldexp(rows, self.powers - tops[:, None])
        return reduced, tops, constants, (np.ldexp(reduced, tops[:, None] - self.powers) == rows).all(axis=1)

    def _proved(self, directions: Floats, reduced: Floats, tops: Indices, found: _Solved) -> Floats:
        """Upper bounds (k,) of the scaled forms; a form whose bound is not near its maximum becomes undecided."""
        bounds = found.bounds
        if self.flat.pivots:
            of_rows, of_rhs = self.errors
            of_forms = self.flat.restriction_errors(directions, np.zeros(len(directions)))[0]
            beside = np.ldexp(of_forms, self.powers - tops[:, None])
            bounds = bounds.widened(found.weights @ of_rhs, beside + found.weights @ of_rows)
        reach = self._reach if bounds.beside.any() else np.zeros(self.powers.size)
        values, gap, terms = bounds.gaps(reduced, found.points, reach)
        room = np.minimum(CLEAN * terms, SHARP * max(self.interior.radius, 0.0) + 8.0 * _EPS * terms)
        for q in np.flatnonzero(~((gap <= room) & np.isfinite(values))):
            if found.status[q] == OPTIMAL:
                found.status[q] = UNDECIDED
        return values

    def _keeps(self, points: Floats) -> NDArray[np.bool_]:
        """Whether points (k, free) miss no row by more than is rounded or small beside the largest ball.

        The bound at a point that does may be far above the maximum: sets may be thinner than the simplex method sees.
        """
        if not len(self.AT):
            return np.full(len(points), True)
        with np.errstate(over="ignore", invalid="ignore"):  # points of forms that are unbounded
            terms = np.abs(points) @ np.abs(self.AT) + np.abs(self.rhs)
            room = SHARP * max(self.interior.radius, 0.0) + (8.0 + len(self.AT)) * _EPS * terms
            return np.asarray((points @ self.AT - self.rhs <= room).all(axis=1))

    @derived
    def errors(self) -> tuple[Floats, Floats]:
        """What the elimination of equalities rounded: bounds (kept, free) and (kept,) for the entries of AT and rhs."""
        of_rows, of_rhs = self.flat.restriction_errors(self.A[self.kept], self.b[self.kept])
        return np.ldexp(of_rows, self.row_powers[:, None] + self.powers), np.ldexp(of_rhs, self.row_powers)

    @derived
    def _reach(self) -> Floats:
        """Bounds (free,) of the coordinates of all points of the set; inf where none is proved."""
        bounds = self._along_axes.bounds
        if self.flat.pivots:
            of_rows, of_rhs = self.errors
            weights = self._along_axes.weights
            bounds = bounds.widened(weights @ of_rhs, weights @ of_rows)
        solved = np.array([name == OPTIMAL for name in self._along_axes.status])
        values = np.where(solved, 2.0 * bounds.values, np.inf)
        return proved_reach(Bounds(values, bounds.spare, 2.0 * bounds.beside))

    @derived
    def _axes(self) -> Floats:
        half = 0.5 * np.eye(self.powers.size)  # as forms are scaled
        return np.vstack([half, -half])

    @derived
    def _along_axes(self) -> _Solved:
        if self._small:
            return self._by_kernel(self._axes)
        answers = [self._by_highs(axis) for axis in self._axes]
        points, weights, bounds, status = zip(*answers, strict=True)
        values, spare = (np.concatenate(part) for part in zip(*((b.values, b.spare) for b in bounds), strict=True))
        all_bounds = Bounds(values, spare, np.vstack([b.beside for b in bounds]))
        return _Solved(np.array(points), np.array(weights), all_bounds, list(status))

    def _solve(self, reduced: Floats) -> _Solved:
        """The forms (k, free), scaled, by the kernel where the program is small."""
        k, free = reduced.shape
        if free and self._small:
            if k == 2 * free and np.array_equal(reduced, self._axes):
                along = self._along_axes
                return replace(along, status=list(along.status))
            return self._by_kernel(reduced)
        nothing = Bounds(np.zeros(k), np.zeros(k), np.zeros((k, free)))
        return _Solved(
            np.zeros((k, free)), np.zeros((k, self.kept.size)), nothing, [UNDECIDED if free else OPTIMAL] * k
        )

    def _by_kernel(self, reduced: Floats) -> _Solved:
        points, weights, values, spare, beside, _, status = kernel.supports(self.AT, self.rhs, self.centre, reduced)
        names = [_NAMES.get(code, UNDECIDED) for code in status.tolist()]
        return _Solved(points, weights, Bounds(values, spare, beside), names)

    def _by_highs(self, reduced: Floats) -> tuple[Floats, Floats, Bounds, str]:
        """Point, multipliers, bounds and status of one form."""
        point, weights, bounds, status = large_program.support(self._highs, self.AT, self.rhs, reduced)
        return point, weights, bounds, status if status in (OPTIMAL, UNBOUNDED) else UNDECIDED

    @derived
    def exact_point(self) -> list[fmpq] | None:
        """A point that satisfies every row exactly; None if the rational simplex is not affordable or did not end."""
        if not self.exact.affordable:
            return None
        start = self.exact.feasible(self.interior.point)
        return start.point if start.status == "reached" else None

    def _by_exact_multipliers(
        self, direction: Floats, point: Floats, weights: Floats
    ) -> tuple[str, float, Floats, Floats] | None:
        """The exact bound by the rows that float multipliers use, if it is near the value at the point."""
        if not weights.any():
            return None
        bound = self.exact.bound(direction, weights)
        if bound is None:
            return None
        value, gap = rounded_up(bound[0]), float(to_floats([bound[0]])[0] - direction @ point)
        if not gap <= CLEAN * (float(np.abs(direction) @ np.abs(point)) + abs(value)):
            return None
        return OPTIMAL, value, point, weights

    def _maximise_carefully(self, direction: Floats, reduced: Floats, top: int) -> tuple[str, float, Floats, Floats]:
        """The rational simplex if it is affordable, else HiGHS, accepted if the bound is near the maximum."""
        nowhere, nothing = np.full(self.flat.dim, np.nan), np.zeros(self.b.size)
        start = self.exact_point
        if start is not None:
            outcome = self.exact.maximum(direction, start)
            if outcome.status == "optimal":
                point, weights = to_floats(outcome.point), weights_of(outcome, self.b.size)
                return OPTIMAL, rounded_up(outcome.value), point, weights
            if outcome.status == "unbounded":
                return UNBOUNDED, np.inf, nowhere, nothing
        z, y, bounds, status = self._by_highs(reduced)
        if status == UNBOUNDED:
            return UNBOUNDED, np.inf, nowhere, nothing
        found = _Solved(z[None], y[None], bounds, [status])
        value = float(self._proved(direction[None], reduced[None], np.array([top]), found)[0])
        if found.status[0] != OPTIMAL:
            return UNDECIDED, np.nan, nowhere, nothing
        constants = self.flat.restrict(direction[None], np.zeros(1))[1]
        value = float(self._with_constants(direction[None], np.ldexp([value], top), constants)[0])
        multipliers = np.zeros(self.b.size)
        multipliers[self.kept] = np.ldexp(y, self.row_powers + top)
        return OPTIMAL, value, self.lift(z), multipliers

    def _with_constants(self, directions: Floats, values: Floats, constants: Floats) -> Floats:
        """The bounds of ``c'x = values - constants``, rounded up unless no sum is rounded."""
        if not self.flat.pivots:
            return values
        error = self.flat.restriction_errors(directions, np.zeros(len(directions)))[1]
        known = np.where(np.isfinite(values), values, 0.0)
        total = known - constants
        part = total - known
        lost = (known - (total - part)) - (constants + part)
        more = error + np.maximum(lost, 0.0)
        total = np.where(more > 0.0, np.nextafter(total + more, np.inf), total)
        return np.where(np.isfinite(values), total, values)
