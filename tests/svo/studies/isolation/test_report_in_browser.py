"""The report of a study, opened in a browser and used: `make test-browser`."""

from __future__ import annotations

from pathlib import Path

import pytest

from svo.plant import load_plant
from svo.studies.configuration import StudyConfiguration
from svo.studies.isolation.publish import publish
from svo.studies.isolation.run import RunRow
from svo.studies.isolation.runner import run_study
from tests.browsing import browser_or_skip, use

pytestmark = pytest.mark.browser

DRIVER = Path(__file__).with_name("read_report.js")


@pytest.fixture(scope="module")
def browser() -> str:
    return browser_or_skip()


@pytest.fixture(scope="module")
def study(browser: str, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, list[RunRow]]:
    """The page of a small study of the Eclipse, and its rows."""
    plant = load_plant("eclipse")
    configuration = StudyConfiguration.for_plant(plant, runs=2, seed=0, noise=["quiet"], faults=["none", "elevator"])
    folder = run_study(configuration, tmp_path_factory.mktemp("report") / "study")
    publish(folder, plant)
    return (folder.path / "report.html").read_text(encoding="utf-8"), folder.rows()


@pytest.mark.parametrize("width", [1200, 420])
def test_a_reader_can_move_in_the_report(
    browser: str, study: tuple[str, list[RunRow]], tmp_path: Path, width: int
) -> None:
    page, rows = study
    seen, console = use(browser, DRIVER, page, tmp_path, width)
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
    seen, console = use(browser, DRIVER, broken, tmp_path, 1200)
    assert "noSuchName" in console
    assert any("noSuchName" in message for message in seen["errors"])


@pytest.mark.parametrize(
    "intruder",
    ["<script>noSuchName();</script>", '<img src="x" onerror="noSuchName()">', '<script src="x.js"></script>'],
)
def test_what_is_not_the_pages_own_does_not_run(
    browser: str, study: tuple[str, list[RunRow]], tmp_path: Path, intruder: str
) -> None:
    seen, console = use(browser, DRIVER, study[0].replace("</body>", f"{intruder}</body>"), tmp_path, 1200)
    assert "noSuchName" not in "".join(seen["errors"])
    assert "Content Security Policy" in console
