"""Proposition 1 and Corollary 2 of paper 001 checked on signals of many kinds: an oracle by simulation.

The characterisation is that of the very signal, with a safety factor of one and a hair, so that nothing hides a
violation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from svo.interval import filter_bound, threshold_sequence
from svo.interval.noise import moving_average_extremes

Array = NDArray[np.float64]
Bound = Callable[[Array, float, int, float], float]

POLES = (0.1, 0.6, 0.9, 0.99)
QBAR = 40


def _ar1(samples: int, rng: np.random.Generator, rho: float = 0.95) -> Array:
    e, out = rng.normal(size=samples), np.zeros(samples)
    for k in range(1, samples):
        out[k] = rho * out[k - 1] + e[k]
    return out


SIGNALS: dict[str, Callable[[int, np.random.Generator], Array]] = {
    "constant": lambda n, rng: np.full(n, 1.0),
    "white": lambda n, rng: rng.normal(size=n),
    "uniform": lambda n, rng: rng.uniform(-1, 1, n),
    "coloured": _ar1,
    "heavy tails": lambda n, rng: rng.standard_t(2, n),
    "offset": lambda n, rng: 0.5 + rng.normal(0, 0.2, n),
    "sine": lambda n, rng: np.sin(0.3 * np.arange(n) + rng.uniform(0, 6)),
    "alternating": lambda n, rng: (-1.0) ** np.arange(n),
    "sparse": lambda n, rng: np.where(rng.random(n) < 0.02, rng.normal(0, 5, n), 0.0),
    "steps": lambda n, rng: np.repeat(rng.choice([-1.0, 1.0], n // 20 + 1), 20)[:n],
}


def printed(bounds: Array, pole: float, r: int, mu: float) -> float:
    """(10), as the package computes it."""
    return filter_bound(bounds, pole, r=r, mu=mu)


def _mutant(last: Callable[[float, int], float], weight: Callable[[float, int], float]) -> Bound:
    """(10) with other factors of lambda_r, and of lambda_q for q < r."""

    def bound(bounds: Array, a: float, r: int, mu: float) -> float:
        inner = sum(weight(a, q) * bounds[q - 1] for q in range(1, r))
        return float(a**r * mu + (1 - a) * (last(a, r) * bounds[r - 1] + inner))

    return bound


def _last(a: float, r: int) -> float:
    return float(r * a ** (r - 1))


def _weight(a: float, q: int) -> float:
    return float(q * (a ** (q - 1) - a**q))


MUTANTS: dict[str, Bound] = {
    "a^r for a^(r-1)": _mutant(lambda a, r: r * a**r, _weight),
    "a^q - a^(q+1) for a^(q-1) - a^q": _mutant(_last, lambda a, q: q * (a**q - a ** (q + 1))),
    "q - 1 for q": _mutant(_last, lambda a, q: (q - 1) * (a ** (q - 1) - a**q)),
    "q = 3 missing": _mutant(_last, lambda a, q: 0.0 if q == 3 else _weight(a, q)),
}


def characterised(signal: Array) -> Array:
    """lambda_q of the signal itself."""
    return (1 + 1e-9) * moving_average_extremes([signal], QBAR) + 1e-12


def proposition_1(signal: Array, bound: Bound = printed) -> tuple[int, int]:
    """(checks, violations) of |y_k| <= tau_(k,r) with mu the true |x_(k-r)|, for random starts and several r."""
    lam, checks, wrong = characterised(signal), 0, 0
    for pole in POLES:
        x = np.empty(len(signal))
        x[0] = 3.0 * lam[0]  # Proposition 1 asks nothing of the start
        for k in range(1, len(signal)):
            x[k] = pole * x[k - 1] + (1 - pole) * signal[k]
        for r in (1, 2, 5, 17, QBAR):
            rest = bound(lam, pole, r, 0.0)
            unit = bound(lam, pole, r, 1.0) - rest  # linear in mu
            limits = rest + unit * np.abs(x[:-r])
            checks += limits.size
            wrong += int(np.sum(np.abs(x[r:]) > limits * (1 + 1e-12)))
    return checks, wrong


def corollary_2(signal: Array, bound: Bound = printed) -> tuple[int, int]:
    """(checks, violations) of |y_k| <= tau_k for the filter that starts at its first input."""
    lam, checks, wrong = characterised(signal), 0, 0
    for pole in POLES:
        if bound is printed:
            tau = threshold_sequence(lam, pole)
        else:
            tau = np.array([lam[0], *(bound(lam, pole, r, float(lam[0])) for r in range(1, QBAR + 1))])
        e = signal[0]
        for k in range(len(signal)):
            e = e if k == 0 else pole * e + (1 - pole) * signal[k]
            checks += 1
            wrong += bool(abs(e) > tau[min(k, QBAR)] * (1 + 1e-12))
    return checks, wrong


def violations(samples: int, seeds: int) -> tuple[int, int]:
    """(checks, violations) of both statements over all kinds of signal."""
    totals = np.zeros(2, dtype=int)
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        for make in SIGNALS.values():
            signal = make(samples, rng)
            totals += np.add(proposition_1(signal), corollary_2(signal))
    return int(totals[0]), int(totals[1])
