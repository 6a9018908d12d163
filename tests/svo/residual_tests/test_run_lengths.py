"""CUSUM's mean run length over its whole range, against three things that share nothing with it.

Simulation where it is short; Page's integral equation itself, in 300 bits of arb, where it is long; and Spitzer's
identity (Siegmund 1985, chapter VIII) where the threshold is high: L = 2 k^2 exp(2 k h + 4 sum Phi(-k sqrt(n)) / n),
up to exp(-2 k h), and to the lattice of steps that are large against h.
"""

import numpy as np
import pytest
from flint import arb, arb_mat, ctx
from scipy.special import ndtr

from svo.residual_tests import CUSUM


def log_length(change: float, threshold: float, sigma: float = 1.0) -> float:
    return CUSUM(change=change * sigma, threshold=threshold * sigma).log_average_run_length(sigma)


def spitzer(change: float, threshold: float) -> float:
    k = change / 2
    n = np.arange(1.0, 80 / k**2 + 2)
    return float(change * threshold + np.log(2 * k**2) + 4 * np.sum(ndtr(-k * np.sqrt(n)) / n) - np.log(2))


def page(change: float, threshold: float, nodes: int, bits: int) -> float:
    """L(0) of L(z) = 1 + L(0) Phi(k - z) + integral_0^h L(x) phi(x - z + k) dx, and half of it."""
    before, ctx.prec = ctx.prec, bits
    try:
        k, h = arb(change) / 2, arb(threshold)
        rule = [arb.legendre_p_root(nodes, j, True) for j in range(nodes)]
        x, w = [h * (1 + at) / 2 for at, _ in rule], [h * weight / 2 for _, weight in rule]
        density = 1 / (2 * arb.pi()).sqrt()
        rows = [
            [-((z - k) / arb(2).sqrt()).erfc() / 2]
            + [-density * (-((x[j] - z + k) ** 2) / 2).exp() * w[j] for j in range(nodes)]
            for z in [arb(0), *x]
        ]
        for i, row in enumerate(rows):
            row[i] += 1
        length = arb_mat(rows).solve(arb_mat([[1]] * (nodes + 1)), algorithm="approx")[0, 0].mid()
        return float(length.log()) - float(np.log(2))
    finally:
        ctx.prec = before


@pytest.mark.parametrize(
    ("change", "threshold", "length"), [(0.01, 100.0, 7385), (0.1, 60.0, 44_616), (1.0, 30.0, 3.402e13)]
)
def test_lengths_at_which_a_rule_of_64_nodes_failed(change, threshold, length):
    assert CUSUM(change=change, threshold=threshold).average_run_length(1.0) == pytest.approx(length, rel=1e-3)


@pytest.mark.parametrize("change", [0.05, 0.1, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("threshold", [30.0, 100.0, 333.3, 1000.0])
def test_high_thresholds_agree_with_spitzers_identity(change, threshold):
    if change * threshold < 20:
        pytest.skip("the identity leaves out exp(-change threshold)")
    assert log_length(change, threshold) == pytest.approx(spitzer(change, threshold), abs=1e-6)


@pytest.mark.parametrize(
    ("change", "threshold", "nodes", "bits"),
    [(0.01, 40.0, 90, 128), (1.0, 25.0, 80, 192), (4.0, 7.3, 60, 192), (10.0, 12.0, 90, 400), (10.0, 0.01, 20, 128)],
)
def test_page_s_integral_equation_in_many_digits(change, threshold, nodes, bits):
    assert log_length(change, threshold) == pytest.approx(page(change, threshold, nodes, bits), abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("change", [0.01, 0.1, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("threshold", [0.1, 3.0, 10.0, 30.0])
def test_page_s_integral_equation_over_the_range(change, threshold):
    assert log_length(change, threshold) == pytest.approx(page(change, threshold, 240, 1200), abs=1e-9)


@pytest.mark.parametrize(("change", "threshold"), [(0.01, 20.0), (0.1, 15.0), (1.0, 4.0), (4.0, 1.0), (6.0, 0.1)])
def test_short_lengths_agree_with_simulation(change, threshold):
    """A shorter version of what `test_false_alarm_rates` does, over the range of changes; 4 standard errors."""
    rng, runs = np.random.default_rng(3), 400
    up, down, lengths, k = np.zeros(runs), np.zeros(runs), np.zeros(runs), 0
    while (running := lengths == 0).any():
        k += 1
        r = rng.standard_normal(runs)
        up, down = np.maximum(up + r - change / 2, 0), np.maximum(down - r - change / 2, 0)
        lengths[running & (np.maximum(up, down) > threshold)] = k
        if k > 20_000:
            pytest.fail("far longer than stated")
    stated = np.exp(log_length(change, threshold))
    assert abs(lengths.mean() - stated) < 4 * lengths.std(ddof=1) / np.sqrt(runs)


def test_it_grows_with_threshold_and_change_and_ends_where_floats_end():
    changes, thresholds = np.geomspace(0.01, 10, 5), np.geomspace(0.01, 1000, 6)
    table = np.array([[log_length(c, h) for h in thresholds] for c in changes])
    assert (np.diff(table, axis=0) > 0).all()
    assert (np.diff(table, axis=1) > 0).all()
    for c, row in zip(changes, table, strict=True):
        for h, expected in zip(thresholds, row, strict=True):
            length = CUSUM(change=c, threshold=h).average_run_length(1.0)
            assert length == (pytest.approx(np.exp(expected)) if expected < 709.7 else np.inf)


def test_units_do_not_matter_and_what_is_beyond_is_said():
    assert log_length(0.7, 11.0, 2.0**-40) == log_length(0.7, 11.0) == log_length(0.7, 11.0, 2.0**55)
    assert CUSUM(change=1.0, threshold=5.0).average_run_length(1e-9) == np.inf
    assert CUSUM(change=90.0, threshold=1e-3).average_run_length(1.0) == np.inf
    for test in (CUSUM(change=90.0, threshold=1.0), CUSUM(change=1.0, threshold=2e4)):
        with pytest.raises(ValueError, match="is sigma in the units of the residual"):
            test.log_average_run_length(1.0)
    with pytest.raises(ValueError, match="sigma is 0"):
        CUSUM().average_run_length(0.0)
