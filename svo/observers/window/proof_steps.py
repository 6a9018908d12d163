"""The steps of a proof from a start to a falsification, as they are made: what `docs/proof_format.md` describes.

Everything is in the user's units, and samples are those of the log.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from svo.checks import Array
from svo.observers.window.certificate import WindowCertificate
from svo.observers.window.chain_starts import Start
from svo.observers.window.evidence import ArrivalSet
from svo.observers.window.sign_split import SplitCertificate
from svo.observers.window.window import Window
from svo.store.values import encode_value

SIDES = ("upper", "lower")


class ProofSteps:
    """Collects the steps of a chain.

    Parameters
    ----------
    start : Start
    template : (r, n) array
        Directions besides the axes in which states are bounded.

    Attributes
    ----------
    steps : list of dict
        As JSON can hold them.
    """

    def __init__(self, start: Start, template: Array) -> None:
        self.steps: list[dict[str, Any]] = [start_step(start, template)]
        self._channels: dict[int, bytes] = {}

    def channel(self, q: int, side: int, value: float, proof: WindowCertificate) -> None:
        """A bound of s of a channel of a window's newest sample, upper (0) or lower (1)."""
        self._add("s", proof, sample=proof.last, channel=q, side=SIDES[side], value=value)

    def arrival(self, window: Window, program: int, sample: int, proof: WindowCertificate) -> None:
        """A bound of the state at a sample: along an axis, or a row of the template."""
        form, arrays = window.settings.form, window.memory.arrays
        row, side = program // 2, program % 2
        value = float(arrays["new_lower" if side else "new_upper"][row])
        unit = form.x[row] if row < len(form.x) else 1.0
        self._add("x", proof, unit, sample=sample, row=row, side=SIDES[side], value=value * unit)

    def alarm(self, proof: WindowCertificate | SplitCertificate) -> None:
        """The falsification, by cases where the window is split by signs."""
        if isinstance(proof, WindowCertificate):
            self._add("alarm", proof)
            return
        self._choose_channels(proof.about())
        self.steps.append({"step": "alarm", **cases(proof.cells, proof.s_lower, proof.s_upper)})

    def _add(self, kind: str, proof: WindowCertificate, unit: float = 1.0, **entries: Any) -> None:
        if not np.isfinite(entries.get("value", 0.0)):
            return  # says nothing
        self._choose_channels(proof)
        if "value" in entries:
            entries["value"] = float(entries["value"]).hex()
        self.steps.append({"step": kind, **entries, **multipliers(proof, unit)})

    def _choose_channels(self, proof: WindowCertificate) -> None:
        for k, s in enumerate(proof.samples, start=proof.first):
            if s.gain is None or s.functional is None:
                continue  # none that floats can hold: the checker leaves all of it out
            if len(s.gain) and self._channels.get(k) != (key := s.gain.tobytes() + s.functional.tobytes()):
                self._channels[k] = key
                factors = {"gain": encode_value(s.gain), "functional": encode_value(s.functional)}
                self.steps.append({"step": "channels", "sample": k, "owner": proof.owner.tolist(), **factors})


def start_step(start: Start, template: Array) -> dict[str, Any]:
    """The step that begins a chain."""
    step: dict[str, Any] = {"step": "start", "sample": start.sample, "from": start.kind}
    if start.kind == "assumed":
        step |= {"set": encode_set(start.set), "because": start.because}
    if start.inverse is not None:
        step |= {"lower": encode_value(start.set.box_lower), "upper": encode_value(start.set.box_upper)}
        step["inverse"] = encode_value(start.inverse)
    return step | {"template": encode_value(template)}


def encode_set(of: ArrivalSet) -> dict[str, Any]:
    """A set as JSON can hold it."""
    return dict(encode_value(of))


def cases(cells: Sequence[WindowCertificate], lower: Array, upper: Array) -> dict[str, Any]:
    """Entries of a step: multipliers of the only cell, or two cases by the sign of an s that all cells are split by.

    ``lower`` and ``upper`` (samples, nq) are bounds of every s that the cells cover.
    """
    if len(cells) == 1:
        return multipliers(cells[0], 1.0)
    ends = [np.array([[getattr(s, name) for s in c.samples] for c in cells]) for name in ("s_lower", "s_upper")]
    below, above = (ends[1] == 0.0) & (upper > 0.0), (ends[0] == 0.0) & (lower < 0.0)
    k, q = np.argwhere((below != above).all(axis=0))[0].tolist()
    parts = []
    for is_mine, end in ((below[:, k, q], upper), (above[:, k, q], lower)):
        known = end.copy()
        known[k, q] = 0.0
        bounds = (lower, known) if end is upper else (known, upper)
        parts.append(cases([c for c, mine in zip(cells, is_mine, strict=True) if mine], *bounds))
    return {"split": [cells[0].first + k, q], "cases": parts}


def multipliers(c: WindowCertificate, unit: float) -> dict[str, Any]:
    """Entries of a step: multipliers of rows, times a power of two, and of lines where there is one."""
    where, values = [], []
    for k, s in enumerate(c.samples):
        for q, side in np.argwhere(s.on_channel).tolist():
            where.append([k, q, side])
            values.append([s.on_channel[q, side] * unit, *s.lines[q, 2 * side : 2 * side + 2]])
    found: dict[str, Any] = {
        "first": c.first,
        "last": c.last,
        "on_start": encode_value(c.on_arrival * unit),
        "on_output": encode_value(np.array([s.on_output for s in c.samples]) * unit),
    }
    if len(c.w_rows):
        found["on_w"] = encode_value(np.array([s.on_w for s in c.samples]) * unit)
    if where:
        found |= {"on_line": where, "line": encode_value(np.array(values))}
    return found
