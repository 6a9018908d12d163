"""The table of tolerances in `docs/theory.md` has the constants of this folder, with their values of today."""

from __future__ import annotations

import re
from pathlib import Path

from tests.mutation.constants import CONSTANTS

PAGE = Path(__file__).parents[2] / "docs/theory.md"
ROW = re.compile(r"^\| `([\w./]+:\w+)` \| (\S+) \| (\w+) \|", re.MULTILINE)


def test_the_page_has_exactly_the_constants_and_their_values() -> None:
    rows = [(name, float(value), kind) for name, value, kind in ROW.findall(PAGE.read_text("utf-8"))]
    assert sorted(rows) == sorted((str(c), c.value, c.kind) for c in CONSTANTS)


def test_every_constant_names_a_test_that_exists() -> None:
    root = Path(__file__).parents[2]
    assert [str(c) for c in CONSTANTS if not (root / c.test.partition("::")[0]).exists()] == []
