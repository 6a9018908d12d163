"""What the readings of a few samples say of the state when nothing is known of it before.

With any left inverse L of the observability matrix O, the readings r of m samples (less what u, w and the middle of
every Delta account for) give the state x of the first one:

    x = L r + (I - L O) x - L (noise, w, Delta and slack as they enter later readings).

Delta and the slack of the readings grow with x, so that |x - L r| <= alpha + M |x| entry by entry, with M >= 0. If
some z > 0 has |L r| + alpha + M z < z, then M is a contraction and |x| < z, whatever x is: (I - M)^-1 >= 0. Everything
but the choice of L and z is evaluated in ball arithmetic (Arb), so no rounding is left out and no tolerance decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from flint import arb, ctx
from numpy.typing import NDArray

from polytopes.exact import ball_up
from svo.checks import Array

_BITS = 128
_CONDITION = 1e10  # of O, weighted and scaled, up to which an inverse is worth trying


class Reading(NamedTuple):
    """Model and data of one sample.

    Attributes
    ----------
    stack : (1 + n_uncertainties, n + ny, n + nu + 1 + nw) array
    u, y, noise, slack : (nu,), (ny,), (ny,), (ny,) arrays
        NaN in y = that sensor is missing. ``slack`` widens its row besides what `state_bounds` adds by ``eps``.
    w_lower, w_upper : (nw,) arrays
    """

    stack: Array
    u: Array
    y: Array
    noise: Array
    slack: Array
    w_lower: Array
    w_upper: Array


def state_bounds(samples: Sequence[Reading], delta: Array, eps: float) -> tuple[Array, Array] | None:
    """Bounds of the state at the first of some samples, by their readings alone.

    Parameters
    ----------
    samples : sequence of Reading
    delta : (n_uncertainties, 2) array
        Bounds of each Delta.
    eps : float
        Every reading is widened by eps (|y| + |C||x| + |D u| + |c| + |F| wmax + n + uncertain part).

    Returns
    -------
    (lower, upper) or None
        None where the readings do not bound the state, or not as far as one inverse of O shows; infinite where floats
        end.
    """
    inverse = left_inverse(samples, delta)
    if inverse is None:
        return None
    with ctx.workprec(_BITS):
        return _Enclosure(samples, delta, eps, inverse).bounds()


def left_inverse(samples: Sequence[Reading], delta: Array) -> list[Array] | None:
    """Weighted least squares in floats, a block (n, ny) a sample, zero for missing sensors; None without full rank."""
    ny = samples[0].y.size
    n = samples[0].stack.shape[1] - ny
    middle = 0.5 * delta[:, 0] + 0.5 * delta[:, 1]
    response, spread = np.eye(n), np.zeros(n)
    rows, sizes, used = [], [], []
    for sample in samples:
        stack = sample.stack[0] + np.tensordot(middle, sample.stack[1:], axes=1)
        half = 0.5 * (sample.w_upper - sample.w_lower)
        width = stack.shape[1] - half.size
        rows.append(stack[n:, :n] @ response)
        direct = np.abs(stack[n:, width:]) @ half
        sizes.append(sample.noise + sample.slack + direct + np.abs(stack[n:, :n]) @ spread)
        used.append(~np.isnan(sample.y))
        spread = np.abs(stack[:n, :n]) @ spread + np.abs(stack[:n, width:]) @ half
        response = stack[:n, :n] @ response
    chosen = np.concatenate(used)
    observed, size = np.vstack(rows)[chosen], np.concatenate(sizes)[chosen]
    if len(observed) < n or not (np.isfinite(observed).all() and np.isfinite(size).all()):
        return None
    size = np.maximum(size, 1e-9 * size.max(initial=0.0))
    weight = 1.0 / np.where(size > 0.0, size, 1.0)
    weighted = observed * weight[:, None]
    columns = np.linalg.norm(weighted, axis=0)
    if not (np.isfinite(columns).all() and (columns > 0.0).all()):
        return None
    left, values, right = np.linalg.svd(weighted / columns, full_matrices=False)
    if not values[-1] * _CONDITION > values[0]:
        return None
    inverse = np.zeros((n, len(chosen)))
    inverse[:, chosen] = ((right.T / values) @ left.T) / columns[:, None] * weight
    return np.split(inverse, len(samples), axis=1)


class _Enclosure:
    """One evaluation; arrays hold balls."""

    def __init__(self, samples: Sequence[Reading], delta: Array, eps: float, inverse: list[Array]) -> None:
        self._samples, self._eps, self._inverse = samples, arb(eps), [balls(L) for L in inverse]
        self._ny = samples[0].y.size
        self._n = samples[0].stack.shape[1] - self._ny
        lower, upper = balls(delta).T
        self._middle, self._half = (lower + upper) / 2, (upper - lower) / 2

    def bounds(self) -> tuple[Array, Array] | None:
        """The state at the first sample, or None if M is no contraction that this shows."""
        n = self._n
        centre, alpha, M = _zeros(n), _zeros(n), _zeros(n, n)
        costates = self._costates()
        M = M + abs(balls(np.eye(n)) - costates[0])
        free, response, spread, share = _zeros(n), balls(np.eye(n)), _zeros(n), _zeros(n, n)
        for L, after, sample in zip(self._inverse, costates[1:], self._samples, strict=True):
            stack, known, uncertain, half = self._parts(sample, free, response, spread, share)
            A, C = stack[:n, :n], stack[n:, :n]
            E, F = np.vsplit(stack[:, stack.shape[1] - half.size :], [n])
            used = ~np.isnan(sample.y)
            y = balls(np.where(used, sample.y, 0.0))
            slack, growth = self._slack(sample, y, C, F, (free, response, spread, share), uncertain, known[n:])
            on_v = np.hstack([after, L])
            residual = y - C @ free - known[n:]
            residual[~used] = arb(0)
            centre = centre + L @ residual
            alpha = alpha + abs(L) @ (balls(sample.noise) + slack) + abs(after @ E + L @ F) @ half
            alpha = alpha + abs(on_v) @ uncertain[0]
            M = M + abs(L) @ growth + abs(on_v) @ uncertain[1]
            free, response = A @ free + known[:n], A @ response
            spread = abs(A) @ spread + abs(E) @ half + uncertain[0][:n]
            share = abs(A) @ share + uncertain[1][:n]
        return _contraction(centre, alpha, M)

    def _costates(self) -> list[Any]:
        """Q_j = sum over i >= j of L_i C_i Phi(i, j) for j = 0..m, the last one zero; Q_0 = L O."""
        n, costates = self._n, [_zeros(self._n, self._n)]
        for L, sample in zip(reversed(self._inverse), reversed(self._samples), strict=True):
            stack = self._central(sample)
            costates.append(L @ stack[n:, :n] + costates[-1] @ stack[:n, :n])
        return costates[::-1]

    def _central(self, sample: Reading) -> Any:
        stack = balls(sample.stack[0])
        for middle, item in zip(self._middle, sample.stack[1:], strict=True):
            stack = stack + middle * balls(item)
        return stack

    def _parts(self, sample: Reading, free: Any, response: Any, spread: Any, share: Any) -> tuple[Any, Any, Any, Any]:
        """Central stack, what is known of both lines, bounds (alpha, M) of the uncertain part, half-widths of w."""
        n, nw = self._n, sample.w_lower.size
        stack = self._central(sample)
        lower, upper = balls(sample.w_lower), balls(sample.w_upper)
        half = (upper - lower) / 2
        given = np.concatenate([balls(sample.u), [arb(1)], (lower + upper) / 2])
        columns = stack.shape[1] - nw
        alpha, M = _zeros(len(stack)), _zeros(len(stack), n)
        for d, item in zip(self._half, map(balls, sample.stack[1:]), strict=True):
            on_x = item[:, :n]
            alpha = alpha + d * (abs(on_x @ free + item[:, n:] @ given) + abs(on_x) @ spread)
            alpha = alpha + d * (abs(item[:, columns:]) @ half)
            M = M + d * (abs(on_x @ response) + abs(on_x) @ share)
        return stack, stack[:, n:] @ given, (alpha, M), half

    def _slack(
        self, sample: Reading, y: Any, C: Any, F: Any, state: tuple[Any, ...], uncertain: Any, known: Any
    ) -> tuple[Any, Any]:
        """Slack of the readings: a constant part and the share of |x|."""
        free, response, spread, share = state
        n, nu = self._n, sample.u.size
        stack = balls(sample.stack[0])[n:]
        largest = balls(np.maximum(np.abs(sample.w_lower), np.abs(sample.w_upper)))
        size = abs(y) + abs(C) @ (abs(free) + spread) + abs(stack[:, n : n + nu]) @ abs(balls(sample.u))
        size = size + abs(known) + abs(stack[:, n + nu]) + abs(F) @ largest + balls(sample.noise) + uncertain[0][n:]
        growth = abs(C) @ (abs(response) + share) + uncertain[1][n:]
        return balls(sample.slack) + self._eps * size, self._eps * growth


def _contraction(centre: Any, alpha: Any, M: Any) -> tuple[Array, Array] | None:
    """The box |x - centre| <= alpha + M |x| implies, by a z that M maps strictly inside."""
    known = abs(centre) + alpha
    share, constant = balls_up(M), balls_up(known)
    n = len(constant)
    if not (np.isfinite(share).all() and np.isfinite(constant).all()):
        return np.full(n, -np.inf), np.full(n, np.inf)
    floor = max(float(constant.max()), np.finfo(float).tiny) * 1e-12
    try:
        z = np.asarray(np.linalg.solve(np.eye(n) - share, constant * (1.0 + 1e-9) + floor), dtype=np.float64)
    except np.linalg.LinAlgError:
        return None
    if not (np.isfinite(z).all() and (z > 0.0).all()):
        return None
    inside = known + M @ balls(z)
    if not all(bool(v < arb(float(limit))) for v, limit in zip(inside, z, strict=True)):
        return None
    radius = alpha + M @ balls(z)
    upper = balls_up(centre + radius)
    return -balls_up(radius - centre), upper


def balls(array: NDArray[Any]) -> Any:
    """The same numbers, exactly, as balls."""
    flat = np.asarray(array, dtype=float)
    balls = np.empty(flat.shape, dtype=object)
    balls.ravel()[...] = [arb(float(v)) for v in flat.ravel()]
    return balls


def _zeros(*shape: int) -> Any:
    return balls(np.zeros(shape))


def balls_up(balls: Any) -> Array:
    """Floats that are not smaller than anything in the balls."""
    array = np.asarray(balls, dtype=object)
    return np.array([ball_up(ball) for ball in array.ravel()]).reshape(array.shape)
