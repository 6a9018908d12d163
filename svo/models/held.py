"""Which disturbances and uncertain scalars of a continuous plant are held over a sample, and which vary inside it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ALL, EVERY_W, EVERY_DELTA = "all", "w", "Delta"


class Varying(NamedTuple):
    """Which vary inside a sample: the disturbances (nw,) and the uncertain scalars (one a Delta)."""

    w: NDArray[np.bool_]
    delta: NDArray[np.bool_]

    @property
    def any(self) -> bool:
        return bool(self.w.any() or self.delta.any())


def which_vary(varying: Any, w_names: Sequence[str], delta_names: Sequence[str]) -> Varying:
    """From the argument ``varying`` of `UncertainModel.from_continuous`.

    Parameters
    ----------
    varying : str or sequence of str
        "all", "w" (every disturbance), "Delta" (every uncertainty), "w[1]", "Delta[0]", or names.
    w_names, delta_names : sequence of str
        Names, "" where there is none.

    Raises
    ------
    TypeError, ValueError
        For anything else; the message lists what there is.
    """
    chosen = [varying] if isinstance(varying, str) else varying
    if not isinstance(chosen, Sequence) or not all(isinstance(name, str) for name in chosen):
        raise TypeError(f"varying is {varying!r}; expected names such as ['w', 'mass'], or 'all'")
    w, delta = (np.zeros(len(names), dtype=bool) for names in (w_names, delta_names))
    for name in chosen:
        hits = [_of(name, EVERY_W, w_names), _of(name, EVERY_DELTA, delta_names)]
        if name not in (ALL, EVERY_W, EVERY_DELTA) and not any(hit.any() for hit in hits):
            known = [ALL, EVERY_W, EVERY_DELTA]
            known += [f"w[{j}]" for j in range(len(w))] + [f"Delta[{i}]" for i in range(len(delta))]
            known += [label for label in (*w_names, *delta_names) if label]
            raise ValueError(f"varying names {name!r}; expected any of {', '.join(known)}")
        w, delta = w | hits[0], delta | hits[1]
    return Varying(w, delta)


def _of(name: str, group: str, labels: Sequence[str]) -> NDArray[np.bool_]:
    hits = [name in (ALL, group, f"{group}[{i}]") or (name == label != "") for i, label in enumerate(labels)]
    return np.array(hits, dtype=bool)
