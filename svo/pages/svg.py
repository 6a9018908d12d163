"""Pictures of matplotlib as SVG inside a page, whose policy allows no style but its own."""

from __future__ import annotations

import re
from io import StringIO
from typing import TYPE_CHECKING

from markupsafe import Markup, escape

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_STYLE = re.compile(r' style="([^"]*)"')
# What matplotlib says of all elements in a style sheet; here it is inherited from the picture.
_ALL = 'stroke-linejoin="round" stroke-linecap="butt"'


def inline_svg(figure: Figure, title: str, prefix: str) -> Markup:
    """A figure as an element of a page: text as outlines, so that it is the same everywhere.

    Parameters
    ----------
    figure : matplotlib Figure
    title : str
        What it shows, for who cannot see it.
    prefix : str
        Told apart by it are the names inside the pictures of one page.
    """
    import matplotlib as mpl

    file = StringIO()
    with mpl.rc_context({"svg.hashsalt": prefix, "svg.fonttype": "path"}):
        figure.savefig(file, format="svg", metadata={"Date": None}, transparent=True)
    text = file.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r"<style[^>]*>.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{prefix}-", text)
    text = _STYLE.sub(_attributes, text)
    return Markup(text.replace("<svg", f'<svg role="img" aria-label="{escape(title)}" {_ALL}', 1))


def _attributes(style: re.Match[str]) -> str:
    """The properties of a style, each as the attribute of its name."""
    pairs = (part.split(":", 1) for part in style[1].split(";") if part.strip())
    return "".join(f' {name.strip()}="{value.strip()}"' for name, value in pairs)
