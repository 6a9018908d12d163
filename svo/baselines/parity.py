"""Parity space of a time-varying model (Chow and Willsky 1984), weighted by the covariance of the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np
from numba import njit

from polytopes.signatures import options_by_name
from svo.baselines.linear_gaussian import GaussianModel, GaussianSamples
from svo.checks import Array, expect, is_count, positive_number
from svo.logs.log import Log

_TRACE = 1e-12  # of a squared norm


@dataclass(frozen=True)
class ParityRecord:
    """Over K samples, NaN while there are too few.

    Attributes
    ----------
    squares : (K,) array
        Squared norm of the whitened parity vector: chi-square of ``degrees`` under the model's assumptions.
    unexplained : (K, n_faults) array
        What is left of it once each fault, of the best constant size over the window, is taken away.
    degrees : int
        Length of the parity vector, (order + 1) ny - n.
    """

    squares: Array
    unexplained: Array
    degrees: int


@options_by_name
@dataclass(frozen=True)
class ParitySpace:
    """Residuals of the last order + 1 measurements that no state can make.

    Stacked, y = O x + known + noise with the state x at the start of the window. The parity vector is what is
    left of y outside the range of O, whitened; its squared norm is that of the generalised least-squares residual.

    Parameters
    ----------
    model : GaussianModel
    order : int
        Transitions in the window, >= 1, with (order + 1) ny > n.
    process_noise : float
        Factor on the covariance of the process noise, for tuning.

    Raises
    ------
    ValueError
        For a number out of its range.
    """

    model: GaussianModel
    order: int = 4
    _: KW_ONLY
    process_noise: float = 1.0

    def __post_init__(self) -> None:
        expect(is_count(self.order, 1), "order", self.order, "a whole number of transitions >= 1")
        if self.degrees < 1:
            raise ValueError(f"order is {self.order}: (order + 1) ny is not above n; expected a longer window")
        positive_number("process_noise", self.process_noise, "factor")

    @property
    def degrees(self) -> int:
        """Length of the parity vector."""
        return (self.order + 1) * self.model.model.n_outputs - self.model.model.n_states

    def run(self, log: Log) -> ParityRecord:
        """All samples of a log, which must have no missing measurements."""
        return self.over(self.model.samples(log))

    def over(self, samples: GaussianSamples, effects: Sequence[tuple[Array, Array]] = ()) -> ParityRecord:
        """The same where the model along the log is known already.

        Parameters
        ----------
        samples : GaussianSamples
        effects : sequence of ((K, n), (K, ny)) arrays
            What each fault of a unit size adds to the next state and to the output.

        Raises
        ------
        ValueError
            If a measurement is missing.
        """
        if np.isnan(samples.y).any():
            k = int(np.argmax(np.isnan(samples.y).any(axis=1)))
            raise ValueError(f"y has a missing sensor at sample {k}; a parity space needs every measurement")
        K = len(samples)
        state = np.zeros((len(effects), *samples.f.shape))
        output = np.zeros((len(effects), *samples.g.shape))
        for j, (on_state, on_output) in enumerate(effects):
            state[j], output[j] = on_state, on_output
        squares, unexplained = np.full(K, np.nan), np.full((K, len(effects)), np.nan)
        A, f, Q, C, g, R, y = samples.arrays()
        _parity(A, f, self.process_noise * Q, C, g, R, y, self.order, state, output, squares, unexplained)
        return ParityRecord(squares, unexplained, self.degrees)


@njit(cache=True)
def _parity(A, f, Q, C, g, R, y, order, state, output, squares, unexplained):  # type: ignore[no-untyped-def]
    n, ny, faults = A.shape[1], C.shape[1], state.shape[0]
    m = (order + 1) * ny
    range_, Z, covariance = np.zeros((m, n)), np.zeros((m, 1 + faults)), np.zeros((m, m))
    for k in range(order, len(y)):
        Phi, mean, spread = np.eye(n), np.zeros((n, 1 + faults)), np.zeros((n, n))
        for i in range(order + 1):
            now = k - order + i
            rows = slice(i * ny, (i + 1) * ny)
            range_[rows] = C[now] @ Phi
            Z[rows] = -C[now] @ mean
            Z[rows, 0] += y[now] - g[now]
            for j in range(faults):
                Z[rows, 1 + j] -= output[j, now]
            later = spread.copy()  # covariance of the states at samples j and now
            covariance[rows, rows] = C[now] @ spread @ C[now].T + R[now]
            for j in range(i + 1, order + 1):
                later = A[k - order + j - 1] @ later
                block = C[k - order + j] @ later @ C[now].T
                covariance[j * ny : (j + 1) * ny, rows] = block
                covariance[rows, j * ny : (j + 1) * ny] = block.T
            Phi = A[now] @ Phi
            mean = A[now] @ mean
            mean[:, 0] += f[now]
            for j in range(faults):
                mean[:, 1 + j] += state[j, now]
            spread = A[now] @ spread @ A[now].T + Q[now]
        L = np.linalg.cholesky(covariance)
        white = np.linalg.solve(L, Z)
        basis = np.ascontiguousarray(np.linalg.qr(np.linalg.solve(L, range_))[0])
        # Rows: the parity vector, and what each fault does to it.
        left = np.ascontiguousarray((white - basis @ (np.ascontiguousarray(basis.T) @ white)).T)
        squares[k] = left[0] @ left[0]
        for j in range(faults):
            size, along = left[1 + j] @ left[1 + j], left[1 + j] @ left[0]
            # A fault within what any state explains leaves no trace: less than a millionth of what it does.
            seen = size > _TRACE * np.sum(white[:, 1 + j] ** 2)
            unexplained[k, j] = squares[k] - (along * along / size if seen else 0.0)
