"""Kalman filter and unknown-input observer as residual generators, over a log or sample by sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polytopes.shown import Shown
from polytopes.signatures import options_by_name
from svo.baselines.filter_kernel import filter_samples
from svo.baselines.linear_gaussian import GaussianModel, GaussianSamples, Sample
from svo.checks import Array, finite_array, positive_number, readings
from svo.logs.log import Log

_STABLE = 1e-9  # how far inside the unit circle a mode must be to count as stable
_UNSEEN = 1e-9  # of |A|: singular value of a mode that the outputs do not see


@dataclass(frozen=True)
class Innovations(Shown):
    """Residuals over K samples.

    Attributes
    ----------
    white : (K, ny) array
        Whitened innovations: without a fault independent standard Gaussians, under the filter's assumptions. With
        nd unknown inputs they lie in the ny - nd directions that those do not reach. Zero for a missing sensor.
    states : (K, n) array
        Estimates after each measurement.
    """

    white: Array
    states: Array

    @property
    def squares(self) -> Array:
        """Squared norm (K,), for `svo.residual_tests.ChiSquare` with ny - nd degrees of freedom."""
        return np.einsum("ki,ki->k", self.white, self.white)


@options_by_name
@dataclass(frozen=True)
class InnovationFilter(Shown):
    """Kalman filter; with ``state_input`` or ``output_input`` an unknown-input observer of least variance.

    The unknown inputs are estimated from the innovation and take all of it that they can explain (Kitanidis,
    Automatica 23, 1987), so the residual does not depend on them at all, whatever they do. Without them this is
    the Kalman filter.

    Parameters
    ----------
    model : GaussianModel
    process_noise : float
        Factor on the covariance of the process noise, for tuning.
    state_input : (n, nd) array, optional
        Directions in which unknown inputs enter the next state.
    output_input : (ny, md) array, optional
        Directions in which unknown inputs enter the output, such as a column of the identity for a faulty sensor.

    Raises
    ------
    ValueError
        If a shape does not fit, the factor is not positive, or the unknown inputs cannot be decoupled
        (`unknown_input_exists`, at the model's typical schedule).
    """

    model: GaussianModel
    _: KW_ONLY
    process_noise: float = 1.0
    state_input: ArrayLike | None = None
    output_input: ArrayLike | None = None
    _E: Array = field(init=False, repr=False)
    _D: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        positive_number("process_noise", self.process_noise, "factor")
        n, ny = self.model.model.n_states, self.model.model.n_outputs
        E, D = _columns("state_input", self.state_input, n), _columns("output_input", self.output_input, ny)
        none = (np.zeros((n, D.shape[1])), np.zeros((ny, E.shape[1])))
        object.__setattr__(self, "_E", np.hstack([E, none[0]]))
        object.__setattr__(self, "_D", np.hstack([none[1], D]))
        if self._E.shape[1]:
            typical = self.model.sample(np.zeros(self.model.model.n_inputs), self.model.model.schedule)
            unknown_input_exists(typical.A, typical.C, E, D=D)

    def run(self, log: Log) -> Innovations:
        """All samples of a log.

        Raises
        ------
        ValueError
            If the log does not fit the model, or an unknown input cannot be told from y at a sample.
        """
        return self.over(self.model.samples(log))

    def over(
        self, samples: GaussianSamples, state_input: Array | None = None, output_input: Array | None = None
    ) -> Innovations:
        """The same where the model along the log is known already.

        Parameters
        ----------
        samples : GaussianSamples
        state_input, output_input : (K, n, nd), (K, ny, nd) arrays, optional
            Directions that change from sample to sample, instead of the filter's own; column j of both belongs to
            one unknown input, which may differ between the two.
        """
        K = len(samples)
        E = np.broadcast_to(self._E, (K, *self._E.shape)) if state_input is None else state_input
        D = np.broadcast_to(self._D, (K, *self._D.shape)) if output_input is None else output_input
        x, P = self.model.mean.copy(), self.model.covariance.copy()
        states, white = np.empty((K, x.size)), np.empty(samples.y.shape)
        before = np.maximum(np.arange(K) - 1, 0)  # each measurement follows from the sample before
        bad = filter_samples(
            x, P, True, samples.A[before], samples.f[before], self.process_noise * samples.Q[before],
            samples.C, samples.g, samples.R, samples.y, E[before], D, states, white,
        )  # fmt: skip
        if bad >= 0:
            raise ValueError(_cannot_tell(bad))
        return Innovations(white, states)

    def start(self) -> OnlineFilter:
        """A run of its own, sample by sample."""
        return OnlineFilter(self)


class OnlineFilter:
    """One run of an `InnovationFilter`, sample by sample, with the calls of the package's observers."""

    def __init__(self, filter_: InnovationFilter) -> None:
        self._filter = filter_
        self._x, self._P = filter_.model.mean.copy(), filter_.model.covariance.copy()
        self._at: Callable[[Array], Sample] | None = None
        self._samples = 0

    def update(self, y0: ArrayLike, u: ArrayLike | None = None, schedule: Any = None) -> Array:
        """The first measurement; returns its whitened innovation (ny,)."""
        if self._at is not None:
            raise ValueError("update was called after the first sample; use step(u=..., y=...)")
        return self._advance(None, y0, u, schedule)

    def step(self, u: ArrayLike | None, y: ArrayLike, u_next: ArrayLike | None = None, schedule: Any = None) -> Array:
        """One transition driven by u, then the measurement y; returns its whitened innovation (ny,)."""
        if self._at is None:
            raise ValueError("step was called before the first measurement; call update(y0=...)")
        return self._advance(self._at(self._inputs(u)), y, u_next, schedule)

    def _inputs(self, u: ArrayLike | None) -> Array:
        size = self._filter.model.model.n_inputs
        return np.zeros(size) if u is None else finite_array("u", u, (size,))

    def _advance(self, before: Sample | None, y: ArrayLike, u: ArrayLike | None, schedule: Any) -> Array:
        model = self._filter.model
        self._at = lambda inputs: model.sample(inputs, schedule)
        now = self._at(self._inputs(u))
        past = now if before is None else before
        white, states = np.empty((1, len(now.g))), np.empty((1, self._x.size))
        measured = readings("y", y, (model.model.n_outputs,))[None]
        bad = filter_samples(
            self._x, self._P, before is None, past.A[None], past.f[None],
            self._filter.process_noise * past.Q[None],
            now.C[None], now.g[None], now.R[None], measured, self._filter._E[None], self._filter._D[None],
            states, white,
        )  # fmt: skip
        if bad >= 0:
            raise ValueError(_cannot_tell(self._samples))
        self._samples += 1
        return white[0]


def unknown_input_exists(A: ArrayLike, C: ArrayLike, E: ArrayLike, D: ArrayLike | None = None) -> None:
    """Refuse unknown inputs that no observer can decouple with a stable error (Chen and Patton 1999, theorem 3.1).

    x(k+1) = A x + E d, y = C x + D s. Needed: [C E, D] of full column rank, less than ny columns (or no residual is
    left), and no unstable mode of the error that the rest of y does not see.

    Parameters
    ----------
    A, C, E, D : (n, n), (ny, n), (n, nd), (ny, md) arrays

    Raises
    ------
    ValueError
        Saying which condition fails.
    """
    A, C = finite_array("A", A), finite_array("C", C)
    n, ny = len(A), len(C)
    A, C, E, D = _balanced(A, C, _columns("E", E, n), _columns("D", D, ny))
    F = np.hstack([C @ E, D])
    rank = int(np.linalg.matrix_rank(F))
    if rank < F.shape[1]:
        raise ValueError(
            f"[C E, D] has rank {rank} with {F.shape[1]} unknown inputs; expected full column rank: the outputs must "
            "tell the unknown inputs apart, so name fewer, or measure more"
        )
    if rank >= ny:
        raise ValueError(f"there are {rank} unknown inputs and {ny} outputs; expected fewer, or no residual is left")
    inverse = np.linalg.pinv(F)
    free = np.eye(n) - np.hstack([E, np.zeros((n, D.shape[1]))]) @ inverse @ C
    error, seen = free @ A, (np.eye(ny) - F @ inverse) @ C @ A
    modes: NDArray[np.complex128] = np.linalg.eigvals(error).astype(complex)
    for value in modes:
        pencil = np.vstack([value * np.eye(n) - error, seen])
        unseen = _UNSEEN * max(1.0, float(np.linalg.norm(A)))
        if abs(value) >= 1.0 - _STABLE and np.linalg.matrix_rank(pencil, tol=unseen) < n:
            raise ValueError(
                f"the error has a mode at {_number(value)} that the decoupled outputs do not see; expected all such "
                "modes inside the unit circle (detectability), so name fewer unknown inputs"
            )


def _balanced(A: Array, C: Array, E: Array, D: Array) -> tuple[Array, Array, Array, Array]:
    """The same system in units in which the sizes of its entries differ least, so that ranks do not depend on units.

    Least squares of ln |entry| = s_row - s_column, rounded to powers of two: states have one scale in both roles.
    """
    n, ny, d = len(A), len(C), E.shape[1] + D.shape[1]
    whole = np.block([[A, E, np.zeros((n, D.shape[1]))], [C, np.zeros((ny, E.shape[1])), D]])
    i, j = np.nonzero(whole)
    column = np.where(j < n, j, ny + j)  # scales: of n states, ny outputs, d unknown inputs
    rows = np.eye(n + ny + d)[i] - np.eye(n + ny + d)[column]
    scale = np.linalg.lstsq(rows, np.log2(np.abs(whole[i, j])), rcond=None)[0].round()
    x, y, inputs = 2.0 ** scale[:n], 2.0 ** scale[n : n + ny, None], 2.0 ** scale[n + ny :]
    e, m = inputs[: E.shape[1]], inputs[E.shape[1] :]
    return A / x[:, None] * x, C / y * x, E / x[:, None] * e, D / y * m


def _columns(name: str, value: ArrayLike | None, rows: int) -> Array:
    if value is None:
        return np.zeros((rows, 0))
    return finite_array(name, value, (rows, "number of unknown inputs"))


def _number(value: np.complex128) -> str:
    return f"{value.real:.6g}" if value.imag == 0 else f"{value:.6g}"


def _cannot_tell(sample: int) -> str:
    return f"at sample {sample} the outputs cannot tell an unknown input; expected C E and D of full column rank there"
