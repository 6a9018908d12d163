"""The named corrections of the published derivatives, each with its evidence in numbers."""

import numpy as np
import pytest

from aircraft.eclipse.derivatives import (
    AIR_DENSITY,
    CORRECTIONS,
    GRAVITY,
    MASS,
    PRINTED_M_U,
    PUBLISHED,
    WING_AREA,
    Derivatives,
)
from aircraft.eclipse.simulator import Surrogate
from aircraft.eclipse.trim import level_trim, linearise

SPEEDS = (25.0, 37.0, 55.0)


def _pure(d, name, V):
    """A pitch derivative without the embedded effect of dw/dt."""
    M_wdot = d.value("M_theta", V) / d.value("Z_theta", V)
    return d.value(f"M_{name}", V) - M_wdot * d.value(f"Z_{name}", V)


def _trim_angle_from_pitch(d, V):
    return np.arctan(-_pure(d, "u", V) / _pure(d, "w", V))  # Cm(alpha, eta) = 0 at every speed


def _other_trim_angles(d, V):
    from_X_q = -d.value("X_q", V) / V  # X_q = -w_e
    from_Z_theta = np.arcsin(-d.value("Z_theta", V) / GRAVITY)  # Z_theta = -g sin(theta)
    # Z = -m g cos(alpha) grows with V^2: Z_u cos(alpha) + Z_w sin(alpha) = -2 g cos(alpha) / V
    from_lift = np.arctan(-(d.value("Z_u", V) + 2 * GRAVITY / V) / d.value("Z_w", V))
    return np.array([from_X_q, from_Z_theta, from_lift])


@pytest.mark.parametrize("V", SPEEDS)
def test_M_u_with_plus_implies_the_trim_angle_of_three_other_estimates(V):
    corrected = Derivatives()
    assert np.abs(_trim_angle_from_pitch(corrected, V) - _other_trim_angles(corrected, V)).max() < 0.015


@pytest.mark.parametrize("V", SPEEDS)
def test_M_u_as_printed_contradicts_the_trim_angle(V):
    printed = Derivatives(["X_w"])
    assert np.abs(_trim_angle_from_pitch(printed, V) - _other_trim_angles(printed, V)).min() > 0.2


@pytest.mark.parametrize(("corrections", "pole"), [((), 0.42), (("X_w",), 0.49)])
def test_M_u_as_printed_has_an_unstable_real_pole_at_37(corrections, pole):
    poles = np.linalg.eigvals(Derivatives(corrections).A(37.0))
    unstable = poles[poles.real > 0]
    assert unstable == pytest.approx([pole], abs=0.005)


def _axial_slopes(d, V):
    """dCX/dalpha along the trim, and CX_alpha, both from X_u and X_w."""

    def alpha(v):
        return -d.value("X_q", v) / v

    def CX(v):  # X_u cos(alpha) + X_w sin(alpha) = 2 X / (m V)
        X = v / 2 * (d.value("X_u", v) * np.cos(alpha(v)) + d.value("X_w", v) * np.sin(alpha(v)))
        return MASS * X / (0.5 * AIR_DENSITY * v**2 * WING_AREA)

    h = 1e-3
    along_trim = (CX(V + h) - CX(V - h)) / (alpha(V + h) - alpha(V - h))
    cross = d.value("X_w", V) * np.cos(alpha(V)) - d.value("X_u", V) * np.sin(alpha(V))
    return along_trim, MASS * V * cross / (0.5 * AIR_DENSITY * V**2 * WING_AREA)


@pytest.mark.parametrize("V", SPEEDS)
def test_X_w_with_minus_matches_the_axial_force_along_the_trim(V):
    along_trim, slope = _axial_slopes(Derivatives(), V)
    assert abs(along_trim - slope) < 0.0305


@pytest.mark.parametrize("V", SPEEDS)
def test_X_w_as_printed_does_not(V):
    along_trim, slope = _axial_slopes(Derivatives(["M_u"]), V)
    assert 0.2 < abs(along_trim - slope) < 0.45


def test_equation_14_with_plus_gives_the_published_Z_q_and_trim():
    d, V = Derivatives(), 37.0
    assert level_trim(Surrogate(), V).alpha == pytest.approx(0.101, abs=0.0005)
    assert -d.value("X_q", V) / V == pytest.approx(0.102, abs=0.0005)
    A, _ = linearise(Surrogate(), level_trim(Surrogate(), V))
    assert A[1, 3] == pytest.approx(d.value("Z_q", V), rel=0.005)


def test_equation_14_as_printed_has_the_wrong_sign_of_Z_q_and_its_trim_does_not_carry_the_weight():
    printed = Surrogate(normal_coupling=-1.0)
    A, _ = linearise(printed, level_trim(printed, 37.0))
    assert A[1, 3] < -36 < 36 < Derivatives().value("Z_q", 37.0)
    trim = level_trim(printed, 37.0)
    shallow = np.array([37 * np.cos(0.01), 37 * np.sin(0.01), 0.01, 0.0])
    assert printed.derivative(shallow, trim.u)[1] > 8.0  # falls at 0.8 g and more


def test_M_wdot_is_embedded_in_the_pitch_row():
    ratio = Derivatives().value("M_theta", np.arange(25, 56)) / Derivatives().value("Z_theta", np.arange(25, 56))
    np.testing.assert_allclose(ratio, 0.1086, atol=5e-4)


@pytest.mark.parametrize(
    ("V", "short_period", "phugoid"),
    [(25, -0.45 + 3.85j, -0.106 + 0.47j), (37, -0.73 + 5.71j, -0.052 + 0.33j), (55, -1.07 + 8.52j, -0.041 + 0.22j)],
)
def test_modes_of_the_corrected_model(V, short_period, phugoid):
    poles = np.linalg.eigvals(Derivatives().A(float(V)))
    slow, fast = sorted(poles[poles.imag > 0], key=abs)
    for mode, expected, digit in ((fast, short_period, 0.01), (slow, phugoid, 0.005)):
        assert abs(mode.real - expected.real) <= digit
        assert abs(mode.imag - expected.imag) <= digit


def test_without_corrections_the_polynomials_are_those_printed():
    assert dict(Derivatives(()).polynomials) == dict(PUBLISHED)
    assert PUBLISHED["M_u"] == (2.6146e-5, -0.003426, -0.1425)
    assert "0.2.6146" in PRINTED_M_U
    assert PUBLISHED["X_w"] == (0.00018, 0.025, -1.0499)


def test_each_correction_changes_one_derivative():
    for name, (item, polynomial) in CORRECTIONS.items():
        changed = Derivatives([name]).polynomials
        assert changed[item] == polynomial
        assert {k for k in PUBLISHED if changed[k] != PUBLISHED[k]} == {item}


def test_matrices_have_the_layout_of_equation_16():
    d, V = Derivatives(), np.array([30.0, 37.0])
    A, B = d.A(V), d.B(V)
    assert A.shape == (2, 4, 4)
    assert B.shape == (2, 4, 2)
    np.testing.assert_array_equal(A[:, 2], [[0, 0, 0, 1]] * 2)
    np.testing.assert_array_equal(A[0], d.A(30.0))
    np.testing.assert_array_equal(A[:, 3, 0], d.value("M_u", V))
    np.testing.assert_array_equal(B[:, 1, 1], 0)
    assert d.B(37.0)[3, 0] == pytest.approx(0.2870, abs=1e-4)


def test_unknown_correction_is_refused():
    with pytest.raises(ValueError, match="M_q"):
        Derivatives(["M_q"])
