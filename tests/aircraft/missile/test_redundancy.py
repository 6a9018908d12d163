"""Residuals of the missile: exact on ideal measurements, signatures of Table I, validity, alignment, bounds."""

from dataclasses import replace

import numpy as np
import pytest

from aircraft.missile.adaptive import ModelError
from aircraft.missile.airframe import FORCE_COEFFICIENTS, INPUT_LOWER, INPUT_UPPER, INPUTS, Airframe
from aircraft.missile.imu import DELAY, NOISE_SETS, SensorErrors
from aircraft.missile.isolability import diagnoses, identifiable, isolability_table
from aircraft.missile.redundancy import RESIDUALS, TABLE_1, ForceBalance, residuals, signature_matrix
from aircraft.missile.scenarios import DL, DM, DN, ETA, SCENARIOS, Flights, Run, locked, thrust_loss
from aircraft.missile.simulator import specific_force

FLIGHTS, IDEAL = Flights(), SensorErrors.none()
ALL = tuple(RESIDUALS)
PRINTED = {  # Table I: dl, dm, dn, eta
    "r11": "1111",
    "r12": "1111",
    "r13": "1111",
    "r14": "1111",
    "r21": "1010",
    "r23": "1010",
    "r32": "0100",
    "r1_11": "1011",
    "r2_11": "0111",
    "r3_11": "1101",
    "r4_11": "0011",
    "r5_11": "1001",
}
FAULTS = {"dl": locked(DL, 6.0), "dm": locked(DM, 6.0), "dn": locked(DN, 6.0), "eta": thrust_loss(0.25, 6.0)}


def _achieved(run: Run) -> np.ndarray:
    aligned = np.full_like(run.flight.achieved, np.nan)
    aligned[DELAY:] = run.flight.achieved[:-DELAY]
    return aligned


def test_ideal_residuals_are_below_1e_12_through_every_scenario() -> None:
    """Without a fault, and in scenario 3 with the inputs that its actuators achieve."""
    healthy = FLIGHTS.run((), IDEAL, 0)
    assert np.nanmax(np.abs(residuals(healthy.flight.y, healthy.aligned_inputs, FLIGHTS.airframe, ALL).values)) < 1e-12
    faulty = FLIGHTS.run(SCENARIOS[3].faults, IDEAL, 0)
    assert np.nanmax(np.abs(residuals(faulty.flight.y, _achieved(faulty), FLIGHTS.airframe, ALL).values)) < 1e-12


def test_residuals_are_the_printed_formulas() -> None:
    """Equations (8), (10), (11) and the second substitution, written out."""
    run = FLIGHTS.run(SCENARIOS[2].faults, NOISE_SETS["gaussian"], 1, 40.0)
    u = run.aligned_inputs
    balance = ForceBalance.of(run.flight.y, FLIGHTS.airframe)
    f1, f2, f3 = balance.f.T
    g = balance.G
    dl, dm, dn, eta = u.T
    log = residuals(run.flight.y, u, FLIGHTS.airframe, ALL)
    r21 = (f2 - g[:, 1, 2] * dn) / g[:, 1, 0] - dl
    dm_hat = f3 / g[:, 2, 1]
    r11 = (f1 - g[:, 0, 1] * dm - g[:, 0, 2] * dn - g[:, 0, 3] * eta) / g[:, 0, 0] - dl
    r1_11 = (f1 - g[:, 0, 1] * dm_hat - g[:, 0, 2] * dn - g[:, 0, 3] * eta) / g[:, 0, 0] - dl
    r2_11 = (f1 - g[:, 0, 1] * dm - g[:, 0, 2] * dn - g[:, 0, 3] * eta) / g[:, 0, 0] - (r21 + dl)
    for name, expected in {"r21": r21, "r11": r11, "r1_11": r1_11, "r2_11": r2_11, "r32": dm_hat - dm}.items():
        np.testing.assert_allclose(log[name], expected, atol=1e-12, equal_nan=True)


def test_computed_signatures_are_table_1() -> None:
    computed = signature_matrix(Airframe(), TABLE_1)
    assert {n: "".join(str(int(b)) for b in row) for n, row in zip(TABLE_1, computed, strict=True)} == PRINTED


@pytest.mark.parametrize("fault", FAULTS)
def test_simulated_faults_make_the_signatures(fault: str) -> None:
    """Ideal measurements: a residual moves by far more than rounding exactly where Table I says one."""
    run = FLIGHTS.run((FAULTS[fault],), IDEAL, 0, 9.0)
    largest = np.nanmax(np.abs(residuals(run.flight.y, run.aligned_inputs, FLIGHTS.airframe).values), axis=0)
    reacts = largest > 1e-6
    assert (reacts | (largest < 1e-12)).all()
    assert [PRINTED[n][INPUTS.index(fault)] == "1" for n in TABLE_1] == reacts.tolist()


