from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from svo.detection.detect import detect
from svo.isolation.architectures import ArchitectureI, ArchitectureII
from svo.logs.log import Log
from svo.models.remainder import remainder_bound
from svo.models.uncertainty import Uncertainty
from svo.observers.window.observer import WindowObserver
from svo.plant.description import find_plant, keep_description, read_description

CART = Path(__file__).parents[4] / "docs" / "examples" / "cart.toml"
STUCK = """
[faults.stuck]
type = "model"
B = [[0.0], [0.0]]
"""
GLOBAL = """
[global]
lower = [-100.0, -10.0]
upper = [100.0, 10.0]
"""


def written(tmp_path: Path, *changes: tuple[str, str], more: str = "") -> Path:
    text = CART.read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    path = tmp_path / "cart.toml"
    path.write_text(text + more, encoding="utf-8")
    return path


def test_the_matrices_bounds_and_columns_are_those_of_the_file() -> None:
    plant = read_description(CART)
    model = plant.model
    assert model.block("A").tolist() == [[1.0, 0.1], [0.0, 1.0]]
    assert model.block("B", uncertainty=0).tolist() == [[0.0], [0.01]]
    assert [b.tolist() for b in model.bounds()] == [[-0.2], [0.2], [0.05]]
    assert (plant.Ts, plant.name, plant.noise_sets) == (0.1, "cart.toml", ("stated",))
    assert [(c.name, c.unit) for c in plant.columns.inputs + plant.columns.outputs] == [
        ("force", "N"),
        ("position", "m"),
    ]
    assert model.names == {
        "inputs": ["force"],
        "outputs": ["position"],
        "states": ["true_position", "true_speed"],
    }
    assert plant.initial.bounding_box()[1].tolist() == [1.0, 1.0]
    bank = plant.bank("stated")
    assert isinstance(bank, ArchitectureI)
    assert bank.names == ("nominal", "sensor", "motor")
    assert bank.observers["nominal"].model is model


def test_disturbances_may_have_two_bounds_and_the_first_states_rows(tmp_path: Path) -> None:
    rows = "A = [[1, 0], [-1, 0], [0, 1], [0, -1]]\nb = [1, 2, 3, 4]\n"
    bounds = ("w = [0.2]", "w = { lower = [-0.1], upper = [0.3] }")
    plant = read_description(written(tmp_path, bounds, ("lower = [-1.0, -1.0]\nupper = [1.0, 1.0]\n", rows)))
    assert [b.tolist() for b in plant.model.bounds()[:2]] == [[-0.1], [0.3]]
    assert [b.tolist() for b in plant.initial.bounding_box()] == [[-2.0, -4.0], [1.0, 3.0]]


def test_an_observer_has_the_horizon_and_directions_of_the_file(tmp_path: Path) -> None:
    full = read_description(written(tmp_path, ("horizon = 10", 'horizon = "full"\ntemplate = [[1, 1]]')))
    observer = full.bank("stated").observers["nominal"]
    assert isinstance(observer, WindowObserver)
    assert observer.horizon is None
    assert observer.directions[-1].tolist() == [1.0, 1.0]


def test_a_continuous_model_is_discretised(tmp_path: Path) -> None:
    discrete = CART.read_text().split("[[model.uncertainties]]")[0].split("[model]")[1]
    matrices = "\ncontinuous = true\nA = [[0, 1], [0, 0]]\nB = [[0], [1]]\nC = [[1, 0]]\nn = [0.0]\n\n[unused]\n"
    text = CART.read_text().replace(discrete, matrices)
    text = text.split("[unused]")[0] + "[initial]" + text.split("[initial]")[1].split("[faults.motor]")[0]
    (tmp_path / "cart.toml").write_text(text)
    model = read_description(tmp_path / "cart.toml").model
    assert np.allclose(model.block("A"), [[1, 0.1], [0, 1]], atol=1e-15)
    assert np.allclose(model.block("B"), [[0.005], [0.1]], atol=1e-15)


