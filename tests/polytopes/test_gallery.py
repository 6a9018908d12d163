"""The pictures of the gallery: each script runs, draws something, is about ten lines, and is on the page."""

import ast
import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

FOLDER = Path(__file__).parents[2] / "docs"
EXAMPLES = sorted(path for path in (FOLDER / "examples" / "polytopes").glob("*.py") if path.stem != "draw")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_picture_of_the_gallery(path: Path) -> None:
    names = runpy.run_path(str(path))
    figure, ax = names["figure"], names["ax"]
    figure.canvas.draw()
    assert ax.patches or ax.collections
    plt.close(figure)
    code = ast.parse(path.read_text("utf-8")).body
    assert len([node for node in code if not isinstance(node, ast.Import | ast.ImportFrom | ast.Expr)]) <= 10
    assert len(path.read_text("utf-8").split("\n\n")[-1].splitlines()) <= 11


def test_the_page_has_all_of_them() -> None:
    page = (FOLDER / "gallery.md").read_text("utf-8")
    assert len(EXAMPLES) == 10
    for path in EXAMPLES:
        assert f"polytopes/{path.name}" in page
        assert f"gallery_{path.stem}.png" in page
        assert (FOLDER / "images" / f"gallery_{path.stem}.png").exists()