def test_ten_patterns_for_sixteen_fault_sets() -> None:
    """The paper's claim that simultaneous faults can be isolated is too strong: two groups of four coincide."""
    table = isolability_table(signature_matrix(Airframe()), TABLE_1)
    assert len(table.groups) == 10
    group = {frozenset(s) for s in (("dl", "dn"), ("dl", "eta"), ("dn", "eta"), ("dl", "dn", "eta"))}
    with_dm = {s | {"dm"} for s in group}
    assert {frozenset(frozenset(s) for s in sets) for sets in table.coinciding} == {
        frozenset(group),
        frozenset(with_dm),
    }
    assert "10 patterns for 16 fault sets" in table.to_text()


def test_no_residual_of_these_equations_can_separate_the_coinciding_sets() -> None:
    """Their columns of G span the same plane, so no function of the imbalance e = G (u_a - u_c) tells them apart."""
    G = ForceBalance.of(FLIGHTS.run((), IDEAL, 0, 5.0).flight.y, FLIGHTS.airframe).G[300]
    for faults in (("dl", "dn"), ("dl", "eta"), ("dn", "eta"), ("dl", "dn", "eta")):
        columns = G[:, [INPUTS.index(f) for f in faults]]
        assert np.linalg.matrix_rank(columns) == 2
        assert np.linalg.matrix_rank(np.hstack([columns, G[:, [DL, DN, ETA]]])) == 2
    assert identifiable(G, ("dl", "dn"))
    assert not identifiable(G, ("dl", "dn", "eta"))


def test_twelve_residuals_carry_three_signals() -> None:
    run = FLIGHTS.run((), NOISE_SETS["gaussian"], 0, 10.0)
    log = residuals(run.flight.y, run.aligned_inputs, FLIGHTS.airframe)
    G = ForceBalance.of(run.flight.y, FLIGHTS.airframe).G
    assert np.linalg.matrix_rank(G[500]) == 3
    np.testing.assert_allclose(log["r11"] * G[:, 0, 0], log["r14"] * G[:, 0, 3], atol=1e-10)
    np.testing.assert_allclose(log["r21"] * G[:, 1, 0], log["r23"] * G[:, 1, 2], atol=1e-10)
    weights = ForceBalance.of(run.flight.y, FLIGHTS.airframe).weights(TABLE_1)
    assert np.linalg.matrix_rank(weights[500]) == 3


def test_g21_and_g23_with_the_printed_minus_contradict_a_healthy_flight() -> None:
    """Correction 4: with it r21 is tens of degrees without a fault."""
    run = FLIGHTS.run((), IDEAL, 0, 63.0)
    balance = ForceBalance.of(run.flight.y, FLIGHTS.airframe)
    dl, _, dn, _ = run.aligned_inputs.T
    printed = (balance.f[:, 1] + balance.G[:, 1, 2] * dn) / -balance.G[:, 1, 0] - dl
    assert np.degrees(np.nanmax(np.abs(printed))) > 60.0
    assert np.nanmax(np.abs(residuals(run.flight.y, run.aligned_inputs, FLIGHTS.airframe, ("r21",)).values)) < 1e-12


def test_a_bz_without_its_minus_sign_contradicts_a_healthy_flight() -> None:
    """Correction 3: a_bz = +Q s_ref / m (cz ...) as printed in section III-A leaves metres per second squared."""
    run = FLIGHTS.run((), IDEAL, 0, 30.0)
    measured = run.flight.y[DELAY:, 2]
    assert np.abs(measured).max() > 5.0
    balance = ForceBalance.of(run.flight.y, FLIGHTS.airframe)
    printed = -(balance.G[DELAY:, 2, 1] * run.aligned_inputs[DELAY:, 1] + measured - balance.f[DELAY:, 2])
    np.testing.assert_allclose(printed, -measured, atol=1e-10)


def test_alignment_with_the_delay_halves_the_scatter() -> None:
    run = FLIGHTS.run((), NOISE_SETS["gaussian"], 0, 20.0)
    aligned, late = (
        np.degrees(np.nanstd(residuals(run.flight.y, u, FLIGHTS.airframe, ("r11",)).values[500:1900]))
        for u in (run.aligned_inputs, run.flight.computed)
    )
    assert aligned == pytest.approx(0.18, abs=0.02)
    assert late == pytest.approx(0.29, abs=0.03)


