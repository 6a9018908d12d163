"""Pictures as files: laid out once, and as matplotlib itself would save them."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from svo.pictures.style import DPI, new_figure
from svo.studies.drawing import Gallery


def drawn(figure: Figure) -> Figure:
    axes = figure.subplots(2, 1, sharex=True)
    for ax, scale in zip(axes, (1.0, 1e4), strict=True):
        ax.plot([0, 1, 2], [0, scale, -scale], label="a line")
        ax.set(xlabel="time [s]", ylabel="speed [m/s]", title="a title")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper left")
    return figure


def test_a_picture_is_laid_out_once_and_is_what_savefig_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn(Figure(figsize=(4, 3), layout="constrained")).savefig(tmp_path / "plain.png", dpi=DPI)
    calls: list[str] = []

    def counted(kind: type, method: str) -> None:
        plain = getattr(kind, method)
        monkeypatch.setattr(kind, method, lambda *of: calls.append(method) or plain(*of))

    counted(ConstrainedLayoutEngine, "execute")
    counted(Figure, "draw")
    picture = Gallery(tmp_path).save("ours", drawn(new_figure(4, 3)), "title", "caption")
    assert sorted(calls) == ["draw", "execute"]
    ours, plain = (matplotlib.image.imread(file) for file in (picture.path, tmp_path / "plain.png"))
    np.testing.assert_array_equal(ours, plain)
