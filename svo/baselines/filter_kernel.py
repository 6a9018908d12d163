"""Compiled filters. All compiled functions of the filters stand in this one file: a cached machine code does not
notice a change in another file."""

from __future__ import annotations

import numpy as np
from numba import njit


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
        K = np.ascontiguousarray(np.linalg.solve(np.ascontiguousarray(L.T), np.ascontiguousarray(gain.T)).T)
        rest = np.eye(x.size) - K @ Ck
        P[:] = rest @ P @ rest.T + K @ Rk @ K.T
        states[k] = x
    return -1


@njit(cache=True)
def multiple_models(xs, Ps, mu, first, transition, A, f, Q, C, g, R, y, log_odds, posterior):  # type: ignore[no-untyped-def]
    """Interacting multiple models (Blom and Bar-Shalom 1988) over samples.

    xs (m, n), Ps (m, n, n) and mu (m,) as x and P in `filter_samples`; the arrays of the models are (m, K, ...). Writes
    posterior (K, m) and log_odds (K,): ln of the odds of all models but the first.
    """
    m = len(xs)
    for k in range(len(y)):
        if not (first and k == 0):
            xs[:], Ps[:], mu[:] = _mixed(xs, Ps, mu, transition)
        weights = np.empty(m)
        for j in range(m):
            if not (first and k == 0):
                xs[j] = A[j, k] @ xs[j] + f[j, k]
                Ps[j] = A[j, k] @ Ps[j] @ A[j, k].T + Q[j, k]
            Ck, Rk, nu = _present(C[j, k], R[j, k], y[k], y[k] - g[j, k] - C[j, k] @ xs[j])
            L = np.linalg.cholesky(Ck @ Ps[j] @ Ck.T + Rk)
            w = np.linalg.solve(L, nu)
            gain = np.ascontiguousarray(np.linalg.solve(L, Ck @ Ps[j]).T)
            xs[j] = xs[j] + gain @ w
            Ps[j] = Ps[j] - gain @ gain.T
            weights[j] = np.log(mu[j]) - 0.5 * (w @ w) - np.sum(np.log(np.diag(L)))
        weights -= np.max(weights)
        log_odds[k] = np.log(np.sum(np.exp(weights[1:] - np.max(weights[1:])))) + np.max(weights[1:]) - weights[0]
        mu[:] = np.exp(weights) / np.sum(np.exp(weights))
        posterior[k] = mu


@njit(cache=True)
def _mixed(xs, Ps, mu, transition):  # type: ignore[no-untyped-def]
    """Means, covariances and probabilities of the models after a possible switch."""
    m, n = xs.shape
    predicted = transition.T @ mu
    means, covariances = np.zeros((m, n)), np.zeros((m, n, n))
    for j in range(m):
        for i in range(m):
            means[j] += transition[i, j] * mu[i] / predicted[j] * xs[i]
        for i in range(m):
            away = xs[i] - means[j]
            covariances[j] += transition[i, j] * mu[i] / predicted[j] * (Ps[i] + np.outer(away, away))
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