def test_a_model_with_own_arrays_needs_the_global_set_and_gets_it(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"fault 'stuck' need not contain the nominal plant.*add \[global\]"):
        read_description(written(tmp_path, more=STUCK))
    bank = read_description(written(tmp_path, more=STUCK + GLOBAL)).bank("stated")
    assert isinstance(bank, ArchitectureII)
    rng = np.random.default_rng(2)
    plant = read_description(written(tmp_path, more=STUCK + GLOBAL + "[bank]\nrecovery = 30\n"))
    log = plant.model.simulate([0.0, 0.0], np.ones((60, 1)), rng)
    dead = plant.faults["stuck"].model.simulate(log.x[20], np.ones((40, 1)), rng)  # type: ignore[index]
    y = np.vstack([log.y[:20], dead.y])
    found = detect(plant, Log(time=log.time, u=log.u, y=y), "stated")
    assert found.detected_s is not None
    assert found.detected_s >= 2.0
    assert "stuck" in found.alive


def test_matrices_may_come_from_a_mat_file(tmp_path: Path) -> None:
    arrays = {"A": [[1.0, 0.1], [0.0, 1.0]], "B": [[0.0], [0.1]], "C": [[1.0, 0.0]], "n": [[0.05]], "extra": 3.0}
    savemat(tmp_path / "model.mat", arrays)
    lines = [
        line for line in CART.read_text().splitlines() if not line.startswith(("A =", "B = [[0.0], [0.1", "C =", "n ="))
    ]
    path = tmp_path / "cart.toml"
    path.write_text("\n".join(lines).replace("[model]", '[model]\nfile = "model.mat"\n#'))
    plant, direct = read_description(path), read_description(CART)
    assert np.array_equal(plant.model.stack(), direct.model.stack())
    assert plant.model.bounds()[2].tolist() == [0.05]
    keep_description(plant, tmp_path / "found")
    again = find_plant("cart.toml", tmp_path / "found")
    assert np.array_equal(again.bank("stated").observers["nominal"].model.stack(), direct.model.stack())
    path.write_text(path.read_text().replace('"model.mat"', '"model.mat"\nn = [0.1]'))
    with pytest.raises(ValueError, match=r"cart.toml, \[model\], key 'n': is given here and in model.mat"):
        read_description(path)
    path.write_text(path.read_text().replace('"model.mat"', '"../model.mat"'))
    with pytest.raises(ValueError, match="expected a file beside the TOML file"):
        read_description(path)


def test_a_noise_bound_that_was_forgotten_is_asked_for(tmp_path: Path) -> None:
    """An exact sensor is one that the file calls exact."""
    assert read_description(written(tmp_path, ("n = [0.05]", "n = [0.0]"))).model.bounds()[2].tolist() == [0.0]
    savemat(tmp_path / "model.mat", {"A": [[1.0, 0.1], [0.0, 1.0]]})
    path = written(tmp_path, ("n = [0.05]", 'file = "model.mat"'), ("A = [[1.0, 0.1], [0.0, 1.0]]", ""))
    with pytest.raises(ValueError, match=r"key 'n': is missing; expected the half-widths"):
        read_description(path)


def test_what_is_kept_is_never_copied_onto_itself(tmp_path: Path) -> None:
    path = written(tmp_path)
    keep_description(read_description(path), tmp_path)
    assert path.read_bytes() == CART.read_bytes()


