"""Pages opened in a headless browser and used by a script that says what a reader sees."""

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

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
WATCH = "<script>window.errors = []; addEventListener('error', (e) => errors.push(e.message));</script>"


def browser_or_skip() -> str:
    """Where a browser lies."""
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip(f"no browser on PATH: none of {', '.join(BROWSERS)}")
    return found


def use(browser: str, driver: Path, page: str, folder: Path, width: int, *more: str) -> tuple[dict[str, Any], str]:
    """What a reader sees who moves in a page as a driver does, and what the browser's console says."""
    script = driver.read_text(encoding="utf-8")
    path = folder / "page.html"
    # What stands before the policy may run; for the driver behind it the policy has to be widened.
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    page = page.replace("script-src ", f"script-src 'sha256-{digest}' ")
    page = page.replace("<head>", "<head>" + WATCH).replace("</body>", f"<script>{script}</script></body>")
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
