"""Exemplary runs: the outline of a set that the pictures draw, and files of samples that are damaged or huge."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polytopes import HPolytope
from svo import UncertainModel, WindowObserver
from svo.logs.drive import drive
from svo.studies.isolation.exemplar import Exemplar, Snapshot, planar_outline


def test_the_outline_holds_the_truth_and_cuts_corners_of_the_box() -> None:
    cart = UncertainModel([[1, 0.1], [0, 1]], [[0], [0.1]], [[1, 0]], E=[[0], [0.1]], w=[0.2], n=[0.05], Ts=0.1)
    rng = np.random.default_rng(3)
    log = cart.simulate([0.1, 0.0], np.ones((30, 1)), rng, corners=True)
    observer = WindowObserver(cart, HPolytope.box([-1, -1], [1, 1]))
    assert log.x is not None
    for k, step in enumerate(drive(observer, log)):
        outline = planar_outline(step)
        assert outline.contains(log.x[k], tol=1e-9)
    assert outline.volume() < 0.8 * step.set.volume()


def test_the_outline_of_a_scalar_state_is_its_interval() -> None:
    model = UncertainModel([[0.9]], None, [[1.0]], n=[0.1])
    step = WindowObserver(model, HPolytope.box([-1.0], [1.0])).update([0.5])
    np.testing.assert_allclose(planar_outline(step).bounding_box(), step.box, atol=1e-12)


def exemplar(samples: int = 50) -> Exemplar:
    bounds = np.arange(samples * 2.0).reshape(samples, 1, 2)
    snapshot = Snapshot(3, "end of the run", {"nominal": HPolytope.box([0.0, 0.0], [1.0, 2.0])})
    alive = np.ones((samples, 1), dtype=bool)
    run = np.zeros((samples, 2))
    return Exemplar(
        "leak", "step", "calm", ("nominal",), np.arange(samples) * 0.1, alive, bounds, bounds, run, (snapshot,)
    )


def test_damaged_samples_are_one_clear_error_or_the_same_samples(tmp_path: Path) -> None:
    path, rng, errors = tmp_path / "run-000000.npz", random.Random(0), []
    exemplar().save(path)
    content = path.read_bytes()
    for case in range(400):
        changed = bytearray(content)
        at = rng.randrange(len(changed))
        if case % 4 == 0:
            del changed[at:]
        else:
            changed[at] = rng.randrange(256)
        path.write_bytes(bytes(changed))
        try:
            assert np.array_equal(Exemplar.load(path).lower, exemplar().lower)
        except ValueError as error:
            errors.append(str(error))
    assert len(errors) > 200
    assert all(error.startswith(str(path)) for error in errors)


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data.pop("lower"),
        lambda data: data.update(x=np.zeros(3)),
        lambda data: data.update(time=np.zeros(50, dtype=np.int8)),
        lambda data: data.update(header=np.array("{}")),
        lambda data: data.update(header=np.array("[" * 20_000)),
        lambda data: data.update(header=np.array(str(data["header"]).replace('"sample": 3', '"sample": 300'))),
        lambda data: data.update(header=np.array(json.dumps([1, 2]))),
    ],
)
def test_samples_that_do_not_fit_together_are_one_clear_error(
    change: Callable[[dict[str, Any]], Any], tmp_path: Path
) -> None:
    path = tmp_path / "run-000000.npz"
    exemplar().save(path)
    with np.load(path) as file:
        data = dict(file)
    change(data)
    np.savez_compressed(path, **data)
    with pytest.raises(ValueError, match=r"run-000000\.npz holds no samples of a run"):
        Exemplar.load(path)


def test_samples_that_unpack_to_too_much_are_refused_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "run-000000.npz"
    exemplar(100_000).save(path)
    monkeypatch.setenv("SVO_UNPACK_LIMIT_MB", "1")
    with pytest.raises(ValueError, match=r"would unpack to .* MB; the limit is 1 MB"):
        Exemplar.load(path)


def test_objects_are_never_loaded(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", header=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match=r"run\.npz is not a file of arrays"):
        Exemplar.load(tmp_path / "run.npz")
