"""Sets of states by several models, on two coordinates or on the only one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from polytopes import HPolytope
from polytopes.plotting import draw_shadow
from polytopes.shown import Picture, in_a_line
from svo.pictures.style import STYLE, colours

_MOST = 8  # entries of a legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def picture_of_sets(sets: Mapping[str, HPolytope], names: Sequence[str], states: Sequence[str]) -> Picture | None:
    """Shadows of sets on the first two states.

    Parameters
    ----------
    sets : mapping of str to HPolytope
        By model; none without any.
    names : sequence of str
        All models, in the order of their colours.
    states : sequence of str
        Labels of the axes.
    """
    if not sets:
        return None
    tone = colours(names)

    def draw(ax: Axes) -> None:
        import matplotlib as mpl

        with mpl.rc_context({**STYLE, "font.size": 8.5}):
            for name, found in sets.items():
                for artist in draw_shadow(found, ax, color=tone[name]):
                    artist.set_label(in_a_line(name, 24))
            ax.set_xlabel(in_a_line(states[0], 40))
            if len(states) > 1:
                ax.set_ylabel(in_a_line(states[1], 40))
            ax.margins(0.08)
            if 1 < len(sets) <= _MOST:
                ax.legend(fontsize=8)

    return Picture(draw)
