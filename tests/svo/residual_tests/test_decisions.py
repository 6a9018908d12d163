"""Batch and online runs agree; each test sees a change, of both signs; formulas as corrected."""

import numpy as np
import pytest

from svo.residual_tests import (
    CUSUM,
    GLR,
    SPRT,
    BoundedThreshold,
    RandomizedSubsampling,
    StaticThreshold,
    StudentT,
    Whitening,
    normalised_sum,
    propagated_bounds,
)

TESTS = [
    StaticThreshold(mean=0.1, sigma=0.9),
    StudentT(mean=0.1, samples=12),
    GLR(mean=0.1, sigma=0.9, samples=12),
    SPRT(mean=0.1, sigma=0.9, change=0.7),
    SPRT(mean=0.1, sigma=0.9, change=-0.7),
    CUSUM(mean=0.1, change=0.8, threshold=4.0),
    RandomizedSubsampling(mean=0.1, samples=40, subsets=32),
]


@pytest.fixture
def residual():
    rng = np.random.default_rng(0)
    r = rng.normal(0.1, 0.9, 300)
    r[120:180] += 4.0
    r[220:] -= 4.0
    r[[0, 5, 130, 299]] = np.nan
    return r


@pytest.mark.parametrize("test", TESTS, ids=repr)
def test_online_steps_give_the_batch_answers(test, residual):
    record, online = test.run(residual), test.start()
    steps = [online.step(r) for r in residual]
    np.testing.assert_allclose(record.statistic, [s.statistic for s in steps], rtol=1e-9, atol=1e-9)
    assert record.alarm.tolist() == [s.alarm for s in steps]


@pytest.mark.parametrize("test", TESTS, ids=repr)
def test_a_change_of_either_sign_is_seen_and_nothing_before(test, residual):
    alarm = test.run(residual).alarm
    up, down = alarm[150:175].mean() > 0.8, alarm[280:].mean() > 0.8
    sided = isinstance(test, SPRT)
    assert up == (not sided or test.change > 0)
    assert down == (not sided or test.change < 0)
    assert alarm[60:115].mean() < 0.1


@pytest.mark.parametrize("test", TESTS, ids=repr)
def test_two_runs_do_not_share_a_state(test, residual):
    first, second = test.start(), test.start()
    for r in residual[:150]:
        first.step(r)
    assert second.step(residual[1]) == test.start().step(residual[1])


@pytest.mark.parametrize("test", TESTS, ids=repr)
def test_missing_and_empty_residuals(test):
    assert not test.run(np.full(5, np.nan)).alarm.any()
    assert test.run([]).alarm.size == 0
    with pytest.raises(ValueError, match=r"residual has shape \(2, 3\)"):
        test.run(np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"residual\[1\] is infinite"):
        test.run([0.0, np.inf])
    with pytest.raises(ValueError, match="r is inf"):
        test.start().step(np.inf)


def test_glr_is_the_largest_likelihood_ratio_over_all_means():
    """Equation (46) maximised by brute force; (47) as printed misses means below the fault-free one."""
    rng = np.random.default_rng(1)
    means = np.linspace(-4, 4, 80_001)
    for shift in (0.8, -0.8):
        r = rng.normal(0.2 + shift, 0.5, 10)
        test = GLR(mean=0.2, sigma=0.5, samples=10)
        ratios = (means - 0.2) / 0.25 * (r.sum() - 10 * (0.2 + means) / 2)
        assert test.run(r).statistic[-1] == pytest.approx(ratios.max(), rel=1e-6)


def test_equation_47_as_printed_holds_only_for_a_mean_that_grew():
    """Survey: sum r < sigma^2 ln(lambda) / (mu1 - mu0) + N (mu0 + mu1) / 2 decides H0."""
    rng = np.random.default_rng(2)
    sigma, N, threshold = 0.5, 10, 3.0
    test = GLR(sigma=sigma, samples=N)
    for shift, agrees in ((1.0, True), (-1.0, False)):
        r = rng.normal(shift, sigma, N)
        mu1 = r.mean()
        printed = not r.sum() < sigma**2 * threshold / mu1 + N * mu1 / 2
        ours = bool(test.run(r).statistic[-1] > threshold)
        assert ours
        assert (printed == ours) is agrees


def test_cusum_with_mu1_as_the_changed_mean_fails_about_another_mean():
    """Equation (49) with mu1 = mean + d instead of d: about mean 5 no change of size 1 is ever summed up."""
    r = np.full(200, 6.0)
    assert CUSUM(mean=5.0, change=1.0, threshold=5.0).run(r).alarm[-1]
    assert not CUSUM(mean=5.0, change=6.0, threshold=5.0).run(r).alarm.any()