def test_near_zero_denominators_are_invalid_and_never_huge() -> None:
    run = FLIGHTS.run((), NOISE_SETS["gaussian"], 0, 5.0)
    y = run.flight.y.copy()
    y[100:, 9:12] *= 0.001  # hardly any dynamic pressure
    log = residuals(y, run.aligned_inputs, FLIGHTS.airframe, ALL)
    fins = [i for i, n in enumerate(ALL) if n != "r14"]
    assert not log.valid[100:, fins].any()
    assert log.valid[100:, ALL.index("r14")].all()  # the propulsion does not need any
    assert log.valid[DELAY:100].all()
    assert not log.valid[:DELAY].any()
    symmetric = replace(FLIGHTS.airframe, cx_dl=0.0, cx_dm=0.0, cx_dn=0.0, cy_dl=0.0)
    names = ("r14", "r23", "r32", "r11")
    log = residuals(run.flight.y, run.aligned_inputs, symmetric, names)
    assert log.valid[DELAY:].all(axis=0).tolist() == [True, True, True, False]
    with pytest.raises(ValueError, match="r11 divides by zero"):
        signature_matrix(symmetric, names)


@pytest.mark.parametrize("error", [0.0, 0.03])
@pytest.mark.parametrize("fault", ["none", *FAULTS])
def test_adaptive_bounds_hold_for_every_residual_that_a_fault_does_not_enter(error: float, fault: str) -> None:
    """Section III-C, with true coefficients anywhere within the relative error and noise at the ends of its range."""
    flights, errors = Flights(model_error=error), NOISE_SETS["bounded"]
    signature = signature_matrix(flights.airframe, ALL)
    quiet = np.ones(len(ALL), bool) if fault == "none" else ~signature[:, INPUTS.index(fault)]
    for seed in range(4):
        run = flights.run(() if fault == "none" else (FAULTS[fault],), errors, seed, 40.0)
        values = residuals(run.flight.y, run.aligned_inputs, flights.airframe, ALL).values
        bounds = ModelError(errors, error).residual_bounds(run.flight.y, flights.airframe, ALL)
        assert (np.abs(values) <= bounds)[DELAY:, quiet].all()


@pytest.mark.parametrize("seed", range(5))
def test_imbalance_bounds_contain_the_worst_of_random_truths(seed: int) -> None:
    """Against brute force: truths drawn at the corners of the bounds, coefficients and inputs at theirs."""
    rng = np.random.default_rng(seed)
    eps, errors, believed = 0.05, NOISE_SETS["bounded"], Airframe()
    measured = np.zeros((1, 15))
    measured[0, 8], measured[0, 9:12] = -5000.0, [620.0, *rng.uniform(-60.0, 60.0, 2)]
    largest = np.zeros(3)
    for _ in range(400):
        true = measured[0] + errors.bound(measured)[0] * rng.choice([-1.0, 1.0], 15)
        signs = rng.choice([-1.0, 1.0], len(FORCE_COEFFICIENTS))
        changed = {
            name: getattr(believed, name) * (1 + eps * s) for name, s in zip(FORCE_COEFFICIENTS, signs, strict=True)
        }
        u = np.where(rng.random(4) < 0.5, INPUT_LOWER, INPUT_UPPER)
        x = np.zeros(12)
        x[:6] = true[6:12]
        y = measured.copy()
        y[0, :3] = specific_force(x, u, replace(believed, **changed).packed())
        off = errors.bound(y)[0, :3]
        e = ForceBalance.of(y, believed).imbalance(u[None])[0]
        largest = np.maximum(largest, (np.abs(e) + off) / ModelError(errors, eps).imbalance_bounds(y, believed)[0])
    assert (largest <= 1.0).all()
    assert (largest > 0.6).all()  # and the bounds are not idle


def test_diagnoses_are_smallest_hitting_sets() -> None:
    assert diagnoses([]) == ((),)
    assert diagnoses([("dl", "dn", "eta"), ("dn", "eta"), ("dl", "eta")]) == (("eta",),)
    assert diagnoses([("dl", "dn"), ("dm",)]) == (("dl", "dm"), ("dm", "dn"))
    assert diagnoses([()]) == ()


def test_mistakes_are_named() -> None:
    with pytest.raises(ValueError, match="r99"):
        residuals(np.zeros((3, 15)), np.zeros((3, 4)), Airframe(), ("r99",))
    with pytest.raises(ValueError, match="y has shape"):
        residuals(np.zeros((3, 14)), np.zeros((3, 4)), Airframe())
    with pytest.raises(ValueError, match="u has shape"):
        residuals(np.full((3, 15), 300.0), np.zeros((2, 4)), Airframe())
    with pytest.raises(ValueError, match="coefficients is -1"):
        ModelError(IDEAL, -1.0)
