"""A study on a real local cluster of worker processes: the same rows, and a worker that is killed costs only time."""

from __future__ import annotations

import contextlib
import gc
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from svo.plant import load_plant
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.runner import run_study

distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")


@pytest.fixture
def cluster(registered_tank: str) -> Iterator[distributed.LocalCluster]:
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0
    ) as cluster:
        yield cluster


def untimed(rows: list[RunRow]) -> list[RunRow]:
    return [replace(row, microseconds_per_step=0.0, microseconds_p99=0.0) for row in rows]


def test_a_worker_killed_in_mid_study_costs_nothing_but_time(
    cluster: distributed.LocalCluster, registered_tank: str, tmp_path: Path
) -> None:
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=5, seed=3)
    killed: list[int] = []

    def kill_one(done: int, of: int) -> None:
        if done == 3 and not killed:
            with distributed.Client(cluster, set_as_default=False) as client:
                killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    spread = run_study(wanted, tmp_path / "cluster", scheduler=cluster.scheduler_address, progress=kill_one)
    here = run_study(wanted, tmp_path / "here")
    assert killed
    assert untimed(spread.rows()) == untimed(here.rows())
    assert spread.alarms.read_bytes() == here.alarms.read_bytes()


def test_a_run_that_fails_on_the_cluster_is_a_row(
    registered_tank: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TANK_BURSTS_IN", "gauge")
    monkeypatch.setenv("TANK_BURSTS", "exit")
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=1, seed=3)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        rows = run_study(wanted, tmp_path, scheduler=cluster.scheduler_address).rows()
    assert [row.error for row in rows] == [None, None, None, "SystemExit: 0"]


def test_an_address_without_a_scheduler_is_one_clear_error(
    registered_tank: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("svo.studies.cluster._CONNECT", "0.5s")
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=1, seed=3)
    with pytest.raises(ValueError, match=r"no dask scheduler answers at 'tcp://127\.0\.0\.1:9'"):
        run_study(wanted, tmp_path, scheduler="tcp://127.0.0.1:9")


def test_an_address_without_a_port_is_one_clear_error_and_nothing_more(
    registered_tank: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=1, seed=3)
    with pytest.raises(ValueError, match=r"no dask scheduler answers at 'nowhere'.*missing port"):
        run_study(wanted, tmp_path, scheduler="nowhere")
    gc.collect()
    assert "Traceback" not in capfd.readouterr().err


def test_a_cluster_without_workers_is_one_clear_error(registered_tank: str, tmp_path: Path) -> None:
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=1, seed=3)
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster,
        pytest.raises(ValueError, match="has no workers"),
    ):
        run_study(wanted, tmp_path, scheduler=cluster.scheduler_address)


def test_a_certificate_is_asked_for(registered_tank: str, tmp_path: Path) -> None:
    wanted = StudyConfiguration.for_plant(load_plant(registered_tank), runs=1, seed=3)
    with pytest.raises(ValueError, match="there is no certificate of this process"):
        run_study(wanted, tmp_path, scheduler="tls://127.0.0.1:8786")


@pytest.fixture
def processes(registered_tank: str, tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A scheduler in a process of its own, with a worker in another, and its address."""
    file = tmp_path / "scheduler.json"
    start = [sys.executable, "-m"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    own = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", file]
    scheduler = subprocess.Popen([*start, "distributed.cli.dask_scheduler", "--port", "0", *own], **quiet)
    worker = subprocess.Popen([*start, "distributed.cli.dask_worker", "--nthreads", "1", "--no-nanny", *own], **quiet)
    try:
        for _ in range(300):
            with contextlib.suppress(OSError, ValueError, KeyError):
                address = json.loads(file.read_text())["address"]
                break
            time.sleep(0.1)
        else:
            pytest.fail("the scheduler has no address after 30 s")
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=30)
        yield scheduler, address
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.wait()


def test_a_scheduler_that_is_killed_is_one_clear_error_and_the_study_goes_on(
    processes: tuple[subprocess.Popen[bytes], str], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scheduler, address = processes
    wanted = StudyConfiguration.for_plant(load_plant("tank"), runs=10, seed=3)

    def kill_it(done: int, of: int) -> None:
        if done == 3:
            scheduler.kill()

    with pytest.raises(RuntimeError, match=r"the dask scheduler at .* is lost .*--resume"):
        run_study(wanted, tmp_path / "out", scheduler=address, progress=kill_it)
    assert "Traceback" not in capfd.readouterr().err
    resumed = run_study(wanted, tmp_path / "out", resume=True)
    assert [row.run for row in resumed.rows()] == list(range(40))
