"""Compiled filters. All compiled functions of the filters stand in this one file: a cached machine code does not
notice a change in another file."""

from __future__ import annotations

import numpy as np
from numba import njit

_IMPOSSIBLE = 1e300  # half a squared innovation, in variances: so far off that only floats end there


@njit(cache=True)
def filter_samples(x, P, first, A, f, Q, C, g, R, y, E, D, states, white):  # type: ignore[no-untyped-def]
    """Kalman filter over samples, with unknown inputs decoupled (Kitanidis 1987) where E and D have columns.

    x (n,) and P (n, n) are the estimate after the sample before (or, if ``first``, before the first measurement) and
    are overwritten by that after the last one. A, f, Q (K, ...) and E (K, n, nd) are of the sample BEFORE each
    measurement; C, g, R and D (K, ny, nd) are of its own. Writes states (K, n) and white (K, ny): the innovations,
    whitened, less what the unknown inputs can explain. Returns the first sample at which an unknown input cannot be
    told from y, or -1.
    """
    for k in range(len(y)):
        start = first and k == 0
        if not start:
            x[:] = A[k] @ x + f[k]
            P[:] = A[k] @ P @ A[k].T + Q[k]
        Ck, Rk, nu = _present(C[k], R[k], y[k], y[k] - g[k] - C[k] @ x)
        L = np.linalg.cholesky(Ck @ P @ Ck.T + Rk)
        w = np.linalg.solve(L, nu)
        gain = np.ascontiguousarray(np.linalg.solve(L, Ck @ P).T)  # of the whitened innovation
        white[k] = w
        if E.shape[2]:
            state = np.zeros_like(E[k]) if start else E[k].copy()
            G = np.linalg.solve(L, Ck @ state + _measured(D[k], y[k]))
            for j in range(G.shape[1]):  # the size of an unknown input is free, so each is one that is seen alike
                scale = 2.0 ** -np.floor(np.log2(max(np.max(np.abs(G[:, j])), 1e-300)))
                G[:, j] *= scale
                state[:, j] *= scale
            normal = G.T @ G
            if start:  # an input of the state has not acted yet
                for j in range(len(normal)):
                    normal[j, j] += 1.0 if normal[j, j] == 0.0 else 0.0
            if np.linalg.matrix_rank(normal) < len(normal):
                return k
            M = np.linalg.solve(normal, np.ascontiguousarray(G.T))
            gain = gain + (state - gain @ G) @ M
            white[k] = w - G @ (M @ w)
        x += gain @ w
        P[:] = _corrected(P, gain, L, Ck, Rk)
        states[k] = x
    return -1


@njit(cache=True)
def multiple_models(xs, Ps, log_mu, first, log_transition, A, f, Q, C, g, R, y, log_odds, posterior):  # type: ignore[no-untyped-def]
    """Interacting multiple models (Blom and Bar-Shalom 1988) over samples.

    xs (m, n), Ps (m, n, n) and log_mu (m,) as x and P in `filter_samples`; the arrays of the models are (m, K, ...).
    Probabilities are kept as logarithms (-inf in log_transition: never), for without switching that of a wrong
    model falls without end. Writes posterior (K, m) and log_odds (K,): ln of the odds of all models but the first.
    """
    m = len(xs)
    for k in range(len(y)):
        if not (first and k == 0):
            xs[:], Ps[:], log_mu[:] = _mixed(xs, Ps, log_mu, log_transition)
        for j in range(m):
            if not (first and k == 0):
                xs[j] = A[j, k] @ xs[j] + f[j, k]
                Ps[j] = A[j, k] @ Ps[j] @ A[j, k].T + Q[j, k]
            Ck, Rk, nu = _present(C[j, k], R[j, k], y[k], y[k] - g[j, k] - C[j, k] @ xs[j])
            L = np.linalg.cholesky(Ck @ Ps[j] @ Ck.T + Rk)
            w = np.linalg.solve(L, nu)
            gain = np.ascontiguousarray(np.linalg.solve(L, Ck @ Ps[j]).T)
            xs[j] = xs[j] + gain @ w
            Ps[j] = _corrected(Ps[j], gain, L, Ck, Rk)
            distance = 0.5 * (w @ w)
            log_mu[j] -= (distance if distance < _IMPOSSIBLE else _IMPOSSIBLE) + np.sum(np.log(np.diag(L)))
        log_mu -= _log_sum(log_mu)
        log_odds[k] = _log_sum(log_mu[1:]) - log_mu[0]
        posterior[k] = np.exp(log_mu)


@njit(cache=True)
def _log_sum(logs):  # type: ignore[no-untyped-def]
    """ln of the sum of exponentials; -inf if all are."""
    largest = np.max(logs)
    return largest + np.log(np.sum(np.exp(logs - largest))) if largest > -np.inf else largest


@njit(cache=True)
def _corrected(P, gain, L, C, R):  # type: ignore[no-untyped-def]
    """Covariance after a measurement, in Joseph's form, which stays positive; gain is of the whitened innovation."""
    K = np.ascontiguousarray(np.linalg.solve(np.ascontiguousarray(L.T), np.ascontiguousarray(gain.T)).T)
    rest = np.eye(len(P)) - K @ C
    return rest @ P @ rest.T + K @ R @ K.T


@njit(cache=True)
def _mixed(xs, Ps, log_mu, log_transition):  # type: ignore[no-untyped-def]
    """Means, covariances and log probabilities of the models after a possible switch."""
    m, n = xs.shape
    predicted = np.empty(m)
    means, covariances = np.zeros((m, n)), np.zeros((m, n, n))
    for j in range(m):
        joint = log_transition[:, j] + log_mu
        predicted[j] = _log_sum(joint)
        share = np.exp(joint - predicted[j])
        for i in range(m):
            if share[i] > 0.0:  # a model that is never switched from may have run off to infinity
                means[j] += share[i] * xs[i]
        for i in range(m):
            if share[i] > 0.0:
                away = xs[i] - means[j]
                covariances[j] += share[i] * (Ps[i] + np.outer(away, away))
    return means, covariances, predicted


@njit(cache=True)
def _present(C, R, y, nu):  # type: ignore[no-untyped-def]
    """Output matrix, noise and innovation without the sensors that are missing (their rows say nothing)."""
    if not np.isnan(y).any():
        return C, R, nu
    C, R, nu = C.copy(), R.copy(), nu.copy()
    for i in range(len(y)):
        if np.isnan(y[i]):
            C[i], R[i], R[:, i], nu[i] = 0.0, 0.0, 0.0, 0.0
            R[i, i] = 1.0
    return C, R, nu


@njit(cache=True)
def _measured(D, y):  # type: ignore[no-untyped-def]
    """The rows of D of the sensors that are there."""
    D = D.copy()
    for i in range(len(y)):
        if np.isnan(y[i]):
            D[i] = 0.0
    return D
