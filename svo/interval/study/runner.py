"""Run a study of interval detectors in processes, run by run, so that a kill loses only the runs in flight."""

from __future__ import annotations

import functools
import json
import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from pathlib import Path

from svo.interval.study.run import DetectorRow, LearnsDetectors, execute
from svo.plant import Plant, load_plant
from svo.study.cluster import outcomes_on_cluster
from svo.study.configuration import Job, StudyConfiguration, versions
from svo.study.store import StudyFolder, write_whole

Progress = Callable[[int, int], None]


def run_detection_study(
    configuration: StudyConfiguration,
    out: str | Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> StudyFolder:
    """Run what is still to be run of a study and store it; parameters and errors as `svo.study.runner.run_study`.

    Raises
    ------
    TypeError
        If the plant has no interval detectors to learn.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; expected at least 1 process")
    plant = load_plant(configuration.plant)
    if not isinstance(plant, LearnsDetectors):
        raise TypeError(f"plant {configuration.plant!r} has no interval detectors; it lacks members of LearnsDetectors")
    folder = StudyFolder(Path(out))
    jobs = configuration.jobs(plant)
    done = folder.open(configuration, resume)
    to_do = [job for job in jobs if job.run not in done]
    if progress is not None:
        progress(len(jobs) - len(to_do), len(jobs))
    results = _results(configuration.plant, to_do, workers, scheduler)
    for count, rows in enumerate(results, len(jobs) - len(to_do) + 1):
        _store(folder, configuration, rows)
        if progress is not None:
            progress(count, len(jobs))
    folder.join_alarms()
    return folder


def read_rows(folder: StudyFolder) -> list[DetectorRow]:
    """The run table, in the order of the runs."""
    import pyarrow.parquet as pq

    rows = pq.read_table(folder.parts, columns=list(DetectorRow.__dataclass_fields__)).to_pylist()
    found = [DetectorRow(**{**row, "violated": tuple(row["violated"])}) for row in rows]
    return sorted(found, key=lambda row: row.run)


def _results(name: str, jobs: list[Job], workers: int, scheduler: str | None) -> Iterator[list[DetectorRow]]:
    """The rows of each run, wherever it runs; on a cluster in the order in which they are done."""
    work = functools.partial(_execute, name)
    if scheduler is not None and jobs:
        yield from outcomes_on_cluster(work, jobs, scheduler)
        return
    if workers == 1 or len(jobs) < 2:
        yield from map(work, jobs)
        return
    # Spawned, not forked: a fork would copy the locks of threads that run in this process.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(work, jobs, chunksize=4)


def _execute(name: str, job: Job) -> list[DetectorRow]:
    plant = _plant(name)
    assert isinstance(plant, LearnsDetectors)
    return execute(plant, job)


@functools.cache
def _plant(name: str) -> Plant:
    return load_plant(name)


def _store(folder: StudyFolder, configuration: StudyConfiguration, rows: list[DetectorRow]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    types = {
        **dict.fromkeys(("run", "seed", "records"), pa.int64()),
        **dict.fromkeys(("fault", "profile", "noise", "detector"), pa.string()),
        **dict.fromkeys(("first_alarm_s", "detection_delay_s"), pa.float64()),
        "false_alarm": pa.bool_(),
        "violated": pa.list_(pa.int64()),
    }
    metadata = {"svo.configuration": json.dumps(configuration.to_dict()), "svo.versions": json.dumps(versions())}
    schema = pa.schema([(name, types[name]) for name in DetectorRow.__dataclass_fields__], metadata=metadata)
    table = pa.Table.from_pylist([asdict(row) for row in rows], schema=schema)
    write_whole(folder.parts / f"run-{rows[0].run:06d}.parquet", lambda file: pq.write_table(table, file))
