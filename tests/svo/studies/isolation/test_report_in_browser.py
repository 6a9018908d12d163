"""The report of a study, opened in a browser and used: `make test-browser`."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from svo.plant import load_plant
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.publish import publish
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.runner import run_study

pytestmark = pytest.mark.browser

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
WATCH = "<script>window.errors = []; addEventListener('error', (e) => errors.push(e.message));</script>"


@pytest.fixture(scope="module")
def browser() -> str:
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no browser on PATH: none of {', '.join(BROWSERS)}")
    return found


@pytest.fixture(scope="module")
def study(browser: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, list[RunRow]]:
    """The page of a small study of the Eclipse, and its rows."""
    plant = load_plant("eclipse")
    configuration = StudyConfiguration.for_plant(plant, runs=2, seed=0, noise=["quiet"], faults=["none", "elevator"])
    folder = run_study(configuration, tmp_path_factory.mktemp("report") / "study")
    publish(folder, plant)
    return (folder.path / "report.html").read_text(encoding="utf-8"), folder.rows()


def use(browser: str, page: str, folder: Path, width: int) -> tuple[dict[str, Any], str]:
    """What a reader sees who moves in a page, and what the browser's console says."""
    driver = Path(__file__).with_name("read_report.js").read_text(encoding="utf-8")
    path = folder / "page.html"
    # What stands before the policy may run; for the driver behind it the policy has to be widened.
    digest = base64.b64encode(hashlib.sha256(driver.encode()).digest()).decode()
    page = page.replace("script-src ", f"script-src 'sha256-{digest}' ")
    page = page.replace("<head>", "<head>" + WATCH).replace("</body>", f"<script>{driver}</script></body>")
    path.write_text(page, encoding="utf-8")
    options = ["--headless", "--disable-gpu", f"--user-data-dir={folder / 'profile'}", f"--window-size={width},1600"]
    options += ["--enable-logging=stderr", "--virtual-time-budget=10000", "--dump-dom"]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        options.append("--no-sandbox")  # which the browser refuses to start with for this user
    run = subprocess.run([browser, *options, path.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    result = re.search(r'<pre id="seen">(.*?)</pre>', run.stdout, re.DOTALL)
    console = "\n".join(line for line in run.stderr.splitlines() if "CONSOLE" in line)
    assert result is not None, console or run.stderr
    return json.loads(html.unescape(result[1])), console


@pytest.mark.parametrize("width", [1200, 420])
def test_a_reader_can_move_in_the_report(
    browser: str, study: tuple[str, list[RunRow]], tmp_path: Path, width: int
) -> None:
    page, rows = study
    seen, console = use(browser, page, tmp_path, width)
    assert not console
    assert seen["errors"] == []
    assert seen["loaded"] == []  # nothing from elsewhere
    assert seen["overflow"] <= 0

    faulty = [row for row in rows if row.fault != "none"]
    assert seen["dots"] == 2 * len(faulty) + 2  # and one of each kind in the legend
    for row, shown in ((faulty[0], "firstRun"), (faulty[1], "nextRun"), (faulty[-1], "pointedRun")):
        assert f"--seed {row.seed} " in seen[shown]
        assert f"detected {row.detection_delay_s:.4g} s, isolated {row.isolation_delay_s:.4g} s" in seen[shown]
    assert seen["marked"] == 2
    mean = sum(row.detection_delay_s or 0 for row in faulty if row.profile == "soft") / 2
    assert f"{mean:.3f}" in seen["table"]

    assert seen["begin"][0].endswith("before the fault; alive: nominal, alpha, elevator, dynamics")
    assert seen["begin"][1] == 4
    assert seen["end"][0].endswith("after the fault; alive: elevator; falsified: nominal, alpha, dynamics")
    assert seen["end"][1] == 1
    assert seen["struck"] == ["nominal", "alpha", "dynamics"]
    assert seen["otherFlight"][1] == 4
    assert seen["redrawn"]
    assert seen["playing"][0] == "Pause"
    assert seen["playing"][1] > 0
    assert seen["paused"] == "Play"


def test_an_error_in_the_page_is_noticed(browser: str, study: tuple[str, list[RunRow]], tmp_path: Path) -> None:
    broken = study[0].replace("<head>", "<head><script>addEventListener('load', () => noSuchName());</script>")
    seen, console = use(browser, broken, tmp_path, 1200)
    assert "noSuchName" in console
    assert any("noSuchName" in message for message in seen["errors"])


@pytest.mark.parametrize(
    "intruder",
    ["<script>noSuchName();</script>", '<img src="x" onerror="noSuchName()">', '<script src="x.js"></script>'],
)
def test_what_is_not_the_pages_own_does_not_run(
    browser: str, study: tuple[str, list[RunRow]], tmp_path: Path, intruder: str
) -> None:
    seen, console = use(browser, study[0].replace("</body>", f"{intruder}</body>"), tmp_path, 1200)
    assert "noSuchName" not in "".join(seen["errors"])
    assert "Content Security Policy" in console
