"""What the outputs of a model do after a step of each input."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from polytopes.shown import Picture
from svo.checks import Array
from svo.pictures.style import COLOURS, STYLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES = 60


def step_responses(stack: Array, n: int, driven: int) -> Array:
    """Outputs (K, ny, k) over `_SAMPLES` samples after a unit step of each of k columns, from x = 0.

    Parameters
    ----------
    stack : (n + ny, n + nu + 1 + nw) array
        [[A B a E], [C D c F]].
    n : int
        Number of states.
    driven : int
        Number nu of inputs; without any the steps are those of the disturbances.
    """
    first = n if driven else n + 1
    last = n + driven if driven else stack.shape[1]
    states, found = np.zeros((n, last - first)), []
    for _ in range(_SAMPLES):
        found.append(stack[n:, :n] @ states + stack[n:, first:last])
        states = stack[:n, :n] @ states + stack[:n, first:last]
    return np.array(found)


def picture_of_responses(stack: Array, n: int, inputs: int, Ts: float) -> Picture:
    """A line for each output and each input; of disturbances where there are no inputs."""
    with np.errstate(over="ignore", invalid="ignore"):
        responses = step_responses(stack, n, inputs)
    what = "inputs" if inputs else "disturbances"

    def draw(ax: Axes) -> None:
        import matplotlib as mpl

        with mpl.rc_context({**STYLE, "font.size": 8.5}):
            for column in range(responses.shape[2]):
                for row in range(responses.shape[1]):
                    tone = COLOURS[(2 + column) % len(COLOURS)]
                    label = f"y[{row}] after {'u' if inputs else 'w'}[{column}]"
                    ax.plot(Ts * np.arange(_SAMPLES), responses[:, row, column], color=tone, label=label)
            ax.set(xlabel="time [s]", title=f"outputs after unit steps of the {what}")
            if 0 < responses[0].size <= 6:
                ax.legend(fontsize=8)

    return Picture(draw, 4.8, 3.0)