ERRORS: list[tuple[tuple[str, str], list[str]]] = [
    (("horizon", "horizn"), ["[observer], key 'horizn'", "did you mean 'horizon'?"]),
    (("[observer]", "[observr]"), ["key 'observr'", "did you mean 'observer'?"]),
    (("magnitude = 0.5", "magntude = 0.5"), ["[faults.sensor], key 'magntude'", "did you mean 'magnitude'?"]),
    (("w = [0.2]", "W = [0.2]"), ["[model], key 'W'", "did you mean 'w'?"]),
    (("Ts = 0.1", "Ts = 'a'"), ["key 'Ts'", "expected a number"]),
    (("Ts = 0.1", "Ts = true"), ["key 'Ts'", "expected a number"]),
    (("Ts = 0.1", "Ts = -1"), ["[model]", "Ts is -1.0; expected a positive sampling time"]),
    (("Ts = 0.1", ""), ["key 'Ts': is missing"]),
    (("Ts = 0.1", "Ts = = 1"), ["is not TOML", "line 2"]),
    (("C = [[1.0, 0.0]]", ""), ["[model], key 'C': is missing"]),
    (("C = [[1.0, 0.0]]", "C = [[1.0]]"), ["[model]", "C has shape (1, 1); expected (ny, 2)"]),
    (("C = [[1.0, 0.0]]", "C = [[1.0, 0.0], [1.0]]"), ["[model], key 'C'", "rows of one length"]),
    (("C = [[1.0, 0.0]]", "C = [[1.0, 'x']]"), ["[model], key 'C'", "expected numbers in brackets"]),
    (("C = [[1.0, 0.0]]", "C = 1.0"), ["[model], key 'C'", "expected numbers in brackets"]),
    (("C = [[1.0, 0.0]]", "C = [[1.0, nan]]"), ["[model]", "C contains NaN at"]),
    (("w = [0.2]", "w = { lower = [0.2] }"), ["[model.w], key 'upper': is missing"]),
    (("w = [0.2]", ""), ["[model]", "w is missing"]),
    (("n = [0.05]", ""), ["[model], key 'n': is missing", "one an output"]),
    (("n = [0.05]", "n = []"), ["[model]", "n has shape (0,)"]),
    (("n = [0.05]", "n = [-0.05]"), ["[model]", "expected finite half-widths >= 0"]),
    (("n = [0.05]", "n = [0.05]\nremainder = [1.0]"), ["key 'remainder'", "continuous = true"]),
    (("B = [[0.0], [0.01]]", ""), ["[model.uncertainties, entry 1]", "no direction"]),
    (("B = [[0.0], [0.01]]", "B = [[0.0]]"), ["[model]", "B of uncertainty mass has shape (1, 1)"]),
    (('name = "mass"', "bounds = [1.0, 0.0]"), ["[model.uncertainties, entry 1]", "lower <= upper"]),
    (('name = "mass"', "name = 3"), ["key 'name': is 3; expected text in quotes"]),
    (("upper = [1.0, 1.0]", "upper = [-2.0, 1.0]"), ["[initial]"]),
    (("upper = [1.0, 1.0]", "upper = [1.0]"), ["[initial]"]),
    (("upper = [1.0, 1.0]", ""), ["[initial], key 'upper': is missing"]),
    (("horizon = 10", "horizon = 0"), ["[observer], key 'horizon'", 'or "full"']),
    (("horizon = 10", "horizon = true"), ["[observer], key 'horizon'", "expected a whole number"]),
    (("horizon = 10", "template = [[1.0]]"), ["[observer]", "template has shape (1, 1)"]),
    (('type = "sensor"', ""), ["[faults.sensor], key 'type': is missing"]),
    (('type = "sensor"', 'typ = "sensor"'), ["key 'type': is missing; is it meant by 'typ'?"]),
    (('type = "sensor"', 'type = "sensors"'), ["expected one of sensor, actuator, plant, model"]),
    (('output = "position"', 'output = "speed"'), ["[faults.sensor], key 'output'", "columns position"]),
    (('kind = "bias"', 'kind = "bais"'), ["[faults.sensor]", "kind is 'bais'; expected one of bias"]),
    (('kind = "loss"', 'kind = "runaway"'), ["[faults.motor]", "travel"]),
    (("[faults.sensor]", "[faults.nominal]"), ["[faults], key 'nominal'", "another name"]),
    (('unit = "N"', 'unti = "N"'), ["[columns.inputs, entry 1], key 'unti'", "did you mean 'unit'?"]),
    (('outputs = [{ name = "position", unit = "m" }]', ""), ["[columns], key 'outputs': is missing"]),
    (('name = "force"', 'name = "position"'), ["[columns]", "'position' more than once"]),
    (("[{ name = \"force\", unit = \"N\" }]", '["force"]'), ["[columns], key 'inputs'", "expected a list of tables"]),
    (('name = "force"', 'name = "a", unit = "N" }, { name = "b"'), ["[columns], key 'inputs': names 2 columns"]),
    (
        ("n = [0.05]", 'n = [0.05]\ncontinuous = true\nvarying = "mass"'),
        ["[model]: remainder is missing", "{'states': ..., 'inputs'"],
    ),
    (
        ("n = [0.05]", "n = [0.05]\ncontinuous = true\nremainder = { states = [1.0], inputs = [2.0] }"),
        ["[model]: remainder['states'] is", "shape (2,)"],
    ),
    (("n = [0.05]", "continuous = true\nremainder = { inputs = [2.0] }"), ["[model.remainder], key 'states'"]),
]  # fmt: skip