def test_sprt_thresholds_are_equation_48():
    test = SPRT(change=1.0, false_alarm=0.01, non_detection=0.1)
    assert np.exp([test.lower, test.upper]) == pytest.approx([0.1 / 0.99, 0.9 / 0.01])


@pytest.mark.parametrize(("samples", "subsets"), [(7, 8), (15, 16), (62, 32)])
def test_subsets_are_a_balanced_group(samples, subsets):
    member = RandomizedSubsampling(samples=samples, subsets=subsets).membership
    rows = {tuple(row) for row in member}
    assert len(rows) == subsets
    assert all(tuple(a ^ b) in rows for a in member for b in member)
    assert not member[0].any()
    assert set(member[1:].sum(axis=1)) == {samples * subsets // (2 * (subsets - 1))}


def test_propagated_bounds_are_attained_and_never_left():
    rng = np.random.default_rng(3)
    A, B = np.array([[0.9, 0.2], [-0.3, 0.7]]), rng.normal(size=(2, 3))
    C, D = rng.normal(size=(1, 2)), rng.normal(size=(1, 3))
    low, high = np.array([-1.0, 0.2, -0.5]), np.array([2.0, 0.3, 0.5])
    lower, upper = propagated_bounds(A, B, C, D, low, high, 30)
    test = BoundedThreshold(lower[:, 0], upper[:, 0])
    for _ in range(200):
        w = np.where(rng.random((30, 3)) < 0.5, low, high)
        assert not test.run(generated(A, B, C, D, w)).alarm.any()
    response = [D, *(C @ np.linalg.matrix_power(A, j) @ B for j in range(29))]
    worst = np.where(np.vstack(response[::-1]) > 0, high, low)  # for the last sample
    r = generated(A, B, C, D, worst)
    assert r[-1] == pytest.approx(upper[-1, 0], rel=1e-10)
    r[-1] += 1e-6
    assert test.run(r).alarm.tolist() == [False] * 29 + [True]


def generated(A, B, C, D, w):
    z, out = np.zeros(len(A)), []
    for sample in w:
        out.append((C @ z + D @ sample)[0])
        z = A @ z + B @ sample
    return np.array(out)


def test_whitening_makes_the_normalised_sum_a_standard_gaussian():
    """Equation (45): the variance of the sum of a correlated residual is another."""
    rng = np.random.default_rng(4)
    runs = []
    for _ in range(40):
        e, r = rng.normal(0, 0.3, 2500), np.zeros(2500)
        for k in range(1, 2500):
            r[k] = 0.8 * r[k - 1] + e[k]
        runs.append(r + 1.5)
    white = Whitening.fit(runs, order=1)
    assert white.coefficients[0] == pytest.approx(0.8, abs=0.01)
    assert (white.mean, white.sigma) == pytest.approx((1.5, 0.3), abs=0.05)
    sums = np.concatenate([normalised_sum(white.apply(r), 50)[99::50] for r in runs])
    raw = np.concatenate([normalised_sum((r - 1.5) / 0.5, 50)[99::50] for r in runs])  # 0.5: its deviation
    assert sums.std() == pytest.approx(1.0, abs=0.05)
    assert raw.std() > 2.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: StaticThreshold(sigma=0.0), "sigma is 0"),
        (lambda: StudentT(samples=1), "samples is 1"),
        (lambda: StudentT(confidence=1.0), "confidence is 1"),
        (lambda: GLR(mean=np.nan), "mean is nan"),
        (lambda: SPRT(change=0.0), "change is 0"),
        (lambda: SPRT(false_alarm=0.6, non_detection=0.5), "expected a sum below 1"),
        (lambda: CUSUM(threshold=-1.0), "threshold is -1"),
        (lambda: RandomizedSubsampling(subsets=12), "power of two"),
        (lambda: RandomizedSubsampling(least=16), "2 least < subsets"),
        (lambda: RandomizedSubsampling(samples=30, subsets=32), "samples is 30"),
        (lambda: BoundedThreshold(1.0, 0.0), "lower is above upper"),
        (lambda: BoundedThreshold([0.0], [1.0]).run([0.0, 0.0]), "residual has shape"),
        (lambda: Whitening.fit([[1.0, 1.0]], 1), "do not vary"),
        (lambda: normalised_sum([[0.0]], 1), "residual has shape"),
    ],
)
def test_wrong_arguments_are_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()
