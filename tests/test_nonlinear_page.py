"""The page of nonlinear plants: its code runs, and its example prints what the page shows."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

from svo import NonlinearModel, functions

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "nonlinear.md").read_text(encoding="utf-8")


def test_the_code_of_the_page_runs(capsys: pytest.CaptureFixture[str]) -> None:
    block = re.search(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    assert block is not None
    exec(compile(block[1], "nonlinear.md", "exec"), {})
    assert capsys.readouterr().out.startswith("consistent ")


def test_the_example_prints_what_the_page_shows(capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(DOCS / "examples" / "two_tanks.py"))
    shown = re.search(r"^```text\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    assert shown is not None
    assert capsys.readouterr().out == shown[1]


@pytest.mark.parametrize("name", ["sin", "abs", "sroot", "sign"])
def test_the_remainders_are_those_of_the_table(name: str) -> None:
    phi, at = getattr(functions, name), 0.5 if name == "sin" else 0.0
    still = NonlinearModel(
        lambda x, u, w: [u[0] - phi(x[0]) + w[0]], lambda x: x, states=["x"], inputs=["u"], disturbances=["w"], w=[0.0],
        Ts=0.1, largest=([-9], [9]),
    )  # fmt: skip
    moving = still.replace(w=[0.2], varying="w")
    asked = [*((still, r) for r in (0.4, 0.2, 0.1, 0.05)), (moving, 0.4), (moving, 0.05)]
    found = [float(model.transition([at - r], [at + r], [0.0]).R[0]) for model, r in asked]
    shown = re.search(rf"^\| `{name}` \|(.*)\|$", PAGE, re.MULTILINE)
    assert shown is not None
    assert [float(v) for v in shown[1].split("|")] == pytest.approx(found, rel=0.05)
