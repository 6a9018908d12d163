"""A recorded flight at its own times: nothing is resampled, healthy flight is quiet, the fault is found."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.recorded_events import PLANT, begin_of, exported, on_grid
from svo import WindowObserver, find_plant, read_log

DATA = os.environ.get("SVO_DATA")
FLIGHTS = ("TestCase_1_1000000000", "TestCase_2_2000000001")


@pytest.mark.skipif(DATA is None, reason="SVO_DATA is not set: no recorded data")
@pytest.mark.parametrize("flight", FLIGHTS)
@pytest.mark.filterwarnings("ignore::svo.logs.columns.LogNote")
def test_a_flight_is_read_as_it_came(flight: str, tmp_path: Path) -> None:
    pytest.importorskip("pyulog", reason="pyulog (extra ulog) reads the flight logs")
    assert DATA is not None
    plant = find_plant(PLANT)
    fault = exported(Path(DATA) / "rflymad" / f"{flight}.ulg", tmp_path) - begin_of(tmp_path)
    log = read_log(tmp_path, plant)
    for j, name in enumerate(("vehicle_air_data", "vehicle_gps_position")):
        rows = np.loadtxt(tmp_path / f"{name}.csv", delimiter=",", skiprows=1, usecols=0) / 1e6 - begin_of(tmp_path)
        known = rows[(rows >= 0) & (rows <= log.time[-1] + 1e-9)]
        np.testing.assert_allclose(log.time[~np.isnan(log.y[:, j])], known, atol=1e-9)
    record = WindowObserver(plant.model, plant.initial, horizon=20).run(log)
    assert record.falsified_at is not None
    assert 0.0 < log.time[record.falsified_at] - fault < 0.6
    sampled, moved = on_grid(log, plant.Ts)
    assert (moved > 0.01).all()
    assert len(sampled) < len(log)


def test_the_example_is_a_plant_of_events() -> None:
    plant = find_plant(PLANT)
    assert plant.dialect is not None  # type: ignore[attr-defined]
    assert plant.dialect.events  # type: ignore[attr-defined]
