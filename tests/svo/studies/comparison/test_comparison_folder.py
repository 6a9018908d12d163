"""A comparison that is interrupted goes on; what it kept is checked before it counts."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from compared_plant import SmallPlant
from test_comparison import registered, untimed  # noqa: F401  (a fixture)

from svo.store import locked
from svo.studies.comparison import comparison as module
from svo.studies.comparison.comparison import Comparison, run_comparison
from svo.studies.comparison.publish import publish_comparison

pytestmark = pytest.mark.usefixtures("registered")
FEW = Comparison(
    "small",
    "usual",
    runs=2,
    healthy_training=3,
    healthy_calibration=3,
    healthy_runs=2,
    faulty_training=1,
    evaluations=2,
    distributions=("bounded",),
)


def test_an_interrupted_comparison_goes_on_and_gives_the_same(tmp_path):
    calls = []

    def interrupt(done, of):
        calls.append(done)
        if done == 8:  # seven detectors are tuned, and the first part is judged
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_comparison(FEW, 1, interrupt, out=tmp_path)
    kept = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*/run-*")}
    assert len(kept) == 8
    with pytest.raises(ValueError, match="holds a comparison already; give --resume"):
        run_comparison(FEW, out=tmp_path)
    with pytest.raises(ValueError, match=r"holds another study .*seed was 0, now 1"):
        run_comparison(replace(FEW, seed=1), out=tmp_path, resume=True)
    with locked(tmp_path), pytest.raises(ValueError, match="is in use by process"):
        run_comparison(FEW, out=tmp_path, resume=True)
    resumed, whole = run_comparison(FEW, out=tmp_path, resume=True), run_comparison(FEW)
    assert all(path.stat().st_mtime_ns == at for path, at in kept.items())
    assert list(map(untimed, resumed.rows)) == list(map(untimed, whole.rows))
    for key, tuned in whole.tuned.items():
        np.testing.assert_equal(vars(resumed.tuned[key].setting), vars(tuned.setting))
    assert publish_comparison(tmp_path, resumed, SmallPlant())

    damaged = tmp_path / "judged" / "run-000001.jsonl"
    damaged.write_bytes(damaged.read_bytes().replace(b"false", b"true ", 1))
    again = run_comparison(FEW, out=tmp_path, resume=True)
    assert list(map(untimed, again.rows)) == list(map(untimed, whole.rows))


@pytest.mark.slow
def test_ctrl_c_says_what_is_true(tmp_path):
    command = [sys.executable, "-m", "svo", "compare", "small", "--runs", "40", "--workers", "2", "--out", tmp_path]
    process = subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    end = time.monotonic() + 300
    while not list((tmp_path / "tuned").glob("run-*")) and time.monotonic() < end:
        assert process.poll() is None
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == (
        "error: interrupted; what is done is kept, and the same command with --resume goes on"
    )
    assert "Traceback" not in errors
    assert list(Path(tmp_path / "tuned").glob("run-*"))
    end = time.monotonic() + 30
    while time.monotonic() < end:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.1)
    pytest.fail("workers of an interrupted comparison are still there after 30 s")


def test_what_fails_is_a_row_and_can_be_tried_again(tmp_path, monkeypatch):
    """A detector that cannot be tuned, and one whose runs fail: the others are compared, and a retry mends both."""
    tune, judge = module.tune_detector, module.compare_run

    def broken_tune(comparison, distribution, index):
        if index == 2:
            raise ArithmeticError("no level")
        return tune(comparison, distribution, index)

    def broken_judge(detector, setting, log, condition, seed):
        if detector.name == "CUSUM" and condition.fault == "second":
            sys.exit(0)
        return judge(detector, setting, log, condition, seed)

    monkeypatch.setattr(module, "tune_detector", broken_tune)
    monkeypatch.setattr(module, "compare_run", broken_judge)
    broken = run_comparison(FEW, out=tmp_path)
    failed = [row for row in broken.rows if row.error is not None]
    assert {(row.detector, row.error) for row in failed} == {
        ("Kalman, chi-square", "not tuned: ArithmeticError: no level"),
        ("CUSUM", "SystemExit: 0"),
    }
    assert len(failed) == len(broken.failures()) == 6 + 2
    assert len(publish_comparison(tmp_path, broken, SmallPlant())) == 5 * 2 + 1
    monkeypatch.undo()
    whole = run_comparison(FEW)
    assert list(map(untimed, whole.rows))[:12] == list(map(untimed, broken.rows))[:12]
    resumed = run_comparison(FEW, out=tmp_path, resume=True)
    assert len(resumed.failures()) == 8
    again = run_comparison(FEW, out=tmp_path, resume=True, retry_failed=True)
    assert list(map(untimed, again.rows)) == list(map(untimed, whole.rows))


def test_a_cluster_gives_the_same_rows():
    distributed = pytest.importorskip("distributed", reason="needs the extra 'cluster'")
    size = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**size, processes=False) as cluster:
        spread = run_comparison(FEW, scheduler=cluster.scheduler_address)
    assert list(map(untimed, spread.rows)) == list(map(untimed, run_comparison(FEW).rows))
