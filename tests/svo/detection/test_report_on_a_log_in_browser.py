"""The report on a log, opened in a browser and used: `make test-browser`."""

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

from svo import detect, find_plant, read_log
from svo.detection.report.report import write_report

pytestmark = pytest.mark.browser

CART = Path(__file__).parents[3] / "docs" / "examples" / "cart.toml"
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
WATCH = "<script>window.errors = []; addEventListener('error', (e) => errors.push(e.message));</script>"


@pytest.fixture(scope="module")
def browser() -> str:
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no browser on PATH: none of {', '.join(BROWSERS)}")
    return found


@pytest.fixture(scope="module")
def page(browser: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    plant = find_plant(CART)
    log = CART.with_suffix(".csv")
    return write_report(tmp_path_factory.mktemp("log"), detect(plant, read_log(log, plant)), log).read_text("utf-8")


def use(browser: str, page: str, folder: Path, width: int, *more: str) -> tuple[dict[str, Any], str]:
    """What a reader sees who moves in a page, and what the browser's console says."""
    driver = Path(__file__).with_name("read_log_report.js").read_text(encoding="utf-8")
    path = folder / "page.html"
    # What stands before the policy may run; for the driver behind it the policy has to be widened.
    digest = base64.b64encode(hashlib.sha256(driver.encode()).digest()).decode()
    page = page.replace("script-src ", f"script-src 'sha256-{digest}' ")
    page = page.replace("<head>", "<head>" + WATCH).replace("</body>", f"<script>{driver}</script></body>")
    path.write_text(page, encoding="utf-8")
    options = ["--headless", "--disable-gpu", f"--user-data-dir={folder / 'profile'}", f"--window-size={width},1600"]
    options += ["--enable-logging=stderr", "--virtual-time-budget=10000", "--dump-dom", *more]
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        options.append("--no-sandbox")  # which the browser refuses to start with for this user
    run = subprocess.run([browser, *options, path.as_uri()], capture_output=True, text=True, timeout=120, check=True)
    result = re.search(r'<pre id="seen">(.*?)</pre>', run.stdout, re.DOTALL)
    console = "\n".join(line for line in run.stderr.splitlines() if "CONSOLE" in line)
    assert result is not None, console or run.stderr
    return json.loads(html.unescape(result[1])), console


@pytest.mark.parametrize(
    ("width", "more"), [(1200, ()), (500, ()), (1200, ("--blink-settings=preferredColorScheme=0",))]
)
def test_a_reader_can_choose_what_is_shown(
    browser: str, page: str, tmp_path: Path, width: int, more: tuple[str, ...]
) -> None:
    seen, console = use(browser, page, tmp_path, width, *more)
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
