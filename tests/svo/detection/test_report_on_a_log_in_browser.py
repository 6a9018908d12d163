"""The report on a log, opened in a browser and used: `make test-browser`."""

from __future__ import annotations

from pathlib import Path

import pytest

from svo import detect, find_plant, read_log
from svo.detection.report.report import write_report
from tests.browsing import browser_or_skip, use

pytestmark = pytest.mark.browser

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
DRIVER = Path(__file__).with_name("read_log_report.js")


@pytest.fixture(scope="module")
def browser() -> str:
    return browser_or_skip()


@pytest.fixture(scope="module")
def page(browser: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    plant = find_plant(CART)
    log = CART.with_suffix(".csv")
    return write_report(tmp_path_factory.mktemp("log"), detect(plant, read_log(log, plant)), log).read_text("utf-8")


@pytest.mark.parametrize(
    ("width", "more"), [(1200, ()), (500, ()), (1200, ("--blink-settings=preferredColorScheme=0",))]
)
def test_a_reader_can_choose_what_is_shown(
    browser: str, page: str, tmp_path: Path, width: int, more: tuple[str, ...]
) -> None:
    seen, console = use(browser, DRIVER, page, tmp_path, width, *more)
    assert not console  # no element breaks the policy, the pictures' own colours among them
    assert seen["errors"] == []
    assert seen["loaded"] == []
    assert seen["overflow"] <= 0
    assert seen["overflowOpen"] <= 0
    assert seen["begin"] == 3
    assert seen["one"] == [2, 0]
    assert seen["none"] == [1, False]  # the verdicts stay
    assert seen["all"] == [3, True]
    assert {"rgb(91, 100, 112)", "rgb(213, 94, 0)", "rgb(0, 114, 178)"} <= set(seen["colours"])
    assert seen["size"][0] > 3 * seen["size"][1] * 0.6
    assert seen["description"]
