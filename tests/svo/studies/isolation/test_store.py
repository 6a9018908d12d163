from __future__ import annotations

import json
from pathlib import Path

import pyarrow.parquet as pq

from svo.plant import load_plant
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.runner import run_study

CONTRACT = (
    "run seed fault profile noise first_alarm_s detection_delay_s isolation_delay_s isolated_as false_alarm "
    "wrong_isolation alive_end microseconds_per_step"
)


def test_the_run_table_has_the_promised_columns_and_says_where_it_comes_from(
    registered_tank: str, tmp_path: Path
) -> None:
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=2, seed=5)
    folder = run_study(wanted, tmp_path)
    table = pq.read_table(tmp_path / "runs.parquet")
    assert table.column_names[:13] == CONTRACT.split()
    assert table.num_rows == 8
    healthy = table.filter(table["fault"].combine_chunks().to_numpy(zero_copy_only=False) == "none")
    assert healthy["detection_delay_s"].null_count == 2
    assert json.loads(table.schema.metadata[b"svo.configuration"]) == wanted.to_dict()
    assert "svo-fdi" in json.loads(table.schema.metadata[b"svo.versions"])
    assert folder.identity()["configuration"]["seed"] == 5


def test_alarms_are_joined_in_the_order_of_the_runs(registered_tank: str, tmp_path: Path) -> None:
    folder = run_study(StudyConfiguration.for_plant(load_plant(registered_tank), runs=2, seed=5), tmp_path)
    from svo.isolation.alarms import read_alarms

    runs = [alarm.source["run"] for alarm in read_alarms(folder.alarms)]
    assert runs == sorted(runs)
    assert set(runs) == {2, 3, 4, 5, 6, 7}
    assert not (tmp_path / "alarms").exists()


def test_a_study_without_alarms_has_an_empty_file_of_them(registered_tank: str, tmp_path: Path) -> None:
    plant = load_plant(registered_tank)
    folder = run_study(StudyConfiguration.for_plant(plant, runs=2, seed=5, faults=("none",)), tmp_path)
    assert folder.alarms.read_bytes() == b""


def test_exemplary_runs_read_back_as_they_were(registered_tank: str, tmp_path: Path) -> None:
    plant = load_plant(registered_tank)
    folder = run_study(StudyConfiguration.for_plant(plant, runs=2, seed=5), tmp_path)
    exemplars = list(folder.exemplars())
    assert [(e.fault, e.profile) for e in exemplars] == [
        ("none", "none"),
        ("leak", "step"),
        ("leak", "ramp"),
        ("gauge", "step"),
    ]
    again = tmp_path / "again.npz"
    exemplars[1].save(again)
    back = type(exemplars[1]).load(again)
    assert back.names == exemplars[1].names
    assert (back.x == exemplars[1].x).all()
    assert [s.event for s in back.snapshots] == [s.event for s in exemplars[1].snapshots]
    assert list(back.snapshots[0].sets) == list(exemplars[1].snapshots[0].sets)