@pytest.mark.parametrize(("change", "expected"), ERRORS, ids=[f"{c[0]} -> {c[1]}" for c, _ in ERRORS])
def test_a_mistake_is_one_error_with_its_place(tmp_path: Path, change: tuple[str, str], expected: list[str]) -> None:
    path = written(tmp_path, change)
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        read_description(path)
    for words in ["cart.toml", *expected]:
        assert words in str(caught.value), str(caught.value)
    assert str(caught.value).count("cart.toml") == 1


def test_the_remainder_may_be_computed_from_bounds_of_states_and_inputs(tmp_path: Path) -> None:
    text = CART.read_text().replace("B = [[0.0], [0.01]]", "A = [[0.0, 0.0], [0.0, 0.1]]")
    path = tmp_path / "cart.toml"
    path.write_text(
        text.replace("n = [0.05]", "n = [0.05]\ncontinuous = true\nremainder = { states = [9.0, 2.0], inputs = [3.0] }")
    )
    model = read_description(path).model
    expected = remainder_bound(
        [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], E=[[0.0], [0.1]], w=[0.2], Ts=0.1, x=[9.0, 2.0], u=[3.0],
        uncertainties=[Uncertainty(A=[[0.0, 0.0], [0.0, 0.1]])],
    )  # fmt: skip
    assert np.array_equal(model.bounds()[1][1:], expected)
    assert expected[1] > 0
    assert model.names is not None


def test_other_noise_sets_are_refused() -> None:
    with pytest.raises(ValueError, match="expected 'stated'"):
        read_description(CART).bank("quiet")


def test_a_registered_plant_is_found_by_its_name(registered_tank: str) -> None:
    assert find_plant("tank").title.startswith("Water tank")
    keep_description(find_plant("tank"), Path("nowhere"))


@pytest.mark.parametrize(
    ("bank", "expected"),
    [
        ("debounce = 0", "[bank], key 'debounce': is 0; expected a number of samples >= 1"),
        ("recover = 3", "did you mean 'recovery'?"),
    ],
)
def test_bank_options_are_checked(tmp_path: Path, bank: str, expected: Any) -> None:
    with pytest.raises(ValueError, match=r"cart\.toml") as caught:
        read_description(written(tmp_path, more=f"[bank]\n{bank}\n"))
    assert expected in str(caught.value)


def test_promised_ranges_of_the_state_are_keys_of_the_model(tmp_path: Path) -> None:
    ranges = "[model]\nphysical = { lower = [-100.0, -inf] }\nlargest = { lower = [-5.0, -1.0], upper = [5.0, 1.0] }"
    model = read_description(written(tmp_path, ("[model]", ranges))).model
    assert model.physical_range is not None
    assert model.start_range is not None
    assert [model.physical_range.lower.tolist(), model.physical_range.upper.tolist()] == [[-100, -np.inf], [np.inf] * 2]
    assert [model.start_range.lower.tolist(), model.start_range.upper.tolist()] == [[-5.0, -1.0], [5.0, 1.0]]
    as_lists = "[model]\nphysical = [[-100.0, -2.0], [100.0, 2.0]]"
    assert read_description(written(tmp_path, ("[model]", as_lists))).model.start_range is not None


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("physical = { lower = [1.0, 0.0], upper = [0.0, 0.0] }", r"\[model\]: physical is between"),
        ("physical = { low = [1.0, 0.0] }", "did you mean 'lower'"),
        ("largest = { lower = [0.0, 0.0] }", r"\[model.largest\], key 'upper': is missing"),
        ("largest = { lower = [0.0, -inf], upper = [0.0, 0.0] }", "all finite"),
        ("largest = 3.0", "key 'largest'"),
    ],
)
def test_a_promised_range_that_is_none_is_named(tmp_path: Path, value: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read_description(written(tmp_path, ("[model]", f"[model]\n{value}")))
