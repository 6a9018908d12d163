"""Models from state-space systems of other libraries and from MAT files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal
from scipy.io import savemat

from svo.models.model import UncertainModel


def test_a_state_space_system_of_another_library() -> None:
    control = pytest.importorskip("control")
    rng = np.random.default_rng(0)
    matrices = [rng.normal(size=shape) for shape in ((3, 3), (3, 2), (2, 3), (2, 2))]
    continuous = control.ss(*matrices)
    expected = control.c2d(continuous, 0.1)
    for model in (
        UncertainModel.from_statespace(continuous, Ts=0.1, n=0.1),
        UncertainModel.from_statespace(expected, n=0.1),
        UncertainModel.from_statespace(control.ss(expected.A, expected.B, expected.C, expected.D, True), Ts=0.1),
    ):
        assert model.Ts == 0.1
        for name in "ABCD":
            np.testing.assert_allclose(model.block(name), getattr(expected, name), rtol=1e-9, atol=1e-12)
    assert not UncertainModel.from_statespace(control.ss(*matrices[:3], 0, 0.1)).uses_input_in_output
    with pytest.raises(ValueError, match="Ts is missing"):
        UncertainModel.from_statespace(continuous)
    with pytest.raises(ValueError, match=r"Ts is 0.2 but the system is discrete with dt = 0.1"):
        UncertainModel.from_statespace(expected, Ts=0.2)
    with pytest.raises(ValueError, match="dt = None"):
        UncertainModel.from_statespace(control.ss(*matrices, None), Ts=0.1)


def test_systems_of_scipy_become_models() -> None:
    matrices = [[0.0, 1.0], [-2.0, -0.3]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.5]]
    expected = UncertainModel.from_continuous(*matrices[:3], Ts=0.1, D=matrices[3])
    for system in (signal.StateSpace(*matrices), signal.lti(*matrices)):
        assert np.array_equal(UncertainModel.from_statespace(system, Ts=0.1).stack(), expected.stack())
    discrete = signal.StateSpace(*(expected.block(name) for name in "ABCD"), dt=0.1)
    model = UncertainModel.from_statespace(discrete, n=0.1)
    assert np.array_equal(model.stack(), expected.stack())
    assert model.Ts == 0.1
    poles = np.linalg.eigvals(UncertainModel.from_statespace(signal.dlti([1.0], [1.0, -0.5, 0.06]), Ts=0.1).block("A"))
    assert sorted(poles.real) == pytest.approx([0.2, 0.3])
    with pytest.raises(ValueError, match="Ts is missing"):
        UncertainModel.from_statespace(signal.StateSpace(*matrices))
    with pytest.raises(TypeError, match="sys is a list; expected a state-space system"):
        UncertainModel.from_statespace([1.0])


def test_a_model_is_read_from_a_mat_file(tmp_path: Path) -> None:
    file = tmp_path / "plant.mat"
    arrays = {"A": [[0.9]], "C": [[1.0]], "E": [[1.0, 0.5]], "w_lower": [[-0.1], [-0.2]], "w_upper": [[0.3], [0.2]]}
    savemat(file, arrays | {"n": 0.05, "c": [[0.4]], "unused": [[1.0, 2.0]]})
    model = UncertainModel.from_mat(file, Ts=0.1, B=[[0.3]])
    assert [b.tolist() for b in model.bounds()] == [[-0.1, -0.2], [0.3, 0.2], [0.05]]
    assert (model.block("c").tolist(), model.block("B").tolist()) == ([0.4], [[0.3]])
    with pytest.raises(ValueError, match=r"A is given and .*plant.mat has it too"):
        UncertainModel.from_mat(file, Ts=0.1, A=[[0.9]])
    for arrays, expected in (
        ({"A": [[0.9]]}, "has no variable 'C'"),
        ({"x": [[0.9]]}, "none of the variables A, B, E, C, D, F, a, c, n, w; found x"),
        ({"A": [[0.9]], "C": [[1.0]], "w_lower": 0.0}, "w_lower with w_upper"),
        (
            {"A": [[0.9]], "C": [[1.0]], "n": [[1.0, 1.0], [1.0, 1.0]]},
            r"variable 'n' has shape \(2, 2\); expected a vector",
        ),
    ):
        savemat(file, arrays)
        with pytest.raises(ValueError, match=expected):
            UncertainModel.from_mat(file, Ts=0.1)
