"""Parity space of a time-varying model (Chow and Willsky 1984), weighted by the covariance of the noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass

import numpy as np
from numpy.typing import NDArray

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.baselines.linear_gaussian import GaussianModel, GaussianSamples
from svo.checks import Array, expect, is_count, positive_number
from svo.logs.log import Log

_TRACE = 1e-12  # of a squared norm
_BLOCK = 512  # windows at a time: some megabytes


@dataclass(frozen=True)
class ParityRecord(Shown):
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
class ParitySpace(Shown):
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
        parts = A, f, self.process_noise * Q, C, g, R, y
        for first in range(0, K - self.order, _BLOCK):
            starts = np.arange(first, min(first + _BLOCK, K - self.order))
            ends = starts + self.order
            squares[ends], unexplained[ends] = _windows(parts, self.order, state, output, starts)
        return ParityRecord(squares, unexplained, self.degrees)


def _last(array: Array) -> Array:
    """Arrays (faults, windows, rows) of faults as (windows, rows, faults)."""
    return np.moveaxis(array, 0, -1)


def _windows(
    parts: tuple[Array, ...], order: int, state: Array, output: Array, starts: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Squares (windows,) and unexplained (windows, faults) of the windows that begin at these samples."""
    A, f, Q, C, g, R, y = parts
    n, ny, faults, windows = A.shape[1], C.shape[1], len(state), len(starts)
    m = (order + 1) * ny
    range_, Z, covariance = np.zeros((windows, m, n)), np.zeros((windows, m, 1 + faults)), np.zeros((windows, m, m))
    Phi, mean, spread = np.eye(n), np.zeros((windows, n, 1 + faults)), np.zeros((windows, n, n))
    for i in range(order + 1):
        now, rows = starts + i, slice(i * ny, (i + 1) * ny)
        range_[:, rows], Z[:, rows] = C[now] @ Phi, -C[now] @ mean
        Z[:, rows, 0] += y[now] - g[now]
        Z[:, rows, 1:] -= _last(output[:, now])
        covariance[:, rows, rows] = C[now] @ spread @ C[now].mT + R[now]
        across = spread @ C[now].mT  # covariance of the state at a later sample and this output
        for j in range(i + 1, order + 1):
            across = A[starts + j - 1] @ across
            columns = slice(j * ny, (j + 1) * ny)
            covariance[:, columns, rows] = C[starts + j] @ across
            covariance[:, rows, columns] = covariance[:, columns, rows].mT
        Phi, mean = A[now] @ Phi, A[now] @ mean
        mean[:, :, 0] += f[now]
        mean[:, :, 1:] += _last(state[:, now])
        spread = A[now] @ spread @ A[now].mT + Q[now]
    white = np.linalg.solve(np.linalg.cholesky(covariance), np.concatenate([Z, range_], axis=2))
    basis, white = np.linalg.qr(white[:, :, 1 + faults :])[0], white[:, :, : 1 + faults]
    left = white - basis @ (basis.mT @ white)  # columns: the parity vector, and what each fault does to it
    squares, size = np.sum(left[:, :, 0] ** 2, axis=1), np.sum(left[:, :, 1:] ** 2, axis=1)
    along = np.sum(left[:, :, 1:] * left[:, :, :1], axis=1)
    # A fault within what any state explains leaves no trace: less than a millionth of what it does.
    seen = size > _TRACE * np.sum(white[:, :, 1:] ** 2, axis=1)
    return squares, squares[:, None] - np.divide(along * along, size, out=np.zeros_like(along), where=seen)
