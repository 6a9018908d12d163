"""Output injection: where exact sensors read the disturbance, it leaves the program.

With F square and invertible and no noise, w = F^-1 (y - C x - D u - c) up to the slack of the data. Then

    x(k+1) = (A - K C) x + (B - K D) u + (a - K c + K y) + d + channels,      K = E F^-1,  |d| <= |K| slack + rounding
    F^-1 (C x + D u + c) within the box of w about F^-1 y, widened by |F^-1| slack + rounding

which has no rows of the width of the slack, as the measurements have. It is used where A - K C is stable. The window
then speaks of d where it spoke of w, but proofs do not: the multiplier of the measurements is F^-T l - K' pi, where l
is that of the box of w and pi the costate of the next state, and the certificate is about the model as it was given.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from svo.checks import Array
from svo.models import UncertainModel, may_be_nonzero
from svo.observers.window.certificate import WindowCertificate, certificate_from
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window_kernel import BASE, TIME, Sizes

_UNIT = 1.1102230246251565e-16
_ILL_CONDITIONED = 1e6  # condition of F from which w stays in the program


def can_inject(model: UncertainModel) -> bool:
    """Whether w can leave the program: no noise, w in a box, F invertible, nothing uncertain about E, C, D, c and F,
    and A - E F^-1 C stable at the typical schedule."""
    nw, ny = model.n_disturbances, model.n_outputs
    if nw != ny or model.F is None or callable(model.n) or np.any(model.bounds(model.schedule)[2]):
        return False
    if model.disturbance_polytope is not None:
        return False
    if may_be_nonzero(*(array for u in model.uncertainties for array in (u.E, u.C, u.D, u.c, u.F))):
        return False
    gains = _gains(model.stack(model.schedule)[0], model.n_states, model.n_inputs)
    if gains is None:
        return False
    closed = model.block("A", model.schedule) - gains[1] @ model.block("C", model.schedule)
    return bool(np.abs(np.linalg.eigvals(closed)).max() < 1.0)


def _gains(matrix: Array, n: int, nu: int) -> tuple[Array, Array] | None:
    """F^-1 and K = E F^-1 of a stack's first item; None where F is singular or nearly so."""
    if not np.isfinite(matrix).all():
        return None
    F = matrix[n:, n + nu + 1 :]
    if not np.linalg.cond(F) < _ILL_CONDITIONED:
        return None
    inverse = np.asarray(np.linalg.inv(F), dtype=np.float64)
    return inverse, matrix[:n, n + nu + 1 :] @ inverse


class OutputInjection:
    """What a window observer's data become, and its proofs again what they would have been.

    The kernel's disturbances are (w, d). A sample with a missing sensor keeps w and has d = 0; one with all of them
    has w = 0 and the d of the module's first lines.
    """

    def __init__(self, n: int, nu: int, nw: int) -> None:
        self._n, self._nu, self._nw = n, nu, nw

    def allocate(self, size: Sizes) -> dict[str, Array]:
        """Memory of the data as given, by ring slot."""
        S, shape = size.N + 1, (size.n + size.ny, size.n + size.nu + 1 + self._nw)
        return {
            "given.stack": np.zeros((S, size.ni, *shape)),
            "given.y": np.zeros((S, size.ny)),
            "given.slack": np.zeros((S, size.ny)),
            "given.injected": np.zeros(S),
        }

    def transform(self, stack: Array, y: Array, w: tuple[Array, Array]) -> tuple[Array, Array, Array, bool]:
        """Stack, measurement and half-widths as the kernel takes them, and whether w is injected."""
        n, nu, ny = self._n, self._nu, self._nw
        known = slice(0, n + nu + 1)
        padded = np.concatenate([stack, np.zeros((*stack.shape[:2], n))], axis=2)
        gains = _gains(stack[0], n, nu) if np.isfinite(y).all() else None
        if gains is None:
            return padded, y, np.zeros(ny), False
        inverse, K = gains
        padded[0, :n, known] = stack[0, :n, known] - K @ stack[0, n:, known]
        padded[0, :n, n + nu] += K @ y
        padded[0, :n, n + nu + 1 :] = np.hstack([np.zeros((n, self._nw)), np.eye(n)])
        centre = 0.5 * w[0] + 0.5 * w[1]
        padded[0, n:, known] = inverse @ stack[0, n:, known]
        padded[0, n:, n + nu] += centre
        padded[0, n:, n + nu + 1 :] = 0.0
        return padded, inverse @ y, np.maximum(w[1] - centre, centre - w[0]), True

    def widths(
        self, stack: Array, y: Array, u: Array, reach: Array, w: tuple[Array, Array], eps: float
    ) -> tuple[Array, Array, Array]:
        """Bounds of d, widening of the box of w, and slack of the measurements, for states |x| <= reach."""
        n, nu = self._n, self._nu
        gains = _gains(stack[0], n, nu)
        assert gains is not None
        inverse, K = gains
        E, F = stack[0, :n, n + nu + 1 :], stack[0, n:, n + nu + 1 :]
        largest = np.maximum(np.abs(w[0]), np.abs(w[1]))
        known = np.concatenate([reach, np.abs(u), [1.0]])
        outputs = np.abs(stack[0, n:, : n + nu + 1]) @ known + np.abs(F) @ largest + np.abs(y)
        states = np.abs(stack[0, :n, : n + nu + 1]) @ known + np.abs(E) @ largest + np.abs(K) @ outputs
        slack = eps * outputs
        unit = 4.0 * _UNIT * (stack.shape[2] + self._nw + 8)
        d = np.abs(E - K @ F) @ largest + np.abs(K) @ slack + unit * states
        rest = np.abs(inverse @ F - np.eye(self._nw)) @ largest
        widening = rest + np.abs(inverse) @ slack + unit * (np.abs(inverse) @ outputs + largest)
        return d, widening, slack

    def certificate(
        self, window: dict[str, Any], size: Sizes, arrival: ArrivalSet, objective: tuple[int, Array] | None = None
    ) -> WindowCertificate:
        """The certificate of the window about the data as given.

        Parameters
        ----------
        objective : (sample, direction), optional
            Of a bound that is to be proven, as in `WindowCertificate.proven_bound`.
        """
        return certificate_from(window, size, arrival, self._outputs(window, size, objective), self._nw)

    def _outputs(self, window: dict[str, Any], size: Sizes, objective: tuple[int, Array] | None) -> dict[int, Array]:
        """Multipliers of the measurements at every sample, by the backward recursion of the costate in floats."""
        n, nu = self._n, self._nu
        multiplier = window["farkas"] * window["scale"]
        nr = size.ny + size.nh + 2 * size.nq
        costate, found = np.zeros(n), {}
        for k in range(int(window["clock"][TIME]), int(window["clock"][BASE]) - 1, -1):
            s, v = k % (size.N + 1), k % (size.N + size.late)
            rows = multiplier[size.na + s * nr :][:nr]
            stack, m = window["given.stack"][s], rows[: size.ny].copy()
            if window["given.injected"][s]:
                gains = _gains(stack[0], n, nu)
                assert gains is not None
                m = gains[0].T @ m - gains[1].T @ costate
            found[k] = m
            on_channel = np.maximum(rows[size.ny + size.nh :].reshape(size.nq, 2), 0.0)
            on_s = window["lines"][v][:, 2] * on_channel[:, 1] - window["lines"][v][:, 0] * on_channel[:, 0]
            costate = stack[0, :n, :n].T @ costate + stack[0, n:, :n].T @ m + on_s @ window["functional"][v][:, :n]
            if objective is not None and objective[0] == k:
                costate = costate - objective[1]
        return found
